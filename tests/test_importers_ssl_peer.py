"""SSL logs that others' code wrote: a recorded match, by the messages of the package sslclient.

The match is of real robots (../shared/matches). Two cameras see it, with noise, and overlap by two metres.
"""

import json
import struct
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
import pytest
from conftest import ROOT
from support import ssl_messages as ssl
from support.recordings import SSL, imported, recording
from support.ssl_games import ordered

from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.matches.frame import MatchLog, wrap
from pitchlore.schemas import AWAY, HOME

PEER = ROOT / ".venv-counterparts" / "bin" / "python"
#: Noise of each detection: uniform up to so much, millimetres and radians.
NOISE_MM, NOISE_RAD = 4.0, 0.02
OVERLAP_MM = 1_000.0
EPOCH = 1_750_000_000.0


class Written(NamedTuple):
    """A log that sslclient wrote, as we read it, and the table that it was made from."""

    data: bytes
    log: MatchLog
    truth: pl.DataFrame


def write(path: Path, table: pl.DataFrame, *, legacy: bool) -> bytes:
    """The log of a table, by two cameras that capture at once."""
    if not PEER.exists():
        pytest.skip("sslclient is not installed: make counterparts")
    rng = np.random.default_rng(8)
    lines: list[dict[str, object]] = []
    for camera in (0, 1):
        seen = table.filter(pl.col("x") * (-1000, 1000)[camera] >= -OVERLAP_MM)
        # a camera sends a frame also if it sees nobody
        whole = table.select("frame", "t").unique().join(seen, on=["frame", "t"], how="left").sort("frame")
        for (frame, t), rows in whole.group_by("frame", "t", maintain_order=True):
            captured = EPOCH + t
            line = {"received": round((captured + 0.008) * 1e9), "frame": frame, "camera": camera, "t": captured,
                    "balls": [], "yellow": [], "blue": [], "legacy": legacy}
            if frame % 200 == 0:
                line["geometry"] = [12000, 9000, 1800, 180, 300]
            for team, player, x, y, heading in rows.select("team", "player", "x", "y", "heading").drop_nulls("x").iter_rows():
                place = (1000 * np.array([x, y]) + rng.uniform(-NOISE_MM, NOISE_MM, 2)).tolist()
                if team == "ball":
                    line["balls"].append([*place, 0.8])
                else:
                    theta = heading + rng.uniform(-NOISE_RAD, NOISE_RAD)
                    line["yellow" if team == "RoboCIn" else "blue"].append([player, *place, theta, 0.95])
            lines.append(line)
    lines.sort(key=lambda line: (line["received"], line["camera"]))
    done = subprocess.run(
        [PEER, ROOT / "tests" / "counterparts" / "write_ssl_log.py", path], text=True, capture_output=True, check=False,
        input="\n".join(map(json.dumps, lines)),
    )
    assert done.returncode == 0, done.stderr
    return path.read_bytes()


#: What a game controller says where the recorder's table has a state; ally is TIGERs, which is blue here.
COMMANDS = {
    "DefendKickOff": (4, 2), "AttackKickOff": (5, 2), "GameRunning": (3,), "Stop": (1,), "Halt": (0,),
    "BallPlacementAlly": (17,), "BallPlacementEnemy": (16,), "DirectAlly": (9,), "DefendFreeKick": (8,),
}


def refereed(data: bytes, table: pl.DataFrame) -> bytes:
    """The log with packets of a game controller, which says what the table does."""
    packets: list[ssl.Message] = []
    state, score, counter, said = None, (0, 0), 0, 1
    reported = table.select("frame", "t", "game_state", "score_home", "score_away").unique("frame").sort("frame")
    for _, t, now, home, away in reported.iter_rows():
        commands = () if now is None or now == state else COMMANDS[now]
        if not commands and (home, away) == score:
            continue
        state, score = now or state, (home, away)
        for command in commands or (said,):
            counter += bool(commands)
            said = command
            content = ssl.referee(1, said, counter, ssl.Team("RoboCIn", away), ssl.Team("TIGERs", home), t=EPOCH + t,
                                  blue_on_positive=False, source="game controller")
            packets.append(ssl.Message(round((EPOCH + t) * 1e9), ssl.REFEREE, content))
    at, messages = 16, []
    while at < len(data):
        received, kind, size = struct.unpack_from(">qii", data, at)
        at += 16 + size
        messages.append(ssl.Message(received, kind, data[at - size : at]))
    return ssl.log(ordered(packets, messages))


