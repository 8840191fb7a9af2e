"""Trajectories: the order of samples, jumps, and what is not there."""

import io

import numpy as np
import polars as pl
import pytest
from conftest import clip
from hypothesis import given
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from support.logs import at_60hz, make_log, ns, of, run, still
from support.recordings import read

from pitchlore.pipeline.base.errors import DamagedLog
from pitchlore.pipeline.matches.frame import Frames, MatchLog
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.stages.trajectories.timeline import order_samples
from pitchlore.schemas import AWAY, HOME

# ---- order of samples


def test_clean_log():
    """Nothing is flagged in a clean log, and its bodies are sorted."""
    t = at_60hz(1)
    bodies = {(AWAY, 0): still(60, 0.5), (HOME, 7): still(60), "ball": still(60), (HOME, 2): still(60, -0.3)}
    table, quality = run(make_log(t, bodies))
    assert quality.is_empty()
    keys = table.select("team", "robot").unique(maintain_order=True).rows()
    assert keys == [("ball", None), ("home", 2), ("home", 7), ("away", 0)]
    for _, rows in table.group_by("team", "robot"):
        assert rows["frame"].to_list() == list(range(60))


def test_duplicate_time():
    """The first of two frames with one time is kept, and the flaw is noted."""
    x = np.array([0.0, 0.01, 0.5, 0.02])
    table, quality = run(make_log([0.0, 0.02, 0.02, 0.04], {"ball": np.stack((x, 0 * x), axis=1)}))
    assert table["x"].to_list() == pytest.approx([0.0, 0.01, 0.02])
    assert table["frame"].to_list() == [0, 1, 2]
    assert quality.select("flaw", "start_ns", "end_ns", "count").rows() == [
        ("duplicate frame", 20_000_000, 20_000_001, 1)
    ]


def test_late_samples():
    """Late samples are sorted back, and the flaw is noted."""
    t = at_60hz(1)
    x = 0.2 * t
    shuffled = np.arange(60)
    shuffled[[20, 21, 22]] = [22, 20, 21]
    bodies = {"ball": np.stack((x, 0 * x), axis=1), (HOME, 0): np.stack((x, 0 * x + 0.2, 0 * x), axis=1)}
    straight, _ = run(make_log(t, bodies))
    mixed, quality = run(make_log(t[shuffled], {key: path[shuffled] for key, path in bodies.items()}))
    assert_frame_equal(mixed, straight)
    assert quality.select("flaw", "start_ns", "end_ns", "count").rows() == [
        ("reordered frame", ns(t[20]), ns(t[21]) + 1, 2)
    ]


def test_clock_jump_back():
    """Frames of a clock that jumps back are left out until it catches up."""
    t = np.concatenate((at_60hz(10), at_60hz(12)[240:]))  # back from 10 s to 4 s, then on to 12 s
    table, quality = run(make_log(t, {"ball": still(len(t))}))
    assert table["t_ns"].to_list() == ns(at_60hz(12)).tolist()
    assert quality.select("flaw", "start_ns", "end_ns", "count").rows() == [
        ("clock jump back", 4_000_000_000, ns(at_60hz(10)[-1]) + 1, 360)
    ]


@pytest.mark.parametrize("at", [0, 30])
def test_wild_time(at):
    """One wild time does not cost the rest of the match."""
    t = at_60hz(5)
    t[at] = 86_400
    table, quality = run(make_log(t, {"ball": still(len(t))}))
    assert table.height == 299
    assert quality.select("flaw", "count").rows() == [("clock leap ahead", 1)]


@given(
    st.lists(st.integers(0, 3_000_000_000), min_size=1, max_size=60),
    st.sampled_from([0, 1_000_000, 500_000_000]),
)
def test_frames_accounted_for(times, reorder_ns):
    """Every frame is kept or counted in a flaw."""
    t = np.array(times, dtype=np.int64)
    kept, flaws = order_samples(t, reorder_ns)
    assert len(kept) >= 1
    assert (np.diff(t[kept]) > 0).all()
    assert len(kept) + sum(f.count for f in flaws if f.flaw != "reordered frame") == len(t)


# ---- jumps


@pytest.mark.parametrize("key", ["ball", (HOME, 3)])
def test_outlier(key):
    """An outlier is suspect, and its neighbours' velocities are as if it were not there."""
    t = at_60hz(2)
    path = np.stack((0.3 * t, 0.1 * t, 0 * t), axis=1)
    path[60, :2] += 0.6
    gone = path.copy()
    gone[60] = np.nan
    table, quality = run(make_log(t, {key: path}))
    without, _ = run(make_log(t, {key: gone}))
    assert table.filter("suspect")["frame"].to_list() == [60]
    outlier = table.row(60, named=True)
    assert outlier["x"] == pytest.approx(0.9)  # kept as logged
    assert (outlier["vx"], outlier["vy"], outlier["omega"]) == (None, None, None)
    assert_frame_equal(table.filter(~pl.col("suspect")), without)
    assert quality.filter(pl.col("flaw").is_in(["ball jump", "robot jump"])).select("start_ns", "count", "robot").rows() == [
        (1_000_000_000, 1, None if key == "ball" else 3)
    ]


def test_ball_put_elsewhere():
    """A ball that keeps to its new place was put there: the segment is cut, no sample is suspect."""
    t = at_60hz(2)
    x = np.where(t < 1, -0.5 + 0.1 * t, 0.5)
    table, quality = run(make_log(t, {"ball": np.stack((x, 0 * x), axis=1), (HOME, 0): still(120)}))
    assert not table["suspect"].any()
    for body in (of(table), of(table, "home", 0)):
        assert body["segment"].to_list() == [0] * 60 + [1] * 60
    assert np.allclose(of(table)["vx"], np.where(t < 1, 0.1, 0), atol=1e-5)
    assert quality.select("flaw", "start_ns", "count").rows() == [("ball jump", 1_000_000_000, 1)]
    assert "put elsewhere" in quality["note"].item()


