"""Trajectories: velocities, segments, roles, properties of any log; the order of samples, jumps, and what is not there."""

import io
import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from conftest import SAMPLE, clip
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from polars.testing import assert_frame_equal
from support.logs import at_60hz, make_log, ns, of, run, still
from support.recordings import RCSS, SSL, read, recording

from pitchlore.pipeline.base.errors import DamagedLog
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.matches.frame import Frames, MatchLog
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.stages.trajectories.timeline import order_samples
from pitchlore.schemas import AWAY, HOME

# ---- velocities


def test_constant_velocity():
    """A constant velocity is exact even with irregular samples."""
    t = np.cumsum(np.random.default_rng(1).uniform(0.002, 0.03, 200))
    t -= t[0]
    table, quality = run(make_log(t, {"ball": np.stack((0.3 * t - 0.4, 0.1 - 0.07 * t), axis=1)}))
    assert np.allclose(table["vx"], 0.3, atol=2e-5)
    assert np.allclose(table["vy"], -0.07, atol=2e-5)
    assert quality.is_empty()


def test_parabola():
    """A parabola has its derivative at the centre and lags a quarter window at the edge."""
    t = np.arange(41) * 0.025  # the window of 0.1 s holds 5 samples
    table, _ = run(make_log(t, {"ball": np.stack((0.5 * t**2, 0 * t), axis=1)}))
    vx = table["vx"].to_numpy()
    assert np.allclose(vx[2:-2], t[2:-2], atol=1e-5)  # acceleration 1 m/s2
    # at an end three samples are left, whose middle is 0.025 s inwards
    assert vx[0] == pytest.approx(0.025, abs=1e-5)
    assert vx[-1] == pytest.approx(t[-1] - 0.025, abs=1e-5)


def test_slow_sampling():
    """A velocity is that of three samples even if sampling is slow."""
    t = np.arange(10) * 0.1
    table, _ = run(make_log(t, {"ball": np.stack((0.5 * t**2, 0 * t), axis=1)}, kind=Kind.SIM2D))
    assert np.allclose(table["vx"].to_numpy()[1:-1], t[1:-1], atol=1e-5)
    assert table["vx"][0] == pytest.approx(0.1, abs=1e-5)  # three at the edge, too: of their middle


def test_rounded_times():
    """Times rounded to nanoseconds do not change the window."""
    k = np.arange(60)
    t_ns = ns(k / 60) + k % 2  # three steps are 50 ms, the window's half, and a nanosecond more or less
    t = k / 60 - 0.5
    vx = run(make_log(None, {"ball": np.stack((t**3, 0 * t), axis=1)}, t_ns=t_ns))[0]["vx"].to_numpy()
    # the line through 7 samples of a cubic h apart is 7 h^2 too steep, the one through 5 is 3.4 h^2
    assert np.allclose((vx - 3 * t**2)[3:-3], 7 / 60**2, atol=1e-5)


def test_noise_gain():
    """Noise in places shows in velocities with the gain that is documented."""
    t = at_60hz(200)
    x = np.random.default_rng(2).normal(0, 0.001, len(t))
    table, _ = run(make_log(t, {"ball": np.stack((x, x), axis=1)}))
    m, h = 7, 1 / 60
    expected = 0.001 / h * math.sqrt(12 / (m * (m**2 - 1)))
    assert table["vx"].std() == pytest.approx(expected, rel=0.05)


def test_turning_through_pi():
    """A turn through pi has a constant rate."""
    t = at_60hz(4)
    theta = np.angle(np.exp(1j * (3.0 * t)))  # wraps twice
    table, _ = run(make_log(t, {(HOME, 4): np.stack((0 * t, 0 * t, theta), axis=1)}))
    assert np.allclose(table["omega"], 3.0, atol=1e-4)
    assert table["theta"].is_between(-math.pi, math.pi + 1e-6).all()


def test_unknown_headings():
    """Unknown headings are null and do not stop velocities."""
    t = at_60hz(1)
    theta = np.where((t > 0.3) & (t < 0.4), np.nan, 0.5 * t)
    table, _ = run(make_log(t, {(HOME, 0): np.stack((0.2 * t, 0 * t, theta), axis=1)}))
    blind = table.filter(pl.col("theta").is_null())
    assert blind["omega"].null_count() == blind.height == 5
    assert np.allclose(table["vx"], 0.2, atol=1e-5)
    assert np.allclose(table["omega"].drop_nulls(), 0.5, atol=1e-4)


