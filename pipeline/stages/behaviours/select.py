"""Behaviours: the grams that recur and have a value (paper section 3.2.2), above 0 or below it."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.numbers.estimates import sides_of_zero
from pitchlore.pipeline.numbers.statistics import false_discovery_rates
from pitchlore.pipeline.settings import BehaviourSettings, RoundSettings
from pitchlore.pipeline.stages.behaviours.neurons import neurons
from pitchlore.pipeline.stages.behaviours.shrinkage import valued
from pitchlore.pipeline.stages.behaviours.som import SelfOrganisingMap, best_matching_units, train_map
from pitchlore.schemas import ROLES, Neurons, Patterns
from pitchlore.schemas.behaviours import id_of
from pitchlore.schemas.situations import MOVES_RANDOMLY


class RoundReport(NamedTuple):
    """Counts of one round of the selection.

    Attributes:
        n: length of the grams.
        distinct: distinct grams (role, codes) that trained the map.
        windows: instances of these grams.
        threshold: activations that a neuron needs.
        activations: instances for each neuron.
        neurons_kept: neurons with at least ``threshold`` activations.
        groups_on_kept: distinct grams on these neurons.
        groups_kept: grams among them that the selection keeps.
        instances_kept: instances of these.
        groups_cost: grams on these neurons that lie on the other side of the threshold.
    """

    n: int
    distinct: int
    windows: int
    threshold: float
    activations: tuple[int, ...]
    neurons_kept: int
    groups_on_kept: int
    groups_kept: int
    instances_kept: int
    groups_cost: int


class RoundResult(NamedTuple):
    """Patterns, map and counts of one round of the selection.

    Attributes:
        patterns: rows of schema Patterns, without team and kind.
        neuron: best-matching unit of each gram in the map, int64 [grams].
        neurons: rows of schema Neurons, without team and kind.
        map: the trained map; None if there were no grams.
        report: counts.
    """

    patterns: pl.DataFrame
    neuron: I64
    neurons: pl.DataFrame
    map: SelfOrganisingMap | None
    report: RoundReport


def select(
    grams: pl.DataFrame, recognised: int, settings: BehaviourSettings, round_: RoundSettings,
    paying: Collection[str] = ROLES,
) -> RoundResult:
    """Select the behaviours of one length.

    The grams of all roles train one map. A neuron is kept if its activations reach the round's share
    of the groups (or of all recognised situations, by the settings). The grams on kept neurons whose
    value, or the lower end of its interval, is above the threshold are kept, role by role. All on
    kept neurons are in a role that is not in ``paying`` and has none above the threshold. Those whose value,
    or the upper end of its interval, is below the threshold's negative become behaviours that are not kept.

    Args:
        grams: a row a (role, codes), all of the round's n (``pipeline.stages.behaviours.grams.merge``).
        recognised: situations recognised in all matches, including those that longer behaviours
            use up.
        settings: settings of all rounds.
        round_: settings of this round.
        paying: roles that have behaviours of earlier rounds, or need none.
    """
    whole = recognised if settings.share_of == "situations" else int(grams["count"].sum())
    threshold = round_.activation * whole
    if grams.is_empty():
        report = RoundReport(round_.n, 0, 0, threshold, (0,) * (round_.rows * round_.columns), 0, 0, 0, 0, 0)
        return RoundResult(
            Patterns.empty(), np.empty(0, dtype=np.int64), Neurons.empty(), None, report)
    codes = grams["codes"].list.to_array(round_.n).to_numpy()
    counts = grams["count"].to_numpy()
    som = train_map(
        codes, counts, round_.rows, round_.columns,
        epochs=settings.epochs, seed=settings.seed, sigma_end=settings.sigma_end,
    )
    neuron = best_matching_units(som, codes)
    activations = np.zeros(len(som.weights), dtype=np.int64)
    np.add.at(activations, neuron, counts)
    kept = (activations >= threshold) & (activations > 0)
    estimated = valued(grams, shrink=settings.shrink)
    mean, placed = pl.col("mean"), pl.when(pl.col("placed") > 0).then("placed")
    purposeful = pl.col("codes").list.eval(pl.element() != MOVES_RANDOMLY).list.any()
    on_kept = estimated.with_columns(pl.Series("neuron", neuron)).filter(pl.Series(kept[neuron]))
    above = pl.col(settings.select_by) > settings.value_over
    costs = pl.col("high" if settings.select_by == "low" else "value") < -settings.value_over
    candidates = on_kept.filter(
        pl.col("count") >= settings.support_at_least, settings.keep_random | purposeful)
    rates = pl.Series("q", false_discovery_rates(*candidates.select("mean", "error").to_numpy().T))
    patterns = candidates.with_columns(
        rates, kept=above | ~(above.any().over("role") | pl.col("role").is_in(paying)),
    ).filter(pl.col("kept") | costs).select(
        id_of().alias("behaviour_id"),
        "role",
        "codes",
        "n",
        "value", "neuron", "low", "high", "mean", "error", "family", "family_spread",
        "family_size", "q", "kept",
        support="count",
        pays=sides_of_zero(),
        spread=(pl.col("value_square_sum") / pl.col("count") - mean**2).clip(lower_bound=0).sqrt(),
        paper=pl.col("paper_sum") / pl.col("count"),
        x=pl.col("x_sum") / placed, y=pl.col("y_sum") / placed,
        team=pl.lit(None), kind=pl.lit(None),
    ).select(list(Patterns.dtypes())).cast(pl.Schema(Patterns.dtypes())).sort("role", "codes")
    report = RoundReport(
        n=round_.n,
        distinct=grams.height,
        windows=int(counts.sum()),
        threshold=threshold,
        activations=tuple(activations.tolist()),
        neurons_kept=int(kept.sum()),
        groups_on_kept=on_kept.height,
        groups_kept=int(patterns["kept"].sum()),
        instances_kept=int(patterns.filter("kept")["support"].sum()),
        groups_cost=int((~patterns["kept"]).sum()),
    )
    return RoundResult(patterns, neuron, neurons(som, neuron, grams, kept), som, report)
