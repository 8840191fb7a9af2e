"""A person's team without a person: the driven robot obeys, the others play on, switching finds whom it should."""

import math

import numpy as np
import pytest

from pitchlore.pipeline.arena.match.controllers import ScriptedController, controller_of
from pitchlore.pipeline.arena.match.human import DriveCommand, HumanController
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.game.bodies import BALL, THETA, X, Y, see

RECIPE = Recipe(home=TeamSettings(kind="human"), away=TeamSettings(kind="static"), seed=3,
                referee=RefereeSettings(duration_s=20))
TOP, AXLE = 1.2, 0.071


def human():
    return HumanController(RECIPE, np.random.default_rng(1))


def view(ball=(0.0, 0.0)):
    bodies = np.zeros((7, 6))
    bodies[BALL, [X, Y]] = ball
    bodies[1:, X] = [-0.6, -0.4, -0.2, 0.2, 0.4, 0.6]
    bodies[1:, Y] = [0.0, 0.3, -0.3, 0.3, -0.3, 0.0]
    return bodies


def wheels_at(command, driven=2):
    controller = human()
    controller.think(0, view(), np.zeros((3, 2)))
    controller.driven = driven
    controller.command(command)
    wheels = np.zeros((3, 2))
    controller.think(1, view(), wheels)
    return wheels


class TestDriving:
    @pytest.mark.parametrize(("command", "left", "right"), [
        (DriveCommand(), 0.0, 0.0),
        (DriveCommand(forward=1), 0.72, 0.72),
        (DriveCommand(forward=-0.5), -0.36, -0.36),
        (DriveCommand(turn=1), -0.1775, 0.1775),  # 5 rad/s times half the axle
        (DriveCommand(forward=1, boost=True), TOP, TOP),
        (DriveCommand(boost=True), TOP, TOP),
        (DriveCommand(turn=-1, boost=True), TOP, -TOP),  # the spin
        (DriveCommand(forward=1, turn=1, boost=True), TOP - 0.355, TOP),  # the turn goes before
        (DriveCommand(forward=7, turn=-7), 0.72 + 0.1775, 0.72 - 0.1775),
    ])
    def test_wheels_by_hand(self, command, left, right):
        assert wheels_at(command)[1].tolist() == pytest.approx([left, right])

    def test_the_others_play_the_static_rules(self):
        mine = wheels_at(DriveCommand(forward=1), driven=2)
        rules = ScriptedController(TeamSettings(kind="static"), RECIPE, np.random.default_rng(1))
        theirs = np.zeros((3, 2))
        for frame in range(2):
            rules.think(frame, view(), theirs)
        assert mine[[0, 2]].tolist() == theirs[[0, 2]].tolist()
        assert mine[1].tolist() != theirs[1].tolist()


class TestSwitching:
    @pytest.mark.parametrize(("ball", "expected"), [((-0.7, 0.0), 1), ((-0.4, 0.6), 2), ((0.5, -0.3), 3)])
    def test_nearest_to_the_ball(self, ball, expected):
        controller = human()
        controller.think(0, view(ball), np.zeros((3, 2)))
        assert controller.driven == expected  # it begins there
        controller.switch("next")
        controller.think(1, view(ball), np.zeros((3, 2)))
        assert controller.driven == expected % 3 + 1
        controller.switch("nearest")
        controller.think(2, view(ball), np.zeros((3, 2)))
        assert controller.driven == expected

    def test_the_last_wish_counts(self):
        controller = human()
        controller.switch("nearest")
        controller.switch("next")
        controller.think(0, view((-0.7, 0.0)), np.zeros((3, 2)))
        assert controller.driven == 2


class TestInAMatch:
    @pytest.mark.parametrize("side", [0, 1])
    def test_forward_is_ahead_on_both_sides(self, side):
        recipe = RECIPE.model_copy(update={"home": TeamSettings(kind="static"), "away": TeamSettings(kind="static")})
        controller = human()
        other = controller_of(TeamSettings(kind="random"), recipe, 1 - side)
        match = MatchInPlay(recipe, (controller, other) if side == 0 else (other, controller))
        match.advance()
        assert controller.playing
        controller.driven = 2
        controller.command(DriveCommand(forward=1))
        row = 2 + 3 * side
        before = match.bodies[row].copy()
        match.advance(10)
        gone = match.bodies[row] - before
        along = gone[X] * math.cos(before[THETA]) + gone[Y] * math.sin(before[THETA])
        assert along > 0.05
        own = np.zeros_like(match.bodies)
        see(match.bodies, side, 1.0 - 2.0 * side, own)
        assert own[2, X] == pytest.approx(match.bodies[row, X] * (1 - 2 * side))

    def test_knows_when_play_rests(self):
        controller = human()
        match = MatchInPlay(RECIPE, (controller, controller_of(TeamSettings(kind="static"), RECIPE, 1)))
        assert not controller.playing
        match.advance()
        assert controller.playing
        match.leave()
        assert not controller.playing
        assert controller.reward == 0
        assert controller.decided() == []
