"""Tracking tables: hand-written ones in several forms with known values, and damaged ones."""

from __future__ import annotations

import gzip
import io
from pathlib import Path

import numpy as np
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.recordings import RSIM, imported, recording, taken_for

from pipeline.decisions import observe
from pipeline.errors import BadRecording, BadSettings
from pipeline.goals import attribute
from pipeline.grams.count import grams, value
from pipeline.importers import tracking_csv, tracking_parquet
from pipeline.importers.tracking_map import TrackingMap, load_map
from pipeline.matches.frame import MatchLog
from pipeline.pitch import Kind
from pipeline.settings import GramSettings, SituationSettings, TrajectorySettings
from pipeline.situations.recognise import recognise
from pipeline.trajectories.derive import trajectories
from schemas import Decisions, Goals

MAPS = Path(__file__).parents[1] / "data" / "samples" / "maps"
HEADER = "frame,t,team,player,x,y,heading"
FRAME = """0,10.0,ball,,0.5,-0.25,
0,10.0,reds,1,-0.6,0.1,1.5
0,10.0,reds,2,-0.2,0.2,
0,10.0,greens,1,0.6,0.3,-3.0
"""


def read(data: bytes | str, mapping: TrackingMap | None = None) -> MatchLog:
    data = data.encode() if isinstance(data, str) else data
    parquet = tracking_parquet.tells(data[:8])
    source = taken_for(data, "game.csv", "tracking-parquet" if parquet else "tracking-csv")
    return (tracking_parquet if parquet else tracking_csv).read(source, mapping or TrackingMap())


def parquet(table: pl.DataFrame) -> bytes:
    out = io.BytesIO()
    table.write_parquet(out)
    return out.getvalue()


def robots(match: MatchLog) -> list[tuple[float, ...]]:
    columns = ("team", "id", "x", "y", "theta")
    return [tuple(round(float(row[name]), 5) for name in columns) for row in match.frames.robots]


