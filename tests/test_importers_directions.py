"""Direction of home's attack, found from where the bodies stand."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.recordings import RSIM, imported, read, recording

from pitchlore.pipeline.importers import directions
from pitchlore.pipeline.importers.rows import pack
from pitchlore.pipeline.matches.frame import Frames

STEP = 100_000_000


def frames(sides: list[float], rng: np.random.Generator, *, spread: float = 0.2) -> Frames:
    """Three a side at 10 Hz; side +1: home's mean is at -0.25, away's at +0.25."""
    count = len(sides)
    team = np.tile(np.repeat([0, 1], 3), count)
    places = np.repeat(sides, 6) * np.where(team == 0, -0.25, 0.25)
    return pack(
        np.arange(count, dtype=np.uint32),
        np.arange(count, dtype=np.int64) * STEP,
        {},
        np.repeat(np.arange(count), 6),
        {
            "team": team.astype(np.uint8), "id": np.tile(np.arange(3), 2 * count).astype(np.uint16),
            "x": places + rng.normal(0, spread, len(team)), "y": rng.normal(0, 0.2, len(team)),
        },
    )


def attacks(match: Frames) -> list[int]:
    periods, _ = directions.infer_periods(match, [])
    return [period.home_attacks for period in periods]


@settings(max_examples=40)
@given(
    first=st.sampled_from([1, -1]), half=st.integers(200, 800), seed=st.integers(0, 2**16),
    tell=st.booleans(),
)
def test_change_of_sides(
    first: int, half: int, seed: int, tell: bool
) -> None:
    """A change of sides is found with and without the half-time event."""
    sides = [float(first)] * half + [-float(first)] * (1000 - half)
    match = frames(sides, np.random.default_rng(seed))
    (one, two), _ = directions.infer_periods(match, [half * STEP] if tell else [])
    assert (one.home_attacks, two.home_attacks) == (first, -first)
    assert one.inferred
    assert two.inferred
    assert abs(one.end_ns - half * STEP) <= (0 if tell else 2 * STEP)
    assert two.start_ns == one.end_ns
    assert two.end_ns == 999 * STEP + 1


@settings(max_examples=40)
@given(first=st.sampled_from([1.0, -1.0]), seed=st.integers(0, 2**16))
def test_no_change_of_sides(first: float, seed: int) -> None:
    """A match without a change of sides has one period."""
    assert attacks(frames([first] * 500, np.random.default_rng(seed))) == [first]


def test_spell_of_pressure() -> None:
    """A fifth of the match with all of home but the goalkeeper in away's half changes no sides."""
    match = frames([1.0] * 1000, np.random.default_rng(3), spread=0.05)
    late = np.repeat(np.arange(1000) >= 800, 6)
    pressing = late & (match.robots["team"] == 0) & (match.robots["id"] > 0)
    match.robots["x"][pressing] += 0.9
    assert attacks(match) == [1]


@settings(max_examples=20)
@given(seed=st.integers(0, 2**16))
def test_weak_votes(seed: int) -> None:
    """If the votes are too weak, home is taken to attack +x, and a flaw says so."""
    match = frames([0.0] * 1000, np.random.default_rng(seed))
    (period,), flaws = directions.infer_periods(match, [])
    assert period.home_attacks == 1
    assert [(flaw.flaw, flaw.count, flaw.start_ns) for flaw in flaws] == [("direction unknown", 1000, 0)]
    assert "too weak" in str(flaws[0].note)


def test_known_first_period() -> None:
    """The direction of the first period is not inferred if it is given."""
    match = frames([1.0] * 500 + [-1.0] * 500, np.random.default_rng(0))
    periods, flaws = directions.infer_periods(match, [500 * STEP], first=-1)
    assert [(p.home_attacks, p.inferred) for p in periods] == [(-1, False), (-1, True)]
    assert [flaw.start_ns for flaw in flaws] == [500 * STEP]


def test_votes_by_time() -> None:
    """Votes are weighted by time: forty slow samples outweigh eighty quick ones."""
    match = frames([1.0] * 40 + [-1.0] * 80, np.random.default_rng(0), spread=0.0)
    match.t_ns[:40] = np.arange(40) * 400_000_000
    match.t_ns[40:] = 40 * 400_000_000 + np.arange(80) * 10_000_000
    assert attacks(match) == [1]
    match.t_ns[-1] += 3_600_000_000_000  # an hour without samples is no hour of -x
    assert attacks(match) == [1]


def test_half_time_outside() -> None:
    """Half-times outside the match do not matter."""
    match = frames([1.0] * 100, np.random.default_rng(0))
    periods, _ = directions.infer_periods(match, [-5, 0, 10**12])
    assert len(periods) == 1


@pytest.mark.parametrize("hidden", [False, True])
def test_real_change_of_sides(hidden: bool) -> None:
    """The sample's change of sides is found at 300 s, with and without the half-time state."""
    match = imported(RSIM)
    if hidden:
        table = pl.read_parquet(recording(RSIM)).with_columns(
            pl.col("game_state").str.replace("half+kickoff_y", "freeball", literal=True)
        )
        match = read(table.write_csv().encode(), "x.csv")
        assert "half" not in match.referee["event"]
    one, two = match.info.periods
    assert (one.home_attacks, two.home_attacks) == (1, -1)
    assert one.end_ns == two.start_ns == 300_000_000_000
    assert match.quality["flaw"].to_list() == ["direction inferred"] * 2
