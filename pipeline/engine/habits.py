"""Options on their way to a policy: sequences made of them, habits, and a team that has nothing else."""

from __future__ import annotations

from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.engine.inputs import Inputs
from pitchlore.pipeline.settings import GramSettings, HabitSettings, ValueSettings
from pitchlore.pipeline.stages.sides.teams import Team, sides_of
from pitchlore.schemas import (
    KEYS,
    Clues,
    Habits,
    HabitTrees,
    Options,
    Situations,
    Table,
    Values,
    Worths,
)

_DETAIL = "habits"


class VersionHabits(NamedTuple):
    """Habits of a version; empty if options of the team were never recovered.

    Attributes:
        tables: rows of schema Habits and of schema HabitTrees.
        details: how they were learned.
    """

    tables: tuple[tuple[pl.DataFrame, type[Table]], ...]
    details: dict[str, dict[str, float]]


def what_was_done(
    inputs: Inputs, settings: GramSettings, referee: pl.DataFrame, bodies: pl.DataFrame
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """The rows of a match of which sequences are made, situations or options, and what each changes of V.

    Args:
        inputs: inputs of the sequences of a match.
        settings: ``of``.
        referee: rows of schema Referee of the match.
        bodies: rows of schema Trajectories of the match.
    """
    if settings.of == "situations":
        return inputs.table("situations", Situations), inputs.table("values", Worths)
    from pitchlore.pipeline.stages.options.runs import as_done  # noqa: PLC0415 (see pipeline.engine.stages)
    from pitchlore.pipeline.stages.values.worths import worths  # noqa: PLC0415 (see pipeline.engine.stages)

    done = as_done(inputs.table("options", Options))
    own = ValueSettings.model_validate(inputs.only("values").settings)
    return done, worths(done, inputs.table("values", Values), referee, bodies, own)


def of_version(
    inputs: Inputs, settings: HabitSettings, team: Team | None, sides: pl.DataFrame, parent: str
) -> VersionHabits:
    """The habits of the team that policies imitate: of a version's own matches, or else those of its parent.

    Args:
        inputs: inputs of the version.
        settings: settings of habits.
        team: the team; None: nobody has any.
        sides: rows of schema Sides of the version's matches.
        parent: the noun of the parent in ``inputs``.
    """
    if team is not None and inputs["options"]:
        from pitchlore.pipeline.stages.options.of_team import team_habits  # noqa: PLC0415 (it loads scikit-learn)
        from pitchlore.pipeline.stages.options.runs import as_logged  # noqa: PLC0415 (see pipeline.engine.stages)

        mine, clues = sides_of(team, sides), [Clues.empty()]
        of_match = max(settings.windows_at_most // len(inputs["options"]), 1)
        matches = zip(inputs.tables("options", Clues), inputs.tables("options", Options), strict=True)
        for table, options in matches:
            told = as_logged(table, options)
            own = told.join(mine, on=("match_id", "team"), how="semi", maintain_order="left")
            clues.append(own.gather_every(max(-(-own.height // of_match), 1)))
        learned = pl.concat(clues).drop_nulls("role")
        habits, trees = team_habits(learned, team, settings, inputs.version)
        if habits.height:
            how = {"window_s": inputs["options"][0].settings["window_s"], "windows": learned.height}
            return VersionHabits(((habits, Habits), (trees, HabitTrees)), {_DETAIL: how})
    if not any(Habits.NAME in held.files for held in inputs[parent]):
        return VersionHabits((), {})
    version = pl.lit(inputs.version, dtype=pl.Int32).alias("version")
    return VersionHabits(tuple(
        (inputs.table(parent, schema).with_columns(version), schema) for schema in (Habits, HabitTrees)
    ), {_DETAIL: inputs.details(parent)[_DETAIL]})


def watched_clock(knowledge: Inputs) -> dict[str, float]:
    """The time between two decisions of a team that plays by these habits: as it was watched."""
    details = knowledge.details("knowledge")
    return {"clock_s": details[_DETAIL]["window_s"]} if _DETAIL in details else {}


def habitual(habits: pl.DataFrame, trees: pl.DataFrame, version: int) -> tuple[pl.DataFrame, pl.DataFrame]:
    """A policy that does what a team most probably does.

    Args:
        habits: rows of schema Habits of the team.
        trees: rows of schema HabitTrees of the team.
        version: version of the policy.

    Returns:
        The options of each role as pairs, as :func:`pipeline.stages.policies.train.train` takes them, with
        their shares of the role's windows as values; and rows of schema Appraisals.
    """
    pairs = habits.select(
        "role", pl.lit(KEYS[-1], dtype=pl.Enum(KEYS)).alias("key"), pl.lit(0, dtype=pl.Int64).alias("state"),
        behaviour_id=pl.format("{}-{}", "role", pl.col("option").cast(pl.String).str.zfill(3)),
        initial=pl.lit(0.0), value="share",
    ).sort("role", "behaviour_id")
    offered = trees.filter(pl.col("code").is_in(habits["option"].implode()))
    return pairs, offered.with_columns(pl.lit(version, dtype=pl.Int32).alias("version"))