def events(match: MatchLog) -> list[tuple[object, ...]]:
    text = pl.col("event", "team").cast(pl.String)
    return match.referee.select(pl.col("t_ns") // 1_000_000_000, text, "score_home", "score_away").rows()


def flaws(match: MatchLog) -> list[tuple[object, ...]]:
    columns = (pl.col("flaw").cast(pl.String), "count", pl.col("team").cast(pl.String), "robot")
    return [row for row in match.quality.select(*columns).rows() if not str(row[0]).startswith("direction")]


def course(*states: tuple[object, ...], columns: str = "game_state,score_home,score_away") -> str:
    """A CSV with one frame a second: away 'blue' at -x, home 'amber' at +x."""
    lines = [f"frame,t,team,player,x,y,{columns}"]
    for second, state in enumerate(states):
        end = ",".join("" if value is None else str(value) for value in state)
        bodies = ("ball,,0.3,0", "amber,0,0.5,0", "blue,0,-0.5,0")
        lines += [f"{second},{second},{body},{end}" for body in bodies]
    return "\n".join(lines) + "\n"


# --- forms --------------------------------------------------------------------------------------


def test_the_plain_form_is_read_as_it_is() -> None:
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
    mapping = TrackingMap.model_validate({"axes": axes})
    match = read(
        "frame,t,team,player,x,y,heading,vx,vy,omega\n0,0,a,1,0.5,-0.25,1,2,3,4\n0,0,b,1,-0.6,0,,,,\n", mapping
    )
    row = match.frames.robots[0]
    assert [float(row[name]) for name in ("x", "y", "theta", "vx", "vy", "omega")] == pytest.approx(expected)


@pytest.mark.parametrize(("unit", "factor"), [("s", 1e9), ("ms", 1e6), ("us", 1e3), ("ns", 1.0)])
def test_times_of_day_keep_their_nanoseconds(unit: str, factor: float) -> None:
    start = 1_763_000_000_123_456_789
    step = max(int(factor // 100), 7)
    exact = [(start + i * step) if unit == "ns" else i * step / factor for i in range(3)]
    rows = "".join(f"{i},{t},a,1,0.7,0\n{i},{t},b,1,-0.7,0\n" for i, t in enumerate(exact))
    match = read(f"frame,t,team,player,x,y\n{rows}", TrackingMap.model_validate({"units": {"time": unit}}))
    assert match.frames.t_ns.tolist() == [0, step, 2 * step]


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(1e-4, 5), min_size=1, max_size=30), st.floats(-1e6, 1e6))
def test_irregular_sampling_is_kept(steps: list[float], start: float) -> None:
    times = np.concatenate(([start], start + np.cumsum(steps)))
    rows = "".join(f"{i},{t!r},a,1,0.7,0\n{i},{t!r},b,1,-0.7,0\n" for i, t in enumerate(times.tolist()))
    match = read(f"frame,t,team,player,x,y\n{rows}")
    assert np.abs(match.frames.t_ns / 1e9 - (times - start)).max() < 1e-6


def test_parquet_and_csv_of_one_table_are_one_match() -> None:
    table = pl.read_csv(f"{HEADER}\n{FRAME}".encode())
    assert read(parquet(table)).frames.robots.tobytes() == read(f"{HEADER}\n{FRAME}").frames.robots.tobytes()
    packed = gzip.compress(f"{HEADER}\n{FRAME}".encode())
    assert read(packed).frames.robots.tobytes() == read(f"{HEADER}\n{FRAME}").frames.robots.tobytes()


def test_without_frame_numbers_times_are_counted() -> None:
    match = read("t,team,player,x,y\n5,a,1,0.7,0\n5,b,1,-0.7,0\n6,a,1,0.7,0\n6,b,1,-0.7,0\n")
    assert match.frames.number.tolist() == [0, 1]
    assert match.frames.counts().tolist() == [2, 2]


def test_names_of_players_are_numbered_and_told() -> None:
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
    """A table in falling order of time is reversed, and a flaw says so."""
    table = pl.read_parquet(recording(RSIM)).filter(pl.col("frame") < 300)
    rising, falling = read(parquet(table)), read(parquet(table.reverse()))
    for part in ("number", "t_ns", "ball", "offsets", "robots"):
        assert getattr(falling.frames, part).tobytes() == getattr(rising.frames, part).tobytes()
    assert falling.referee.equals(rising.referee)
    assert flaws(rising) == []
    assert flaws(falling) == [("reordered frame", 300, None, None)]
    row = falling.quality.row(0, named=True)
    assert (row["start_ns"], row["end_ns"]) == (0, int(rising.frames.t_ns[-1]) + 1)


def test_almost_falling_order_of_time() -> None:
    """A table whose times fall except for one frame is kept as recorded."""
    lines = [f"{i},{i},{team},1,{x},0\n" for i in (3, 2, 0, 1) for team, x in (("a", 0.7), ("b", -0.7))]
    match = read("frame,t,team,player,x,y\n" + "".join(lines))
    assert match.frames.number.tolist() == [3, 2, 0, 1]
    assert flaws(match) == []


def test_a_clock_that_counts_down_is_refused() -> None:
    lines = [f"{i},{600 - i},{team},1,{x},0\n" for i in range(5) for team, x in (("a", 0.7), ("b", -0.7))]
    with pytest.raises(BadRecording, match=r"times that fall while its frame numbers rise\. If t counts down"):
        read("frame,t,team,player,x,y\n" + "".join(lines))


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
        assert match.quality["note"][0].endswith(says)
    assert len(match.frames) == frames


def test_table_sorted_by_body() -> None:
    """A table sorted by body is the same match as one sorted by time."""
    table = pl.read_parquet(recording(RSIM)).filter(pl.col("frame") < 300)
    by_frame = read(parquet(table))
    by_body = read(parquet(table.sort("team", "player", "frame")))
    assert by_body.frames.robots.tobytes() == by_frame.frames.robots.tobytes()
    assert by_body.frames.ball.tobytes() == by_frame.frames.ball.tobytes()
    assert by_body.referee.equals(by_frame.referee)


# --- home and the pitch ---------------------------------------------------------------------------


def test_inference_of_home() -> None:
    """Goals in the states decide which team is home, else kick-offs, else the ball, else the alphabet."""
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


def test_the_map_names_home_whatever_the_evidence() -> None:
    mapping = load_map("[teams]\nhome = 'amber'\n")
    match = read(course(("play", 0, 0), ("goal_b", 1, 0)), mapping)
    assert (match.info.home, match.info.away) == ("amber", "blue")


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


def test_a_pitch_that_is_given_is_not_guessed() -> None:
    mapping = load_map("[pitch]\nkind = 'ssl'\nlength = 6.05\nwidth = 4.05\n")
    match = read(f"{HEADER}\n{FRAME}", mapping)
    assert (match.info.pitch.kind, match.info.pitch.length, match.info.pitch.width) == (Kind.SSL, 6.05, 4.05)
    assert "pitch" not in match.info.settings["guessed"]  # type: ignore[operator]


# --- referee --------------------------------------------------------------------------------------


def test_events_of_states() -> None:
    """A state is an event on its first frame; a goal of the same frame comes first."""
    match = read(course(
        ("kickoff_a", 0, 0), ("play", 0, 0), ("kickoff_b+goal_a", 1, 0), ("play", 1, 0), ("freeball", 1, 0),
        ("freeball", 1, 0), (None, 1, 0), ("stop", 1, 0), ("play", 1, 0), ("penalty_b", 1, 0),
        ("half+kickoff_b", 1, 0), ("time_over", 1, 0),
    ))
    assert events(match) == [
        (0, "kick-off", "home", 0, 0),
        (2, "goal", "home", 1, 0), (2, "kick-off", "away", 1, 0),
        (4, "fault", None, 1, 0),
        (7, "stop", None, 1, 0),
        (8, "play", None, 1, 0),
        (9, "fault", "away", 1, 0),
        (10, "half", None, 1, 0), (10, "kick-off", "away", 1, 0),
        (11, "end", None, 1, 0),
    ]


def test_the_score_says_what_a_goal_is() -> None:
    """A goal in the states that does not count is a stop; one that is taken back becomes one."""
    match = read(course(
        ("play", 0, 0), ("goal_a", 0, 0), ("play", 2, 0), ("stop", 1, 0), ("kickoff_b", 1, 0)
    ))
    assert events(match) == [
        (0, "play", None, 0, 0),
        (1, "stop", None, 0, 0),
        (2, "goal", "home", 1, 0), (2, "stop", None, 2, 0), (2, "play", None, 2, 0),
        (3, "stop", None, 1, 0),
        (4, "kick-off", "away", 1, 0),
    ]


def test_without_scores_goals_are_those_of_the_states() -> None:
    match = read(course(("kickoff_a",), ("goal_b+kickoff_a",), ("goal_a",), ("kickoff_b",), columns="game_state"))
    assert events(match) == [
        (0, "kick-off", "home", 0, 0), (1, "goal", "away", 0, 1), (1, "kick-off", "home", 0, 1),
        (2, "goal", "home", 1, 1), (3, "kick-off", "away", 1, 1),
    ]


@pytest.mark.parametrize(
    ("after", "team"),
    [
        ((("play",), ("kickoff_a",)), "away"),  # the next kick-off is the conceding team's
        ((("kickoff_b",), ("play",)), "home"),
        ((("goal+kickoff_b",),), "home"),  # on the goal's own frame
    ],
)
def test_goal_attributed_by_the_next_kick_off(
    after: tuple[tuple[object, ...], ...], team: str
) -> None:
    """If a state names no scoring team, the team that does not kick off next has scored."""
    goal = () if "goal" in str(after) else (("goal",),)
    match = read(course(("kickoff",), ("play",), *goal, *after, columns="game_state"))
    score = (1, 0) if team == "home" else (0, 1)
    assert events(match)[1] == (2, "goal", team, *score)
    assert events(match)[-1][3:] == score


@pytest.mark.parametrize(
    "after",
    [
        (), ("play",), ("goal+kickoff", "play"), ("kickoff", "kickoff_a"), ("half", "kickoff_a"),
        ("half+kickoff_a",), ("end", "kickoff_a"), ("goal_b", "kickoff_a"),
    ],
)
def test_goal_of_an_unknown_team(after: tuple[str, ...]) -> None:
    """If no source names the scoring team, the goal's team is null, and so is the score from then on."""
    first = () if after[:1] == ("goal+kickoff",) else ("goal",)
    states = ("kickoff", "play", *first, *after)
    found = events(read(course(*((state,) for state in states), columns="game_state")))
    assert found[:2] == [(0, "kick-off", None, 0, 0), (2, "goal", None, None, None)]
    # a later goal that is known to be home's does not make the score known again
    assert {row[3:] for row in found[1:]} == {(None, None)}
    if "goal_b" in after:
        assert (3, "goal", "away", None, None) in found


def test_unexplained_kick_off() -> None:
    """A kick-off without a half-time before it follows a goal, even if the scoring team is unknown."""
    match = read(course(("kickoff",), ("play",), ("kickoff",), ("play",), columns="game_state"))
    assert events(match) == [
        (0, "kick-off", None, 0, 0), (2, "goal", None, None, None), (2, "kick-off", None, None, None)
    ]


def test_goal_without_a_rise_of_the_score() -> None:
    """If the table has a score, a goal state at which the score does not rise is a stop."""
    match = read(course(("play", 0, 0), ("goal", 0, 0), ("kickoff_a", 0, 0), ("goal", 1, 0), ("kickoff_b", 1, 0)))
    assert [row[1:] for row in events(match)] == [
        ("play", None, 0, 0), ("stop", None, 0, 0), ("kick-off", "home", 0, 0), ("goal", "home", 1, 0),
        ("kick-off", "away", 1, 0),
    ]


def test_goals_from_kick_offs() -> None:
    """Without a score and without goals in the states, kick-offs tell the goals."""
    match = read(course(
        ("kickoff_a",), ("play",), ("kickoff_b",), ("play",), ("half",), ("kickoff_b",), ("play",),
        ("kickoff_a",), columns="game_state",
    ))
    assert [row for row in events(match) if row[1] == "goal"] == [
        (2, "goal", "home", 1, 0), (7, "goal", "away", 1, 1)
    ]


def test_a_score_that_nobody_tells_stays_unknown() -> None:
    assert events(read(course(("play",), ("freeball",), columns="game_state"))) == [
        (0, "play", None, None, None), (1, "fault", None, None, None)
    ]


def test_restart_by_the_ball_at_the_centre() -> None:
    """If no state ever stops play, the ball at the centre restarts it after a goal."""
    csv = course(*[(0, 0)] * 2, *[(1, 0)] * 4, columns="score_home,score_away")
    match = read(csv.replace("4,4,ball,,0.3,0", "4,4,ball,,0.01,0.02"))
    assert events(match) == [(0, "play", None, 0, 0), (2, "goal", "home", 1, 0), (4, "kick-off", "away", 1, 0)]
    never = read(csv)
    assert events(never)[1:] == [(2, "goal", "home", 1, 0), (3, "kick-off", "away", 1, 0)]


def test_unknown_state() -> None:
    """A state that is not known stops play and is a flaw; a map can give its meaning."""
    csv = course(("play",), ("snack_break",), ("play",), ("snack_break",), columns="game_state")
    match = read(csv)
    assert [row[1] for row in events(match)] == ["play", "stop", "play", "stop"]
    assert flaws(match) == [("skipped", 2, None, None)]
    named = read(csv, load_map("[states]\nsnack_break = 'kick-off away'\n"))
    assert events(named)[1][:3] == (1, "kick-off", "away")
    assert flaws(named) == []


def test_segment_that_changes_in_play() -> None:
    """A segment that changes in play without a gap is a fault."""
    def rows(*segments: tuple[float, str, str]) -> str:
        return "frame,t,team,player,x,y,segment,game_state\n" + "".join(
            f"{i},{t},{team},1,{x},0,{segment},{state}\n"
            for i, (t, segment, state) in enumerate(segments) for team, x in (("a", 0.7), ("b", -0.7))
        )

    match = read(rows((0, "0", "play"), (0.3, "1", "play"), (2.0, "2", "play"), (2.2, "2", "stop"),
                      (2.4, "3", "stop")))
    assert match.referee.select(pl.col("t_ns") // 10**8, pl.col("event").cast(pl.String), "note").rows() == [
        (0, "play", "play"), (3, "fault", "segment"), (22, "stop", "stop")
    ]


# --- damage ---------------------------------------------------------------------------------------


def test_positions_that_are_not_numbers() -> None:
    """A position or heading that is not a number is missing, and a flaw says so."""
    match = read(
        f"{HEADER}\n{FRAME}1,10.1,ball,,inf,0,\n1,10.1,reds,1,NaN,0,0\n1,10.1,reds,2,,,\n1,10.1,greens,1,0.6,0,inf\n"
        "2,10.2,greens,1,1e300,0,0\n"
    )
    assert match.frames.counts().tolist() == [3, 1, 0]
    assert np.isnan(match.frames.robots["theta"][-1])
    assert np.isnan(match.frames.ball["x"]).tolist() == [False, True, True]
    # robot 2 of the reds was simply not seen
    assert flaws(match) == [
        ("not a number", 1, "home", 1), ("not a number", 1, "away", 1), ("not a number", 1, "ball", None),
        ("not a number", 1, "home", 1),  # the heading
    ]
    row = match.quality.filter((pl.col("robot") == 1) & (pl.col("team") == "away")).row(0, named=True)
    assert (row["start_ns"], row["end_ns"]) == (100_000_000, 100_000_001)


def test_rows_that_belong_to_no_body_are_counted() -> None:
    match = read(f"{HEADER}\n{FRAME}0,10,reds,,0,0,0\n0,,reds,1,0,0,0\nx,10,reds,1,0,0,0\n0,10,,1,0,0,0\n")
    assert flaws(match) == [("skipped", 3, None, None), ("skipped", 1, None, None)]
    assert match.frames.counts().tolist() == [3]


def test_a_cut_csv_is_kept_and_marked() -> None:
    match = read(f"{HEADER}\n{FRAME}1,10.1,reds,1,0.")
    assert len(match.frames) == 1
    assert not match.info.complete
    assert match.info.incomplete_reason == "the incomplete last line was left out"
    assert flaws(match) == [("truncated", 1, None, None)]
    packed = gzip.compress(pl.read_parquet(recording(RSIM)).head(20_000).write_csv().encode())
    half = read(packed[: len(packed) // 2])
    assert 500 < len(half.frames) < 20_000 // 7
    assert half.info.incomplete_reason == "the gzip stream is cut off"


def columns_twice() -> bytes:
    out = io.BytesIO()
    x = pa.array([0.0])
    names = ["t", "team", "player", "x", "x", "y"]
    pq.write_table(pa.Table.from_arrays([x, pa.array(["a"]), pa.array([1]), x, x, x], names=names), out)
    return out.getvalue()


PLAIN = pl.read_csv(f"{HEADER}\n{FRAME}".encode())


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "has no column t, team, player, x, y"),
        (f"{HEADER}\n".encode(), "a header and no row"),
        (f"{HEADER}\nx,x,ball,,0,0,0\n".encode(), "has 'x', not numbers"),
        (f"{HEADER}\n0,0,,,0,0,0\n".encode(), "no row with a time and a team"),
        (b"frame,t,team,player,pos_x,y\n0,0,a,1,0,0\n",
         r"no column x; it has frame, t, team, player, pos_x, y. Name the columns in a map"),
        (b"frame,time,teams,player,x,y\n0,0,a,1,0,0\n", r"teams?\? ?|did you mean teams\?"),
        (b"frame,t,team,player,x,x,y\n0,0,a,1,0,0,0\n", "column x twice"),
        (columns_twice(), "column x twice"),
        (parquet(PLAIN.with_columns(pl.lit("here").alias("x"))), "x is String, not numbers"),
        (parquet(PLAIN.with_columns(pl.lit("[now]").alias("t"))), "t is String, not numbers"),
        (parquet(PLAIN.with_columns(pl.concat_list("x", "y").alias("team"))), "team is List.*, not names"),
        (b"frame,t,team,player,x,y\n0,0,a,1,left,0\n", "x has 'left', not numbers"),
        (b"frame,t,team,player,x,y\n0,0,a,1,0,0,0,0,0\n", "cannot be read as CSV"),
        (b"PAR1 but not really PAR1", "cannot be read as Parquet"),
        (parquet(PLAIN)[:-30], "cannot be read as Parquet"),
        (parquet(PLAIN.filter(pl.col("team") != "reds")), "has 1 teams besides 'ball': greens. Name home, .*; if the other team was not"),
        (parquet(pl.concat([PLAIN, PLAIN.with_columns(team=pl.lit("umpires"))])), "has 3 teams"),
        (parquet(PLAIN.with_columns(pl.col("frame") - 5)), "frame numbers below 0"),
        (parquet(PLAIN.with_columns(score_home=pl.lit(10**6), score_away=0)), "score_home below 0 or above"),
        (parquet(pl.concat([PLAIN, PLAIN.with_columns(pl.col("t") * 1e6)])), "spans more than a day"),
    ],
)
def test_refusal_of_other_tables(data: bytes, says: str) -> None:
    """A file that is no tracking table is refused in one line that says what it lacks."""
    with pytest.raises(BadRecording, match=says) as refusal:
        read(data)
    assert str(refusal.value).startswith("game.csv: ")
    assert "\n" not in str(refusal.value)
    assert refusal.value.next_step


