"""How agents choose: in the proportions that are asked for, whatever the values and temperatures."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from pitchlore.pipeline.stages.paradigms.rules.selection import (
    ActionSelection,
    boltzmann,
    sample,
    selection_weights,
)

HUGE, ALMOST_ONE = 1e308, math.nextafter(1.0, 0.0)


def weights(selection, values, temperature):
    out = np.full(len(values), np.nan)
    selection_weights(selection, np.array(values, np.float64), temperature, out)
    return out.tolist()


finite = st.floats(allow_nan=False, allow_infinity=False)
vectors = st.lists(finite, min_size=1, max_size=6)
temperatures = st.one_of(st.floats(0, 1e300), st.sampled_from([0.0, 5e-324, 1e-300, 1e-10, 1.0, 16.0, 1e300]))
unit = st.floats(0, 1, exclude_max=True)


@pytest.mark.parametrize(("values", "temperature", "expected"), [
    ([1, 3, 3], 0.0, [0, 1, 1]),
    ([1, 3, 3], 1e-300, [0, 1, 1]),
    ([1, 3, 3 - 1e-12], 1e-300, [0, 1, 0]),
    ([1, 3, 3], 1e300, [1, 1, 1]),
    ([5e-324, 0], 0.0, [1, 0]),
    ([-HUGE, HUGE], 0.0, [0, 1]),
    ([-HUGE, HUGE], 1e-300, [0, 1]),  # the difference overflows, and divided by the temperature once more
    ([-HUGE, HUGE], 1.0, [0, 1]),
    ([-HUGE, HUGE], 1e300, [0, 1]),  # exp(-2e8)
    ([HUGE, HUGE, 0], 1e-300, [1, 1, 0]),
    ([-HUGE, -HUGE], 1e300, [1, 1]),
    ([7], 0.0, [1]),
    ([0.0, -0.0], 0.0, [1, 1]),
])
def test_boltzmann_extremes(values, temperature, expected):
    """Boltzmann weights are exact at extreme temperatures and values."""
    assert weights(ActionSelection.BOLTZMANN, values, temperature) == expected


@given(values=vectors, temperature=temperatures)
def test_boltzmann_order(values, temperature):
    """The greatest value weighs 1, and a smaller value never weighs more than a greater one."""
    out = weights(ActionSelection.BOLTZMANN, values, temperature)
    for value, weight in zip(values, out, strict=True):
        assert 0 <= weight <= 1
        assert weight == 1 or value < max(values)
    order = sorted(range(len(values)), key=values.__getitem__)
    assert all(out[a] <= out[b] for a, b in pairwise(order))
    assert max(out) == 1


@given(
    chances=st.lists(st.floats(0, 1e300), min_size=1, max_size=6).filter(any),
    u=st.one_of(unit, st.sampled_from([0.0, 5e-324, 0.5, ALMOST_ONE])),
)
@example(chances=[0.0, 1.0, 0.0], u=ALMOST_ONE)
@example(chances=[0.0, 1.0, 0.0], u=0.0)
@example(chances=[0.1, 0.2, 0.7, 0.0], u=ALMOST_ONE)
@example(chances=[5e-324, 0.0], u=ALMOST_ONE)
@example(chances=[1.0, 5e-324, 0.0], u=ALMOST_ONE)
def test_zero_weight(chances, u):
    """An action that weighs nothing is never chosen."""
    assert chances[sample(np.array(chances), u)] > 0


@given(values=vectors, temperature=temperatures, u=st.one_of(unit, st.sampled_from([0.0, ALMOST_ONE])))
def test_sampled_boltzmann(values, temperature, u):
    """Any temperature can be sampled, and at 0 the sample is one of the greatest."""
    out = np.empty(len(values))
    boltzmann(np.array(values), temperature, out)
    assert out[sample(out, u)] > 0
    boltzmann(np.array(values), 0.0, out)
    assert values[sample(out, u)] == max(values)


@pytest.mark.parametrize(("chances", "expected"), [
    ([1, 3, 0, 4], [125, 375, 0, 500]),
    ([0.25, 0, 0.75], [250, 0, 750]),
    ([0, 1e-300, 1e-300], [0, 500, 500]),
    ([3e300, 1e300], [750, 250]),
])
def test_proportions(chances, expected):
    """Actions are chosen in proportion to their weights."""
    middles = (np.arange(1000) + 0.5) / 1000
    chosen = [sample(np.array(chances, np.float64), u) for u in middles]
    assert np.bincount(chosen, minlength=len(chances)).tolist() == expected
    assert chosen == sorted(chosen)
