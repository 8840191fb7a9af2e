"""The arena: 3v3 with random wheels; state in one call or body by body, and pymunk's steps alone."""

import numpy as np
import pytest
from support.by_attribute import body_by_body, pymunk_alone

from pitchlore.pipeline.arena.physics.arena import Arena
from pitchlore.pipeline.game.pitch import PITCHES, Kind

VSSS = PITCHES[Kind.VSSS]
FRAMES = 6_000
GROUP = "move an arena by a frame"


def commands(frames):
    """New random wheels every 0.4 s, drawn beforehand: a list of float64 [6, 2]."""
    chosen = np.random.default_rng(1).uniform(-1.2, 1.2, (-(-frames // 24), 6, 2))
    return list(np.repeat(chosen, 24, axis=0)[:frames])


def play(arena, wheels):
    for commanded in wheels:
        arena.frame(commanded)


@pytest.mark.benchmark(group=GROUP)
def test_ours(timed):
    arena, wheels = Arena(VSSS, 3), commands(FRAMES)
    play(arena, wheels[:100])
    timed(len(wheels), "frames", play, (arena, wheels), rounds=7)


@pytest.mark.benchmark(group=GROUP)
def test_body_by_body(timed):
    arena, wheels = body_by_body(VSSS, 3), commands(FRAMES // 6)
    other = Arena(VSSS, 3)
    timed(len(wheels), "frames", play, (arena, wheels), rounds=5)
    for _ in range(5):
        play(other, wheels)
    assert other.bodies.tobytes() == arena.bodies.tobytes()


@pytest.mark.benchmark(group=GROUP)
def test_pymunk_alone(timed):
    """The limit: as many steps of the same space, with no floor and nobody who looks."""
    timed(FRAMES, "frames", pymunk_alone(VSSS, FRAMES), rounds=5)


@pytest.mark.benchmark(group="put the bodies of an arena")
def test_place_ours(timed):
    arena = Arena(VSSS, 3)
    bodies = arena.bodies.copy()
    timed(1, "placings", arena.place, (bodies,), rounds=300)
