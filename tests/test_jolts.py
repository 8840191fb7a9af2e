"""Jolts of the ball: how much its velocity has just changed, against the literal ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.literal import BALL, Match
from support.scenes import walk

from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.pipeline.stages.situations.dense import dense_match


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from([Kind.VSSS, Kind.SIM2D]))
def test_same_as_literal(seed, kind):
    """Jolts and gains are those of the literal recogniser, on matches with holes, stops and suspect samples."""
    table = walk(seed)
    found = dense_match(table, SCALES[kind]).ball[5:7]
    match = Match(table, PITCHES[kind])
    for place, frame in enumerate(match.frames):
        if BALL in match.at[frame]:
            assert found[:, place] == pytest.approx(match.ball_jolts[frame], abs=1e-5)
        else:
            assert np.isnan(found[:, place]).all()
