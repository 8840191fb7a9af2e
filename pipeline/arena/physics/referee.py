"""The referee: watches every frame, calls goals and fouls, keeps the time and the score.

Its memory is one record of whole numbers, from which a match can be continued. At each frame, from the
first on, :func:`referee_call` looks at the bodies before they move. :func:`call_events` says a call in words,
and :func:`pipeline.arena.physics.restarts.restart` puts the bodies at the calls from KICK_OFF to HALF.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple, Self

import numpy as np
import polars as pl

from pitchlore.pipeline.arena.physics.laws import (
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
    frames_lasting,
)
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import BALL, VX, VY, Record, X, Y
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.matches.frame import Period
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.schemas import AWAY, HOME, SIDES, Referee

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
        "attackers_seen",  # 1 if there was such a frame since the ball came into that area, else 0
        "defenders_seen",
        "reason",  # of the last foul: STUCK, ATTACKERS or DEFENDERS
        "annulled",  # 1 if the last foul annulled a goal, else 0
    )
])  # fmt: skip

#: The laws as :func:`referee_call` needs them: metres and metres a second, frames, robots, and whether there
#: are such restarts.
LIMITS = np.dtype([
    *((name, np.float64) for name in ("goal_line", "post", "area_x", "area_y", "near", "slow_speed",
                                    "penalty_share")),
    *((name, np.int64) for name in (
        "duration", "halves", "pause", "stuck", "crowded", "crowd", "remember", "penalties", "goal_kicks",
    )),
])  # fmt: skip

#: Instead of a team.
NOBODY = -1

#: Multiples of this spread evenly over 2**32: it is 2**32 by the golden ratio.
_EVENLY = 2_654_435_761

#: Reasons of fouls.
STUCK, ATTACKERS, DEFENDERS = range(3)

#: Words for the reasons, as they are noted in the log.
REASONS = {
    STUCK: "stuck ball",
    ATTACKERS: "too many attackers in the area",
    DEFENDERS: "too many defenders in the area",
}

#: Words for the restarts, as they are noted in the log.
WORDS = {KICK_OFF: "kick-off", FREE_BALL: "free ball", PENALTY: "penalty", GOAL_KICK: "goal kick"}


@dataclass(frozen=True, slots=True)
class Laws:
    """The laws on a pitch, at a frame rate.

    Attributes:
        settings: the settings that the laws are made from.
        hz: frames a second.
        marks: marks of the pitch.
        limits: one record of :data:`LIMITS`, shape [], for :func:`referee_call`.
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
        duration = frames_lasting(settings.duration_s, hz)
        if duration < settings.halves:
            raise BadSettings(
                f"{settings.halves} halves do not fit into {settings.duration_s:g} s",
                where="referee", next_step="Play longer, or fewer halves",
            )
        limits = (
            marks.goal_line, marks.post, marks.area_x, marks.area_y, marks.near,
            settings.stuck_speed * SCALES[pitch.kind].speed, settings.penalty_share,
            duration, settings.halves, max(1, frames_lasting(settings.pause_s, hz)),
            frames_lasting(settings.stuck_s, hz), frames_lasting(settings.crowd_s, hz), settings.crowd,
            settings.remember_crowds, settings.penalty, settings.goal_kick,
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
            Period(start_ns=start, end_ns=end, home_attacks=attack_direction(half), inferred=False)
            for half, (start, end) in enumerate(edges)
        )