@pytest.mark.parametrize(("missing", "spanned"), [(4, True), (20, False)])
def test_holes(missing, spanned):
    """A velocity spans a short hole and no long one."""
    t = at_60hz(2)
    path = np.stack((np.where(t < 1, 0.0, 0.5 * (t - 1)), 0 * t, 0 * t), axis=1)  # stands, then drives
    path[60 : 60 + missing] = np.nan
    robot = of(run(make_log(t, {(HOME, 1): path, "ball": still(len(t))}))[0], "home", 1)
    assert robot.height == len(t) - missing
    before, after = (robot.filter(pl.col("frame") == frame)["vx"].item() for frame in (59, 60 + missing))
    if spanned:
        assert before > 0.05
        assert after < 0.45
    else:
        assert before == 0.0
        assert after == pytest.approx(0.5, abs=1e-4)


def test_one_sample():
    """A sample alone has no velocity."""
    table, _ = run(make_log([0.0, 1.0, 2.0], {"ball": still(3)}))
    assert table["vx"].null_count() == 3
    assert table["segment"].to_list() == [0, 1, 2]


# ---- segments


@pytest.mark.parametrize(("events", "periods", "expected"), [
    # a goal ends its segment, and play stops until the kick-off
    ([(0, "kick-off", "home"), (3, "goal", "home"), (5, "kick-off", "away"), (7, "stop", None), (8, "play", None), (9, "end", None)],
     (), [0, 0, 0, None, None, 1, 1, None, 2, None]),
    # one with its restart at once begins the next segment; the restart may be noted first
    ([(1, "kick-off", "away"), (1, "goal", "home")], (), [0, 1]),
    # play is on before a first goal, and not before a first kick-off
    ([(1, "kick-off", "home")], (), [None, 0]), ([(1, "goal", "home")], (), [0, None]),
    # a fault cuts a segment, and play that goes on does not
    ([(0, "kick-off", None), (1, "play", None), (2, "fault", "home")], (), [0, 0, 1]),
    # so does a change of period, even if the referee says nothing
    ([], [(0, 1, 1), (1, 2, 1)], [0, 1]),
])
def test_segments(events, periods, expected):
    """Goals, stops, faults and periods end segments, each second as listed."""
    t = np.arange(10 * len(expected)) * 0.1
    table, _ = run(make_log(t, {"ball": still(len(t))}, kind=Kind.SIM2D, referee=events, periods=periods))
    assert table["segment"].to_list() == [segment for segment in expected for _ in range(10)]


def test_velocity_at_restart():
    """Velocities do not reach over a restart."""
    t = at_60hz(2)
    x = np.where(t < 1, 0.4 * t, 0.0)  # put back at 1 s
    events = [(1, "goal", "home"), (1, "kick-off", "away")]
    table, quality = run(make_log(t, {"ball": np.stack((x, 0 * x), axis=1)}, referee=events))
    assert np.allclose(table["vx"][:60], 0.4, atol=1e-5)
    assert np.allclose(table["vx"][60:], 0.0, atol=1e-7)
    assert quality.is_empty()


def test_gap():
    """A gap cuts a segment and is flagged."""
    t = np.concatenate((at_60hz(1), at_60hz(1) + 3))
    table, quality = run(make_log(t, {"ball": still(120)}))
    assert table["segment"].to_list() == [0] * 60 + [1] * 60
    assert quality.select("flaw", "start_ns", "end_ns").rows() == [("gap", ns(59 / 60), ns(3))]


# ---- turning, roles


def test_second_half():
    """A second half played the other way is turned."""
    t = at_60hz(2)
    bodies = {
        "ball": still(120, 0.3, 0.2), (HOME, 1): still(120, 0.1, -0.4, 0.5), (AWAY, 1): still(120, 0.6, 0.0, -math.pi)
    }
    events, periods = [(1, "half", None), (1, "kick-off", "away")], [(0, 1, 1), (1, 2, -1)]
    table, _ = run(make_log(t, bodies, referee=events, periods=periods))
    first, second = table.filter(pl.col("frame") == 10), table.filter(pl.col("frame") == 70)
    assert first["turned"].to_list() == [False] * 3
    assert second["turned"].to_list() == [True] * 3
    assert second["x"].to_list() == pytest.approx([-0.3, -0.1, -0.6])
    assert second["y"].to_list() == pytest.approx([-0.2, 0.4, 0.0])
    assert first["theta"].to_list() == [None, pytest.approx(0.5), pytest.approx(math.pi)]
    assert second["theta"].to_list() == [None, pytest.approx(0.5 - math.pi), pytest.approx(0.0, abs=1e-6)]
    assert table["segment"].unique().to_list() == [0, 1]


