"""Actions of robots by what they see, and by the way to act that a lot has given them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from looking.lots import BLIND
from peers.playing import Observed

from pitchlore.pipeline.arena.env import BEHAVIOURS, ParallelMatch
from pitchlore.pipeline.arena.teams.appraising import ActionValues, action_values_at
from pitchlore.pipeline.arena.teams.clock import PAPER
from pitchlore.pipeline.arena.teams.constant import clock_of, constant
from pitchlore.pipeline.numbers.arrays import F32, I64, Bools
from pitchlore.pipeline.state.observation import see_from
from pitchlore.schemas import ROLES
from pitchlore.schemas.sights import SIGHT

#: Sights that a blind robot draws from.
_KEPT = 4096


class Seen(NamedTuple):
    """Sights and roles of the robots of some matches.

    Attributes:
        sights: float32 [matches, N, 30].
        roles: int64 [matches, N], by index in ROLES.
    """

    sights: F32
    roles: I64

    @classmethod
    def of(cls, pitches: Sequence[ParallelMatch], observed: Sequence[Observed]) -> Seen:
        """Sights and roles in matches whose environments observed this."""
        vectors = np.array([list(each.values()) for each in observed])
        sights = np.empty((*vectors.shape[:2], len(SIGHT)), np.float32)
        for place, pitch in enumerate(pitches):
            view = pitch.match.views[pitch.driven[0]]
            for robot in range(vectors.shape[1]):
                see_from(view, robot + 1, pitch.settings.matches.pitch.goal_x, sights[place, robot])
        return cls(sights, vectors[:, :, len(SIGHT):].argmax(axis=2))


class Chooser:
    """Chooses actions by what robots see.

    Args:
        appraiser: appraiser of an apprentice.
        ways: the ways to act.
        rng: draws what blind robots look at.
    """

    def __init__(self, appraiser: ActionValues, ways: Sequence[str], rng: np.random.Generator) -> None:
        self._appraiser, self._ways, self._rng = appraiser, ways, rng
        self._actions = np.array([BEHAVIOURS.index(code) for code in appraiser.codes])
        teams = [constant(way) for way in ways]
        assert all(clock_of(way) == PAPER for way in ways), "a behaviour goes on until it is over"
        self._constant = np.array([team is not None for team in teams])
        codes = [team or [BEHAVIOURS[0]] * len(ROLES) for team in teams]
        self._codes = np.array([[BEHAVIOURS.index(code) for code in own] for own in codes])
        self._seen = [np.empty((0, len(SIGHT)), np.float32) for _ in ROLES]

    def keep(self, sights: F32, roles: I64) -> None:
        """Keep what robots saw in play, float32 [n, 30], of roles, int64 [n], for blind ones to look at."""
        if BLIND in self._ways:
            for role, kept in enumerate(self._seen):
                self._seen[role] = np.concatenate([kept, sights[roles == role]])[-_KEPT:]

    def anew(self, ways: I64) -> Bools:
        """True for robots that begin what they choose anew at each step, bool [n]: constants go on."""
        return ~self._constant[ways]

    def __call__(self, sights: F32, roles: I64, ways: I64) -> I64:
        """Actions of robots, as indices in BEHAVIOURS, int64 [n].

        Args:
            sights: float32 [n, 30].
            roles: int64 [n], by index in ROLES.
            ways: int64 [n], by index in the ways.
        """
        looked_at = sights.copy()
        if BLIND in self._ways:
            for role, kept in enumerate(self._seen):
                blind = np.flatnonzero((roles == role) & (ways == self._ways.index(BLIND)))
                if len(blind) and len(kept):
                    looked_at[blind] = kept[self._rng.integers(len(kept), size=len(blind))]
        values = action_values_at(self._appraiser, looked_at)
        worth = np.where(self._appraiser.allowed[roles].T, values, -np.inf)
        return np.where(self._constant[ways], self._codes[ways, roles], self._actions[worth.argmax(axis=0)])
