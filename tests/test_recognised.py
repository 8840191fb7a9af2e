"""Recognition of a recording's situations: what a kind usually shows, and the flaw where it is far less."""

import json
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from conftest import clip
from support import recordings
from usual.study import rates_of, situations_of

from pitchlore.pipeline import matches
from pitchlore.pipeline.engine import recognised
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recognised import warm, with_recognition
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.stages.situations.rules import TABLE_1
from pitchlore.pipeline.stages.situations.usual import recognition
from pitchlore.pipeline.store import Store
from pitchlore.schemas.situations import MOVES_RANDOMLY

USUAL = json.loads(Path("pipeline/stages/situations/usual.json").read_text())


def poor(match: MatchLog) -> list[str]:
    """Notes of the flaw."""
    return with_recognition(match).quality.filter(pl.col("flaw") == "poor recognition")["note"].to_list()


def without_headings(match: MatchLog) -> MatchLog:
    robots = match.frames.robots.copy()
    robots["theta"] = np.nan
    return replace(match, frames=replace(match.frames, robots=robots))


def test_every_kind_is_measured() -> None:
    """Each kind of match has codes of Table 1 that its recordings showed, and how long these were."""
    assert set(USUAL) == {kind.value for kind in Kind}
    for reported in USUAL.values():
        assert set(map(int, reported["rates"])) <= set(TABLE_1) - {MOVES_RANDOMLY}
        assert len(reported["rates"]) >= 20
        assert reported["robot_s"] > 900
        assert min(reported["rates"].values()) > 0


def test_the_rates_are_those_of_the_sample() -> None:
    """The file's rates of VSSS are those that the recogniser finds in the sample now."""
    rates, seconds = rates_of(situations_of(recordings.imported(recordings.RSIM)))
    assert round(seconds) == USUAL["vsss"]["robot_s"]
    assert {str(code): round(rate, 7) for code, rate in rates.items()} == USUAL["vsss"]["rates"]


@pytest.mark.parametrize("name", recordings.ALL)
def test_recordings_are_recognised(name: str) -> None:
    """No recording that shows what its kind shows has the flaw."""
    assert poor(recordings.imported(name)) == []


@pytest.mark.parametrize("name", [recordings.RSIM, recordings.SSL, recordings.RCSS])
def test_without_headings(name: str) -> None:
    """Without headings hardly anything is recognised; the flaw says so, and what to give."""
    (note,) = poor(without_headings(recordings.imported(name)))
    assert "no robot has a heading" in note


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_of_the_wrong_size(factor: float) -> None:
    """A recording whose lengths are ten times too small or large shows far fewer situations; a cure is named."""
    match = recordings.imported(recordings.RSIM)
    robots, ball = match.frames.robots.copy(), match.frames.ball.copy()
    for axis in ("x", "y"):
        robots[axis] *= factor
        ball[axis] *= factor
    (note,) = poor(replace(match, frames=replace(match.frames, robots=robots, ball=ball)))
    assert "units, axes and the pitch's kind" in note


def test_once() -> None:
    """A match that has the flaw does not get it twice."""
    match = with_recognition(without_headings(recordings.imported(recordings.RSIM)))
    assert with_recognition(match) is match


def test_too_short_to_tell() -> None:
    """Ten seconds of six robots show few situations; that is no flaw, and neither are longer pieces."""
    match = recordings.read(clip(0.0, 10.0).write_csv().encode(), "short.csv")
    assert poor(without_headings(match)) == []
    situations = situations_of(recordings.imported(recordings.RSIM))
    for start in range(0, 600, 20):
        begins, ends = pl.col("start_ns") >= start * 10**9, pl.col("end_ns") <= (start + 20) * 10**9
        assert not recognition(situations.filter(begins, ends), Kind.VSSS).poor


@pytest.mark.slow
def test_the_table_of_import_says_so(call, tmp_path: Path) -> None:
    """Positions alone: import's table and quality have the flaw."""
    clip(0.0, 60.0).drop("heading").write_csv(tmp_path / "places.csv")
    code, out, _ = call("import", tmp_path / "places.csv", "--data", tmp_path / "data")
    assert code == 0
    assert "poor recognition" in out
    code, out, _ = call(
        "sql", "select note from quality where flaw = 'poor recognition'", "--csv", "--data", tmp_path / "data")
    assert "no robot has a heading" in out


@pytest.mark.parametrize("error", [ImportError("cannot import name 'njit' from partially initialized module 'numba'"), KeyboardInterrupt()])
def test_loading_that_fails(monkeypatch, error) -> None:
    """A module that is loaded ahead fails without a word: who asks for it meets the same error. Ctrl-C had shown a traceback."""
    began, failed = threading.Event(), list[object]()

    def fail(_: MatchLog) -> None:
        began.set()
        raise error

    monkeypatch.setattr(recognised, "_poor", fail)
    monkeypatch.setattr(threading, "excepthook", failed.append)
    warm.__wrapped__()
    assert began.wait(10.0)
    for thread in threading.enumerate():
        if thread.name == "recogniser":
            thread.join(10.0)
    assert failed == []


def test_our_own_logs_stay_as_they_are(tmp_path: Path) -> None:
    """A log of ours is not looked at again: imported elsewhere it has the same bytes."""
    match = without_headings(recordings.imported(recordings.RSIM))
    with (tmp_path / "match.mcap").open("wb") as file:
        matches.write(match, file)
    store = Store(tmp_path / "data")
    receipt, *_ = take_in(store, Recording(file=tmp_path / "match.mcap"))
    assert store.read(receipt, "log") == (tmp_path / "match.mcap").read_bytes()
    assert "poor recognition" not in receipt.details["flaws"]