def test_a_misspelt_column_is_asked_after() -> None:
    with pytest.raises(BadRecording, match=r"player \(did you mean players\?\)"):
        read("frame,t,team,players,x,y\n0,0,a,1,0,0\n")


@pytest.mark.parametrize(
    ("toml", "says"),
    [
        ("[units]\nlength = 'feet'\n", "units.length: input should be 'm', 'cm' or 'mm'"),
        ("[axis]\nx = 'left'\n", "axis: extra inputs are not permitted"),
        ("[units\n", "is not TOML"),
        ("[states]\nrun = 'go'\n", "run is 'go', not one of kick-off"),
        ("[states]\nrun = 'play nobody'\n", "run is 'play nobody'"),
        ("[pitch]\nlength = -1\n", "pitch.length"),
    ],
)
def test_a_map_that_does_not_fit_is_refused(toml: str, says: str) -> None:
    with pytest.raises(BadSettings, match=says):
        load_map(toml, "camera.toml")


@pytest.mark.parametrize(
    ("toml", "says"),
    [
        ("[columns]\nheading = 'yaw'\n", "no column yaw"),
        ("[teams]\nhome = 'purple'\n", "no team 'purple'; it has greens, reds"),
        ("[teams]\nhome = 'reds'\naway = 'grens'\n", "no team 'grens'; it has greens, reds"),
    ],
)
def test_a_map_that_is_not_of_this_file_is_refused(toml: str, says: str) -> None:
    with pytest.raises(BadRecording, match=says):
        read(f"{HEADER}\n{FRAME}", load_map(toml))


