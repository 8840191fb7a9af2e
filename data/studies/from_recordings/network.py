"""A demonstrator that is a network: a PPO of data/studies/peers, which chooses an option five times a second.

It sees what teams that look see, and logs its options as they do. It chooses at each restart, and each 0.2 s
after it; in its training it chose each 0.2 s of the match. An option that is chosen again goes on.
"""

from __future__ import annotations

import numpy as np
from peers.network import Network
from peers.playing import STEP_S

from pitchlore.pipeline.arena.env import BEHAVIOURS
from pitchlore.pipeline.arena.match import sighted
from pitchlore.pipeline.arena.match.controllers import Controller, Decided, measures_of, rng_of
from pitchlore.pipeline.arena.match.driven import BehaviourController
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.numbers.arrays import F32, F64, I64
from pitchlore.schemas import ROLES
from pitchlore.schemas.sights import SIGHT
from pitchlore.schemas.situations import MOVES_RANDOMLY


class NetworkController(Controller):
    """Plays a network of options. Of the states of its decisions nothing is logged: they are 0.

    Args:
        network: takes vectors of :mod:`pipeline.arena.match.sighted`, and chooses indices in BEHAVIOURS.
        recipe: recipe of the match.
        team: 0 home, 1 away.
    """

    def __init__(self, network: Network, recipe: Recipe, team: int) -> None:
        self._network, self._robots = network, BehaviourController(recipe, rng_of(recipe, team))
        self._measures, self._scales = measures_of(recipe).packed(), sighted.scales(recipe)
        self._seen: F32 = np.empty((recipe.robots, sighted.NUMBERS), dtype=np.float32)
        self._every, self._next = round(STEP_S * recipe.physics.hz), 0
        self._episode, self._made = 0, list[tuple[int, I64, I64]]()
        self._over = list[Decided]()

    def restarted(self, frame: int, lead: int) -> None:  # noqa: D102
        self._robots.restarted(frame, lead)
        self._next = frame

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        if frame >= self._next:
            sighted.observe(view[None], (0,), self._measures, self._scales, self._seen)
            chosen = self._network.choose(self._seen)
            self._robots.command(chosen)
            self._made.append((frame, self._seen[:, len(SIGHT):].argmax(axis=1), chosen))
            self._next = frame + self._every
        self._robots.think(frame, view, wheels)

    def stopped(self, frame: int, reward: float) -> None:  # noqa: D102
        ends = [*(at for at, _, _ in self._made[1:]), frame]
        for place, ((at, roles, chosen), end) in enumerate(zip(self._made, ends, strict=True), start=1):
            last = place == len(self._made)
            for robot, role in enumerate(roles.tolist()):
                code = BEHAVIOURS[chosen[robot]]
                self._over.append(Decided(
                    at, robot + 1, role, 0, None if code == MOVES_RANDOMLY else f"{ROLES[role]}-{code:03d}",
                    random=False, episode=self._episode, end=end, last=last, reward=reward if last else 0.0))
        self._made.clear()
        self._episode += 1

    def decided(self) -> list[Decided]:  # noqa: D102
        over, self._over = self._over, []
        return over
