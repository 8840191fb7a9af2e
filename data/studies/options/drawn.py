"""The ratios for robots that drive otherwise than our arena's: trees of the setting ``robots = "measured"``.

Teams that deal options at random play in arenas whose motors, grip, bodies, friction and ball are drawn anew
for each match; their executors assume the robots of our arena. Windows are described as in a recording whose
robots were measured: motors follow commands as they can; others are nearer by what they are thicker.
``make study-options`` does it after the ratios of our arena. The ranges were fixed when pSim was known, and
include its motors, thickness and ball; no match of pSim was learned from. If the file changes, its SHA-256 in
``pipeline.settings`` (``MEASURED_TREES``) does, so that options are made anew; a test says so.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pymunk
from harness import ROOT
from options.dealt import Job, rows
from options.shipped import main

from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.physics.arena import Arena
from pitchlore.pipeline.arena.physics.settings import PhysicsSettings
from pitchlore.pipeline.game.pitch import SCALES, Kind, Pitch
from pitchlore.pipeline.numbers.arrays import F32, F64
from pitchlore.pipeline.stages.options.robots import RobotTraits, limited

FIRST_SEED = 4_483_000
#: A rim's speed that no command reaches: commands are limited before.
_ANY = 2.0


class Drawn(NamedTuple):
    """An arena that was drawn.

    Attributes:
        physics: motors, floor and friction.
        half: half a robot's side, metres.
        skin: so much rounder robots and walls are, metres.
        ball: radius of the ball, metres.
        robots: robots as a recording of that arena shows them.
    """

    physics: PhysicsSettings
    half: float
    skin: float
    ball: float
    robots: RobotTraits


class DrawnArena(Arena):
    """An arena with bodies of other sizes, and motors that limit commands in another way."""

    def __init__(self, pitch: Pitch, robots: int, drawn: Drawn) -> None:
        self._drawn = drawn
        super().__init__(pitch, robots, drawn.physics)

    def frame(self, wheels: F64) -> F64:
        """Advance by one frame; see :meth:`Arena.frame`."""
        return super().frame(limited(wheels, self._drawn.robots.top, self._drawn.robots.together))

    def _build(self, bodies: F64) -> pymunk.Space:
        space, half = super()._build(bodies), self._drawn.half
        for shape in space.shapes:
            if isinstance(shape, pymunk.Circle):
                shape.unsafe_set_radius(self._drawn.ball)
            elif isinstance(shape, pymunk.Poly):
                shape.unsafe_set_radius(self._drawn.skin)
                if shape.body is not space.static_body:
                    shape.unsafe_set_vertices([(-half, -half), (half, -half), (half, half), (-half, half)])
        space.reindex_static()  # walls are rounder than they were when they were added
        return space


def drawn(seed: int) -> Drawn:
    """The arena of a match."""
    rng = np.random.default_rng([seed, 77])

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    top, acceleration, axle = float(rng.uniform(0.5, 1.5)), between(4, 200), float(rng.uniform(0.06, 0.085))
    together = bool(rng.random() < 0.5)
    # wheels of quick motors slip at each start, unless the floor holds them
    grip = between(0.6, 100) if acceleration < 15 else between(5, 1000)
    physics = PhysicsSettings(
        wheel_speed=_ANY, wheel_acceleration=acceleration, axle=axle, substeps=int(rng.integers(1, 3)),
        forward_grip=grip, sideways_grip=grip * between(0.7, 1.5), ball_mass=between(0.03, 0.2),
        robot_restitution=float(rng.uniform(0, 0.5)), friction=float(rng.uniform(0.1, 0.8)),
        rolling=float(rng.uniform(0, 0.6)), wall_restitution=float(rng.uniform(0.1, 0.8)))
    half, skin, ball = (float(rng.uniform(*span)) for span in ((0.034, 0.044), (0, 0.009), (0.0175, 0.022)))
    usual = SCALES[Kind.VSSS]
    robots = RobotTraits(
        top, acceleration, axle, together, 2 * (half + skin - usual.robot_radius),
        half + skin + ball - usual.robot_radius - usual.ball_radius, half + 2 * skin - usual.robot_radius,
        measured=True)
    return Drawn(physics, half, skin, ball, robots)


def into(arena: Drawn, match: MatchInPlay) -> None:
    """Let a match be played there, from here on."""
    moving = DrawnArena(match.recipe.pitch, match.recipe.robots, arena)
    moving.place(match.bodies.copy())
    match._arena, match.bodies = moving, moving.bodies


def drawn_rows(job: Job) -> tuple[F32, F64]:
    """Rows as :func:`options.dealt.rows`, of a match in an arena that was drawn."""
    arena = drawn(job.seed)
    return rows(job, partial(into, arena), arena.robots)


if __name__ == "__main__":
    path = ROOT / "pipeline" / "stages" / "options" / "measured.npz"
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else path, first=FIRST_SEED, described=drawn_rows)
