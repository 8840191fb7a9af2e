"""Options on their way to a policy: sequences made of them, habits, and a team that has nothing else."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.engine.inputs import Held, Inputs, StoreInputs, by_day
from pitchlore.pipeline.engine.placement.executors import Executors, Here, executors
from pitchlore.pipeline.engine.placement.processes import MANY
from pitchlore.pipeline.engine.tasks import spread
from pitchlore.pipeline.numbers.arrays import F32, I64
from pitchlore.pipeline.settings import (
    GramSettings,
    HabitSettings,
    KnowledgeSettings,
    OptionSettings,
    ValueSettings,
)
from pitchlore.pipeline.stages.sides.teams import Team, sides_of
from pitchlore.pipeline.store import Store
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
    from pitchlore.pipeline.numbers.trees import Trees
    from pitchlore.pipeline.stages.options.robots import RobotTraits

_DETAIL = "habits"
#: Habits are learned anew when one in so many of the newest poses is new.
_NEW = 3


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
        before: the noun of the version before, whose habits may stand (:func:`newer_matches`).
    """
    if team is not None and (inputs["options"] or inputs["trajectories"]):
        mine, at_most = sides_of(team, sides), settings.habits.windows_at_most
        if settings.recover is None or inputs["options"]:
            found, how = _of_all(inputs, mine, at_most)
        else:
            poses = _poses(inputs, mine)
            for held in inputs[before]:
                newer = newer_matches(held, team, poses)
                if newer is not None:
                    return _again(inputs, before, newer=newer)
            found, how = _of_newest(inputs, mine, poses, at_most, settings.recover)
        from pitchlore.pipeline.stages.options.of_team import fit_habits, team_habits  # noqa: PLC0415 (it loads scikit-learn)

        def fits(sets: Sequence[tuple[F32, I64]], own: HabitSettings) -> list[dict[int, Trees]]:
            pieces = [(str(place), {"observation": observation, "option": option, "settings": own})
                      for place, (observation, option) in enumerate(sets)]
            grown = dict(spread(_workers(inputs), fit_habits, pieces, len(pieces), task="habits"))
            return [grown[label] for label, _ in pieces]

        habits, trees = team_habits(found, team, settings.habits, inputs.version, fits)
        if habits.height:
            return VersionHabits(((habits, Habits), (trees, HabitTrees)), {_DETAIL: how})
    if any(Habits.NAME in held.files for held in inputs[parent]):
        return _again(inputs, parent)
    return VersionHabits((), {})


def _again(inputs: Inputs, noun: str, **details: int) -> VersionHabits:
    """The habits of another version, with some of its details anew."""
    version = pl.lit(inputs.version, dtype=pl.Int32).alias("version")
    return VersionHabits(tuple(
        (inputs.table(noun, schema).with_columns(version), schema) for schema in (Habits, HabitTrees)
    ), {_DETAIL: inputs.details(noun)[_DETAIL] | details})


class Poses(NamedTuple):
    """The poses of a team in a match.

    Attributes:
        sha256: SHA-256 of their table.
        rows: its rows, counted for each side that the team is.
    """

    sha256: str
    rows: int


def _poses(inputs: Inputs, mine: pl.DataFrame) -> dict[str, Poses]:
    """The poses of a team in its matches, the newest first."""
    assert isinstance(inputs, StoreInputs)
    sides = dict(mine.group_by("match_id").len().iter_rows())
    held = {each.name: each.files[Trajectories.NAME] for each in inputs["trajectories"]}
    files = {log.name: held[log.name] for log in sorted(inputs["matches"], key=by_day, reverse=True)}
    return {match: Poses(file.sha256, (file.rows or 0) * sides[match])
            for match, file in files.items() if match in sides}