def test_other_teams_are_left_out() -> None:
    """If a map names home and away, rows of other teams are left out and counted."""
    mapping = load_map("[teams]\nhome = 'reds'\naway = 'greens'\n")
    match = read(parquet(pl.concat([PLAIN, PLAIN.with_columns(team=pl.lit("umpires"))])), mapping)
    assert (match.info.home, match.info.away) == ("reds", "greens")
    assert flaws(match) == [("skipped", 4, None, None)]


@pytest.mark.parametrize(
    ("toml", "teams", "side"),
    [
        ("home = 'reds'\naway = 'greens'", ("reds", "greens"), 0),
        ("home = 'greens'\naway = 'reds'", ("greens", "reds"), 1),
        ("home = 'reds'", ("reds", "(not recorded)"), 0),
        ("away = 'reds'", ("(not recorded)", "reds"), 1),
    ],
)
def test_team_that_was_not_recorded(
    toml: str, teams: tuple[str, str], side: int
) -> None:
    """A table with one team is read if a map names it; the other team has no rows."""
    only = parquet(PLAIN.filter(pl.col("team") != "greens"))
    match = read(only, load_map(f"[teams]\n{toml}\n"))
    assert (match.info.home, match.info.away) == teams
    assert [(row[0], row[1]) for row in robots(match)] == [(side, 1), (side, 2)]
    assert match.frames.ball["x"].tolist() == [0.5]
    assert [period.home_attacks for period in match.info.periods] == [1]
    assert match.quality["flaw"].to_list() == ["direction unknown"]


