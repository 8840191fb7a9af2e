"""The teams that play by themselves, behind one call."""

from __future__ import annotations

from enum import IntEnum

from numba import njit
from numpy.random import Generator

from pipeline.arena.teams import human_like, moving_randomly, static
from pipeline.arena.teams.dice import Dice
from pipeline.arena.teams.human_like import HumanLike
from pipeline.arena.teams.measures import Measures, Packed
from pipeline.bodies import F64


class Team(IntEnum):
    """A kind of team."""

    RANDOM = 0
    STATIC = 1
    HUMAN_LIKE = 2


_RANDOM, _STATIC = 0, 1


def new_memory(team: Team, robots: int, m: Measures, rng: Generator, people: HumanLike | None = None) -> F64:
    """What a team has to remember, before a game; a team that plays another game needs another one.

    Args:
        team: which.
        robots: N, at least 1.
        m: measures of the pitch on which it will play.
        rng: draws the person of a human-like team; the others draw nothing.
        people: what people may be like; the defaults if None.

    Returns:
        float64 [rows, columns], contiguous; what they mean is the team's business.
    """
    if team == Team.RANDOM:
        return moving_randomly.new_memory(robots)
    if team == Team.STATIC:
        return static.new_memory(robots)
    return (people or HumanLike()).sample(rng, robots, m)


@njit(cache=True, nogil=True, error_model="numpy")
def play_packed(team: int, view: F64, memory: F64, packed: Packed, dice: Dice, wheels: F64) -> None:
    """:func:`play` with measures that cost little to hand over (:meth:`Measures.packed`)."""
    play(team, view, memory, packed[0], dice, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def play(team: int, view: F64, memory: F64, m: Measures, dice: Dice, wheels: F64) -> None:
    """One frame of a team.

    Args:
        team: a :class:`Team`.
        view: float64 [1 + 2 N, 6], as :func:`pipeline.bodies.see` gives it: own robots in rows 1 to N,
            the own goal at -x. All numbers are finite.
        memory: as :func:`new_memory` made it and the frames before left it.
        m: measures; ``m.frame_s`` is the time between two calls.
        dice: decide what the team leaves to chance; give each team its own, and what one does by chance
            does not depend on the other.
        wheels: float64 [N, 2], written: left and right wheel of the robots of rows 1 to N, m/s, within
            ± ``m.top``.
    """
    if team == _RANDOM:
        moving_randomly.play(view, memory, m, dice, wheels)
    elif team == _STATIC:
        static.play(view, memory, m, dice, wheels)
    else:
        human_like.play(view, memory, m, dice, wheels)
