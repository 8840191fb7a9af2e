"""Losses of the ball by thirds of the pitch, and places and receivers of passes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.views.commentary.words import percent
from pitchlore.schemas import ROLES, SIDES

#: Thirds of the pitch along it, as a team sees them.
THIRDS = ("own third", "middle third", "attacking third")
#: Ways of a pass, and the directions of schema Passes that each is made of.
WAYS = (("forward", ("front",)), ("sideways", ("left", "right")), ("back", ("back",)))
#: Share of its samples from which a robot's commonest role is said without the share.
_CONSTANT = 0.9

#: By robot and role: the number of samples in play.
RoleSamples = dict[int, dict[str, int]]


class RobotNumbers(NamedTuple):
    """Numbers of a robot of a team, over matches.

    Attributes:
        role: its role on a page: the one that it has longest in the page's matches.
        share: share of its samples in play in which it has this role.
        minutes: minutes of the matches in which it is seen.
    """

    role: str
    share: float
    minutes: float

    @property
    def says(self) -> str:
        """Its role in words, with the share where the role is not constant."""
        return self.role if self.share >= _CONSTANT else f"{self.role} for {percent(self.share)}"


class Losses(NamedTuple):
    """Balls that a robot lost to the adversary.

    Attributes:
        robot: its number.
        role: its role in words; empty where it is not seen.
        thirds: losses in each of THIRDS.
        n: all of them.
        per_ten: losses in ten minutes of the matches in which it is seen; None where it is not seen.
    """

    robot: int
    role: str
    thirds: tuple[int, ...]
    n: int
    per_ten: float | None


class Passing(NamedTuple):
    """Passes that arrived, counted.

    Attributes:
        thirds: by the third in which a pass begins (rows) and ends (columns), in the order of THIRDS.
        robots: numbers of the robots that pass or receive, sorted.
        pairs: by the robot that passes (rows) and the one that receives (columns), in that order.
        ways: by the robot that passes (rows) and the direction (columns), in the order of WAYS.
        n: all of them.
    """

    thirds: list[list[int]]
    robots: list[int]
    pairs: list[list[int]]
    ways: list[list[int]]
    n: int


def third(x: str, length: pl.Expr | float) -> pl.Expr:
    """Index into THIRDS of a column of places along the pitch (m, the team attacks +x); Int8.

    A place on the border of two thirds is in the one ahead, one behind a goal line in the third next to it.
    """
    return ((pl.col(x) / length + 0.5) * len(THIRDS)).floor().clip(0, len(THIRDS) - 1).cast(pl.Int8)


def samples(trajectories: pl.DataFrame) -> dict[str, RoleSamples]:
    """Samples in play of each side's robots, by role, from rows of schema Trajectories of one match."""
    counts = trajectories.filter(
        pl.col("team") != "ball", pl.col("segment").is_not_null(), pl.col("role").is_not_null()
    ).group_by(pl.col("team", "role").cast(pl.String), "robot").len().sort("team", "robot", "role")
    found: dict[str, RoleSamples] = {side: {} for side in SIDES}
    for side, role, robot, count in counts.iter_rows():
        found[side].setdefault(robot, {})[role] = count
    return found


def robot_numbers(each: Iterable[tuple[Mapping[int, Mapping[str, int]], float]]) -> dict[int, RobotNumbers]:
    """Numbers of each robot of a team over its sides in matches: their samples, and the matches' minutes.

    Of roles with as many samples the first by name is taken.
    """
    totals: RoleSamples = {}
    minutes: dict[int, float] = {}
    for robots, lasts in each:
        for robot, roles in robots.items():
            minutes[robot] = minutes.get(robot, 0.0) + lasts
            own = totals.setdefault(robot, {})
            for role, count in roles.items():
                own[role] = own.get(role, 0) + count
    found = {}
    for robot, roles in sorted(totals.items()):
        role = min(roles, key=lambda name: (-roles[name], name))
        found[robot] = RobotNumbers(role, roles[role] / max(sum(roles.values()), 1), minutes[robot])
    return found


