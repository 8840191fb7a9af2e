"""Sums are exact: the same by the key of one number as by columns, in any order and for any split."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from polars.testing import assert_frame_equal

from pitchlore.pipeline.numbers import sums
from pitchlore.pipeline.numbers.sums import added_up, exact

FEW = st.integers(-3, 3)
#: Many of them fall into one slot, or differ in the last bits only.
MANY = st.one_of(FEW, st.sampled_from([-(2**63), 2**63 - 1, 2**62, 2**40, 2**40 + 1]), st.integers(-(2**63), 2**63 - 1))
ROWS = st.lists(st.tuples(MANY, FEW, st.floats(-4, 4)), max_size=60)


def table(rows):
    found = pl.DataFrame(rows, schema={"key": pl.Int64, "count": pl.Int64, "sum": pl.Float64}, orient="row")
    return found.with_columns(pl.Series("sum", exact(found["sum"].to_numpy())))


@given(ROWS, st.integers(0, 60), st.permutations(range(3)))
def test_by_number(rows, cut, order):
    """The sums by one number are those by columns, sorted."""
    parts = [table(rows[:cut]), table(rows[cut:]), table(rows)]
    found = added_up([parts[i] for i in order], "key")
    assert_frame_equal(found, added_up(parts, ["key"]).sort("key"), check_exact=True)
    assert_frame_equal(added_up([found], "key"), found, check_exact=True)
    with pytest.MonkeyPatch.context() as little:  # however little is held back
        little.setattr(sums, "_BUFFERED_ROWS", 2)
        assert_frame_equal(added_up(iter(parts), "key"), found, check_exact=True)


def test_many():
    """All of many numbers are found again."""
    numbers = np.random.default_rng(0).integers(-(2**63), 2**63 - 1, 50_000)
    found = added_up([table([]), pl.DataFrame({"key": np.tile(numbers, 2), "count": 1, "sum": 0.5})], "key")
    assert found["key"].to_list() == sorted(set(numbers.tolist()))
    assert (found["count"] == 2).all()
    assert (found["sum"] == 1.0).all()
