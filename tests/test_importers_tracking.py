"""Tracking tables: hand-written ones in several forms with known values."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.recordings import RSIM, recording, same_frames
from support.tracking import FRAME, HEADER, course, flaws, parquet, read, robots

from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap, load_map

MAPS = Path(__file__).parents[1] / "data" / "samples" / "maps"

# --- forms --------------------------------------------------------------------------------------


def test_plain_form() -> None:
    """The plain form is read as it is, and what is guessed is reported."""
    match = read(f"{HEADER}\n{FRAME}1,10.025,ball,,0.5,-0.25,\n1,10.025,greens,1,0.6,0.3,0\n")
    assert (match.info.home, match.info.away) == ("greens", "reds")
    assert match.frames.number.tolist() == [0, 1]
    assert match.frames.t_ns.tolist() == [0, 25_000_000]
    assert match.frames.counts().tolist() == [3, 1]
    assert robots(match)[0] == (0, 1, 0.6, 0.3, -3.0)
    assert robots(match)[1] == (1, 1, -0.6, 0.1, 1.5)
    assert np.isnan(match.frames.robots["theta"][2])  # not known
    assert np.isnan(match.frames.robots["vx"]).all()
    assert match.frames.ball[["x", "y"]].tolist() == [(0.5, -0.25), (0.5, -0.25)]
    assert match.info.pitch.kind is Kind.VSSS
    assert match.info.settings["guessed"] == {
        "home": {"team": "greens", "from": "alphabet"},
        "pitch": {"kind": "vsss", "length": 1.5, "width": 1.3, "goal_width": 0.4, "goal_depth": 0.1},
    }


def test_shipped_map() -> None:
    """The shipped map reads centimetres from the corner, y down, degrees clockwise."""
    mapping = load_map((MAPS / "centimetres.toml").read_text(encoding="utf-8"))
    match = read(
        "Frame;ms;side;id;px;py;angle\n"
        "7;1000;Ball;;75;65;\n"
        "7;1000;blue;3;0;0;90\n"
        "7;1000;yellow;4;150;130;-45\n"
        "8;1016;Ball;;100;35;\n",
        mapping,
    )
    assert (match.info.home, match.info.away) == ("yellow", "blue")
    assert match.frames.t_ns.tolist() == [0, 16_000_000]
    assert match.frames.ball["x"].tolist() == [0.0, 0.25]
    assert match.frames.ball["y"].tolist() == pytest.approx([0.0, 0.3])
    # the upper left corner; 90 degrees clockwise is down. Then the lower right one.
    assert robots(match) == [
        (0, 4, 0.75, -0.65, round(np.pi / 4, 5)), (1, 3, -0.75, 0.65, round(-np.pi / 2, 5)),
    ]
    assert [(p.home_attacks, p.inferred) for p in match.info.periods] == [(1, False)]
    assert match.info.settings["map"] == mapping.settings()
    assert match.info.settings["guessed"] == {}


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        # the file says x 0.5, y -0.25, heading 1, velocity (2, 3), turning at 4
        ({}, (0.5, -0.25, 1.0, 2.0, 3.0, 4.0)),
        ({"y": "down", "heading": "cw"}, (0.5, 0.25, -1.0, 2.0, -3.0, -4.0)),
        ({"x": "left", "y": "down"}, (-0.5, 0.25, 1.0 - np.pi, -2.0, -3.0, 4.0)),  # half a turn
        ({"heading": "cw"}, (0.5, -0.25, -1.0, 2.0, 3.0, -4.0)),
    ],
)
def test_axes_are_turned(axes: dict[str, str], expected: tuple[float, ...]) -> None:
    """The axes that a map names are turned into ours."""
    mapping = TrackingMap.model_validate({"axes": axes})
    match = read(
        "frame,t,team,player,x,y,heading,vx,vy,omega\n0,0,a,1,0.5,-0.25,1,2,3,4\n0,0,b,1,-0.6,0,,,,\n", mapping
    )
    row = match.frames.robots[0]
    assert [float(row[name]) for name in ("x", "y", "theta", "vx", "vy", "omega")] == pytest.approx(expected)


@pytest.mark.parametrize(("unit", "factor"), [("s", 1e9), ("ms", 1e6), ("us", 1e3), ("ns", 1.0)])
def test_nanoseconds(unit: str, factor: float) -> None:
    """Times of day keep their nanoseconds in every unit."""
    start = 1_763_000_000_123_456_789
    step = max(int(factor // 100), 7)
    exact = [(start + i * step) if unit == "ns" else i * step / factor for i in range(3)]
    rows = "".join(f"{i},{t},a,1,0.7,0\n{i},{t},b,1,-0.7,0\n" for i, t in enumerate(exact))
    match = read(f"frame,t,team,player,x,y\n{rows}", TrackingMap.model_validate({"units": {"time": unit}}))
    assert match.frames.t_ns.tolist() == [0, step, 2 * step]


@settings(max_examples=20)
@given(st.lists(st.floats(1e-4, 5), min_size=1, max_size=30), st.floats(-1e6, 1e6))
def test_irregular_sampling_is_kept(steps: list[float], start: float) -> None:
    times = np.concatenate(([start], start + np.cumsum(steps)))
    rows = "".join(f"{i},{t!r},a,1,0.7,0\n{i},{t!r},b,1,-0.7,0\n" for i, t in enumerate(times.tolist()))
    match = read(f"frame,t,team,player,x,y\n{rows}")
    assert np.abs(match.frames.t_ns / 1e9 - (times - start)).max() < 1e-6


def test_no_frame_numbers() -> None:
    """Without frame numbers the times are counted."""
    match = read("t,team,player,x,y\n5,a,1,0.7,0\n5,b,1,-0.7,0\n6,a,1,0.7,0\n6,b,1,-0.7,0\n")
    assert match.frames.number.tolist() == [0, 1]
    assert match.frames.counts().tolist() == [2, 2]


def test_names_of_players() -> None:
    """Names of players are numbered, and the numbers are reported."""
    match = read(
        "frame,t,team,player,x,y\n0,0,a,zoe,0.1,0\n0,0,a,ann,0.7,0\n0,0,b,7,-0.2,0\n0,0,b,30000,-0.6,0\n"
    )
    assert [(row[0], row[1], row[2]) for row in robots(match)] == [
        (0, 0, 0.7), (0, 1, 0.1), (1, 7, -0.2), (1, 30000, -0.6)
    ]
    guessed = match.info.settings["guessed"]
    assert isinstance(guessed, dict)
    assert guessed["players"] == {"a": {"ann": 0, "zoe": 1}}


# --- frames that are repeated, out of order, or by body -------------------------------------------


def test_duplicated_and_reordered_frames() -> None:
    """Duplicated and reordered frames are kept as recorded."""
    table = pl.read_csv(f"{HEADER}\n{FRAME}".encode())
    later = [table.with_columns(frame=pl.lit(i, pl.Int64), t=pl.lit(10.0 + i / 10)) for i in range(4)]
    match = read(parquet(pl.concat([later[0], later[2], later[2], later[1], later[3], later[0]])))
    assert match.frames.number.tolist() == [0, 2, 2, 1, 3, 0]
    assert (match.frames.t_ns // 100_000_000).tolist() == [0, 2, 2, 1, 3, 0]
    assert match.frames.counts().tolist() == [3] * 6


def test_falling_order_of_time() -> None:
    """A table in falling order of time is reversed, and a flaw says so; one sorted by body needs none."""
    table = pl.read_parquet(recording(RSIM)).filter(pl.col("frame") < 300)
    rising, falling, by_body = (
        read(parquet(each)) for each in (table, table.reverse(), table.sort("team", "player", "frame")))
    for other in (falling, by_body):
        assert same_frames(other.frames, rising.frames)
        assert other.referee.equals(rising.referee)
    assert flaws(rising) == []
    assert flaws(falling) == [("reordered frame", 300, None, None)]
    row = falling.quality.row(0, named=True)
    assert (row["start_ns"], row["end_ns"]) == (0, int(rising.frames.t_ns[-1]) + 1)


def test_almost_falling() -> None:
    """A table whose times fall except for one frame is kept as recorded."""
    lines = [f"{i},{i},{team},1,{x},0\n" for i in (3, 2, 0, 1) for team, x in (("a", 0.7), ("b", -0.7))]
    match = read("frame,t,team,player,x,y\n" + "".join(lines))
    assert match.frames.number.tolist() == [3, 2, 0, 1]
    assert flaws(match) == []


def test_countdown() -> None:
    """A table without frame numbers whose times fall while the score rises has a clock that counts down."""
    lines = [f"{600 - i},{team},1,{x},0,{i // 3},0\n" for i in range(5) for team, x in (("a", 0.7 + i / 100), ("b", -0.7))]
    match = read("t,team,player,x,y,score_home,score_away\n" + "".join(lines), load_map("[teams]\nhome = 'a'"))
    assert np.round(match.frames.robots["x"][::2], 2).tolist() == pytest.approx([0.7, 0.71, 0.72, 0.73, 0.74])
    assert match.referee.select("score_home").row(-1) == (1,)


@pytest.mark.parametrize(
    ("unit", "step", "frames", "says"),
    [
        ("s", 25, 100, 'interval is 25 s: if times are not in s, say so in a map: [units] time = "ms"'),
        ("ms", 1000, 100, 'interval is 1 s: if times are not in ms, say so in a map: [units] time = "us"'),
        ("ns", 10**9, 100, "interval is 1 s"),
        ("s", 25, 99, None),  # too few to tell
        ("ms", 25, 100, None),
    ],
)
def test_slow_sampling(
    unit: str, step: int, frames: int, says: str | None
) -> None:
    """Samples too far apart for the unit of time are a flaw that names the finer unit."""
    rows = "".join(f"{i},{i * step},a,1,0.7,0\n{i},{i * step},b,1,-0.7,0\n" for i in range(frames))
    match = read(f"frame,t,team,player,x,y\n{rows}", TrackingMap.model_validate({"units": {"time": unit}}))
    assert flaws(match) == ([("slow sampling", frames, None, None)] if says else [])
    if says:
        assert match.quality.filter(flaw="slow sampling")["note"][0].endswith(says)
    assert len(match.frames) == frames


# --- home and the pitch ---------------------------------------------------------------------------


def test_inference_of_home() -> None:
    """The map decides which team is home, else goals in the states, else kick-offs, the ball or the alphabet."""
    def home(*states: tuple[object, ...]) -> object:
        match = read(course(*states))
        guessed = match.info.settings["guessed"]
        assert isinstance(guessed, dict)
        assert guessed["home"]["team"] == match.info.home
        return match.info.home, guessed["home"]["from"]

    assert home(("play", 0, 0), ("goal_b", 1, 0)) == ("blue", "goals in the states")
    assert home(("play", 0, 0), ("goal_a", 0, 1)) == ("blue", "goals in the states")
    assert home(("play", 0, 0), ("stop", 1, 0), ("kickoff_a", 1, 0)) == ("blue", "kick-offs")
    assert home(("play", 0, 0), ("stop", 0, 1), ("kickoff_a", 0, 1)) == ("amber", "kick-offs")
    # the kick-off after half-time says nothing of a goal
    assert home(("play", 0, 0), ("stop", 1, 0), ("half+kickoff_a", 1, 0)) == ("amber", "alphabet")
    assert home(("play", 0, 0), ("play", 0, 0)) == ("amber", "alphabet")
    in_goal = course(("play", 0, 0), ("play", 1, 0)).replace("ball,,0.3", "ball,,0.76")
    assert read(in_goal).info.home == "blue"  # amber stands at +x, where the ball went in
    assert read(in_goal, load_map("[teams]\nhome = 'amber'\n")).info.home == "amber"


@pytest.mark.parametrize(
    ("scale", "kind", "length"),
    [
        (1.0, Kind.VSSS, 1.5), (1.45, Kind.VSSS, 2.2), (6.0, Kind.SSL, 9.0), (8.0, Kind.SSL, 12.0),
        (70.0, Kind.SIM2D, 105.0),
    ],
)
def test_inference_of_the_pitch(scale: float, kind: Kind, length: float) -> None:
    """The pitch is inferred from how far along it positions reach."""
    table = pl.read_parquet(recording(RSIM)).filter(pl.col("frame") % 50 == 0)
    match = read(parquet(table.with_columns(pl.col("x", "y") * scale)))
    assert (match.info.pitch.kind, match.info.pitch.length) == (kind, length)