@pytest.fixture(scope="module", params=[False, True], ids=["2014", "legacy"])
def written(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Written:
    """The match by two cameras that capture at once, each fourth frame."""
    table = pl.read_parquet(recording(SSL)).filter(pl.col("frame") % 4 == 0)
    if request.param:
        table = table.filter(pl.col("frame") < 2_000)
    data = write(tmp_path_factory.mktemp("ssl") / "peer.log", table, legacy=request.param)
    return Written(data, read(open_source(data, "peer.log")), table)


def test_frames(written: Written) -> None:
    """Each frame comes back once, at its time, with its number and its robots; the pitch is the geometry's."""
    _, log, truth = written
    frames = truth.group_by("frame").agg(pl.col("t").first(), (pl.col("team") != "ball").sum().alias("robots")).sort("frame")
    assert log.frames.number.tolist() == frames["frame"].to_list()
    elapsed = (frames["t"] - frames["t"][0]).to_numpy()
    np.testing.assert_allclose(log.frames.t_ns / 1e9, elapsed, rtol=0, atol=1e-6)
    assert log.frames.counts().tolist() == frames["robots"].to_list()
    assert (log.info.pitch.length, log.info.pitch.width, log.info.pitch.goal_width, log.info.pitch.goal_depth) == (
        12.0, 9.0, 1.8, 0.18)
    assert (log.info.home, log.info.away, log.info.complete) == ("blue", "yellow", True)
    assert log.quality.filter(pl.col("flaw").is_in(["damaged record", "truncated", "not a number"])).is_empty()


def test_bodies_are_within_the_noise(written: Written) -> None:
    """Robots and ball of every frame are where they were within the noise, one of a number, in and out of the overlap."""
    _, log, truth = written
    robots = truth.filter(pl.col("team") != "ball").with_columns(
        side=pl.when(pl.col("team") == "TIGERs").then(HOME).otherwise(AWAY)).sort("frame", "side", "player")
    got = log.frames.robots
    ball = truth.filter(pl.col("team") == "ball").sort("frame")
    assert got["team"].tolist() == robots["side"].to_list()
    assert got["id"].tolist() == robots["player"].to_list()
    for column in ("x", "y"):
        off = np.abs(got[column] - robots[column].to_numpy())
        assert off.max() <= NOISE_MM / 1000 + 1e-5
        assert np.abs(log.frames.ball[column] - ball[column].to_numpy()).max() <= NOISE_MM / 1000 + 1e-5
    turn = np.abs(wrap(got["theta"].astype(np.float64) - robots["heading"].to_numpy()))
    assert turn.max() <= NOISE_RAD + 1e-5
    # in the overlap two cameras are averaged, so the noise is less: uniform noise u has u / √3, two have u / √6
    off = got["x"] - robots["x"].to_numpy()
    both = (np.abs(robots["x"]) < OVERLAP_MM / 1000).to_numpy()
    assert off[both].std() * 1000 == pytest.approx(NOISE_MM / 6**0.5, rel=0.05)
    assert off[~both].std() * 1000 == pytest.approx(NOISE_MM / 3**0.5, rel=0.05)


@pytest.mark.parametrize("written", [False], ids=["2014"], indirect=True)
def test_with_a_game_controller(written: Written) -> None:
    """The same match as a table and as a log with a referee has the same goals, restarts and score."""
    data = refereed(written.data, pl.read_parquet(recording(SSL)))
    log, other = read(open_source(data, "gc.log")), imported(SSL)
    assert [(m.info.home, m.info.away) for m in (log, other)] == [("TIGERs", "RoboCIn")] * 2
    assert log.info.settings["goals"] == {"from": "referee"}
    for match in (log, other):
        assert match.referee.select("score_home", "score_away").row(-1) == (1, 0)
        assert match.referee.filter(event="goal")["team"].to_list() == ["home"]
    # the table has a fault of its own, where the recorder's segment changes, and does not say whose kicks are
    events = pl.col("event").is_in(["kick-off", "fault", "goal"]) & pl.col("note").ne("segment")
    ours, theirs = (match.referee.filter(events) for match in (log, other))
    assert ours["event"].to_list() == theirs["event"].to_list()
    np.testing.assert_allclose(ours["t_ns"] / 1e9, theirs["t_ns"] / 1e9, atol=0.05)  # a sample is 0.042 s
    assert ours["team"].null_count() == 0