def one_role(says: str, sides: Mapping[str, Mapping[int, RobotNumbers]]) -> str:
    """A sentence with one role for each robot: the longest, and after it that of the moment if it is another.

    Args:
        says: a sentence in which a robot is called ``name number (role then)``.
        sides: the robots of each side, by what it is called.
    """
    def named(found: re.Match[str]) -> str:
        name, number, then = found.groups()
        seen = sides[name].get(int(number))
        role = then if seen is None else seen.role
        return f"{name} {number} ({role}{'' if then == role else f', here {then}'})"

    names = "|".join(map(re.escape, sorted(sides, key=len, reverse=True)))
    return re.sub(rf"({names}) (\d+) \(({'|'.join(ROLES)})\)", named, says)


def time_in(role: str, each: Iterable[Mapping[int, Mapping[str, int]]]) -> list[tuple[int, float]]:
    """Robots of a team that ever had a role, each with the share of its samples in play, the greatest first.

    Args:
        role: the role.
        each: samples of the team's robots by role, a side of a match each.
    """
    own: dict[int, int] = {}
    whole: dict[int, int] = {}
    for robots in each:
        for robot, roles in robots.items():
            own[robot] = own.get(robot, 0) + roles.get(role, 0)
            whole[robot] = whole.get(robot, 0) + sum(roles.values())
    shares = ((robot, samples / whole[robot]) for robot, samples in own.items() if samples)
    return sorted(shares, key=lambda it: (-it[1], it[0]))


def losses(
    possession: pl.DataFrame, lengths: Mapping[str, float], robots: Mapping[int, RobotNumbers]
) -> list[Losses]:
    """Losses of the ball, by robot and place: possessions that the adversary ended.

    Args:
        possession: rows of schema Possession of one team.
        lengths: length of the pitch of each match, m.
        robots: the team's robots that are seen; those without a loss have a row, too.

    Returns:
        A row a robot, sorted by number.
    """
    lost = possession.filter(pl.col("ended") == "lost")
    counts = _counts(lost.select("last_robot", third("end_x", _length(lengths))))
    found = []
    for robot in sorted({*robots, *lost["last_robot"].to_list()}):
        seen = robots.get(robot)
        thirds = tuple(counts.get((robot, at), 0) for at in range(len(THIRDS)))
        n = sum(thirds)
        per_ten = 10 * n / seen.minutes if seen and seen.minutes else None
        found.append(Losses(robot, seen.says if seen else "", thirds, n, per_ten))
    return found


def passing(passes: pl.DataFrame, lengths: Mapping[str, float]) -> Passing:
    """Passes from third to third and from robot to robot.

    Args:
        passes: rows of schema Passes of one team.
        lengths: length of the pitch of each match, m.
    """
    length = _length(lengths)
    zones = _counts(passes.select(third("x", length), third("to_x", length)))
    pairs = _counts(passes.select("robot", "receiver"))
    ways = _counts(passes.select("robot", pl.col("direction").cast(pl.String).replace_strict(
        {direction: at for at, (_, own) in enumerate(WAYS) for direction in own}, return_dtype=pl.Int8)))
    robots = sorted({robot for pair in pairs for robot in pair})
    return Passing(
        [[zones.get((start, end), 0) for end in range(len(THIRDS))] for start in range(len(THIRDS))],
        robots, [[pairs.get((giver, taker), 0) for taker in robots] for giver in robots],
        [[ways.get((giver, at), 0) for at in range(len(WAYS))] for giver in robots], passes.height)


def _length(lengths: Mapping[str, float]) -> pl.Expr:
    return pl.col("match_id").replace_strict(dict(lengths), return_dtype=pl.Float64)


def _counts(rows: pl.DataFrame) -> dict[tuple[int, ...], int]:
    """How often each pair of values occurs."""
    found: dict[tuple[int, ...], int] = {}
    pairs: Sequence[tuple[int, ...]] = rows.rows()
    for pair in pairs:
        found[pair] = found.get(pair, 0) + 1
    return found
