"""Knowledge: the behaviours of one version, and the states in which they began."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain

import polars as pl

from pitchlore.pipeline.numbers.estimates import estimated, sides_of_zero
from pitchlore.pipeline.numbers.sums import added_up, exact
from pitchlore.pipeline.settings import KnowledgeSettings
from pitchlore.pipeline.stages.sides.teams import Team, as_of, of_teams
from pitchlore.pipeline.state import project
from pitchlore.schemas import KEYS, ROLES, Behaviours, Occasions, Patterns
from pitchlore.schemas.behaviours import PAYS, moves_randomly

_TEAM = Team._fields
#: Names, as numbers while occasions are added up: that takes half the memory.
_NUMBERED = pl.Schema(dict.fromkeys((*_TEAM, "behaviour_id"), pl.Categorical()))
_NAMES = pl.Schema(dict.fromkeys(_NUMBERED, pl.String()))
_PAIR = (*_TEAM, "role", "key", "state", "behaviour_id")
#: What :func:`diff` shows of a behaviour before and after.
_COMPARED = ("support", "value", "low", "high", "states")


@dataclass(frozen=True, slots=True)
class Difference:
    """Changes from one version of the knowledge to another.

    Attributes:
        behaviours: one row a behaviour that was added, removed or changed (support or value):
            team, kind, behaviour_id, change, role, n, and support, value, low, high and states before and
            after (null where it is not in that version); sorted by team, kind, change, n descending,
            behaviour_id.
        roles: one row a role of each team: behaviours, states and pairs of a state and a behaviour, before
            and after.
    """

    behaviours: pl.DataFrame
    roles: pl.DataFrame


def behaviours(patterns: Iterable[pl.DataFrame], version: int) -> pl.DataFrame:
    """The patterns of all rounds as rows of schema Behaviours of one version.

    Args:
        patterns: rows of schema Patterns, a table a round.
        version: at least 1.
    """
    return _behaviours(pl.concat([Patterns.empty(), *patterns]), version)


def merge_behaviours(parts: Iterable[pl.DataFrame], version: int) -> pl.DataFrame:
    """Merge behaviours of several versions into those of one.

    Support and mean are exactly those over the instances of all parts: sums of values are multiples of
    ``pipeline.numbers.sums.QUANTUM``, and rounding recovers them (below a support of about a million). So
    merging in steps equals merging at once. The spread is pooled by the law of total variance. All else is
    the mean over the instances, but for the error and the interval, which get narrower as those of the mean
    of independent estimates do, and for ``q``: a part in which a behaviour was sure is enough.

    Args:
        parts: rows of schema Behaviours, of distinct instances; the earlier versions first.
        version: version of the result, at least 1.

    Returns:
        Rows of schema Behaviours. ``neuron`` refers to the latest map that found the behaviour.
    """
    found = pl.concat([Behaviours.empty(), *parts]).with_columns(mean=pl.coalesce("mean", "value"))
    sums = pl.Series("sum", exact((found["mean"] * found["support"]).to_numpy()))
    everywhere = found.with_columns(sums).with_columns(
        middle=(pl.col("sum").sum() / pl.col("support").sum()).over(*_TEAM, "behaviour_id"))
    square = pl.col("support") * (pl.col("spread") ** 2 + (pl.col("mean") - pl.col("middle")) ** 2)
    whole = pl.col("support").sum()
    merged = everywhere.group_by(*_TEAM, "behaviour_id", maintain_order=True).agg(
        pl.col("role", "codes", "n").first(),
        spread=(square.sum() / whole).sqrt(),
        neuron=pl.col("neuron").last(),
        mean=pl.col("middle").first(),
        error=pl.when(pl.col("error").is_not_null().all()).then(
            (pl.col("support") * pl.col("error")).pow(2).sum().sqrt() / whole),
        support=whole,
        q=pl.col("q").min(),
        kept=pl.col("kept").any(),
        family_size=pl.when(pl.col("family_size").is_not_null().all()).then(pl.col("family_size").max()),
        **{
            name: pl.when(pl.col(name).is_not_null().all()).then(
                (pl.col(name) * pl.col("support")).sum() / whole)
            for name in ("family", "family_spread", "paper", "x", "y")
        },
    )
    return _behaviours(estimated(merged).with_columns(pays=sides_of_zero().cast(pl.Enum(PAYS))), version)


def _behaviours(patterns: pl.DataFrame, version: int) -> pl.DataFrame:
    """Patterns as rows of one version, in the schema's order."""
    return (
        patterns.with_columns(pl.lit(version, dtype=pl.Int32).alias("version"))
        .select(list(Behaviours.dtypes()))
        .sort(*_TEAM, "n", "role", "codes", descending=[False, False, True, False, False])
    )


