"""`pitchlore record` and `pitchlore play`: what they leave behind when they are killed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.played import starting
from support.processes import eventually, pitchlore

from pitchlore.flows.commands import record
from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.engine.imports import import_all
from pitchlore.pipeline.engine.record import match_log
from pitchlore.pipeline.engine.recordings import PLAYING, _nothing_logged
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Matches

#: Of a match that is certainly not over when it is killed.
MINUTES = 100
CHUNKS, HEAD = 300_000, 8_192  # bytes: more than a chunk, more than what is before the first


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A data folder in which a match was killed as it was played."""
    data = tmp_path_factory.mktemp("killed")
    words = ["record", "--home", "static", "--away", "static", "--minutes", MINUTES, "--data", data]
    with subprocess.Popen(pitchlore(*words)) as process:
        try:
            eventually(lambda: process.poll() is not None or any(log.stat().st_size > CHUNKS for log in logs(data)), 120)
            assert process.poll() is None, "it ended before it could be killed"
        finally:
            process.kill()
    assert process.returncode == -signal.SIGKILL
    return data


@pytest.mark.slow
def test_killed_match(killed, call):
    """The next run takes what was played of a match that was killed, frame for frame."""
    store = Store(killed)
    assert not list(store.receipts("matches"))
    assert call("run", "--data", killed)[0] == 0
    (receipt,) = store.receipts("matches")
    row = store.read_table(receipt, "matches", Matches).row(0, named=True)
    assert not row["complete"]
    assert 10.0 < row["duration_s"] < 60 * MINUTES
    assert store.receipt("situations", receipt.name) is not None
    assert not store.quarantined()

    static = TeamSettings(kind="static")
    recipe = Recipe(home=static, away=static, seed=1, referee=RefereeSettings(duration_s=60 * MINUTES))
    assert receipt.name == recipe.match_id
    salvaged = matches.read(store.read(receipt, "log"), where="salvaged").frames
    again = starting(recipe)
    again.advance(len(salvaged))
    played = again.take().frames
    assert salvaged.ball.tobytes() == played.ball.tobytes()
    for name in played.robots.dtype.names:
        np.testing.assert_array_equal(salvaged.robots[name], played.robots[name])


#: Plays a match of two seconds and kills itself when its log is whole and is to be committed.
COMMITTING = """
import os, signal, sys
from pathlib import Path
import pitchlore.pipeline.engine.record
from pitchlore.pipeline.store import Store
from test_record import short

pitchlore.pipeline.engine.record.keep = lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL)
pitchlore.pipeline.engine.record.record(Store(Path(sys.argv[1])), short(1))
"""


def short(seed):
    random = TeamSettings(kind="random")
    return Recipe(home=random, away=random, seed=seed, referee=RefereeSettings(duration_s=2.0))


def logs(data):
    return list((data / "playing").glob("*.mcap"))


def head(data, recipe):
    """The log of a match that was killed before anything of it was logged: its path and bytes."""
    with Store(data).growing(PLAYING, f"{recipe.match_id}.mcap") as (path, stream):
        matches.Recorder(stream, starting(recipe).info)
    return path, path.read_bytes()


@pytest.mark.slow
def test_killed_early_or_late(tmp_path, call):
    """A kill before the first chunk or at the commit loses nothing logged and leaves no trouble."""
    pytest.importorskip("pygame")
    folders = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    here = {**os.environ, "PYTHONPATH": folders, "SDL_VIDEODRIVER": "dummy"}
    committing, person = (
        subprocess.Popen(words, env=here, stdout=subprocess.DEVNULL)
        for words in ([sys.executable, "-c", COMMITTING, tmp_path], pitchlore("play", "--data", tmp_path))
    )
    try:
        eventually(lambda: person.poll() is not None or any(
            log.name.startswith("human-") and log.stat().st_size > HEAD for log in logs(tmp_path)), 120)
        assert person.poll() is None, "it ended before it could be killed"
        person.kill()
        assert committing.wait(120) == -signal.SIGKILL
    finally:
        person.kill()
        person.wait()
    unplayed, _ = head(tmp_path, short(2))
    assert len(logs(tmp_path)) == 3

    code, out, _ = call("run", "--data", tmp_path)
    assert code == 0
    assert f"{unplayed}: removed, for its match was killed before anything of it was logged" in out.splitlines()
    assert not unplayed.exists()
    store = Store(tmp_path)
    assert not store.quarantined()
    mine, whole = store.receipts("matches")
    assert (whole.name, whole.details["frames"], whole.details["complete"]) == (short(1).match_id, 121, True)
    assert mine.name.startswith("human-")
    assert 60 <= mine.details["frames"] < 1000  # far from what fills a chunk
    assert not mine.details["complete"]
    assert store.receipt("situations", mine.name) is not None


def test_logged_at_once(tmp_path):
    """A logged message is in the file at once.

    The bytes that the system has are those that a killed process leaves.
    """
    played = starting(short(1))
    with match_log(Store(tmp_path), played) as log_it:
        for seconds in (1, 2):
            played.advance(60)
            log_it()
            (log,) = logs(tmp_path)
            assert len(matches.read(log.read_bytes(), where="killed here").frames) == 60 * seconds


def test_interrupted_match(tmp_path):
    """A match that breaks off is logged to its last frame."""
    played = starting(short(1))

    def interrupted():
        with match_log(Store(tmp_path), played):
            played.advance(17)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    (log,) = logs(tmp_path)
    assert len(matches.read(log.read_bytes(), where="broken off").frames) == 17


def test_days_of_play(call, tmp_path, monkeypatch):
    """Days of play are said before they begin."""
    monkeypatch.setattr(record, "spread", lambda *_: iter(()))
    for minutes, many, said in (("1000", "1000000",
                                 ["1,000,000 matches are 694,444 days of play; Ctrl-C keeps those that are finished"]),
                                ("8", "179", [])):
        code, _, err = call("record", "--minutes", minutes, "--matches", many, "--data", tmp_path)
        assert (code, [line for line in err.splitlines() if "days" in line]) == (0, said)


def test_empty_log(tmp_path):
    """A log without a frame is removed, unless somebody writes it or it is none of ours."""
    store = Store(tmp_path)
    path, whole = head(tmp_path, short(1))
    with store.growing(PLAYING, path.name):
        assert import_all(store).notes == []
        assert path.exists()
    for length in (0, 100, len(whole)):
        path.write_bytes(whole[:length])
        report = import_all(store)
        assert [note.split(": ")[0] for note in report.notes] == [str(path)]
        assert not report.failed
        assert not path.exists()
    path.write_bytes(b"what nobody here has written")
    assert not store.discard(path, _nothing_logged)
    assert path.exists()