@pytest.mark.parametrize(
    ("robots", "midfield", "strikers"), [(1, 0, 0), (2, 0, 1), (3, 1, 1), (5, 2, 2), (11, 5, 5)]
)
def test_roles(robots, midfield, strikers):
    """Roles go by the distance to the own goal."""
    expected = ["goalkeeper"] + ["midfield"] * midfield + ["striker"] * strikers
    bodies = {(HOME, i): still(3, -0.7 + 0.1 * i) for i in range(robots)}
    bodies |= {(AWAY, i): still(3, 0.7 - 0.1 * i) for i in range(robots)}
    table, _ = run(make_log([0, 0.1, 0.2], bodies))
    for team in ("home", "away"):
        assert of(table.filter(pl.col("frame") == 1), team)["role"].to_list() == expected


def test_role_ties():
    """A tie for a role goes to the lower number, and the absent do not count."""
    bodies = {(HOME, 9): still(2, -0.2, 0.3), (HOME, 4): still(2, -0.2, -0.3), (HOME, 5): np.array([[-0.7, 0, 0], [np.nan] * 3])}
    table, _ = run(make_log([0, 0.02], bodies))
    roles = {(f, r): role for f, r, role in table.select("frame", "robot", "role").rows()}
    assert roles == {
        (0, 5): "goalkeeper", (0, 4): "midfield", (0, 9): "striker", (1, 4): "goalkeeper", (1, 9): "striker"
    }


# ---- properties


@st.composite
def logs(draw):
    frames = draw(st.integers(2, 40))
    steps = draw(hnp.arrays(np.int64, frames, elements=st.integers(1_000_000, 700_000_000)))
    place = hnp.arrays(np.float32, (frames, 3), elements=st.floats(-1, 1, width=32) | st.just(float("nan")))
    keys = draw(st.lists(st.tuples(st.integers(0, 1), st.integers(0, 5)), max_size=4, unique=True))
    bodies = {key: draw(place) for key in ["ball", *keys]}
    t_ns = np.cumsum(steps) - steps[0]
    times = st.integers(0, int(t_ns[-1])).map(lambda t: t / 1e9)
    names = st.sampled_from(["kick-off", "fault", "goal", "stop", "play", "half"])
    events = sorted(draw(st.lists(st.tuples(times, names, st.none()), max_size=5)), key=lambda e: e[0])
    return t_ns, bodies, events


@pytest.mark.slow
@settings(max_examples=60)
@given(logs())
def test_turned_log(log):
    """A whole log played the other way has the same trajectories, marked as turned."""
    t_ns, bodies, events = log
    turned = {
        key: np.stack((-path[:, 0], -path[:, 1], np.angle(np.exp(1j * (path[:, 2] + np.pi)))), axis=1)
        for key, path in bodies.items()
    }
    end = t_ns[-1] / 1e9 + 1
    one, flaws = run(make_log(None, bodies, t_ns=t_ns, referee=events, periods=[(0, end, 1)]))
    other, same_flaws = run(make_log(None, turned, t_ns=t_ns, referee=events, periods=[(0, end, -1)]))
    assert_frame_equal(flaws, same_flaws)
    exact = ("turned", "theta", "omega")
    assert_frame_equal(one.drop(exact), other.drop(exact))
    assert other["turned"].all()
    assert_frame_equal(one.select("omega"), other.select("omega"), abs_tol=1e-3)
    delta = (one["theta"] - other["theta"]).drop_nulls().to_numpy()
    assert np.allclose(np.angle(np.exp(1j * delta)), 0, atol=1e-5)