def attack_direction(halves_over: int) -> Literal[1, -1]:
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
def referee_call(bodies: F64, state: Record, limits: Record) -> int:
    """The referee's call at the next frame.

    The laws are those of VSSReferee's checkers; each law names its file under
    ``src/world/entities/referee/`` and the commit at which it was read. In order of precedence:

    - END: the duration is over, HALF: a half is. Play lasts up to that frame, exclusive: a ball that
      is first seen in the goal at it came too late. Both come whatever is due; at HALF the teams
      change sides and the other one kicks off at the same frame (``checkers/halftime`` bd54b4f, whose
      clock counts only while play is on; ours never stops).
    - KICK_OFF, FREE_BALL, PENALTY or GOAL_KICK: the rest after a goal or a foul is over, and play
      restarts at this frame. The first frame is a kick-off. Nothing else is judged at this frame,
      nor while play rests (``referee.cpp`` fed6b80).
    - The ball is in the goal: it is wholly past a goal line (its centre by more than its radius) and its
      centre is between the posts. If too many attackers were seen in this goal area since the ball came
      into it, the goal is annulled, and FOUL is called as in the next law. Else GOAL. It counts for the
      team that attacks this goal, whoever touched the ball last; the other one is to kick off
      (``checkers/ballplay`` 7a49259).
    - FOUL, the ball has left the goal area: a goal kick is due if too many attackers were seen in it
      since the ball came, a penalty if too many defenders were, their goalkeeper included. If both
      were, the crowd decides that has been there longer, up to this frame; one that has gone counts as
      0 frames. If they are equal it is a penalty (``checkers/ballplay`` 7a49259; that a foul is given to
      the team that was seen, though its crowd has gone: b41ae24).
    - FOUL, a goal kick is due: too many attackers have their centres in the goal area in which the
      ball is, and had them so at each frame for more than the allowed time
      (``checkers/twoattackers`` cc5f044).
    - FOUL, a penalty is due: likewise with defenders (``checkers/twodefenders`` cc5f044).
    - FOUL: the ball was slow at each frame for the whole allowed time, all the time in a goal area or all
      the time outside. In a goal area a goal kick is due if both teams have a robot near the ball, else
      a penalty. Outside, or where there are no such restarts, it is a free ball in the quarter of the
      pitch where the ball is (``checkers/stoppedball`` 18de86c).

    A goal area is a rectangle without its arc, and goes on behind the goal line; its lines are outside.
    A robot is where its centre is. A foul makes the referee forget all that it counted.

    A time limit of n frames is over when its condition held at n + 1 frames in a row. What is missing
    (NaN) is nowhere and does not move. docs/decisions/arena.md ("Laws of VSSReferee") lists what that program
    does otherwise.

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
    resume = frame + law["pause"]
    in_goal = abs(x) > law["goal_line"] and abs(y) < law["post"]
    area = end if in_goal or (abs(x) > law["area_x"] and abs(y) < law["area_y"]) else 0
    if area != now["area"]:
        if now["area"] != 0:
            _count_crowds(bodies, now, law)
            _overlook(now, law)
            if now["attackers_seen"] or now["defenders_seen"]:
                return _crowd_foul(now, False, resume)
        now["area"] = area
        now["slow"] = now["attackers"] = now["defenders"] = 0
    if area != 0:
        _count_crowds(bodies, now, law)
        if in_goal or now["defenders"] > law["crowded"]:
            _overlook(now, law)
        if in_goal:
            if now["attackers_seen"]:
                return _crowd_foul(now, True, resume)
            conceded = _defender(now)
            if conceded == HOME:
                now["away_goals"] += 1
            else:
                now["home_goals"] += 1
            _stop(now, KICK_OFF, conceded, resume)
            return GOAL
        if now["attackers"] > law["crowded"]:
            return _foul(now, GOAL_KICK, ATTACKERS, resume)
        if now["defenders"] > law["crowded"]:
            return _foul(now, PENALTY, DEFENDERS, resume)
        if law["remember"]:
            now["attackers_seen"] |= now["attackers"] > 0
            now["defenders_seen"] |= now["defenders"] > 0

    vx, vy = bodies[BALL, VX], bodies[BALL, VY]
    now["slow"] = now["slow"] + 1 if vx * vx + vy * vy <= law["slow_speed"] ** 2 else 0
    if now["slow"] > law["stuck"]:
        contested = area != 0 and _both_near(bodies, law["near"])
        if contested and law["goal_kicks"]:
            return _foul(now, GOAL_KICK, STUCK, resume)
        if area != 0 and not contested and law["penalties"]:
            return _foul(now, PENALTY, STUCK, resume)
        now["quarter"] = (1 if x > 0 else 0) + (2 if y > 0 else 0)
        return _foul(now, FREE_BALL, STUCK, resume)
    return PLAY_ON


@njit(cache=True, nogil=True, error_model="numpy")
def _defender(now: Record) -> int:
    """The team whose goal is at the end of the area in which the ball was last."""
    home = 1 - 2 * (now["halves_over"] % 2)  # the end that home attacks
    return AWAY if now["area"] == home else HOME


@njit(cache=True, nogil=True, error_model="numpy")
def _count_crowds(bodies: F64, now: Record, law: Record) -> None:
    """Count one more frame of each crowd that is in the area, and none of one that is not.

    Where there are no goal kicks, attackers are no crowd, and without penalties defenders are none.
    """
    home, away = _robots_in(bodies, now["area"], law)
    defending = home if _defender(now) == HOME else away
    attacking = home + away - defending
    many = attacking >= law["crowd"] and law["goal_kicks"]
    now["attackers"] = now["attackers"] + 1 if many else 0
    many = defending >= law["crowd"] and law["penalties"]
    now["defenders"] = now["defenders"] + 1 if many else 0


@njit(cache=True, nogil=True, error_model="numpy")
def _overlook(now: Record, law: Record) -> None:
    """Forget a crowd of defenders that is not judged a foul; the frame decides, evenly for all frames."""
    if now["frame"] * _EVENLY % 2**32 >= law["penalty_share"] * 2**32:
        now["defenders"] = now["defenders_seen"] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def _crowd_foul(now: Record, annulled: bool, resume: int) -> int:
    """Call the foul of a crowd that was seen; of two, that of the older one, or the defenders'."""
    older = now["attackers"] > now["defenders"]
    if now["attackers_seen"] and (older or not now["defenders_seen"]):
        call = _foul(now, GOAL_KICK, ATTACKERS, resume)
    else:
        call = _foul(now, PENALTY, DEFENDERS, resume)
    now["annulled"] = annulled
    return call


