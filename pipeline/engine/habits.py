"""Options on their way to a policy: sequences made of them, habits, and a team that has nothing else."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any, NamedTuple

import polars as pl

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.engine.inputs import Inputs, StoreInputs
from pitchlore.pipeline.settings import GramSettings, KnowledgeSettings, OptionSettings, ValueSettings
from pitchlore.pipeline.stages.sides.teams import Team, sides_of
from pitchlore.schemas import (
    KEYS,
    SIDES,
    Clues,
    Habits,
    HabitTrees,
    Options,
    Situations,
    Table,
    Trajectories,
    Values,
    Worths,
)

if TYPE_CHECKING:
    from pitchlore.pipeline.stages.options.robots import RobotTraits

_DETAIL = "habits"


class VersionHabits(NamedTuple):
    """Habits of a version; empty if options of the team were never recovered.

    Attributes:
        tables: rows of schema Habits and of schema HabitTrees.
        details: how they were learned.
    """

    tables: tuple[tuple[pl.DataFrame, type[Table]], ...]
    details: dict[str, dict[str, Any]]


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


def recovered_options(
    inputs: Inputs, settings: OptionSettings, teams: Collection[str] = SIDES
) -> tuple[pl.DataFrame, pl.DataFrame, dict[str, RobotTraits]]:
    """Rows of schema Options and of schema Clues of a match, and the robots of each side.

    Args:
        inputs: the match and its trajectories.
        settings: how they are recovered.
        teams: the sides whose options are.
    """
    from pitchlore.pipeline.stages.options.likelihood import shipped_ratios  # noqa: PLC0415 (see pipeline.engine.stages)
    from pitchlore.pipeline.stages.options.recover import logged_options, options  # noqa: PLC0415 (see pipeline.engine.stages)

    held = inputs.details("matches")
    told = settings.logged and (held.get("decisions") != 0 or "options" in held)
    log = inputs.log() if told else None
    return options(
        inputs.table("trajectories", Trajectories), inputs.pitch, settings, shipped_ratios(settings.robots),
        None if log is None else logged_options(log.decisions, log.options), teams)


def of_version(
    inputs: Inputs, settings: KnowledgeSettings, team: Team | None, sides: pl.DataFrame, parent: str,
    before: str,
) -> VersionHabits:
    """The habits of the team that policies imitate: of a version's own matches, or else those of its parent.

    Args:
        inputs: inputs of the version.
        settings: settings of the version.
        team: the team; None: nobody has any.
        sides: rows of schema Sides of the version's matches.
        parent: the noun in ``inputs`` of the version to which this one adds.
        before: the noun of the version before, whose habits stand if it learned from the same clues.
    """
    if team is not None and (inputs["options"] or inputs["trajectories"]):
        from pitchlore.pipeline.stages.options.of_team import team_habits  # noqa: PLC0415 (it loads scikit-learn)

        mine, at_most = sides_of(team, sides), settings.habits.windows_at_most
        if settings.recover is None or inputs["options"]:
            found, how = _of_all(inputs, mine, at_most)
        else:
            found, how = _of_newest(inputs, mine, at_most, settings.recover)
        if any(held.details.get(_DETAIL) == how for held in inputs[before]):
            return _again(inputs, before)
        habits, trees = team_habits(found, team, settings.habits, inputs.version)
        if habits.height:
            return VersionHabits(((habits, Habits), (trees, HabitTrees)), {_DETAIL: how})
    if any(Habits.NAME in held.files for held in inputs[parent]):
        return _again(inputs, parent)
    return VersionHabits((), {})


def _again(inputs: Inputs, noun: str) -> VersionHabits:
    """The habits of another version."""
    version = pl.lit(inputs.version, dtype=pl.Int32).alias("version")
    return VersionHabits(tuple(
        (inputs.table(noun, schema).with_columns(version), schema) for schema in (Habits, HabitTrees)
    ), {_DETAIL: inputs.details(noun)[_DETAIL]})


def _of_all(inputs: Inputs, mine: pl.DataFrame, at_most: int) -> tuple[pl.DataFrame, dict[str, Any]]:
    """Clues to a team's options in all matches whose options were recovered, and how they were gathered."""
    clues, of_match = [Clues.empty()], max(at_most // len(inputs["options"]), 1)
    tables = (inputs.tables("options", schema) for schema in (Clues, Options))
    for table, options in zip(*tables, strict=True):
        own = _of_team(table, options, mine)
        clues.append(own.gather_every(max(-(-own.height // of_match), 1)))
    learned = pl.concat(clues).drop_nulls("role")
    return learned, {"window_s": inputs["options"][0].settings["window_s"], "windows": learned.height}


def _of_newest(
    inputs: Inputs, mine: pl.DataFrame, at_most: int, settings: OptionSettings
) -> tuple[pl.DataFrame, dict[str, Any]]:
    """Clues to a team's options in as many of its newest matches as fit, and how they were gathered."""
    assert isinstance(inputs, StoreInputs)
    clues = list[pl.DataFrame]()
    for held in reversed(inputs["trajectories"]):
        sides = mine.filter(match_id=held.name)["team"].cast(pl.String).to_list()
        if not sides:
            continue
        options, table, _ = recovered_options(inputs.of_match(held.name), settings, sides)
        clues.append(_of_team(table, options, mine))
        windows = sum(each.height for each in clues)
        if windows > at_most:  # of the newest match alone every so manyth
            clues = clues[:-1] or [clues[0].gather_every(-(-windows // at_most))]
            break
    learned = pl.concat([Clues.empty(), *reversed(clues)]).drop_nulls("role")
    seen = learned.select("match_id", "team", "robot", "role", "start_ns").write_csv().encode()
    numbers = (learned[name].to_numpy().tobytes() for name in ("sight", "ratios"))
    return learned, {"window_s": settings.window_s, "windows": learned.height, "matches": len(clues),
                     "clues": digest(b"".join([seen, *numbers]))}


def _of_team(clues: pl.DataFrame, options: pl.DataFrame, mine: pl.DataFrame) -> pl.DataFrame:
    """The clues of a team's sides in a match; what the team logged is known."""
    from pitchlore.pipeline.stages.options.runs import as_logged  # noqa: PLC0415 (see pipeline.engine.stages)

    return as_logged(clues, options).join(mine, on=("match_id", "team"), how="semi", maintain_order="left")


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
