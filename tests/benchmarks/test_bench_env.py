"""The arena for learners: frames of 3v3 through an environment, beside the match alone with the same wheels.

Rates are frames of physics a second: a step is one frame, or as many as the name says. Actions are drawn
beforehand: what a learner's own network takes is not in it.
"""

import numpy as np
import pytest
from support.watched import Replayed

from pitchlore.pipeline.arena.env import BEHAVIOURS, env, parallel_env
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings

FRAMES = 6_000
GROUP = "play 3v3 through an environment"
#: Frames between new wheels, as for the arena alone.
HELD = 24


def drawn(steps, high=None):
    """Actions of six robots, float32 [steps, 6, 2] wheels that hold for 24 frames, or int [steps, 6] below ``high``."""
    rng = np.random.default_rng(1)
    if high is not None:
        return rng.integers(high, size=(steps, 6))
    return np.repeat(rng.uniform(-1, 1, (-(-steps // HELD), 6, 2)).astype(np.float32), HELD, axis=0)[:steps]


def of_agents(steps):
    """Actions of six agents, by their names."""
    names = parallel_env().possible_agents
    return [dict(zip(names, step, strict=True)) for step in steps]


@pytest.mark.benchmark(group=GROUP)
@pytest.mark.parametrize(("begin", "drawn_actions"), [
    pytest.param(lambda: parallel_env(step_s=1 / 60), lambda: of_agents(drawn(FRAMES)), id="ours, six agents, a frame a step"),
    pytest.param(lambda: parallel_env(step_s=4 / 60), lambda: of_agents(drawn(FRAMES)[::4]), id="six agents, four frames a step"),
    pytest.param(lambda: parallel_env(actions="behaviours"), lambda: of_agents(drawn(FRAMES // 24, len(BEHAVIOURS)).tolist()),
                 id="six agents behaviours of 24 frames"),
    pytest.param(lambda: env("static"), lambda: drawn(FRAMES)[:, :3].reshape(FRAMES, 6), id="one agent a team against static"),
])
def test_environment(timed, begin, drawn_actions):
    """All actions from a new kick-off; each step returns observations, rewards and infos of all agents."""
    actions = list(drawn_actions())

    def play(one):
        for action in actions:
            one.step(action)

    def fresh():
        one = begin()
        one.reset(seed=1)
        return (one,), {}

    timed(FRAMES, "frames", play, setup=fresh, rounds=7, warmup_rounds=1)


@pytest.mark.benchmark(group=GROUP)
def test_the_match_alone(timed):
    """The limit: the same wheels in a match that nobody looks at and that is not logged."""
    driven = TeamSettings(kind="human")
    recipe = Recipe(home=driven, away=driven, seed=1)
    wheels = recipe.physics.wheel_speed * drawn(FRAMES).astype(float)

    def fresh():
        return (MatchInPlay(recipe, (Replayed(wheels[:, :3]), Replayed(wheels[:, 3:])), logged=False),), {}

    timed(FRAMES, "frames", lambda match: match.advance(FRAMES), setup=fresh, rounds=7, warmup_rounds=1)