@njit(cache=True, nogil=True, error_model="numpy")
def _foul(now: Record, due: int, reason: int, resume: int) -> int:
    """Call a foul; goal kicks are for the defenders of the area, penalties for the attackers."""
    team = NOBODY if due == FREE_BALL else (_defender(now) if due == GOAL_KICK else 1 - _defender(now))
    now["reason"], now["annulled"] = reason, 0
    _stop(now, due, team, resume)
    return FOUL


@njit(cache=True, nogil=True, error_model="numpy")
def _stop(now: Record, due: int, team: int, resume: int) -> None:
    """Note what restarts play, who takes it and when, and count anew from there."""
    now["due"], now["team"], now["resume"] = due, team, resume
    now["slow"] = now["area"] = now["attackers"] = now["defenders"] = 0
    now["attackers_seen"] = now["defenders_seen"] = 0


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
    """True if each team has a robot at most ``near`` from the ball."""
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


def call_events(call: int, state: Record, laws: Laws) -> tuple[RefereeEvent, ...]:
    """Events of a call for the log; ask before the next frame is watched.

    A goal is the team's that scored. A foul is a ``stop``, and the restart after it a ``fault``. The fault
    notes the restart. The stop notes it, too, and its reason, and whether it annulled a goal: "goal kick:
    goal annulled, too many attackers in the area". Kick-offs, penalties and goal kicks are for the team
    that takes them. HALF is two events at one time, ``half`` and ``kick-off``.

    Args:
        call: result of :func:`referee_call`; PLAY_ON gives no event.
        state: after that.
        laws: laws of the match.
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
        annulled = "goal annulled, " if state["annulled"] else ""
        note = f"{WORDS[int(state['due'])]}: {annulled}{REASONS[int(state['reason'])]}"
        return (RefereeEvent(t_ns, "stop", None, *score, note),)
    if call == END:
        return (RefereeEvent(t_ns, "end", None, *score, "end"),)
    if call in (KICK_OFF, HALF):
        kick_off = RefereeEvent(t_ns, "kick-off", team, *score, WORDS[KICK_OFF])
        half = RefereeEvent(t_ns, "half", None, *score, "half")
        return (kick_off,) if call == KICK_OFF else (half, kick_off)
    return (RefereeEvent(t_ns, "fault", team, *score, WORDS[call]),)


def event_rows(match_id: str, events: Iterable[RefereeEvent]) -> pl.DataFrame:
    """Rows of schema Referee, in the order in which they were reported."""
    rows = [{"match_id": match_id, **event._asdict()} for event in events]
    return Referee.of(rows)
