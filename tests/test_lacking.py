"""Words of a run on its knowledge: why there is none, which leagues it mixes, and how it is restricted."""

import json
import re
from pathlib import Path

import polars as pl
import pytest
from conftest import clip
from support.recordings import RCSS, recording

from pitchlore.pipeline.store import Store

POSITIONS = ("frame", "t", "team", "player", "x", "y")


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A data folder with an inbox."""
    (tmp_path / "data" / "inbox").mkdir(parents=True)
    return tmp_path / "data"


@pytest.mark.slow
def test_nothing_to_learn(call, data):  # type: ignore[no-untyped-def]
    """Where no goal is known, `run` says what each match lacks and makes no version; the score is unknown everywhere."""
    clip(0.0, 4.0).select(POSITIONS).filter(pl.col("team") != "ball").write_csv(data / "inbox" / "noball.csv")
    code, out, _ = call("run", "--data", data)
    assert code == 0
    assert "No knowledge and no policy were made: no match shows a course of play with a ball." in out
    assert "the ball was never seen, so that none is found" in out
    assert "add columns score_home and score_away" in out
    assert "No match yet" not in out
    store = Store(data)
    assert store.latest("knowledge") is None
    assert store.latest("policies") is None

    code, out, _ = call("run", "--data", data)  # nothing is new, and it says the same
    assert code == 0
    assert "No knowledge and no policy were made" in out

    code, out, _ = call("commentary", "noball", "--data", data)
    assert code == 0
    assert "blue (home) – yellow (away), score unknown, 0:04 min" in out
    assert out.count("unknown") == 3  # score, and the goals of either side
    assert "0 : 0" not in out
    reported = json.loads(call("commentary", "noball", "--json", "--data", data)[1])["summary"]
    assert [(reported[side]["score"], reported[side]["goals"]) for side in ("home", "away")] == [(None, None)] * 2
    rows = json.loads(call("sql", "select score_home, score_away from matches", "--json", "--data", data)[1])
    assert rows == [{"score_home": None, "score_away": None}]
    call("scout", "noball", "--data", data)
    (page,) = (file.read_text() for file in data.glob("scout*/matches/noball*.html"))
    counted = {row.partition("<")[0]: set(re.findall(r"<td>([^<]*)", row))
               for row in page.replace("<tr>", "").split('<th scope="row">') if row.startswith("goals")}
    assert "? : ?" in page
    assert counted == {"goals": {"–"}, "goals from shots": {"–"}}


@pytest.mark.slow
def test_positions_alone(call, data):  # type: ignore[no-untyped-def]
    """Positions alone become goals with an origin, behaviours and a policy; nobody says 0 : 0."""
    clip(0.0, 300.0).select(POSITIONS).write_csv(data / "inbox" / "team.csv")
    code, out, _ = call("run", "--data", data)
    assert code == 0
    assert "knowledge version 1 (new)" in out
    goals = json.loads(call("sql", "select team, origin, confidence from goals order by t_ns", "--json", "--data", data)[1])
    assert len(goals) == 11
    assert {goal["origin"] for goal in goals} == {"ball"}
    assert all(goal["confidence"] >= 0.9 for goal in goals)
    out = call("commentary", "team", "--data", data)[1]
    assert out.count("Goals were found from the ball: each is at least 95 % sure") == 1
    assert "% sure.)" not in out, "a goal says how sure it is only where that is less"
    assert "score unknown" in out
    assert "(found from the ball)" in out


@pytest.mark.slow
def test_two_leagues(call, data):  # type: ignore[no-untyped-def]
    """`run` warns of two leagues in one knowledge; --kind and --team restrict it; nobody is asked for in vain."""
    clip(0.0, 60.0).write_parquet(data / "inbox" / "small.parquet")
    (data / "inbox" / RCSS).write_bytes(recording(RCSS))
    code, out, _ = call("run", "--no-train", "--data", data)
    assert code == 0
    assert "The knowledge is of 2 leagues (2d: KickRunA, KickRunB; vsss: blue, yellow)." in out
    assert "Say --kind or --team" in out

    code, out, _ = call("run", "--no-train", "--kind", "2d", "--data", data)
    assert code == 0
    assert "The knowledge is of" not in out
    newest = Store(data).latest("knowledge")
    assert newest is not None
    assert {team["kind"] for team in newest.details["teams"]} == {"2d"}

    code, out, _ = call("run", "--no-train", "--team", "blue", "--team", "KickRunA", "--data", data)
    newest = Store(data).latest("knowledge")
    assert newest is not None
    assert [team["team"] for team in newest.details["teams"]] == ["KickRunA", "blue"]

    before = newest.version
    code, out, _ = call("run", "--no-train", "--team", "nobody", "--data", data)
    assert code == 0
    assert "--kind, --team or the [sides] settings leave no team. There are KickRunA (2d), KickRunB (2d), blue (vsss)" in out
    newest = Store(data).latest("knowledge")
    assert newest is not None
    assert newest.version == before
