"""A team that looks, made blind: each robot acts on a sight that its role had earlier in the match.

It is the control of all that such a team gains by looking. The sight is any that the role had in the match so
far, the present one included, drawn anew for each decision; or that of so long ago. In the first way robots
also change their minds more often than those that look.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit

from pitchlore.pipeline.arena.match.controllers import AppraisingController, Controller, PolicyTables, rng_of
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.teams.appraising import NUMBERS, ActionPolicy, choose, read_state
from pitchlore.pipeline.game.bodies import Records
from pitchlore.pipeline.game.tactics.splitmix import SplitMix, uniform
from pitchlore.pipeline.numbers.arrays import F32, F64, I64
from pitchlore.pipeline.state.observation import see_from
from pitchlore.schemas import HOME, ROLES

#: Sights that are kept of each role, where any of them is drawn.
_KEPT = 4096


class Memory(NamedTuple):
    """Sights of the match so far.

    Attributes:
        sights: float32 [3, K, 30], by role.
        held: int64 [3], how many there are of each role; of a full role any is replaced.
        late: number of decisions between a sight and the act, K - 1; 0: any sight that is held is drawn.
        decisions: int64 [1], those so far; a sight is at its decision's number modulo K.
    """

    sights: F32
    held: I64
    late: int
    decisions: I64

    @classmethod
    def of(cls, late: int) -> Memory:
        """An empty memory."""
        return cls(np.zeros((len(ROLES), late + 1 if late else _KEPT, NUMBERS), dtype=np.float32),
                   np.zeros(len(ROLES), dtype=np.int64), late, np.zeros(1, dtype=np.int64))


class BlindController(AppraisingController):
    """Plays a policy that appraises actions by what robots see, on what they saw earlier.

    Args:
        tables: the policy, with appraisals.
        settings: how often it decides and how it explores.
        recipe: recipe of the match.
        rng: decides what is left to chance.
        late_s: how long ago robots saw what they act on, seconds, rounded to whole decisions, at least one.
            None: any
            earlier sight, drawn anew for each decision.
    """

    def __init__(
        self, tables: PolicyTables, settings: TeamSettings, recipe: Recipe, rng: np.random.Generator,
        late_s: float | None,
    ) -> None:  # fmt: skip
        assert tables.appraisals is not None, "only a team that looks can be blind"
        super().__init__(tables.values, tables.appraisals, settings, recipe, rng)
        late = 0 if late_s is None else max(1, round(late_s * recipe.physics.hz / self._clock))
        self._memory = Memory.of(late)

    def _decide(self, view: F64) -> None:
        _decide(view, self._direction, self._lead, self._robots, self._policy, self._held, self._measures,
                self._splitmix, self._made, self._memory)


def blind(tables: PolicyTables, late_s: float | None) -> Callable[[Recipe, int], Controller]:
    """Controllers of a blind team for :func:`pipeline.stages.evaluations.results_of_pair`."""

    def controller(recipe: Recipe, side: int) -> Controller:
        settings = recipe.home if side == HOME else recipe.away
        assert not settings.predict_s, "a blind team predicts nothing"
        return BlindController(tables, settings, recipe, rng_of(recipe, side), late_s)

    return controller


@njit(cache=True, nogil=True, error_model="numpy")
def _decide(
    view: F64, direction: float, lead: int, robots: Records, policy: ActionPolicy, held: I64, packed: Records,
    splitmix: SplitMix, decisions: Records, memory: Memory,
) -> None:
    """Decide for all robots, as :func:`pipeline.arena.teams.appraising.decide`, by earlier sights."""
    roles = np.empty(2 * len(robots), dtype=np.int64)
    state = read_state(view, direction, lead, policy, packed, roles)
    sight = np.empty(NUMBERS, dtype=np.float32)
    for robot in range(1, len(robots) + 1):
        see_from(view, robot, packed[0].goal_x, sight)
        if memory.late > 0:
            _of_late(memory, roles[robot - 1], sight)
        else:
            _drawn(memory, roles[robot - 1], sight, splitmix)
        choose(robot, sight, view, roles, state, robots, policy, held, packed, splitmix, decisions)
    memory.decisions[0] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _drawn(memory: Memory, role: int, sight: F32, splitmix: SplitMix) -> None:
    """Keep a sight, and write one of the kept ones of the role over it."""
    room, count = memory.sights.shape[1], memory.held[role]
    memory.sights[role, count if count < room else int(uniform(splitmix) * room)] = sight
    memory.held[role] = min(count + 1, room)
    sight[:] = memory.sights[role, int(uniform(splitmix) * memory.held[role])]


@njit(cache=True, nogil=True, error_model="numpy")
def _of_late(memory: Memory, role: int, sight: F32) -> None:
    """Keep a sight, and write the role's of so long ago over it; before that the first one of the match."""
    now, room = memory.decisions[0], memory.sights.shape[1]
    memory.sights[role, now % room] = sight
    sight[:] = memory.sights[role, (now + 1) % room if now >= memory.late else 0]
