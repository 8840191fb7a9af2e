"""A family of teams that stands in for people at joysticks; it is no model of anyone.

A person drives one robot at a time, as well as a person can, and sees the others a reaction late; the
rest of the team follows the static rules at a slower pace. Reaction, steadiness, skill, patience and
tactics differ from person to person and are drawn anew for each game. All numbers are ours; a simple
reaction to something seen takes people about a quarter of a second.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from numba import njit
from numpy.random import Generator
from pydantic import AfterValidator, Field

from pipeline.arena.teams import static
from pipeline.arena.teams.dice import Dice, normal
from pipeline.arena.teams.geometry import distance, offset
from pipeline.arena.teams.measures import Measures
from pipeline.arena.teams.steering import EITHER, FRONT, around, steer
from pipeline.bodies import BALL, COLUMNS, F64, THETA, VX, VY, X
from pipeline.settings import Frozen

Tactic = Literal["aggressive", "defensive", "chaser"]
TACTICS: tuple[Tactic, ...] = ("aggressive", "defensive", "chaser")
_AGGRESSIVE, _DEFENSIVE, _CHASER = (float(i) for i in range(len(TACTICS)))


def _ordered(span: tuple[float, float]) -> tuple[float, float]:
    if span[0] > span[1]:
        raise ValueError("the least is more than the most")
    return span


_Positive = Annotated[float, Field(ge=0, allow_inf_nan=False)]
_Part = Annotated[float, Field(gt=0, le=1)]
Span = Annotated[tuple[_Positive, _Positive], AfterValidator(_ordered)]
Share = Annotated[tuple[_Part, _Part], AfterValidator(_ordered)]


class HumanLike(Frozen):
    """What people may be like; each pair is the least and the most, drawn evenly between them.

    Attributes:
        delay_s: how late the ball and the other team are seen, seconds.
        wobble_rad: standard deviation of the direction of driving around what is meant, radians.
        wobble_s: how long an error of direction lasts, seconds.
        skill: share of the top speed that the driven robot uses.
        pace: share of the top speed that the others use.
        switch_s: how long a robot is driven before another may be, seconds.
        tactics: which there are; each game has one, all are as likely.
    """

    delay_s: Span = (0.15, 0.35)
    wobble_rad: Span = (0.05, 0.30)
    wobble_s: Span = (0.2, 0.5)
    skill: Share = (0.6, 1.0)
    pace: Share = (0.3, 0.6)
    switch_s: Span = (0.5, 2.0)
    tactics: tuple[Tactic, ...] = Field(default=TACTICS, min_length=1)

    def sample(self, rng: Generator, robots: int, m: Measures) -> F64:
        """Somebody who plays one game: the memory of the team before it.

        Args:
            rng: draws the person.
            robots: in the team.
            m: measures of the pitch on which they will play.

        Returns:
            float64 [N + 3 + delay + 1, 6 (1 + 2 N)]; see the module's comments for its rows.
        """
        delay, wobble, lasting, skill, pace, switch = (
            float(rng.uniform(*span))
            for span in (self.delay_s, self.wobble_rad, self.wobble_s, self.skill, self.pace, self.switch_s)
        )
        tactic = self.tactics[int(rng.integers(len(self.tactics)))]
        frames = round(delay / m.frame_s)
        memory = np.zeros((robots + 3 + frames + 1, COLUMNS * (1 + 2 * robots)))
        person = memory[robots + 1]
        person[TACTIC] = TACTICS.index(tactic)
        person[WOBBLE] = wobble
        person[KEEPS] = math.exp(-m.frame_s / lasting) if lasting > 0 else 0.0
        person[SKILL], person[PACE] = skill, pace
        person[SWITCH] = max(round(switch / m.frame_s), 1)
        return memory


# Rows of the memory: 0 to N are those of the static rules; then the person, the columns below; then what
# is seen; then a ring of the last views, as many as the delay is long and one.
#: Columns of the person: index of the tactic; standard deviation of the wobble, radians; its correlation
#: from frame to frame; shares of the top speed; frames between switches; frames played; the row of the
#: robot that is driven; how far its direction is off now, radians.
TACTIC, WOBBLE, KEEPS, SKILL, PACE, SWITCH, FRAMES, DRIVEN, OFF = range(9)


@njit(cache=True, nogil=True, error_model="numpy")
def play(view: F64, memory: F64, m: Measures, dice: Dice, wheels: F64) -> None:
    """One frame of the team; see :func:`pipeline.arena.teams.teams.play`."""
    count = wheels.shape[0]
    person = memory[count + 1]
    seen = memory[count + 2].reshape(view.shape)
    _look(view, count, int(person[FRAMES]), memory[count + 3:], seen)
    static.share_out(seen, count, m, memory)
    if person[FRAMES] % person[SWITCH] == 0.0:
        person[DRIVEN] = _choose(seen, count, person[TACTIC], memory)
    person[FRAMES] += 1.0
    keeps = person[KEEPS]
    person[OFF] = keeps * person[OFF] + math.sqrt(1.0 - keeps * keeps) * person[WOBBLE] * normal(dice)
    keeper, attacker = int(memory[0, static.KEEPER]), int(memory[0, static.ATTACKER])
    driven = int(person[DRIVEN])
    place = 0
    for robot in range(1, count + 1):
        share = person[PACE]
        if robot == driven:
            share = person[SKILL]
            seen[robot, THETA] += person[OFF]
        if robot == driven and person[TACTIC] == _CHASER:
            _chase(seen, robot, m, wheels)
        elif robot == attacker or (robot == driven and robot != keeper and person[TACTIC] == _AGGRESSIVE):
            static.attack(seen, robot, m, wheels)
        elif robot == keeper:
            static.guard(seen, robot, m, wheels)
        else:
            static.support(seen, robot, place, m, wheels)
            place += 1
        if robot == driven:
            seen[robot, THETA] = view[robot, THETA]
        wheels[robot - 1, 0] *= share
        wheels[robot - 1, 1] *= share
        static.get_free(seen, robot, m, memory[robot], wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _look(view: F64, count: int, frame: int, ring: F64, seen: F64) -> None:
    """What the person sees: the own robots as they are (people feel what they do), the rest late.

    Args:
        view: float64 [1 + 2 N, 6], as it is.
        count: N.
        frame: how many have been played.
        ring: float64 [delay + 1, 6 (1 + 2 N)], the last views; the view is put in.
        seen: float64 [1 + 2 N, 6], written.
    """
    now = ring[frame % len(ring)].reshape(view.shape)
    late = ring[(frame + 1) % len(ring) if frame + 1 >= len(ring) else 0].reshape(view.shape)
    for row in range(view.shape[0]):
        for column in range(COLUMNS):
            now[row, column] = view[row, column]
    for row in range(view.shape[0]):
        own = 1 <= row <= count
        for column in range(COLUMNS):
            seen[row, column] = view[row, column] if own else late[row, column]


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(seen: F64, count: int, tactic: float, memory: F64) -> int:
    """Which robot to drive: the attacker, the nearest to the ball, or in defence the nearest behind it."""
    if tactic == _AGGRESSIVE:
        return int(memory[0, static.ATTACKER])
    best, least = 1, np.inf
    for robot in range(1, count + 1):
        cost = distance(seen, robot, BALL)
        if tactic == _DEFENSIVE and seen[robot, X] > seen[BALL, X]:
            cost += 2.0 * (seen[robot, X] - seen[BALL, X])
        if cost < least:
            best, least = robot, cost
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _chase(seen: F64, robot: int, m: Measures, wheels: F64) -> None:
    """Straight at the ball, except from ahead of it toward the own goal's mouth: round it."""
    dx, dy = offset(seen, robot, BALL)
    away = math.hypot(dx, dy)
    ahead = dx < 0.0 and away < m.close
    if ahead:
        side = 1.0 if dy <= 0.0 else -1.0
        dx, dy = around(seen, robot, dx, dy + side * 3.0 * m.radius, away, m)
    later = min(away / m.top, 0.3)
    dx, dy = dx + later * seen[BALL, VX], dy + later * seen[BALL, VY]
    steer(seen, robot, dx, dy, m.top, EITHER if ahead else FRONT, m, wheels)
