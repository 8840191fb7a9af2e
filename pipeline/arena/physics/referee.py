"""The referee: watches every frame, calls goals and fouls, keeps the time and the score.

Its memory is one array of whole numbers; whoever keeps that array can go on with the match. ::

    laws = Laws.of(pitch, settings, hz)
    state = begin()
    for every frame, from the first one on:
        call = watch(bodies, state, laws.lengths, laws.times)
        if call:
            events += told(call, state, laws)
            if KICK_OFF <= call <= HALF:
                restart(bodies, call, state, laws, rng)  # pipeline.arena.physics.restarts
        log the bodies, and move them unless call is END
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple, Self

import numpy as np
import numpy.typing as npt
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
from pipeline.bodies import BALL, F64, VX, VY, X, Y
from pipeline.errors import BadSettings
from pipeline.matches.frame import AWAY, HOME, Period
from pipeline.pitch import SCALES, Pitch
from schemas import TEAMS, Referee

I64 = npt.NDArray[np.int64]

#: Fields of the state, int64 [FIELDS]:
FIELDS = 13
(
    FRAME,  # frames watched; the number of the next one, counted from 0
    HALVES_OVER,  # halves that are over: home attacks +x if it is even
    OPENER,  # team that kicks off the first half, and every other one
    HOME_GOALS,
    AWAY_GOALS,
    DUE,  # restart that is to come; PLAY_ON while play is on; END after the final whistle
    TEAM,  # that takes the restart that was last or is due, NOBODY for a free ball and at the end
    QUARTER,  # of the last free ball: 1 if at x > 0, plus 2 if at y > 0, in the pitch frame
    RESUME,  # frame of the restart that was last or is due
    SLOW,  # frames in a row, in play, at which the ball was slow
    AREA,  # goal area in which the ball was last: -1 at -x, 1 at +x, 0 none
    ATTACKERS,  # frames in a row at which too many attackers were in that area with the ball,
    DEFENDERS,  # and too many defenders
) = range(FIELDS)

#: Instead of a team.
NOBODY = -1

# What `watch` needs of the laws, as `Laws` lays it out: metres and metres a second, ...
_GOAL_LINE, _POST, _AREA_X, _AREA_Y, _NEAR, _SLOW_SPEED = range(6)
# ... and frames, robots and whether there are such restarts.
_DURATION, _HALVES, _PAUSE, _STUCK, _CROWDED, _CROWD, _PENALTIES, _GOAL_KICKS = range(8)

#: Words for the restarts, as they are noted in the log.
WORDS = {KICK_OFF: "kick-off", FREE_BALL: "free ball", PENALTY: "penalty", GOAL_KICK: "goal kick"}


@dataclass(frozen=True, slots=True)
class Laws:
    """The laws on a pitch that is seen so many times a second.

    Attributes:
        settings: what they were made of.
        hz: frames a second.
        marks: of the pitch.
        lengths: float64 [6], for :func:`watch`.
        times: int64 [8], for :func:`watch`.
    """

    settings: RefereeSettings
    hz: float
    marks: Marks
    lengths: F64
    times: I64

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
        lengths = (
            marks.goal_line, marks.post, marks.area_x, marks.area_y, marks.near,
            settings.stuck_speed * SCALES[pitch.kind].speed,
        )
        times = (
            duration, settings.halves, max(1, frames_of(settings.pause_s, hz)),
            frames_of(settings.stuck_s, hz), frames_of(settings.crowd_s, hz), settings.crowd,
            settings.penalty, settings.goal_kick,
        )
        return cls(settings, hz, marks, np.array(lengths), np.array(times, dtype=np.int64))

    @property
    def duration(self) -> int:
        """The frame of the final whistle; a match has one frame more than this."""
        return int(self.times[_DURATION])

    def t_ns(self, frame: int) -> int:
        """When a frame is, nanoseconds after the first."""
        return round(frame * 1e9 / self.hz)

    def periods(self) -> tuple[Period, ...]:
        """The halves, for the match's description; home attacks +x in the first."""
        halves = int(self.times[_HALVES])
        starts = [self.t_ns(-(-half * self.duration // halves)) for half in range(halves)]
        edges = pairwise([*starts, self.t_ns(self.duration) + 1])
        return tuple(
            Period(start_ns=start, end_ns=end, home_attacks=home_attacks(half), inferred=False)
            for half, (start, end) in enumerate(edges)
        )


def home_attacks(halves_over: int) -> Literal[1, -1]:
    """The direction along x in which home attacks, after so many halves."""
    return -1 if halves_over % 2 else 1


def begin(opener: int = HOME, score: tuple[int, int] = (0, 0)) -> I64:
    """The referee's state before the first frame, at which it calls the kick-off.

    Args:
        opener: team that kicks off, 0 home, 1 away.
        score: goals of home and away that count already.
    """
    state = np.zeros(FIELDS, dtype=np.int64)
    state[[OPENER, TEAM]] = opener
    state[[HOME_GOALS, AWAY_GOALS]] = score
    state[DUE] = KICK_OFF
    return state


@njit(cache=True, nogil=True, error_model="numpy")
def watch(bodies: F64, state: I64, lengths: F64, times: I64) -> int:
    """What the referee calls at the next frame.

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
        state: int64 [FIELDS], from :func:`begin`; changed. ``state[DUE]`` and ``state[TEAM]`` tell more
            of the call.
        lengths: ``Laws.lengths``.
        times: ``Laws.times``.

    Returns:
        The call; PLAY_ON (0) if there is none. After END it is always PLAY_ON.
    """
    if state[DUE] == END:
        return PLAY_ON
    frame = state[FRAME]
    state[FRAME] = frame + 1
    if frame >= times[_DURATION]:
        state[DUE], state[TEAM] = END, NOBODY
        return END
    if frame * times[_HALVES] >= (state[HALVES_OVER] + 1) * times[_DURATION]:
        state[HALVES_OVER] += 1
        _stop(state, KICK_OFF, (state[OPENER] + state[HALVES_OVER]) % 2, frame)
        state[DUE] = PLAY_ON
        return HALF
    if state[DUE] != PLAY_ON:
        if frame < state[RESUME]:
            return PLAY_ON
        call: int = state[DUE]
        state[DUE] = PLAY_ON
        return call

    x, y = bodies[BALL, X], bodies[BALL, Y]
    end = 1 if x > 0 else -1
    home = 1 - 2 * (state[HALVES_OVER] % 2)
    defender = AWAY if end == home else HOME
    resume = frame + times[_PAUSE]
    if abs(x) > lengths[_GOAL_LINE] and abs(y) < lengths[_POST]:
        state[AWAY_GOALS if defender == HOME else HOME_GOALS] += 1
        _stop(state, KICK_OFF, defender, resume)
        return GOAL

    area = end if abs(x) > lengths[_AREA_X] and abs(y) < lengths[_AREA_Y] else 0
    if area != state[AREA]:
        state[AREA] = area
        state[ATTACKERS] = state[DEFENDERS] = 0
    if area != 0:
        home_there, away_there = _robots_in(bodies, area, lengths)
        defending = home_there if defender == HOME else away_there
        attacking = home_there + away_there - defending
        state[ATTACKERS] = state[ATTACKERS] + 1 if attacking >= times[_CROWD] else 0
        state[DEFENDERS] = state[DEFENDERS] + 1 if defending >= times[_CROWD] else 0
        if state[ATTACKERS] > times[_CROWDED] and times[_GOAL_KICKS]:
            _stop(state, GOAL_KICK, defender, resume)
            return FOUL
        if state[DEFENDERS] > times[_CROWDED] and times[_PENALTIES]:
            _stop(state, PENALTY, 1 - defender, resume)
            return FOUL

    vx, vy = bodies[BALL, VX], bodies[BALL, VY]
    state[SLOW] = state[SLOW] + 1 if vx * vx + vy * vy < lengths[_SLOW_SPEED] ** 2 else 0
    if state[SLOW] > times[_STUCK]:
        contested = area != 0 and _both_near(bodies, lengths[_NEAR])
        if contested and times[_GOAL_KICKS]:
            _stop(state, GOAL_KICK, defender, resume)
        elif area != 0 and not contested and times[_PENALTIES]:
            _stop(state, PENALTY, 1 - defender, resume)
        else:
            state[QUARTER] = (1 if x > 0 else 0) + (2 if y > 0 else 0)
            _stop(state, FREE_BALL, NOBODY, resume)
        return FOUL
    return PLAY_ON


@njit(cache=True, nogil=True, error_model="numpy")
def _stop(state: I64, due: int, team: int, resume: int) -> None:
    """Note what restarts play, who takes it and when, and count anew from there."""
    state[DUE], state[TEAM], state[RESUME] = due, team, resume
    state[SLOW] = state[AREA] = state[ATTACKERS] = state[DEFENDERS] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def _robots_in(bodies: F64, area: int, lengths: F64) -> tuple[int, int]:
    """How many robots of home and of away have their centres in the goal area at that end."""
    robots = (bodies.shape[0] - 1) // 2
    home = away = 0
    for row in range(1, bodies.shape[0]):
        if area * bodies[row, X] > lengths[_AREA_X] and abs(bodies[row, Y]) < lengths[_AREA_Y]:
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


class Event(NamedTuple):
    """One row of schema Referee but for the match."""

    t_ns: int
    event: str
    team: str | None
    score_home: int
    score_away: int
    note: str | None


def told(call: int, state: I64, laws: Laws) -> tuple[Event, ...]:
    """What the log tells of a call; to be asked before the next frame is watched.

    A goal is the team's that scored. A foul is a ``stop``, and the restart after it a ``fault``; both
    note which. Kick-offs, penalties and goal kicks are for the team that takes them. HALF is two
    events at one time, ``half`` and ``kick-off``.

    Args:
        call: what :func:`watch` returned; nothing is told of PLAY_ON.
        state: after that.
        laws: of the match.
    """
    t_ns = laws.t_ns(int(state[FRAME]) - 1)
    score = int(state[HOME_GOALS]), int(state[AWAY_GOALS])
    taker = int(state[TEAM])
    team = None if taker == NOBODY else TEAMS[taker]
    if call == PLAY_ON:
        return ()
    if call == GOAL:
        return (Event(t_ns, "goal", TEAMS[1 - taker], *score, "goal"),)
    if call == FOUL:
        return (Event(t_ns, "stop", None, *score, WORDS[int(state[DUE])]),)
    if call == END:
        return (Event(t_ns, "end", None, *score, "end"),)
    if call in (KICK_OFF, HALF):
        kick_off = Event(t_ns, "kick-off", team, *score, WORDS[KICK_OFF])
        return (kick_off,) if call == KICK_OFF else (Event(t_ns, "half", None, *score, "half"), kick_off)
    return (Event(t_ns, "fault", team, *score, WORDS[call]),)


def table(match_id: str, events: Iterable[Event]) -> pl.DataFrame:
    """Rows of schema Referee, in the order in which they were told."""
    rows = [{"match_id": match_id, **event._asdict()} for event in events]
    return Referee.validate(pl.DataFrame(rows, schema=Referee.dtypes()))
