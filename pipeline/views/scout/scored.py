"""How goals came about: their kinds, who scored, from where, and what the scorer did last."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.views.scout.gallery import Clip
from pitchlore.pipeline.views.scout.leadup import LeadUp
from pitchlore.pipeline.views.scout.zones import THIRDS, third
from pitchlore.schemas import SIDES
from pitchlore.schemas.goals import KINDS

#: Seconds shown before and after a goal; moments that are named of each line.
BEFORE_S, AFTER_S, MOMENTS = 5.0, 0.5, 3
#: Situations of a run.
RUN = 2
#: Kind of goals of which the source does not tell it.
UNKNOWN = "unknown"
#: Kind of goals that a robot of the adversary made.
ERROR = "error"


class Scored(NamedTuple):
    """One goal of a team.

    Attributes:
        match: id.
        side: home or away, whose goal it is.
        t_ns: when the referee gave it.
        robot: maker; the adversary's robot for an error; None where that is unknown.
        kind: one of KINDS, or unknown.
        distance: from the ball to the goal's middle at the shot that became it, m; None without a shot.
        third: index into THIRDS of that shot's place; None without a shot.
        run: codes of the last RUN situations that the scorer began up to the shot, or up to the goal where
            there is no shot, in one stretch of play; empty where there are fewer, or no scorer of the team.
        before: play before it.
    """

    match: str
    side: str
    t_ns: int
    robot: int | None
    kind: str
    distance: float | None
    third: int | None
    run: tuple[int, ...]
    before: LeadUp = LeadUp()

    @property
    def clip(self) -> Clip:
        """The seconds that lead to it; the robot that made it is watched, on its side."""
        return clip_of({"match_id": self.match, "team": self.side, "robot": self.robot, "kind": self.kind,
                        "t_ns": self.t_ns}, f"{self.kind} goal")


def clip_of(goal: Mapping[str, Any], says: str) -> Clip:
    """The clip that leads to a goal, a row of schema Goals; the robot that made it is ringed, on its side."""
    side, t_ns = goal["team"], goal["t_ns"]
    if side is not None and goal["kind"] == ERROR:
        side = SIDES[1 - SIDES.index(side)]
    return Clip.about({**goal, "team": side}, t_ns, t_ns, says, before_s=BEFORE_S, after_s=AFTER_S)


class GoalGroup(NamedTuple):
    """Goals that have something in common.

    Attributes:
        says: description.
        n: number of goals.
        shots: number of these that a shot became.
        distance: median distance of these shots, m; None without one.
        clips: up to MOMENTS of the goals, spread evenly.
    """

    says: str
    n: int
    shots: int
    distance: float | None
    clips: list[Clip]


class Run(NamedTuple):
    """The run of situations that came last before most goals.

    Attributes:
        codes: codes of its situations.
        n: goals that it came before.
        of: goals of which the scorer's run is known.
        clips: up to MOMENTS of the goals.
    """

    codes: tuple[int, ...]
    n: int
    of: int
    clips: list[Clip]


class Summary(NamedTuple):
    """How a team's goals came about.

    Attributes:
        n: number of goals.
        whole: all of them as one line.
        kinds: a line a kind, in the order of KINDS, then unknown; only kinds that there are.
        scorers: a line a robot, the most goals first.
        thirds: shots that became goals from each of THIRDS.
        run: last run before most of them; None where no run came before two.
    """

    n: int
    whole: GoalGroup
    kinds: list[GoalGroup]
    scorers: list[GoalGroup]
    thirds: tuple[int, ...]
    run: Run | None


def scored(
    goals: pl.DataFrame, shots: pl.DataFrame, situations: pl.DataFrame, length: float
) -> list[Scored]:
    """The goals of a match whose team is known, in order of time.

    A shot of the team with the outcome goal belongs to the first goal at or after it.

    Args:
        goals: rows of schema Goals of the match.
        shots: rows of schema Shots of the match.
        situations: rows of schema Situations of the match.
        length: length of the pitch, m.
    """
    went_in = shots.filter(pl.col("outcome") == "goal").select(
        pl.col("team").cast(pl.String), "t_ns", "distance", at=third("x", length)).sort("t_ns").rows()
    found, last_ns, begun = [], -1, _begun(situations)
    for row in goals.sort("t_ns").iter_rows(named=True):
        side, t_ns, kind = row["team"], row["t_ns"], row["kind"] or UNKNOWN
        if side is None:
            last_ns = t_ns
            continue
        shot = next((it for it in reversed(went_in) if it[0] == side and last_ns < it[1] <= t_ns), None)
        own = row["robot"] is not None and kind != ERROR
        until_ns = t_ns if shot is None else shot[1]
        run = _run(begun.get((side, row["robot"]), []), last_ns, until_ns) if own else ()
        found.append(Scored(row["match_id"], side, t_ns, row["robot"], kind,
                            None if shot is None else shot[2], None if shot is None else shot[3], run))
        last_ns = t_ns
    return found


def _begun(situations: pl.DataFrame) -> dict[tuple[str, int], list[tuple[int, int | None, int]]]:
    """Start, segment and code of the situations of each robot, from the first to the last to begin."""
    return situations.select("team", "robot", "start_ns", "segment", "code").sort(
        "start_ns", "code").rows_by_key(("team", "robot"))


def _run(begun: Sequence[tuple[int, int | None, int]], after_ns: int, t_ns: int) -> tuple[int, ...]:
    """The last situations that a robot began after a time and up to another, in one stretch of play."""
    first, past = (bisect_right(begun, at, key=itemgetter(0)) for at in (after_ns, t_ns))
    last = begun[max(first, past - RUN):past]
    whole = len(last) == RUN and len({segment for _, segment, _ in last}) == 1
    return tuple(code for _, _, code in last) if whole else ()


def again(rows: Iterable[Sequence[Any]]) -> list[Scored]:
    """Goals from their JSON."""
    return [Scored._make(row)._replace(run=tuple(row[-2]), before=LeadUp._make(row[-1])) for row in rows]


def summary(goals: Sequence[Scored], robots: Mapping[int, str]) -> Summary:
    """How a team's goals came about.

    Args:
        goals: goals of the team.
        robots: role of each of the team's robots in words.
    """
    def named(goal: Scored) -> str:
        if goal.robot is None:
            return "nobody known"
        if goal.kind == ERROR:
            return "a robot of the adversary"
        role = robots.get(goal.robot, "")
        return f"robot {goal.robot}{f' ({role})' if role else ''}"

    kinds = sorted(_lines(goals, lambda goal: goal.kind), key=lambda it: (*KINDS, UNKNOWN).index(it.says))
    scorers = sorted(_lines(goals, named), key=lambda it: (-it.n, it.says))
    places = [goal.third for goal in goals]
    return Summary(len(goals), _line("all", goals), kinds, scorers,
                   tuple(places.count(at) for at in range(len(THIRDS))), _commonest(goals))


def _lines(goals: Sequence[Scored], says: Callable[[Scored], str]) -> list[GoalGroup]:
    groups: dict[str, list[Scored]] = {}
    for goal in goals:
        groups.setdefault(says(goal), []).append(goal)
    return [_line(name, own) for name, own in groups.items()]


def _line(says: str, goals: Sequence[Scored]) -> GoalGroup:
    far = [goal.distance for goal in goals if goal.distance is not None]
    return GoalGroup(says, len(goals), len(far), float(np.median(far)) if far else None, _clips(goals))


def _clips(goals: Sequence[Scored]) -> list[Clip]:
    places = np.linspace(0, len(goals) - 1, min(len(goals), MOMENTS)).round().astype(int)
    return [goals[int(place)].clip for place in places]


def _commonest(goals: Sequence[Scored]) -> Run | None:
    groups: dict[tuple[int, ...], list[Scored]] = {}
    for goal in goals:
        if goal.run:
            groups.setdefault(goal.run, []).append(goal)
    if not groups:
        return None
    codes = min(groups, key=lambda run: (-len(groups[run]), run))
    own = groups[codes]
    of = sum(len(each) for each in groups.values())
    return Run(codes, len(own), of, _clips(own)) if len(own) > 1 else None


class Lost(NamedTuple):
    """Goals against a team after one of its robots lost the ball.

    Attributes:
        robot: its number.
        role: its role in words.
        thirds: by the third in which it lost the ball, in the order of THIRDS.
        n: all of them.
        since_s: median of the seconds from the loss to the goal.
        clips: up to MOMENTS of the goals.
    """

    robot: int
    role: str
    thirds: tuple[int, ...]
    n: int
    since_s: float
    clips: list[Clip]


def lost_before(goals: Sequence[Scored], robots: Mapping[int, str]) -> list[Lost]:
    """The robots that lost the ball before goals against their team, the most goals first.

    Args:
        goals: the goals against the team.
        robots: role of each of the team's robots in words.
    """
    by: dict[int, list[Scored]] = {}
    for goal in goals:
        if goal.before.lost_by is not None:
            by.setdefault(goal.before.lost_by, []).append(goal)
    found = []
    for number, own in sorted(by.items(), key=lambda it: (-len(it[1]), it[0])):
        places = [goal.before.third for goal in own]
        found.append(Lost(
            number, robots.get(number, ""), tuple(places.count(at) for at in range(len(THIRDS))), len(own),
            float(np.median([goal.before.since_s or 0.0 for goal in own])), _clips(own)))
    return found


def of_side(goals: Sequence[Scored], side: str) -> list[Scored]:
    """The goals of one side, home or away."""
    assert side in SIDES
    return [goal for goal in goals if goal.side == side]