def occasions(
    decisions: Iterable[tuple[pl.DataFrame, pl.DataFrame]],
    learner: Team | None,
    version: int,
    settings: KnowledgeSettings = KnowledgeSettings(),
    known: pl.Series | None = None,
) -> pl.DataFrame:
    """Count the states in which behaviours began, for each team, by every key of the settings.

    The result does not depend on the order of the tables; memory is bounded by the number of
    distinct (team, role, key, state, behaviour).

    Args:
        decisions: rows of schema Decisions, and rows of schema Sides of their matches. A null behaviour,
            "moves randomly", counts as the behaviour of the one code 194. The paper's learner starts from
            it in every new state and values it like any other (sections 4 and 6).
        learner: team that policies imitate: states in which players decided in its league are added to
            it. None: to no team.
        version: version of the knowledge, at least 1.
        settings: state_key, backoff, own and optimistic.
        known: ids of the learner's behaviours, [B]. A chosen behaviour outside them, from other
            knowledge, is no occasion. None if all are known.

    Returns:
        Rows of schema Occasions. ``initial`` is the greatest value of the behaviours seen in the
        state by the role, so that each of them is tried (paper section 3.2.2, last sentence).
    """
    begun = (_by_keys(table, own, learner, settings, known) for table, own in decisions)
    every = (sums.cast(_NUMBERED) for sums in chain([_sums(Occasions.empty())], begun))
    return _occasions(added_up(every, _PAIR).cast(_NAMES), version, settings)


def merge_occasions(
    parts: Iterable[pl.DataFrame], version: int, settings: KnowledgeSettings = KnowledgeSettings()
) -> pl.DataFrame:
    """Merge occasions of several versions into those of one.

    The result is exact: it equals :func:`occasions` of all decisions together.

    Args:
        parts: rows of schema Occasions, of distinct decisions, in any order.
        version: version of the result, at least 1.
        settings: optimistic; ``initial`` is computed anew.
    """
    return _occasions(added_up(map(_sums, parts), _PAIR), version, settings)


def _by_keys(
    table: pl.DataFrame, sides: pl.DataFrame, learner: Team | None, settings: KnowledgeSettings,
    known: pl.Series | None,
) -> pl.DataFrame:
    """Occasions from the decisions of some matches, by every key of the settings."""
    begun = _counted(of_teams(table.filter(~pl.col("chosen")), sides))
    if learner is not None:
        there = sides.filter(kind=learner.kind)
        chosen = table.filter("chosen").join(there, on="match_id", how="semi", maintain_order="left")
        begun = pl.concat([begun, _own(as_of(chosen, learner), settings, known)])
    slot = begun["role"].to_physical().to_numpy()
    return pl.concat(
        begun.select(
            *_TEAM,
            "role",
            pl.lit(key, dtype=pl.Enum(KEYS)).alias("key"),
            pl.Series("state", project(begun["state"].to_numpy(), key, slot)),
            "behaviour_id",
            "count",
            "value_sum",
        )
        for key in settings.state_keys
    )


def _own(chosen: pl.DataFrame, settings: KnowledgeSettings, known: pl.Series | None) -> pl.DataFrame:
    """Occasions from the states in which a player decided, by the setting ``own``."""
    if settings.own == "nothing":
        return _counted(chosen.clear())
    begun = _counted(chosen)
    random = pl.col("behaviour_id") == moves_randomly()
    offered = begun.with_columns(
        moves_randomly().alias("behaviour_id"), pl.lit(0, dtype=pl.Int64).alias("count"),
        pl.lit(0.0).alias("value_sum"))
    if settings.own == "moves randomly":
        return pl.concat([begun.filter(random), offered])
    if known is not None:
        begun = begun.filter(random | pl.col("behaviour_id").is_in(known.implode()))
    return pl.concat([begun, offered])


def _counted(decisions: pl.DataFrame) -> pl.DataFrame:
    """Each decision as an occasion with count 1."""
    return decisions.select(
        *_TEAM,
        "role",
        "state",
        pl.col("behaviour_id").fill_null(moves_randomly()),
        pl.lit(1, dtype=pl.Int64).alias("count"),
        pl.Series("value_sum", exact(decisions["value"].to_numpy())),
    )


