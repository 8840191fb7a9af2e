"""Compiled functions: which forms they have."""

from pitchlore.pipeline.numbers.kernels import njit


@njit(cache=False)
def doubled(number):
    return 2 * number


@njit(cache=False)
def three_times(number):
    return doubled(1) + doubled(number)


def test_forms():
    """Compiled code has one form for whole numbers, named or not, and Python another, when it first calls."""
    assert three_times(3) == 8
    assert (len(doubled._inner.signatures), len(doubled.signatures)) == (1, 0)
    assert doubled(4) == 8
    assert (len(doubled._inner.signatures), len(doubled.signatures)) == (1, 1)
