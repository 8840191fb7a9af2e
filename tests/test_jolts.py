"""Jolts of the ball: how much its velocity has just changed, against the literal ones and by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.literal import BALL, Match
from support.scenes import film, goes, stands, walk

from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.pipeline.stages.situations.dense import dense_match


def jolted(ball, seconds, *, hz=40.0, kind=Kind.VSSS):
    """Jolt and gain of the ball at each sample, m/s."""
    table = film({"ball": ball, "home-1": stands(0, 0.5)}, seconds, hz=hz)
    return dense_match(table, SCALES[kind]).ball[5:7]


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