@pytest.mark.slow
@settings(max_examples=60)
@given(logs())
def test_rows_of_bodies(log):
    """Every body with a place has a row in its frame, and no other has one."""
    t_ns, bodies, events = log
    table, _ = run(make_log(None, bodies, t_ns=t_ns, referee=events))
    assert table.height == sum(int(np.isfinite(path[:, :2]).all(axis=1).sum()) for path in bodies.values())
    assert table.select("team", "robot", "frame").is_unique().all()


@pytest.mark.slow
@settings(max_examples=40)
@given(logs(), st.integers(0, 2**32 - 1))
def test_other_segments(log, seed):
    """Velocities do not depend on other segments."""
    t_ns, bodies, _ = log
    half = len(t_ns) // 2
    event = [(t_ns[half] / 1e9, "fault", None)]
    noise = np.random.default_rng(seed)
    other = {key: path.copy() for key, path in bodies.items()}
    for path in other.values():
        path[half:, :2] += noise.normal(0, 1, (len(path) - half, 2))
    first = pl.col("t_ns") < int(t_ns[half])
    one, _ = run(make_log(None, bodies, t_ns=t_ns, referee=event))
    two, _ = run(make_log(None, other, t_ns=t_ns, referee=event))
    assert_frame_equal(one.filter(first), two.filter(first))


# ---- recordings


@pytest.fixture(scope="module")
def sample():
    return read(SAMPLE.read_bytes(), SAMPLE.name, match_id="sample")


def test_sample_match(sample):
    """The sample match is clean: no flaw, no suspect sample, no impossible speed."""
    table, quality = run(sample)
    assert table.height == 24_000 * 7
    assert quality.is_empty()
    assert not table["suspect"].any()
    assert table["segment"].null_count() == 0  # play goes on at once
    assert table["segment"].max() + 1 == sample.referee["t_ns"].n_unique()
    speed = (table["vx"] ** 2 + table["vy"] ** 2).sqrt()
    assert speed.null_count() == 0
    assert speed.max() < 1.3  # the simulator's robots drive at 1.2 m/s at most
    goalkeepers = table.filter(pl.col("role") == "goalkeeper").group_by("team").agg(pl.col("x").mean())
    assert dict(goalkeepers.rows())["home"] < -0.3
    assert dict(goalkeepers.rows())["away"] > 0.3


def test_order_of_robots(sample):
    """The order of robots in a frame does not matter."""
    frames = sample.frames
    cut = int(frames.offsets[500])
    short = Frames(frames.number[:500], frames.t_ns[:500], frames.ball[:500], frames.offsets[:501], frames.robots[:cut])
    backwards = replace(short, robots=np.ascontiguousarray(short.robots.reshape(500, 6)[:, ::-1]).reshape(-1))
    assert_frame_equal(run(MatchLog(sample.info, short))[0], run(MatchLog(sample.info, backwards))[0])


def test_real_robots():
    """Flags of real robots are those found by eye: outliers, a ball and a robot moved (docs/decisions/trajectories.md)."""
    log = read(recording(SSL), SSL, match_id="recorded")
    table, quality = run(replace(log, referee=log.referee.clear()))  # all of it as play
    jumps = quality.filter(pl.col("flaw") != "gap").select("flaw", "count", pl.col("start_ns") // 1_000_000)
    assert jumps.rows() == [("ball jump", 9, 72_031), ("ball jump", 1, 258_621), ("robot jump", 1, 184_247)]
    assert quality.filter(pl.col("flaw") == "gap").height == 14
    speed = table.select("team", v=(pl.col("vx") ** 2 + pl.col("vy") ** 2).sqrt()).group_by("team").max()
    fastest = dict(speed.rows())
    assert fastest["ball"] < 6.6  # the rules allow 6.5 m/s
    assert max(fastest["home"], fastest["away"]) < 5


def test_sim2d_goals():
    """A simulated 2D match stops at its goals, and players are put back after them."""
    table, quality = run(read(recording(RCSS), RCSS, match_id="recorded"))
    stops = table.group_by("segment").agg(pl.col("t_ns").max()).drop_nulls("segment").sort("segment")
    assert stops["t_ns"].to_list()[:3] == [21_700_000_000, 56_800_000_000, 92_100_000_000]
    put = quality.filter(pl.col("note").str.starts_with("put elsewhere"))
    assert {21_900_000_000, 57_000_000_000, 92_300_000_000} <= set(put["start_ns"])
    assert not table["suspect"].any()


# ---- samples


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