@pytest.mark.parametrize("teams", ["home = 'purple'", "home = 'purple'\naway = 'yellow'"])
def test_one_team_that_the_map_does_not_name(teams: str) -> None:
    """A table with one team is refused if the map names another."""
    with pytest.raises(BadRecording, match="no team 'purple'; it has reds"):
        read(parquet(PLAIN.filter(pl.col("team") != "greens")), load_map(f"[teams]\n{teams}\n"))


def test_a_match_of_one_team_goes_through_all_stages() -> None:
    table = pl.read_parquet(recording(RSIM)).filter(pl.col("team") != "yellow", pl.col("t") < 60)
    match = read(parquet(table), load_map("[teams]\nhome = 'blue'\nhome_attacks = 'right'\n"))
    pitch = match.info.pitch
    tracks, _ = trajectories(match, TrajectorySettings())
    assert set(tracks["team"].cast(pl.String)) == {"ball", "home"}
    done = recognise(tracks, pitch, SituationSettings())
    assert len(done) > 100
    made = Goals.validate(attribute(match.referee, tracks, done, pitch))
    assert set(made["team"].cast(pl.String)) == {"home"}
    valued = value(done, made, GramSettings())
    assert valued["value"].max() > 0  # type: ignore[operator]
    found = grams(valued, 1, None, GramSettings())
    assert set(found["team"].cast(pl.String)) == {"home"}
    known = found.sort("count", descending=True).head(3).with_row_index("i").with_columns(
        behaviour_id=pl.format("b-{}", "i")
    )
    seen = observe(valued, tracks, match.referee, known, pitch, GramSettings())
    # a state has both teams: without the adversary none is known
    assert Decisions.validate(seen).is_empty()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.binary(max_size=6))
