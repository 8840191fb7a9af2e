"""The replay as a film: what is seen where and when, and that it is small and always the same."""

import io
import math

import polars as pl
import pytest
from PIL import Image
from support.handmade import handmade
from support.rows import referee
from test_replay import match, situations, trajectories

from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.views.replay.animation import animation

pytestmark = pytest.mark.slow

BLUE, ORANGE, WHITE = (63, 158, 230), (240, 138, 60), (255, 255, 255)
#: Pixels a metre: 400 without margins of 8 over 1.5 m and two goals of 0.1 m.
SCALE = 384 / 1.7


def played(ms=range(0, 2000, 20), ball=lambda t: (0.2 * t, 0.0), blue=lambda t: (-0.3, 0.2), segment=0):
    """A ball, a blue and an orange robot; places by time in seconds."""
    return trajectories([
        row for t in ms for row in (
            (t, "ball", None, *ball(t / 1000), None, segment), (t, "home", 1, *blue(t / 1000), 0.0, segment),
            (t, "away", 2, 0.5, -0.3, math.pi, segment))])


def film(rows=None, doing=None, referee=None, *, kind=Kind.VSSS, start_s=0.0, seconds=2.0, length=2.0):
    shown = handmade(PITCHES[kind], matches=match(score_home=0, score_away=0, duration_s=length),
                  trajectories=played() if rows is None else rows, situations=doing, referee=referee)
    return animation(shown, start_s=start_s, seconds=seconds)


def pictures(gif):
    image = Image.open(io.BytesIO(gif))
    found = []
    for number in range(image.n_frames):
        image.seek(number)
        found.append((image.info["duration"], image.convert("RGB")))
    return found


def at(gif, t_s):
    """The picture that is shown at a time."""
    passed = 0
    for duration, picture in pictures(gif):
        passed += duration
        if t_s * 1000 < passed:
            return picture
    raise AssertionError("the film is over")


def seen(picture, x, y):
    """The colour at a place on a VSSS pitch."""
    return picture.getpixel((round(200 + x * SCALE), round(50 + (0.65 - y) * SCALE)))


def near(one, other):
    return max(abs(a - b) for a, b in zip(one, other, strict=True)) <= 12


@pytest.mark.parametrize(("kind", "speed"), [(Kind.VSSS, 0.2), (Kind.SSL, 2.0), (Kind.SIM2D, 2.0)])
def test_frame_rate(kind, speed):
    """A film of any league has twelve and a half pictures a second."""
    found = pictures(film(played(ball=lambda t: (speed * t, 0.0)), kind=kind))
    assert len(found) == 25
    assert {duration for duration, _ in found} == {80}
    assert found[0][1].width == 400


def test_bodies_and_trail():
    """Bodies are drawn where they were, with +y up, and the trail lies behind the ball."""
    first, *_, last = (picture for _, picture in pictures(film()))
    for picture in (first, last):
        assert near(seen(picture, -0.3 - 0.028, 0.2 - 0.02), BLUE)
        assert near(seen(picture, 0.5 + 0.028, -0.3 - 0.02), ORANGE)
    assert near(seen(first, 0.0, 0.0), WHITE)
    assert near(seen(last, 0.2 * 1.92, 0.0), WHITE)
    # the trail is behind the ball, not before it
    assert sum(seen(last, 0.2 * 1.6, 0.0)) > sum(seen(last, 0.2 * 2.3, 0.0)) + 60
    # +y is up
    (_, higher), *_ = pictures(film(played(blue=lambda _: (-0.3, 0.4))))
    assert near(seen(higher, -0.3 - 0.028, 0.4 - 0.02), BLUE)


def test_same_bytes():
    """The same match gives the same bytes, and another match or time gives others."""
    first = film(seconds=0.5)
    assert first == film(played().sample(fraction=1.0, shuffle=True, seed=1), seconds=0.5)
    assert first != film(played(blue=lambda t: (-0.3, 0.2 + 0.1 * t)), seconds=0.5)
    assert first != film(start_s=0.4, seconds=0.5)


def test_equal_pictures():
    """Pictures in a row that are equal become one picture that is shown longer."""
    (only,) = pictures(film(played(ball=lambda _: (0.0, 0.0)), seconds=0.8))
    assert only[0] == 800


def test_situation_caption():
    """The film says what a robot does while the robot does it, and not before or after."""
    doing = situations([("home", 1, 46, "Robot approaches the ball", 1000, 1500, 1.0, "ball")])
    still = played(ball=lambda _: (0.0, 0.0))
    gif = film(still, doing)
    before, during, after = (at(gif, t).crop((0, 345, 400, 376)).tobytes() for t in (0.9, 1.2, 1.6))
    assert before == after != during


def test_goal_and_score():
    """A goal is marked for a while, and the score changes with it."""
    still = played(range(0, 4000, 20), ball=lambda _: (0.0, 0.0))
    goal = referee((0.0, "kick-off", "home", 0, 0), (1.0, "goal", "away", 0, 1))
    gif = film(still, referee=goal, seconds=4.0, length=4.0)
    before, lit, after = (at(gif, t) for t in (0.5, 2.0, 3.5))
    edge = (0.3, 0.65)
    assert near(seen(lit, *edge), ORANGE)
    assert not near(seen(before, *edge), ORANGE)
    assert seen(after, *edge) == seen(before, *edge)
    head = (0, 0, 400, 34)
    assert before.crop(head).tobytes() != after.crop(head).tobytes()


def test_trail_at_restart():
    """The ball's trail does not reach across a restart."""
    rows = pl.concat([played(range(0, 480, 20), ball=lambda _: (-0.6, 0.0)), played(range(480, 960, 20), ball=lambda _: (0.0, 0.0), segment=1)])
    last = pictures(film(rows, seconds=0.96))[-1][1]
    assert seen(last, -0.5, 0.0) == seen(last, -0.45, 0.0)


def test_unrecorded_time():
    """While nothing was recorded no robot is shown."""
    rows = played([*range(0, 500, 20), *range(1500, 2000, 20)])
    found = pictures(film(rows))
    gap = next(picture for duration, picture in found if duration > 400)
    assert not near(seen(gap, -0.3 - 0.028, 0.2 - 0.02), BLUE)
    assert near(seen(found[-1][1], -0.3 - 0.028, 0.2 - 0.02), BLUE)


@pytest.mark.parametrize(("start_s", "seconds"), [(0.0, 0.0), (-1.0, 5.0), (0.0, 121.0), (math.nan, 5.0), (0.0, math.nan)])
def test_bad_times(start_s, seconds):
    """A start or length that makes no sense is refused."""
    with pytest.raises(BadSettings, match="cannot show"):
        film(start_s=start_s, seconds=seconds)


def test_start_after_end():
    """A film that would start at the match's end or later is refused."""
    with pytest.raises(NotFound, match=r"m-1: has nothing to show from 9 s on\. It is 2\.0 s long"):
        film(start_s=9.0)
    with pytest.raises(NotFound, match=r"nothing to show from 2 s on"):
        film(start_s=2.0)
