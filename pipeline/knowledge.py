"""Knowledge: the behaviours of one version and the states in which they were seen."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import polars as pl

from pipeline.sequences import exact
from pipeline.settings import KnowledgeSettings
from schemas import ROLES, Behaviours, Occasions
from schemas.behaviours import moves_randomly

_PAIR = ("role", "state", "behaviour_id")

#: Decisions that :func:`occasions` holds back before it adds them up.
_BUFFERED_ROWS = 1 << 20


@dataclass(frozen=True, slots=True)
class Difference:
    """What changed from one version of the knowledge to another.

    Attributes:
        behaviours: one row a behaviour that was added, removed or changed (support or value):
            behaviour_id, change, role, n, and support, value and states before and after
            (null where it is not in that version); sorted by change, n descending, behaviour_id.
        roles: one row a role: behaviours, states and pairs of a state and a behaviour, before
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
    return (
        pl.concat([pl.DataFrame(schema=_without_version(Behaviours.dtypes())), *patterns])
        .with_columns(pl.lit(version, dtype=pl.Int32).alias("version"))
        .select(list(Behaviours.dtypes()))
        .sort("n", "role", "codes", descending=[True, False, False])
    )


def occasions(
    decisions: Iterable[pl.DataFrame], version: int, settings: KnowledgeSettings = KnowledgeSettings()
) -> pl.DataFrame:
    """Count the states in which behaviours were begun.

    The result does not depend on the order of the tables; memory is bounded by the number of
    distinct (role, state, behaviour).

    Args:
        decisions: rows of schema Decisions, a table a match. A null behaviour, "moves randomly",
            counts as the behaviour of the one code 194: the paper's learner starts from it in
            every new state and values it as any other (sections 4 and 6).
        version: of the knowledge, at least 1.
        settings: optimistic.

    Returns:
        Rows of schema Occasions. ``initial`` is the greatest value of the behaviours seen in the
        state by the role, so that each of them is tried (paper section 3.2.2, last sentence).
    """
    total = Occasions.empty().select(*_PAIR, "count", value_sum="value")
    held: list[pl.DataFrame] = []
    rows = 0
    for table in decisions:
        held.append(
            table.select(
                "role",
                "state",
                pl.col("behaviour_id").fill_null(moves_randomly()),
                pl.lit(1, dtype=pl.Int64).alias("count"),
                pl.Series("value_sum", exact(table["value"].to_numpy())),
            )
        )
        rows += table.height
        if rows > max(_BUFFERED_ROWS, total.height):
            total, held, rows = _add_up([total, *held]), [], 0
    return (
        _add_up([total, *held])
        .with_columns(
            pl.lit(version, dtype=pl.Int32).alias("version"), value=pl.col("value_sum") / pl.col("count")
        )
        .with_columns(initial=pl.max_horizontal(
            pl.col("value").max().over("role", "state"), pl.lit(settings.optimistic, dtype=pl.Float64)
        ))
        .select(list(Occasions.dtypes()))
        .sort(_PAIR)
    )


def diff(
    behaviours_before: pl.DataFrame,
    behaviours_after: pl.DataFrame,
    occasions_before: pl.DataFrame,
    occasions_after: pl.DataFrame,
) -> Difference:
    """Compare two versions of the knowledge.

    Args:
        behaviours_before: rows of schema Behaviours of the earlier version.
        behaviours_after: of the later version.
        occasions_before: rows of schema Occasions of the earlier version.
        occasions_after: of the later version.
    """
    before = _with_states(behaviours_before, occasions_before)
    after = _with_states(behaviours_after, occasions_after)
    changed = pl.any_horizontal(
        pl.col(f"{name}_before") != pl.col(f"{name}_after") for name in ("support", "value")
    )
    joined = (
        before.rename({name: f"{name}_before" for name in ("support", "value", "states")})
        .join(
            after.rename({name: f"{name}_after" for name in ("support", "value", "states")}),
            on=("behaviour_id", "role", "n"), how="full", coalesce=True,
        )
        .with_columns(
            change=pl.when(pl.col("support_before").is_null()).then(pl.lit("added"))
            .when(pl.col("support_after").is_null()).then(pl.lit("removed"))
            .when(changed).then(pl.lit("changed"))
        )
        .filter(pl.col("change").is_not_null())
        .select(
            "behaviour_id", "change", "role", "n",
            *(f"{name}_{when}" for name in ("support", "value", "states") for when in ("before", "after")),
        )
        .sort("change", "n", "behaviour_id", descending=[False, True, False])
    )
    roles = pl.DataFrame({"role": ROLES}, schema={"role": pl.Enum(ROLES)})
    for when, patterns, seen in (
        ("before", behaviours_before, occasions_before), ("after", behaviours_after, occasions_after),
    ):
        roles = roles.join(
            patterns.group_by("role").agg(pl.len().cast(pl.Int64).alias(f"behaviours_{when}")),
            on="role", how="left", maintain_order="left",
        ).join(
            seen.group_by("role").agg(
                pl.col("state").n_unique().cast(pl.Int64).alias(f"states_{when}"),
                pl.len().cast(pl.Int64).alias(f"pairs_{when}"),
            ),
            on="role", how="left", maintain_order="left",
        )
    return Difference(joined, roles.with_columns(pl.exclude("role").fill_null(0)))


def _with_states(patterns: pl.DataFrame, seen: pl.DataFrame) -> pl.DataFrame:
    """Behaviours with the number of states in which each was seen."""
    states = seen.group_by("behaviour_id").agg(states=pl.len().cast(pl.Int64))
    return patterns.select("behaviour_id", "role", "n", "support", "value").join(
        states, on="behaviour_id", how="left"
    ).with_columns(pl.col("states").fill_null(0))


def _add_up(parts: list[pl.DataFrame]) -> pl.DataFrame:
    return pl.concat(parts).group_by(_PAIR).agg(pl.col("count").sum(), pl.col("value_sum").sum())


def _without_version(dtypes: dict[str, pl.DataType]) -> dict[str, pl.DataType]:
    return {name: dtype for name, dtype in dtypes.items() if name != "version"}