def test_random_damage(at: int, junk: bytes) -> None:
    """Whatever bytes are damaged, the file is read or refused with BadRecording."""
    whole = f"{HEADER}\n{FRAME}".encode()
    for data in (whole, parquet(PLAIN)):
        place = at % len(data)
        try:
            match = read(data[:place] + junk + data[place + len(junk) :])
        except BadRecording:
            continue
        assert match.frames.t_ns.min() == 0


def test_events_of_the_sample() -> None:
    """The facts of data/samples/README.md."""
    match = imported(RSIM)
    counts = dict(match.referee["event"].cast(pl.String).value_counts().iter_rows())
    assert counts == {"goal": 25, "kick-off": 27, "fault": 6, "half": 1}
    assert len(match.frames) == 24_000
    assert match.frames.t_ns[-1] == 599_975_000_000
    assert (np.diff(match.frames.t_ns) == 25_000_000).all()


def test_a_heading_that_is_no_number_is_told() -> None:
    text = "frame,t,team,player,x,y,heading\n" + "".join(
        f"{i},{i / 10},{team},{player},0.1,0.1,{'abc' if i == 3 and team == 'a' else 0.5 if player else ''}\n"
        for i in range(6) for team, player in (("a", 1), ("b", 1), ("ball", ""))
    )
    log = read(text)
    told = log.quality.filter(pl.col("flaw") == "not a number")
    assert told.select("team", "robot", "count", "note").rows() == [("home", 1, 1, "heading taken for missing")]