def test_robot_put_elsewhere():
    """A robot that was put elsewhere does not cut the segment."""
    t = at_60hz(2)
    x = np.where(t < 1, -0.5, 0.5)
    table, _ = run(make_log(t, {(AWAY, 2): np.stack((x, 0 * x, 0 * x), axis=1), "ball": still(120)}))
    robot = of(table, "away", 2)
    assert robot["segment"].to_list() == [0] * 120
    assert not robot["suspect"].any()
    assert np.abs(robot["vx"]).max() == 0.0


@pytest.mark.parametrize(("t", "elsewhere", "segments"), [
    (at_60hz(2), (1.0, 1.2), [0] * 120),  # a visit too short to be accepted
    (at_60hz(1), (0.0, 0.01), [0] * 60),  # the first sample
    (np.concatenate((at_60hz(1), 2 + at_60hz(1))), (2.0, 2.01), [0] * 60 + [1] * 60),  # the first after a gap
])
def test_suspects(t, elsewhere, segments):
    """Samples elsewhere are suspect, and those after them are not; no segment is cut."""
    away = (t >= elsewhere[0]) & (t < elsewhere[1])
    x = np.where(away, 0.6, -0.4)
    table, quality = run(make_log(t, {"ball": np.stack((x, 0 * x), axis=1)}))
    assert table["suspect"].to_list() == away.tolist()
    assert table["segment"].to_list() == segments
    assert quality.filter(flaw="ball jump")["count"].to_list() == [away.sum()]


def test_near_segment_before():
    """A first sample that was near in the segment before is not a wrong one."""
    t = at_60hz(2)
    x = np.where(t < 1.02, -0.4, 0.4)  # put elsewhere two samples after the fault
    bodies = {(HOME, 0): np.stack((x, 0 * x, 0 * x), axis=1), "ball": still(120)}
    table, quality = run(make_log(t, bodies, referee=[(0, "play", None), (1, "fault", None)]))
    assert not table["suspect"].any()
    assert quality.select("flaw", "start_ns", "count").rows() == [("robot jump", ns(62 / 60), 1)]


# ---- what is not there


def test_lost_ball():
    """A lost ball has no rows and is flagged."""
    t = at_60hz(3)
    ball = still(180)
    ball[60:120] = np.nan
    ball[150] = np.nan  # one frame is not worth a word
    table, quality = run(make_log(t, {"ball": ball, (HOME, 0): still(180)}))
    assert of(table).height == 119
    assert quality.select("flaw", "start_ns", "end_ns", "team", "count").rows() == [
        ("ball lost", 1_000_000_000, 2_000_000_000, "ball", 60)
    ]


def test_not_a_number():
    """A place that is not a number is left out and flagged."""
    t = at_60hz(1)
    robot, ball = still(60), still(60)
    robot[7, 1], ball[9, 0] = np.nan, np.inf
    table, quality = run(make_log(t, {"ball": ball, (AWAY, 1): robot}))
    assert of(table).height == of(table, "away").height == 59
    assert quality.select("flaw", "start_ns", "team", "count").rows() == [
        ("not a number", 150_000_000, "ball", 1), ("not a number", ns(7 / 60), None, 1)
    ]


def test_robot_twice():
    """A robot twice in a frame counts once."""
    log = make_log([0, 0.02], {(HOME, 1): still(2, -0.7), (HOME, 2): still(2, 0.1)})
    twice = log.frames.robots.copy()
    twice["id"][3] = 1
    frames = Frames(log.frames.number, log.frames.t_ns, log.frames.ball, log.frames.offsets, twice)
    table, quality = run(MatchLog(log.info, frames))
    assert table.select("frame", "robot", "x").rows() == [(0, 1, pytest.approx(-0.7)), (1, 1, pytest.approx(-0.7)), (0, 2, pytest.approx(0.1))]
    assert quality.select("flaw", "count").rows() == [("duplicate frame", 1)]


@pytest.mark.parametrize(("field", "value"), [("team", 2), ("id", 40_000)])
def test_impossible_robot(field, value):
    """A robot of no possible team or number is refused."""
    log = make_log([0.0], {(HOME, 1): still(1)})
    log.frames.robots[field] = value
    with pytest.raises(DamagedLog, match="made-by-hand"):
        run(log)


def test_no_frames_no_rows():
    table, quality = run(make_log([], {}))
    assert table.is_empty()
    assert quality.is_empty()


def test_swapped_ids():
    """Two robots that exchange their ids for a moment are flagged as jumps, and are not taken for fast."""
    table = clip(0.0, 20.0)
    during = pl.col("t").is_between(8.0, 8.2) & (pl.col("team") == "blue")
    other = pl.when(during & pl.col("player").is_in([0, 1])).then(1 - pl.col("player")).otherwise(pl.col("player"))
    table.with_columns(player=other).write_parquet(file := io.BytesIO())
    moved, quality = trajectories(read(file.getvalue(), "swapped.parquet"), TrajectorySettings())
    jumps = quality.filter(flaw="robot jump").sort("robot")
    assert jumps.select("robot", "start_ns").rows() == [(0, 8_000_000_000), (1, 8_000_000_000)]
    robots = moved.filter(pl.col("team").is_not_null())
    assert float(robots.select((pl.col("vx") ** 2 + pl.col("vy") ** 2).sqrt().max()).item()) < 2.0
