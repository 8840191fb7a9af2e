"""Counting the grams of a match, against polars window functions over the same table."""

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal
from support.rows import sequences_of

from pitchlore.pipeline.numbers.sums import QUANTUM
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.stages.behaviours.grams import grams, merge, spelt
from pitchlore.schemas import ROLES, SIDES, Goals, Situations

SETTINGS = GramSettings(outcome="paper")
CODES = np.array([1, 11, 21, 22, 34, 44, 46, 47, 57, 68, 78, 88, 108, 118, 138, 150, 162, 173, 184, 194])


def valued(seed=0, situations=8_000):
    """A match as long as a recorded one: six robots, 0.4 s a situation."""
    rng = np.random.default_rng(seed)
    each = situations // 6
    end = np.cumsum(rng.integers(1, 32, each) * 25_000_000)
    table = pl.concat([
        pl.DataFrame({
            "match_id": "bench-0", "team": team, "robot": robot, "role": rng.choice(ROLES, each),
            "code": rng.choice(CODES, each), "name": "", "start_ns": np.concatenate(([0], end[:-1])),
            "end_ns": end, "strength": None, "target": None, "segment": np.arange(each) // 50,
        }, schema=Situations.dtypes())
        for team in SIDES for robot in range(3)
    ])
    times = np.arange(1, 20) * 25_000_000_000
    goals = pl.DataFrame({"match_id": "bench-0", "t_ns": times, "team": rng.choice(SIDES, 19), "robot": None,
                          "kind": None, "origin": "referee", "confidence": None}, schema=Goals.dtypes())
    worths = pl.DataFrame({"change": rng.normal(0, 0.1, table.height), "x": 0.0, "y": 0.0})
    found = sequences_of(table, goals, worths, SETTINGS).with_columns(who=pl.col("team").to_physical().cast(pl.Int64))
    return table.hstack(found.select("follows", "value", "change", "x", "y", "who"))


def with_polars(table, n):
    """The same count and sum by shifts over each robot's segments."""
    keys = ["team", "robot", "segment"]
    ahead = [pl.col("code").shift(-i).over(keys).alias(f"c{i}") for i in range(n)]
    follows = [
        ((pl.col("start_ns").shift(-i) - pl.col("end_ns").shift(1 - i)) < SETTINGS.gap_s * 1e9).over(keys)
        .alias(f"f{i}") for i in range(1, n)
    ]
    mean = sum(pl.col("value").shift(-i).over(keys) for i in range(n)) / n
    return (
        table.with_columns(*ahead, *follows, mean.alias("mean"))
        .filter(pl.all_horizontal(pl.col(f"c{n - 1}").is_not_null(), *(f"f{i}" for i in range(1, n))))
        .group_by("team", "role", codes=pl.concat_list([f"c{i}" for i in range(n)]))
        .agg(count=pl.len(), value_sum=pl.col("mean").sum())
        .sort("team", "role", "codes")
    )


@pytest.mark.benchmark(group="count and value the 4-grams of one match")
@pytest.mark.parametrize("how", ["ours", "polars window functions"])
def test_of_a_match(timed, how):
    table = valued()
    ours = spelt(merge([grams(table, 4)]), 4)
    theirs = with_polars(table, 4)
    assert ours["count"].to_list() == theirs["count"].to_list()
    assert np.allclose(ours["value_sum"], theirs["value_sum"], atol=1e-6)
    run = (lambda: grams(table, 4)) if how == "ours" else (lambda: with_polars(table, 4))
    timed(table.height, "situations", run, rounds=20, warmup_rounds=2)


def added_up_by_polars(tables):
    """The same sums, unsorted."""
    return pl.concat(tables).lazy().group_by("key").agg(pl.all().sum()).collect()


@pytest.mark.benchmark(group="merge the 4-grams of 100 matches")
@pytest.mark.parametrize("how", ["ours, sorted", "polars group_by of whole numbers"])
def test_of_many_matches(timed, how):
    tables = [grams(valued(seed), 4) for seed in range(10)] * 10
    floats = pl.selectors.float()
    whole = [table.with_columns((floats / QUANTUM).cast(pl.Int64)) for table in tables]
    ours, theirs = merge(tables), added_up_by_polars(whole).sort("key")
    assert_frame_equal(ours, theirs.with_columns(pl.col(ours.select(floats).columns) * QUANTUM), check_exact=True)
    run = (lambda: merge(tables)) if how.startswith("ours") else (lambda: added_up_by_polars(whole))
    timed(sum(table.height for table in tables), "rows", run, rounds=30, warmup_rounds=1)
