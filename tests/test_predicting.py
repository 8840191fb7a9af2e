"""A team with a late camera reckons where bodies are now."""

import numpy as np
import pytest
from support.played import whole
from support.watched import Watched

from pitchlore.pipeline.arena.match.controllers import (
    PolicyTables,
    controller_of,
    controllers_of,
    measures_of,
)
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.camera import CameraSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.constant import constant
from pitchlore.pipeline.arena.teams.predicting import Predictor, predict
from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, X, Y, see
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.stages.sequences.sights import sights
from pitchlore.schemas import Values
from pitchlore.schemas.sights import SIGHT

LATE = CameraSettings(latency_s=0.1)
STATIC = TeamSettings(kind="static", predict_s=0.1)


def recipe(home=STATIC, camera=LATE, seconds=60.0, **rest):
    return Recipe(home=home, away=TeamSettings(kind="static"), seed=3, camera=camera,
                  referee=RefereeSettings(duration_s=seconds), **rest)


def errors(of):
    """Errors of the places at which a team is shown its bodies, in each frame of play, metres: [T, 1 + 2 N]."""
    match = MatchInPlay(of, controllers_of(of, {}))
    outer = match.controllers[0]
    inner = outer._player if of.home.predict_s else outer
    watcher = Watched(inner)
    if of.home.predict_s:
        outer._player = watcher
    else:
        match.controllers = (watcher, match.controllers[1])
    true, out = np.empty(match.bodies.shape), []
    while not match.over:
        match.call()
        seen = len(watcher.shown)
        see(match.bodies, 0, match.attacks, true)
        match.move()
        if len(watcher.shown) > seen:
            out.append(np.hypot(*(watcher.shown[-1] - true)[:, :2].T))
    return np.array(out)


def test_free_robot():
    """A robot that is told to drive and turn is reckoned by its wheels, and is there."""
    measures = measures_of(recipe())
    by, rims = Predictor.of(1, 6), np.zeros(2)
    by.restart()
    pose, path, out = np.zeros(3), [], np.empty((3, 6))
    wheels = np.zeros((1, 2))
    for frame in range(120):
        path.append(pose.copy())
        view = np.zeros((3, 6))
        view[1, :3] = path[max(frame - 6, 0)]
        predict(frame, view, wheels, measures.packed(), 6.0, by, out)
        assert out[1, [X, Y]] == pytest.approx(pose[:2], abs=1e-9)
        assert np.cos(out[1, THETA] - pose[2]) == pytest.approx(1.0)
        wheels[0] = (0.6, 0.9) if frame < 60 else (0.5, -0.2)
        rims += np.clip(wheels[0] - rims, -0.1, 0.1)
        ahead, turn = rims.mean() / 60, (rims[1] - rims[0]) / measures.axle / 60
        pose += [ahead * np.cos(pose[2] + turn / 2), ahead * np.sin(pose[2] + turn / 2), turn]
    assert out[1, [VX, VY]] == pytest.approx([0.15 * np.cos(pose[2]), 0.15 * np.sin(pose[2])], abs=0.03)
    assert out[1, OMEGA] == pytest.approx(-0.7 / measures.axle)


def test_what_rolls_on():
    """The ball and adversaries go on as they move; walls stop them, and the goal is open."""
    measures = measures_of(recipe())
    view, out = np.zeros((3, 6)), np.empty((3, 6))
    view[BALL] = 0.3, 0.1, 0.0, 1.0, -0.5, 0.0
    view[2] = -0.2, 0.6, 3.1, 0.0, 2.0, 1.0
    predict(0, view, np.zeros((1, 2)), measures.packed(), 6.0, Predictor.of(1, 6), out)
    assert out[BALL] == pytest.approx([0.4, 0.05, 0.0, 1.0, -0.5, 0.0])
    assert out[2, [X, Y]] == pytest.approx([-0.2, measures.half_width])
    assert out[2, THETA] == pytest.approx(3.2 - 2 * np.pi)
    view[BALL] = 0.74, 0.0, 0.0, 3.0, 0.0, 0.0
    predict(1, view, np.zeros((1, 2)), measures.packed(), 6.0, Predictor.of(1, 6), out)
    assert out[BALL, X] == pytest.approx(measures.goal_x + 2 * measures.radius)
    view[BALL, Y] = 0.4
    predict(2, view, np.zeros((1, 2)), measures.packed(), 6.0, Predictor.of(1, 6), out)
    assert out[BALL, X] == pytest.approx(measures.goal_x)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_match(noise):
    """In a match, own robots are shown several times nearer to their places than the late picture has them."""
    camera = LATE.model_copy(update={"position_noise": noise})
    late = errors(recipe(TeamSettings(kind="static"), camera))
    ahead = errors(recipe(STATIC, camera))
    assert np.median(ahead[:, 1:4]) < np.median(late[:, 1:4]) / (4 if noise == 0 else 2)
    assert ahead[:, BALL].mean() < late[:, BALL].mean()


def test_off():
    """A team that does not predict is not wrapped, and its matches keep their ids."""
    plain = TeamSettings(kind="static")
    assert type(controller_of(plain, recipe(plain), 0)).__name__ == "ScriptedController"
    assert "predict_s" not in plain.model_dump()
    assert recipe(plain).match_id != recipe(STATIC).match_id


def test_sights():
    """A sight of a team that predicts is what the late camera shows when the decision takes effect."""
    control = constant("constant:044")
    own = TeamSettings(kind="learned", policy="it", predict_s=0.1)
    of = recipe(own)
    log = whole(MatchInPlay(of, controllers_of(of, {"it": PolicyTables(control.policy())})))
    found = sights(log, Values.empty(), GramSettings())
    home = log.decisions.filter(team="home").sort("team", "robot", "t_ns")
    at = np.searchsorted(log.frames.t_ns, home["t_ns"].to_numpy())
    last = len(log.frames) - 1
    turned = np.abs(log.frames.ball["x"])
    seen = np.abs(found.filter(team="home")["sight"].to_numpy()[:, list(SIGHT).index("ball_x")])
    assert seen == pytest.approx(turned[np.minimum(at + 6, last)], abs=1e-6)
    assert np.abs(seen - turned[at]).max() > 0.02
