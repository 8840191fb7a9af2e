"""Tracking tables that are damaged, partial or no tables, and maps that do not fit."""

import io

import numpy as np
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.recordings import RSIM, imported, recording
from support.tracking import FRAME, HEADER, flaws, parquet, read, robots

from pitchlore.pipeline.base.errors import BadRecording, BadSettings
from pitchlore.pipeline.engine.memory import MemoryInputs
from pitchlore.pipeline.importers.tracking.mapping import load_map
from pitchlore.pipeline.settings import ModelSettings, Settings
from pitchlore.schemas import Decisions, Goals, Patterns, Sequences, Situations, Trajectories, Worths


def test_not_numbers() -> None:
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


def test_rows_of_no_body() -> None:
    """Rows that belong to no body are left out and counted."""
    match = read(f"{HEADER}\n{FRAME}0,10,reds,,0,0,0\n0,,reds,1,0,0,0\nx,10,reds,1,0,0,0\n0,10,,1,0,0,0\n")
    assert flaws(match) == [("skipped", 3, None, None), ("skipped", 1, None, None)]
    assert match.frames.counts().tolist() == [3]


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
        (f"{HEADER}\nx,x,ball,,0,0,0\n".encode(), r"has the time 'x', no number, clock or date \(row 1\)"),
        (f"{HEADER}\n0,0,,,0,0,0\n".encode(), "no row with a time and a team"),
        (b"t,team,player,x,y\n0,a,,0,0\n0,b,,0,0\n", "no row of the ball or a player"),
        (b"frame,t,team,player,x_1,y\n0,0,a,1,0,0\n",
         r"no column x; it has frame, t, team, player, x_1, y. Name the columns in a map"),
        (b"frame,time,teams,player,x,y\n0,0,a,1,0,0\n", r"teams?\? ?|did you mean teams\?"),
        (b"frame,t,team,players,x,y\n0,0,a,1,0,0\n", r"player \(did you mean players\?\)"),
        (b"frame,t,team,player,x,x,y\n0,0,a,1,0,0,0\n", "column x twice"),
        (columns_twice(), "column x twice"),
        (parquet(PLAIN.with_columns(pl.lit("here").alias("x"))), "x is String, not numbers"),
        (parquet(PLAIN.with_columns(pl.lit("[now]").alias("t"))), r"has the time '\[now\]', no number"),
        (parquet(PLAIN.with_columns(pl.concat_list("x", "y").alias("team"))), "team is List.*, not names"),
        (b"frame,t,team,player,x,y\n0,0,a,1,left,0\n", "x has 'left', not numbers"),
        (b"frame,t,team,player,x,y,score_home,score_away\n0,0,a,1,0,0,0.5,0\n",
         "column score_home has 0.5, not whole numbers"),
        (b"frame,t,team,player,x,y\n0,0,a,1,0,0,0,0,0\n", "cannot be read as CSV"),
        (b"PAR1 but not really PAR1", "cannot be read as Parquet"),
        (parquet(PLAIN)[:-30], "cannot be read as Parquet"),
        (parquet(PLAIN.filter(pl.col("team") != "reds")), "has one team besides 'ball': greens. Name home, .*; if the other team was not"),
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


@pytest.mark.parametrize(
    ("toml", "says"),
    [
        ("[units]\nlength = 'feet'\n", "units.length: input should be 'm', 'cm', 'mm', 'share', "),
        ("[axis]\nx = 'left'\n", r"axis: there is no such key \(did you mean axes\?\)"),
        ("[units\n", "is not TOML"),
        ("[states]\nrun = 'go'\n", "run is 'go', not one of kick-off"),
        ("[states]\nrun = 'play nobody'\n", "run is 'play nobody'"),
        ("[pitch]\nlength = -1\n", "pitch.length"),
    ],
)
def test_bad_map(toml: str, says: str) -> None:
    """A map with keys or values that do not exist is refused."""
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
def test_map_of_other_file(toml: str, says: str) -> None:
    """A map that names what the file does not have is refused."""
    with pytest.raises(BadRecording, match=says):
        read(f"{HEADER}\n{FRAME}", load_map(toml))


def test_other_teams() -> None:
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
def test_missing_team(
    toml: str, teams: tuple[str, str], side: int
) -> None:
    """A table with one team is read if a map names it; the other team has no rows."""
    only = parquet(PLAIN.filter(pl.col("team") != "greens"))
    match = read(only, load_map(f"[teams]\n{toml}\n"))
    assert (match.info.home, match.info.away) == teams
    assert [(row[0], row[1]) for row in robots(match)] == [(side, 1), (side, 2)]
    assert match.frames.ball["x"].tolist() == [0.5]
    assert [period.home_attacks for period in match.info.periods] == [1]
    assert match.quality["flaw"].to_list() == ["goals unknown", "direction unknown"]


@pytest.mark.parametrize("teams", ["home = 'purple'", "home = 'purple'\naway = 'yellow'"])
def test_unnamed_team(teams: str) -> None:
    """A table with one team is refused if the map names another."""
    with pytest.raises(BadRecording, match="no team 'purple'; it has reds"):
        read(parquet(PLAIN.filter(pl.col("team") != "greens")), load_map(f"[teams]\n{teams}\n"))


def test_match_of_one_team() -> None:
    """A match of one team goes through all stages; a state has both teams, so no decision is known."""
    table = pl.read_parquet(recording(RSIM)).filter(pl.col("team") != "yellow", pl.col("t") < 60)
    match = read(parquet(table), load_map("[teams]\nhome = 'blue'\nhome_attacks = 'right'\n"))
    stages = MemoryInputs(match, Settings(models=ModelSettings(goals_at_least=2, block_s=5)))
    assert set(stages.table("trajectories", Trajectories)["team"].cast(pl.String)) == {"ball", "home"}
    assert len(stages.table("situations", Situations)) > 100
    for noun, schema in (("goals", Goals), ("sequences", Sequences)):
        assert set(stages.table(noun, schema)["team"].cast(pl.String)) == {"home"}
    assert stages.table("sequences", Sequences)["value"].max() > 0  # type: ignore[operator]
    assert stages.table("values", Worths)["change"].max() > 0  # type: ignore[operator]
    assert len(stages.table("behaviours", Patterns))
    assert stages.table("decisions", Decisions).is_empty()


def test_events_of_the_sample() -> None:
    """The sample has the events and times that data/samples/README.md tells."""
    match = imported(RSIM)
    counts = dict(match.referee["event"].cast(pl.String).value_counts().iter_rows())
    assert counts == {"goal": 25, "kick-off": 27, "fault": 6, "half": 1}
    assert len(match.frames) == 24_000
    assert match.frames.t_ns[-1] == 599_975_000_000
    assert (np.diff(match.frames.t_ns) == 25_000_000).all()


def test_heading_not_a_number() -> None:
    """A heading that is no number is taken for missing, and a flaw says so."""
    reported = read(f"{HEADER}\n{FRAME.replace('-3.0', 'abc')}").quality.filter(flaw="not a number")
    assert reported.select("team", "robot", "count", "note").rows() == [("home", 1, 1, "heading taken for missing")]