def newer_matches(before: Held, team: Team, poses: Mapping[str, Poses]) -> int | None:
    """Number of newer matches that the standing habits of a team have not learned from; None: they fall.

    They stand as long as all matches are there that they were learned from, and less than a third of as many
    of the newest poses is new. So all fits together cost a few times as much as one, however many matches
    come one by one.
    """
    learned: dict[str, str] = before.details.get(_DETAIL, {}).get("of", {})
    there = all(match in poses and poses[match].sha256 == sha256 for match, sha256 in learned.items())
    if not learned or not there or before.details["imitates"] != team._asdict():
        return None
    left, new, newer = sum(poses[match].rows for match in learned), 0, 0
    most = left / _NEW
    for match, own in poses.items():
        if left <= 0:
            break
        left -= own.rows
        if match not in learned:
            newer, new = newer + 1, new + own.rows
    return newer if new < most else None


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
    inputs: Inputs, mine: pl.DataFrame, poses: Mapping[str, Poses], at_most: int, settings: OptionSettings
) -> tuple[pl.DataFrame, dict[str, Any]]:
    """Clues to a team's options in as many of its newest matches as fit, and how they were gathered.

    Whether another match fits is told by its poses, and by how many windows the newest has.
    """
    assert isinstance(inputs, StoreInputs)
    workers, order = _workers(inputs), list(poses)
    data = workers.path(inputs.root)

    def piece(match: str) -> dict[str, Any]:
        return {"inputs": inputs.of_match(match), "data": data, "mine": mine, "settings": settings}

    if not order:  # it is of another league
        return Clues.empty(), {}
    clues = {order[0]: _clues(**piece(order[0]))}
    windows = clues[order[0]].height
    rows = np.cumsum([own.rows for own in poses.values()])
    fitting = max(int((rows * (windows / max(rows[0], 1)) <= at_most).sum()), 1)
    others = ((match, piece(match)) for match in order[1:fitting])
    found = dict(spread(workers, _clues, others, fitting - 1, task="clues"))
    clues |= {match: found[match] for match in order[1:fitting]}
    every = max(-(-windows // at_most), 1) if len(clues) == 1 else 1  # a single match may have too many
    taken = (each.gather_every(every) for each in reversed(clues.values()))
    learned = pl.concat([Clues.empty(), *taken]).drop_nulls("role")
    return learned, {"window_s": settings.window_s, "windows": learned.height, "matches": len(clues),
                     "newest": order[0], "newer": 0, "of": {match: poses[match].sha256 for match in clues}}


def _clues(
    inputs: StoreInputs, data: Path, mine: pl.DataFrame, settings: OptionSettings
) -> pl.DataFrame:
    """Clues to a team's options in a match; another process may gather them."""
    own = inputs.at(Store(data))
    sides = mine.filter(match_id=own.only("matches").name)["team"].cast(pl.String).to_list()
    options, clues, _ = recovered_options(own, settings, sides)
    return _of_team(clues, options, mine)


def _workers(inputs: Inputs) -> Executors:
    """Executors of what habits take: those of the run in a league that keeps them busy, else this process."""
    return executors.get() if len(inputs["sides"]) >= MANY else Here(1)


def _of_team(clues: pl.DataFrame, options: pl.DataFrame, mine: pl.DataFrame) -> pl.DataFrame:
    """The clues of a team's sides in a match; what the team logged is known."""
    from pitchlore.pipeline.stages.options.runs import as_logged  # noqa: PLC0415 (see pipeline.engine.stages)

    return as_logged(clues, options).join(mine, on=("match_id", "team"), how="semi", maintain_order="left")


def watched_clock(knowledge: Inputs) -> dict[str, float]:
    """The time between two decisions of a team that plays by these habits: as it was watched."""
    details = knowledge.details("knowledge")
    return {"clock_s": details[_DETAIL]["window_s"]} if _DETAIL in details else {}


def copy_of(knowledge: Mapping[str, Any]) -> dict[str, Any]:
    """The matches of a version's habits, by its details, for a policy's; empty where all matches count."""
    how = knowledge.get(_DETAIL, {})
    return {name: how[name] for name in ("matches", "newest", "newer")} if "of" in how else {}


def matches_of(copied: Mapping[str, Any]) -> str:
    """The matches of :func:`copy_of` in words."""
    newer = copied["newer"]
    waits = "match is newer, and waits" if newer == 1 else "matches are newer, and wait"
    beside = f"; {newer} {waits} until a third of the newest poses is new" if newer else ""
    return f"{copied['matches']} match{'es' * (copied['matches'] != 1)}, up to {copied['newest']}{beside}"


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
