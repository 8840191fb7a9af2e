"""From occurrences of rules to rows of the table of situations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.numbers.arrays import I8, I32, I64
from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations.occurrences import (
    Gaps,
    Meanings,
    RobotSamples,
    Rows,
    nanoseconds,
    resolve,
)
from pitchlore.pipeline.stages.situations.rulebook import holds_ns
from pitchlore.pipeline.stages.situations.rules import RULES, TABLE_1, Start, Target
from pitchlore.schemas import ROLES, SIDES, Situations
from pitchlore.schemas.situations import MOVES_RANDOMLY


class Robots(NamedTuple):
    """The B robots of a match at T samples, home first, by number.

    Attributes:
        team: int8 [B], 0 home, 1 away.
        robot: int64 [B], the robots' numbers.
        role: int8 [B, T], index in ROLES as last seen; -1 before the first time.
        segment: int32 [T], -1 while play is stopped.
    """

    team: I8
    robot: I64
    role: I8
    segment: I32


def situations(
    row: int, robots: Robots, samples: RobotSamples, found: Rows, settings: SituationSettings
) -> dict[str, npt.NDArray[Any]]:
    """The situations of the robot in ``row`` from its occurrences, columns for :func:`situation_rows`."""
    code, target = _codes_and_targets(row, robots, samples, found)
    named = code > 0
    found, code, target = found[named], code[named], target[named]
    # priority, start, code; then rule and other robot, which only make the order definite
    key = _PRIORITY[code]
    for part, bits in ((found["k0"], 32), (code, 8), (found["rule"], 7), (found["other"] + 1, 10)):
        key = (key << bits) | part
    least_ns = np.minimum(holds_ns(settings.fire_at), nanoseconds(settings.random_least_s))
    longest_ns = np.minimum(_LONGEST_NS[code], nanoseconds(settings.longest_s))
    meanings = Meanings(code, target, longest_ns, least_ns[found["rule"]])
    gaps = Gaps(
        settings.least_share, MOVES_RANDOMLY, nanoseconds(settings.random_least_s),
        nanoseconds(settings.random_longest_s),
    )
    rows = resolve(np.argsort(key), found, meanings, samples, gaps)
    index = samples.place[rows["k0"]]
    return {
        "row": np.full(len(rows), row),
        "role": robots.role[row, index],
        "code": rows["code"],
        "start_ns": samples.t_ns[rows["k0"]],
        "end_ns": samples.until_ns[rows["k1"] - 1],
        "strength": rows["strength"],
        "target": rows["target"],
        "segment": robots.segment[index],
    }


def situation_rows(
    robots: Robots, match_id: str, parts: Sequence[dict[str, npt.NDArray[Any]]]
) -> pl.DataFrame:
    """Rows of schema Situations from those of :func:`situations`, one robot after the other."""
    if not parts:
        return Situations.empty()
    found = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    names = [f"{SIDES[team]}-{robot}" for team, robot in zip(robots.team, robots.robot, strict=True)]
    targets = pl.Series([*names, *map(str, _THINGS), None], dtype=pl.String)
    return pl.DataFrame({
        "team": pl.Series(SIDES, dtype=pl.Enum(SIDES)).gather(robots.team[found["row"]]),
        "robot": robots.robot[found["row"]],
        "role": _ROLES.gather(found["role"]),
        "code": found["code"],
        "name": _NAMES.gather(found["code"]),
        "start_ns": found["start_ns"],
        "end_ns": found["end_ns"],
        "strength": found["strength"],
        "target": targets.gather(found["target"] % len(targets)),
        "segment": found["segment"],
    }).select(
        pl.lit(match_id).alias("match_id"), pl.exclude("strength"), pl.col("strength").fill_nan(None),
    ).select(*Situations.dtypes()).cast(pl.Schema(Situations.dtypes()))


def _codes_and_targets(row: int, robots: Robots, samples: RobotSamples, found: Rows) -> tuple[I64, I64]:
    """Code (0 for none) and target of each occurrence, int64 [M]; the roles at its start decide the code."""
    rule, other = found["rule"], found["other"]
    start = samples.place[found["k0"]]
    role, other_role = robots.role[row, start], robots.role[other, start]
    turn = np.where(_TARGET[rule] == Target.TEAMMATE, (other_role - role) % len(ROLES), other_role)
    unknown = (other >= 0) & (other_role < 0)
    code = np.where(other < 0, _CODES[rule, 0], np.where(unknown, 0, _CODES[rule, turn]))
    things = len(robots.robot) + np.array([_THINGS.index(t) if t in _THINGS else -1 for t in _TARGET])
    return code, np.where(other >= 0, other, np.where(_TARGET[rule] == Target.NOTHING, -1, things[rule]))


#: Targets that are not robots. In numbers they follow the robots' rows; -1 is none.
_THINGS = (Target.BALL, Target.OWN_GOAL, Target.ADVERSARY_GOAL)
_TARGET = np.array([rule.target for rule in RULES])
_CODES = np.array([rule.code if isinstance(rule.code, tuple) else (rule.code,) * 3 for rule in RULES])
_PRIORITY = np.array([TABLE_1.get(code, ("", None))[1] or 0 for code in range(MOVES_RANDOMLY + 1)])
_ROLES = pl.Series(ROLES, dtype=pl.Enum(ROLES))
_NAMES = pl.Series([TABLE_1.get(code, ("", None))[0] for code in range(MOVES_RANDOMLY + 1)])

#: How long situations of a code may last when merged, so that merging does not undo the cutting.
_LONGEST_NS = np.array([
    max(
        (nanoseconds(rule.limit_s) for rule in RULES if rule.start == Start.WHILE and rule.code == code),
        default=np.iinfo(np.int64).max,
    )
    for code in range(MOVES_RANDOMLY + 1)
])
