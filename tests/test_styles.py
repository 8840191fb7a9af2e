"""The scripts of two styles: a high press, and a deep block with passes forward; and what static has in common with them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from support.openings import M, driven, mirrored, splitmix, view_of, views

from pitchlore.pipeline.arena.teams import counter, pressing, static
from pitchlore.pipeline.arena.teams.people import People
from pitchlore.pipeline.game.bodies import BALL, X, Y

PACKED = M.packed()
KEEPER = (-0.70, 0.0, math.pi / 2)
pytestmark = pytest.mark.unit


def memory_of(script):
    """A team's memory before a match."""
    return script.new_memory(3, M, np.random.default_rng(0), People())


def film(script, bodies, frames, *, ball_rests=False):
    """Let three robots play against three that stand; the bodies are changed. Yields after each frame."""
    memory, rest = memory_of(script), bodies[BALL].copy()
    for _ in driven(bodies, frames, lambda wheels: script.play(bodies, PACKED, splitmix(), wheels[:3], *memory)):
        if ball_rests:
            bodies[BALL] = rest
        yield bodies


@pytest.mark.parametrize("script", [static, pressing, counter])
@given(view=views(count=3, ties=False))
@settings(max_examples=50)
def test_mirror(script, view):
    """In the mirror a robot's wheels are swapped."""
    one, other = np.zeros((2, 3, 2))
    script.play(view, PACKED, splitmix(), one, *memory_of(script))
    script.play(mirrored(view), PACKED, splitmix(), other, *memory_of(script))
    assert other[:, ::-1] == pytest.approx(one, abs=1e-9)


def carried(ball, *others):
    """A view in which row 4 has a ball at (x, y); the keeper of row 6 is at its goal, the field players far off."""
    bodies = view_of(KEEPER, (-0.45, 0.25, 0.0), (-0.45, -0.35, 0.0), ball=(*ball, 0, 0))
    bodies[4:7, :3] = (ball[0] + 0.06, ball[1], math.pi), *others, (0.7, 0.0, math.pi / 2)
    return bodies


def nearest(bodies):
    """Metres from the ball to the nearest field player."""
    return np.hypot(*(bodies[2:4, :2] - bodies[BALL, :2]).T).min()


def test_press_and_block():
    """With the ball deep in the adversary's half, one second robot is there, too, the other blocks before its own area."""
    second = {}
    for script in (pressing, counter):
        bodies = carried((0.5, 0.2), (0.4, -0.4, 0.0))
        last = next(last for last in film(script, bodies, 200, ball_rests=True) if nearest(last) < 0.08)
        away = np.hypot(*(last[2:4, :2] - last[BALL, :2]).T)
        second[script] = last[2 + away.argmax(), :2].copy()
    assert second[pressing][0] > 0.2
    x, y = second[counter]
    assert -M.goal_x + M.area_depth < x < -M.goal_x + M.area_depth + 0.2
    assert y == pytest.approx(0.2 * (x + M.goal_x) / (0.5 + M.goal_x), abs=0.03)  # on the ball's way to the goal


@pytest.mark.parametrize(("waits", "way"), [((-0.25, -0.3), (-0.25, -0.3)), ((0.5, -0.4), (-0.75, 0.0))])
def test_cover(waits, way):
    """The second robot stands in the way of a pass to an adversary near the own goal, else in the goal's way."""
    bodies = carried((0.1, 0.2), (*waits, 0.0))
    *_, last = film(pressing, bodies, 120, ball_rests=True)
    ball = last[BALL, :2]
    cover = max((2, 3), key=lambda robot: math.hypot(*(last[robot, :2] - ball)))
    (dx, dy), (ox, oy) = np.array(way) - ball, last[cover, :2] - ball
    assert 0 < (ox * dx + oy * dy) / math.hypot(dx, dy) < math.hypot(dx, dy)
    assert abs(ox * dy - oy * dx) / math.hypot(dx, dy) < 0.06


def test_pass():
    """With the ball won and the way open, the ball goes to the teammate ahead; with an adversary in it, it does not."""
    to_mate = []
    for blocker in ((0.1, -0.5, 0.0), (0.02, 0.11, 0.0)):
        bodies = view_of(KEEPER, (-0.27, -0.1, 0.6), (0.3, 0.3, 0.0), ball=(-0.2, -0.05, 0, 0))
        bodies[4:7, :3] = blocker, (0.5, -0.5, 0.0), (0.7, 0.0, 0.0)
        away = min(math.hypot(*(last[3, :2] - last[BALL, :2])) for last in film(counter, bodies, 75))
        to_mate.append(away)
    assert to_mate[0] < 0.07
    assert to_mate[1] > to_mate[0] + 0.05


def test_runs_ahead():
    """When the ball is won, the other field player runs ahead of it, and not into the adversary's area."""
    bodies = view_of(KEEPER, (-0.28, 0.3, 0.0), (-0.4, -0.3, 0.0), ball=(-0.2, 0.3, 0, 0))
    bodies[4:7, :3] = (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (0.7, 0.0, 0.0)
    ahead, deepest = [], -1.0
    for last in film(counter, bodies, 120):
        ahead.append(last[3, X] - last[BALL, X])
        deepest = max(deepest, last[3, X])
    assert ahead[0] < 0 < max(ahead)
    assert deepest < M.goal_x - M.area_depth


@pytest.mark.parametrize("script", [static, pressing, counter])
def test_leaves_the_ball_to_the_keeper(script):
    """No field player is in its own area while the ball is there."""
    bodies = view_of(KEEPER, (-0.3, 0.3, math.pi), (-0.2, -0.1, math.pi), ball=(-0.68, 0.3, 0, 0))
    bodies[4:7, :3] = (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (0.7, 0.0, 0.0)
    for last in film(script, bodies, 150):
        if static.in_area(*last[BALL, [X, Y]], 0.0, M):
            assert not any(static.in_area(*last[robot, [X, Y]], 0.0, M) for robot in (2, 3))


def test_won_and_lost():
    """The ball is won by who is clearly nearer, and lost to who is; in between all is as it was."""
    memory = memory_of(counter)

    def seen(own, theirs):
        view = view_of(KEEPER, (-own, 0.0, 0.0), (-0.5, 0.4, 0.0))
        view[4:7, :3] = (theirs, 0.0, 0.0), (0.6, 0.5, 0.0), (0.7, 0.5, 0.0)
        counter.play(view, PACKED, splitmix(), np.zeros((3, 2)), *memory)
        return bool(memory[-1]["won"][0])

    assert [seen(0.2, 0.1), seen(0.1, 0.12), seen(0.1, 0.2), seen(0.12, 0.1), seen(0.2, 0.1)] == [
        False, False, True, True, False]
