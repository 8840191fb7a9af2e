"""Jolts of the ball: how much its velocity has just changed, against the literal ones and by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.literal import BALL, Match
from support.scenes import film, goes, stands, walk

from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.pipeline.stages.situations.dense import dense_match


def jolted(ball, seconds, *, hz=40.0, kind=Kind.VSSS, drop=()):
    """Jolt and gain of the ball at each sample, m/s; samples in ``drop`` are not there."""
    table = film({"ball": ball, "home-1": stands(0, 0.5)}, seconds, hz=hz)
    frames = [frame for frame in range(round(seconds * hz)) if frame not in drop]
    found = dense_match(table.filter(table["frame"].is_in(frames)), SCALES[kind]).ball[5:7]
    return found[0], found[1]


def along(x):
    """A path along x, a sample each."""
    places = np.array(x)
    return lambda t: (places, 0 * t, 0 * t)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1))
def test_same_as_literal(seed):
    """Jolts and gains are those of the literal recogniser, on matches with holes, stops and suspect samples."""
    table = walk(seed)
    found = dense_match(table, SCALES[Kind.VSSS]).ball[5:7]
    match = Match(table, PITCHES[Kind.VSSS])
    for place, frame in enumerate(match.frames):
        if BALL in match.at[frame]:
            assert found[:, place] == pytest.approx(match.ball_jolts[frame], abs=1e-5)
        else:
            assert np.isnan(found[:, place]).all()


def test_kicked_from_rest():
    """A ball at rest that leaves at 1 m/s is jolted by 1 m/s."""
    jolt, gain = jolted(goes((0, 0, 0, 0), (0.5, 0, 0, 0), (1, 0.5, 0, 0)), 1.0)
    # the velocity after is taken over two samples of 25 ms: half of them, all, and half of those before
    assert jolt[20:25] == pytest.approx([0, 0.5, 1.0, 0.5 - 0.1 * 0.5, 0], abs=1e-5)
    # the gain stays that of the greatest jolt for 50 ms
    assert gain[20:25] == pytest.approx([0, 0.5, 1.0, 1.0, 1.0], abs=1e-5)
    assert jolt[:20] == pytest.approx(np.zeros(20), abs=1e-5)


def test_rebound():
    """A ball that comes back slower is jolted by the sum of its speeds, less a tenth, and has lost speed."""
    jolt, gain = jolted(goes((0, 3.0, 0, 0), (1, 1.0, 0, 0), (2, 1.5, 0, 0)), 2.0, hz=10, kind=Kind.SIM2D)
    assert jolt[11] == pytest.approx(2.0 + 0.5 - 0.1 * 2.0, abs=1e-5)
    assert gain[11] == pytest.approx(0.5 - 2.0, abs=1e-5)
    assert np.delete(jolt, 11) == pytest.approx(np.zeros(19), abs=1e-5)


def test_rolling():
    """A ball that loses 6 % of its speed each cycle, as in rcssserver, has no jolt."""
    steps = 2.0 * 0.94 ** np.arange(20)
    jolt, gain = jolted(along(np.cumsum(steps)), 2.0, hz=10, kind=Kind.SIM2D)
    assert (jolt == 0).all()
    assert (gain[2:] < 0).all()


def test_first_samples():
    """A segment's first samples have no jolt, however fast the ball is."""
    jolt, gain = jolted(along(np.arange(10) ** 2.0), 1.0, hz=10, kind=Kind.SIM2D)
    assert jolt[:2].tolist() == gain[:2].tolist() == [0, 0]
    assert (jolt[2:] > 0).all()


def test_hole():
    """A hole of 0.3 s begins anew; one sample that is missing does not."""
    kicked = along(np.where(np.arange(20) < 10, 0.0, np.arange(20) - 10.0))
    assert jolted(kicked, 2.0, hz=10, drop=(9, 10))[0].max() == 0  # at rest at 0.8 s, on its way at 1.1 s
    assert jolted(kicked, 2.0, hz=10, drop=(10,))[0].max() == pytest.approx(5.0, abs=1e-5)
