"""Controls of the learner that looks: fits to a log in which actions, or sights, were dealt out anew.

In each role the actions of the logged decisions, or what robots saw when they made them, are permuted. So
nothing can be learned of actions, or of where an action is worth more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import polars as pl

from pitchlore.pipeline.engine import policies
from pitchlore.pipeline.engine.chain import Chain
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import AppraisalSettings
from pitchlore.pipeline.stages.policies.appraise import fit_action_values

#: Keys of a decision and of its sight.
_AT = ("match_id", "team", "robot", "t_ns")
Tables = tuple[pl.DataFrame, pl.DataFrame]
#: Deals decisions and sights out anew: both tables, and the seed.
Deal = Callable[[pl.DataFrame, pl.DataFrame, int], Tables]


def actions_dealt(decisions: pl.DataFrame, sights: pl.DataFrame, seed: int) -> Tables:
    """The tables with the actions permuted in each role, among the decisions that trees are fitted to.

    Args:
        decisions: rows of schema Decisions.
        sights: rows of schema Sights of the same matches.
        seed: seed of the permutation.
    """
    dealt = pl.col("behaviour_id").shuffle(seed).over("role")
    return _replaced(decisions, _fitted(decisions, sights).select("place", dealt), "behaviour_id"), sights


def sights_dealt(decisions: pl.DataFrame, sights: pl.DataFrame, seed: int) -> Tables:
    """The tables with what was seen permuted in each role, among the decisions that trees are fitted to.

    Args:
        decisions: rows of schema Decisions.
        sights: rows of schema Sights of the same matches.
        seed: seed of the permutation.
    """
    rows = _fitted(decisions, sights).select("row", dealt=pl.col("row").shuffle(seed).over("role"))
    of = rows.select(place="row", sight=sights["sight"].gather(rows["dealt"]))
    return decisions, _replaced(sights, of, "sight")


def _fitted(decisions: pl.DataFrame, sights: pl.DataFrame) -> pl.DataFrame:
    """Decisions of one code after which the change of V is known.

    Returns:
        Columns place (its row), role, behaviour_id and row (that of its sight).
    """
    seen = sights.select(*_AT, "change").with_row_index("row")
    return decisions.with_row_index("place").filter(
        "chosen", pl.col("behaviour_id").str.count_matches("-") == 1,
    ).join(seen, on=_AT, maintain_order="left").filter(
        pl.col("change").is_not_null(),
    ).select("place", "role", "behaviour_id", "row")


def _replaced(table: pl.DataFrame, of: pl.DataFrame, column: str) -> pl.DataFrame:
    """A table with other values in some rows of a column; ``of`` has them by the rows' ``place``."""
    dealt_out = pl.coalesce(f"{column}_right", column).alias(column)
    whole = table.with_row_index("place").join(of, on="place", how="left", maintain_order="left")
    return whole.with_columns(dealt_out).select(table.columns)


def dealt(
    deal: Deal, decisions: pl.DataFrame, sights: pl.DataFrame, pairs: pl.DataFrame,
    settings: AppraisalSettings, version: int, watched: pl.DataFrame | None = None,
    habits: pl.DataFrame | None = None,
) -> Tables:  # fmt: skip
    """Appraisals and kept pairs of a log that was dealt out anew.

    ``deal`` deals it out; the rest is as for :func:`pipeline.stages.policies.appraise.fit_action_values`.
    """
    assert not settings.watched, "what was watched is not dealt out"
    own = deal(decisions, sights, settings.seed)
    return fit_action_values(*own, pairs, settings, version, watched, habits)


def stages(deal: Deal) -> Chain:
    """The stages of a season whose apprentice learns from a log that was dealt out anew."""
    fit = partial(policies.compute, fit=partial(dealt, deal))
    own = dict(STAGES) | {"policies": replace(STAGES["policies"], compute=fit)}
    return Chain(*own.values())
