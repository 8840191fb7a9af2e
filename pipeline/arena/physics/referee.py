"""The referee: watches every frame, calls goals and fouls, keeps the time and the score.

Its memory is one record of whole numbers, from which a match can be continued. At each frame, from the
first on, :func:`watch` looks at the bodies before they move. :func:`told` says a call in words, and
:func:`pipeline.arena.physics.restarts.restart` puts the bodies at the calls from KICK_OFF to HALF.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple, Self

import numpy as np
import polars as pl
from numba import njit

from pipeline.arena.physics.laws import (
    END,
    FOUL,
    FREE_BALL,
    GOAL,
    GOAL_KICK,
    HALF,
    KICK_OFF,
    PENALTY,
    PLAY_ON,
    Marks,
    RefereeSettings,
    frames_of,
)
from pipeline.arrays import F64
from pipeline.bodies import BALL, VX, VY, Record, X, Y
from pipeline.errors import BadSettings
from pipeline.matches.frame import AWAY, HOME, Period
from pipeline.pitch import SCALES, Pitch
from schemas import SIDES, Referee

#: The referee's memory; all fields int64.
STATE = np.dtype([
    (name, np.int64)
    for name in (
        "frame",  # frames watched; the number of the next one, counted from 0
        "halves_over",  # halves that are over: home attacks +x if it is even
        "opener",  # team that kicks off the first half, and every other one
        "home_goals",
        "away_goals",
        "due",  # restart that is to come; PLAY_ON while play is on; END after the final whistle
        "team",  # that takes the restart that was last or is due, NOBODY for a free ball and at the end
        "quarter",  # of the last free ball: 1 if at x > 0, plus 2 if at y > 0, in the pitch frame
        "resume",  # frame of the restart that was last or is due
        "slow",  # frames in a row, in play, at which the ball was slow
        "area",  # goal area in which the ball was last: -1 at -x, 1 at +x, 0 none
        "attackers",  # frames in a row at which too many attackers were in that area with the ball,
        "defenders",  # and too many defenders
    )
])  # fmt: skip

#: The laws as :func:`watch` needs them: metres and metres a second, frames, robots, and whether there are
#: such restarts.
LIMITS = np.dtype([
    *((name, np.float64) for name in ("goal_line", "post", "area_x", "area_y", "near", "slow_speed")),
    *((name, np.int64) for name in (
        "duration", "halves", "pause", "stuck", "crowded", "crowd", "penalties", "goal_kicks",
    )),
])  # fmt: skip

#: Instead of a team.
NOBODY = -1

#: Words for the restarts, as they are noted in the log.
WORDS = {KICK_OFF: "kick-off", FREE_BALL: "free ball", PENALTY: "penalty", GOAL_KICK: "goal kick"}


@dataclass(frozen=True, slots=True)
class Laws:
    """The laws on a pitch, at a frame rate.

    Attributes:
        settings: the settings that the laws are made from.
        hz: frames a second.
        marks: marks of the pitch.
        limits: one record of :data:`LIMITS`, shape [], for :func:`watch`.
    """

    settings: RefereeSettings
    hz: float
    marks: Marks
    limits: Record

    @classmethod
    def of(cls, pitch: Pitch, settings: RefereeSettings, hz: float) -> Self:
        """The laws on a pitch, at ``hz`` frames a second.

        Raises:
            BadSettings: if a half has no frame, or the pitch cannot be played on (see ``Marks.of``).
        """
        marks = Marks.of(pitch)
        duration = frames_of(settings.duration_s, hz)
        if duration < settings.halves:
            raise BadSettings(
                f"{settings.halves} halves do not fit into {settings.duration_s:g} s",
                where="referee", next_step="Play longer, or fewer halves",
            )
        limits = (
            marks.goal_line, marks.post, marks.area_x, marks.area_y, marks.near,
            settings.stuck_speed * SCALES[pitch.kind].speed,
            duration, settings.halves, max(1, frames_of(settings.pause_s, hz)),
            frames_of(settings.stuck_s, hz), frames_of(settings.crowd_s, hz), settings.crowd,
            settings.penalty, settings.goal_kick,
        )
        return cls(settings, hz, marks, np.array(limits, dtype=LIMITS))

    @property
    def duration(self) -> int:
        """The frame of the final whistle; a match has one frame more than this."""
        return int(self.limits["duration"])

    def t_ns(self, frame: int) -> int:
        """Time of a frame, nanoseconds after the first."""
        return round(frame * 1e9 / self.hz)

    def periods(self) -> tuple[Period, ...]:
        """The halves, for the match's description; home attacks +x in the first."""
        halves = int(self.limits["halves"])
        starts = [self.t_ns(-(-half * self.duration // halves)) for half in range(halves)]
        edges = pairwise([*starts, self.t_ns(self.duration) + 1])
        return tuple(
            Period(start_ns=start, end_ns=end, home_attacks=home_attacks(half), inferred=False)
            for half, (start, end) in enumerate(edges)
        )


def home_attacks(halves_over: int) -> Literal[1, -1]:
    """The direction along x in which home attacks, after so many halves."""
    return -1 if halves_over % 2 else 1


def begin(opener: int = HOME, score: tuple[int, int] = (0, 0)) -> Record:
    """The referee's state before the first frame, at which it calls the kick-off.

    Args:
        opener: team that kicks off, 0 home, 1 away.
        score: goals of home and away that count already.

    Returns:
        One record of :data:`STATE`, shape [].
    """
    state = np.zeros((), dtype=STATE)
    state["opener"] = state["team"] = opener
    state["home_goals"], state["away_goals"] = score
    state["due"] = KICK_OFF
    return state


@njit(cache=True, nogil=True, error_model="numpy")
def watch(bodies: F64, state: Record, limits: Record) -> int:
    """The referee's call at the next frame.

    In order of precedence:

    - END: the duration is over, HALF: a half is. Play lasts up to that frame, exclusive: a ball that
      is first seen in the goal at it came too late. Both come whatever is due; at HALF the teams
      change sides and the other one kicks off at the same frame.
    - KICK_OFF, FREE_BALL, PENALTY or GOAL_KICK: the rest after a goal or a foul is over, and play
      restarts at this frame. The first frame is a kick-off. Nothing else is judged at this frame,
      nor while play rests.
    - GOAL: the whole ball is past a goal line (its centre by more than its radius) and its centre
      between the posts. It counts for the team that attacks this goal, whoever touched the ball
      last; the other one is to kick off.
    - FOUL, a goal kick is due: too many attackers have their centres in the goal area in which the
      ball is, and had them so at each frame for more than the allowed time.
    - FOUL, a penalty is due: likewise with defenders, their goalkeeper included.
    - FOUL: the ball was slow at each frame for the whole allowed time. In a goal area a goal kick is
      due if both teams have a robot near the ball, else a penalty. Outside, or where there are no such
      restarts, it is a free ball in the quarter of the pitch where the ball is.

    A time limit of n frames is over when its condition held at n + 1 frames in a row. What is missing
    (NaN) is nowhere and does not move.

    Args:
        bodies: float64 [1 + 2 N, 6] in the pitch frame, as they are at this frame.
        state: from :func:`begin`; changed. Its fields ``due`` and ``team`` tell more of the call.
        limits: ``Laws.limits``.

    Returns:
        The call; PLAY_ON (0) if there is none. After END it is always PLAY_ON.
    """
    now, law = state[()], limits[()]
    if now["due"] == END:
        return PLAY_ON
    frame = now["frame"]
    now["frame"] = frame + 1
    if frame >= law["duration"]:
        now["due"], now["team"] = END, NOBODY
        return END
    if frame * law["halves"] >= (now["halves_over"] + 1) * law["duration"]:
        now["halves_over"] += 1
        _stop(now, KICK_OFF, (now["opener"] + now["halves_over"]) % 2, frame)
        now["due"] = PLAY_ON
        return HALF
    if now["due"] != PLAY_ON:
        if frame < now["resume"]:
            return PLAY_ON
        call: int = now["due"]
        now["due"] = PLAY_ON
        return call

    x, y = bodies[BALL, X], bodies[BALL, Y]
    end = 1 if x > 0 else -1
    home = 1 - 2 * (now["halves_over"] % 2)
    defender = AWAY if end == home else HOME
    resume = frame + law["pause"]
    if abs(x) > law["goal_line"] and abs(y) < law["post"]:
        if defender == HOME:
            now["away_goals"] += 1
        else:
            now["home_goals"] += 1
        _stop(now, KICK_OFF, defender, resume)
        return GOAL

    area = end if abs(x) > law["area_x"] and abs(y) < law["area_y"] else 0
    if area != now["area"]:
        now["area"] = area
        now["attackers"] = now["defenders"] = 0
    if area != 0:
        home_there, away_there = _robots_in(bodies, area, law)
        defending = home_there if defender == HOME else away_there
        attacking = home_there + away_there - defending
        now["attackers"] = now["attackers"] + 1 if attacking >= law["crowd"] else 0
        now["defenders"] = now["defenders"] + 1 if defending >= law["crowd"] else 0
        if now["attackers"] > law["crowded"] and law["goal_kicks"]:
            _stop(now, GOAL_KICK, defender, resume)
            return FOUL
        if now["defenders"] > law["crowded"] and law["penalties"]:
            _stop(now, PENALTY, 1 - defender, resume)
            return FOUL

    vx, vy = bodies[BALL, VX], bodies[BALL, VY]
    now["slow"] = now["slow"] + 1 if vx * vx + vy * vy < law["slow_speed"] ** 2 else 0
    if now["slow"] > law["stuck"]:
        contested = area != 0 and _both_near(bodies, law["near"])
        if contested and law["goal_kicks"]:
            _stop(now, GOAL_KICK, defender, resume)
        elif area != 0 and not contested and law["penalties"]:
            _stop(now, PENALTY, 1 - defender, resume)
        else:
            now["quarter"] = (1 if x > 0 else 0) + (2 if y > 0 else 0)
            _stop(now, FREE_BALL, NOBODY, resume)
        return FOUL
    return PLAY_ON


@njit(cache=True, nogil=True, error_model="numpy")
def _stop(now: Record, due: int, team: int, resume: int) -> None:
    """Note what restarts play, who takes it and when, and count anew from there."""
    now["due"], now["team"], now["resume"] = due, team, resume
    now["slow"] = now["area"] = now["attackers"] = now["defenders"] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def _robots_in(bodies: F64, area: int, law: Record) -> tuple[int, int]:
    """Number of robots of home and of away with their centres in the goal area at that end."""
    robots = (bodies.shape[0] - 1) // 2
    home = away = 0
    for row in range(1, bodies.shape[0]):
        if area * bodies[row, X] > law["area_x"] and abs(bodies[row, Y]) < law["area_y"]:
            if row <= robots:
                home += 1
            else:
                away += 1
    return home, away


@njit(cache=True, nogil=True, error_model="numpy")
def _both_near(bodies: F64, near: float) -> bool:
    """Whether each team has a robot at most ``near`` from the ball."""
    robots = (bodies.shape[0] - 1) // 2
    home = away = False
    for row in range(1, bodies.shape[0]):
        dx, dy = bodies[row, X] - bodies[BALL, X], bodies[row, Y] - bodies[BALL, Y]
        if dx * dx + dy * dy <= near * near:
            if row <= robots:
                home = True
            else:
                away = True
    return home and away


class RefereeEvent(NamedTuple):
    """One row of schema Referee but for the match."""

    t_ns: int
    event: str
    team: str | None
    score_home: int
    score_away: int
    note: str | None


def told(call: int, state: Record, laws: Laws) -> tuple[RefereeEvent, ...]:
    """Events of a call for the log; ask before the next frame is watched.

    A goal is the team's that scored. A foul is a ``stop``, and the restart after it a ``fault``; both
    note which. Kick-offs, penalties and goal kicks are for the team that takes them. HALF is two
    events at one time, ``half`` and ``kick-off``.

    Args:
        call: what :func:`watch` returned; nothing is told of PLAY_ON.
        state: after that.
        laws: of the match.
    """
    t_ns = laws.t_ns(int(state["frame"]) - 1)
    score = int(state["home_goals"]), int(state["away_goals"])
    taker = int(state["team"])
    team = None if taker == NOBODY else SIDES[taker]
    if call == PLAY_ON:
        return ()
    if call == GOAL:
        return (RefereeEvent(t_ns, "goal", SIDES[1 - taker], *score, "goal"),)
    if call == FOUL:
        return (RefereeEvent(t_ns, "stop", None, *score, WORDS[int(state["due"])]),)
    if call == END:
        return (RefereeEvent(t_ns, "end", None, *score, "end"),)
    if call in (KICK_OFF, HALF):
        kick_off = RefereeEvent(t_ns, "kick-off", team, *score, WORDS[KICK_OFF])
        half = RefereeEvent(t_ns, "half", None, *score, "half")
        return (kick_off,) if call == KICK_OFF else (half, kick_off)
    return (RefereeEvent(t_ns, "fault", team, *score, WORDS[call]),)


def table(match_id: str, events: Iterable[RefereeEvent]) -> pl.DataFrame:
    """Rows of schema Referee, in the order in which they were told."""
    rows = [{"match_id": match_id, **event._asdict()} for event in events]
    return Referee.validate(pl.DataFrame(rows, schema=Referee.dtypes()))