def _sums(seen: pl.DataFrame) -> pl.DataFrame:
    """Occasions with the exact sum of their instances' values in place of the mean."""
    total = (seen["value"].fill_null(0.0) * seen["count"]).to_numpy()
    return seen.select(*_PAIR, "count", pl.Series("value_sum", exact(total)))


def _occasions(sums: pl.DataFrame, version: int, settings: KnowledgeSettings) -> pl.DataFrame:
    """Rows of schema Occasions from each pair's count and sum of values."""
    least = pl.lit(settings.optimistic, dtype=pl.Float64)
    return (
        sums.with_columns(
            pl.lit(version, dtype=pl.Int32).alias("version"),
            value=pl.when(pl.col("count") > 0).then(pl.col("value_sum") / pl.col("count")),
        )
        .with_columns(
            initial=pl.max_horizontal(pl.col("value").max().over(*_TEAM, "role", "key", "state"), least))
        .select(list(Occasions.dtypes()))
        .sort(_PAIR)
    )


def finest(seen: pl.DataFrame) -> pl.DataFrame:
    """Occasions by the finest key only, so each counts once."""
    return seen.filter(pl.col("key").to_physical() == pl.col("key").to_physical().min())


def diff(
    behaviours_before: pl.DataFrame,
    behaviours_after: pl.DataFrame,
    occasions_before: pl.DataFrame,
    occasions_after: pl.DataFrame,
) -> Difference:
    """Compare two versions of the knowledge, with states by the finest key of each.

    Args:
        behaviours_before: rows of schema Behaviours of the earlier version.
        behaviours_after: rows of schema Behaviours of the later version.
        occasions_before: rows of schema Occasions of the earlier version.
        occasions_after: rows of schema Occasions of the later version.
    """
    occasions_before, occasions_after = finest(occasions_before), finest(occasions_after)
    before = _with_states(behaviours_before, occasions_before)
    after = _with_states(behaviours_after, occasions_after)
    changed = pl.any_horizontal(
        pl.col(f"{name}_before") != pl.col(f"{name}_after") for name in ("support", "value")
    )
    joined = (
        before.rename({name: f"{name}_before" for name in _COMPARED})
        .join(
            after.rename({name: f"{name}_after" for name in _COMPARED}),
            on=(*_TEAM, "behaviour_id", "role", "n"), how="full", coalesce=True, nulls_equal=True,
        )
        .with_columns(
            change=pl.when(pl.col("support_before").is_null()).then(pl.lit("added"))
            .when(pl.col("support_after").is_null()).then(pl.lit("removed"))
            .when(changed).then(pl.lit("changed"))
        )
        .filter(pl.col("change").is_not_null())
        .select(
            *_TEAM, "behaviour_id", "change", "role", "n",
            *(f"{name}_{when}" for name in _COMPARED for when in ("before", "after")),
        )
        .sort(*_TEAM, "change", "n", "behaviour_id", descending=[False, False, False, True, False])
    )
    there = pl.concat([table.select(_TEAM) for table in (behaviours_before, behaviours_after,
                                                         occasions_before, occasions_after)])
    roles = there.unique().sort(_TEAM).join(
        pl.DataFrame({"role": ROLES}, schema={"role": pl.Enum(ROLES)}), how="cross")
    for when, patterns, seen in (
        ("before", behaviours_before, occasions_before), ("after", behaviours_after, occasions_after),
    ):
        known = patterns.group_by(*_TEAM, "role").agg(pl.len().cast(pl.Int64).alias(f"behaviours_{when}"))
        states = seen.group_by(*_TEAM, "role").agg(
            pl.col("state").n_unique().cast(pl.Int64).alias(f"states_{when}"),
            pl.len().cast(pl.Int64).alias(f"pairs_{when}"),
        )
        for counts in (known, states):
            roles = roles.join(
                counts, on=(*_TEAM, "role"), how="left", maintain_order="left", nulls_equal=True)
    return Difference(joined, roles.with_columns(pl.exclude(*_TEAM, "role").fill_null(0)))


def _with_states(patterns: pl.DataFrame, seen: pl.DataFrame) -> pl.DataFrame:
    """Behaviours with the number of states in which each was seen."""
    states = seen.group_by(*_TEAM, "behaviour_id").agg(states=pl.len().cast(pl.Int64))
    return patterns.select(*_TEAM, "behaviour_id", "role", "n", "support", "value", "low", "high").join(
        states, on=(*_TEAM, "behaviour_id"), how="left", nulls_equal=True
    ).with_columns(pl.col("states").fill_null(0))
