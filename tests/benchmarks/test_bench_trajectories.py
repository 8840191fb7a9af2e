"""One match of 8 minutes at 60 Hz, 3 a side: the whole stage, and its velocities by other means."""

import numpy as np
import polars as pl
import pytest
from scipy.signal import savgol_filter
from support.logs import make_log

from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.stages.trajectories.kinematics import slopes

FRAMES, ROBOTS = 28_800, 6
ROWS = FRAMES * (ROBOTS + 1)
HALF_NS = 50_000_000


@pytest.fixture(scope="module")
def log():
    """Bodies on smooth curves; a goal and a kick-off every 20 s; the teams change sides."""
    rng = np.random.default_rng(0)
    t = np.arange(FRAMES)[:, None] / 60
    rate, phase = rng.uniform(0.2, 1.5, (2, ROBOTS + 1)), rng.uniform(0, 6, (2, ROBOTS + 1))
    paths = np.stack((0.6 * np.sin(rate[0] * t + phase[0]), 0.5 * np.sin(rate[1] * t + phase[1]),
                      np.angle(np.exp(1j * (2 * t + phase[0])))), axis=2)
    bodies = {"ball": paths[:, -1], **{(i // 3, i % 3): paths[:, i] for i in range(ROBOTS)}}
    events = [(second, event, None) for second in range(20, 480, 20) for event in ("goal", "kick-off")]
    return make_log(t[:, 0], bodies, referee=events, periods=[(0, 240, 1), (240, 480, -1)])


@pytest.fixture(scope="module")
def table(log):
    return trajectories(log, TrajectorySettings())[0].with_columns(robot=pl.col("robot").fill_null(-1))


@pytest.mark.benchmark(group="trajectories of one match, the whole stage")
def test_ours(timed, log):
    table, _ = timed(ROWS, "rows", trajectories, (log, TrajectorySettings()), rounds=10, warmup_rounds=1)
    assert table.height == ROWS


@pytest.mark.benchmark(group="estimate velocities from positions")
def test_ours_kernel(timed, table):
    part = table.select(pl.struct("team", "robot", "segment").rle_id().cast(pl.Int64)).to_series().to_numpy()
    values = table.select("x", "y").to_numpy().T.astype(np.float64)
    work = part, table["t_ns"].to_numpy(), np.ascontiguousarray(values), HALF_NS, 3
    vx, vy = timed(ROWS, "rows", slopes, work, rounds=20, warmup_rounds=1)
    assert np.array_equal(vx, table["vx"])
    assert np.array_equal(vy, table["vy"])


def rolling(table):
    """The same estimate in polars: covariance over variance in a rolling window."""
    t = (pl.col("t_ns") - pl.col("t_ns").first()).cast(pl.Float64) / 1e9
    return table.rolling(
        "t_ns", period="100000000i", offset="-50000000i", closed="both", group_by=["team", "robot", "segment"]
    ).agg(*((pl.cov(t, v, ddof=0) / t.var(ddof=0)).alias(v) for v in ("x", "y")))


@pytest.mark.benchmark(group="estimate velocities from positions")
def test_polars_rolling(timed, table):
    found = timed(ROWS, "rows", rolling, (table,), rounds=3)
    assert np.allclose(found["x"], table["vx"], atol=1e-3)


def savgol(table):
    """Savitzky-Golay of scipy, which takes the times for regular and knows no segments."""
    return [
        savgol_filter(body.select("x", "y").to_numpy(), 7, 1, deriv=1, delta=1 / 60, axis=0)
        for body in table.partition_by("team", "robot", maintain_order=True)
    ]


@pytest.mark.benchmark(group="estimate velocities from positions")
def test_scipy_savgol_filter(timed, table):
    found = np.concatenate(timed(ROWS, "rows", savgol, (table,), rounds=10))
    assert np.median(np.abs(found[:, 0] - table["vx"].to_numpy())) < 1e-3


def fit_each(table):
    """numpy.polyfit a window, for the ball's first minute."""
    ball = table.head(3_600)
    t, places = ball["t_ns"].to_numpy() / 1e9, ball.select("x", "y").to_numpy().astype(np.float64)
    return [np.polyfit(t[i - 3 : i + 4] - t[i], places[i - 3 : i + 4], 1)[0] for i in range(3, len(t) - 3)]


@pytest.mark.benchmark(group="estimate velocities from positions")
def test_numpy_polyfit(timed, table):
    found = np.array(timed(3_594, "rows", fit_each, (table,), rounds=3))
    assert np.median(np.abs(found[:, 0] - table["vx"].to_numpy()[3:3_597])) < 1e-4
