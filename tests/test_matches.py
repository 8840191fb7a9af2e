"""The log of a match: round trips, the recorder, and the row of a match."""

import io
import weakref
from datetime import UTC, datetime

import numpy as np
import polars as pl
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.mcap_logs import (
    INFO,
    SMALL,
    commands_of,
    decisions_of,
    frames_of,
    match,
    options_of,
    referee_of,
    written,
)
from support.recordings import same

from pitchlore.pipeline import matches
from pitchlore.pipeline.base.errors import BadRecording, SchemaMismatch
from pitchlore.pipeline.matches.frame import ROBOT_DTYPE, Frames, MatchLog
from pitchlore.schemas import Commands, Decisions, Matches, Quality, Referee

# --- round trips -----------------------------------------------------------------------------


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_round_trip(data):
    """A log that is written is read back the same."""
    counts = data.draw(st.lists(st.integers(0, 23), max_size=40))
    # times repeat and go back, as recorders let them
    times = data.draw(st.lists(st.integers(0, 2**62), min_size=len(counts), max_size=len(counts)))
    text = st.none() | st.text(st.characters(exclude_characters="\0", codec="utf-8"), min_size=1)
    score = st.none() | st.integers(0, 2**15 - 1)
    row = st.tuples(
        st.integers(0, 2**62), st.sampled_from(["goal", "kick-off", "end"]),
        st.sampled_from([None, "home", "away"]), score, score, text,
    )  # fmt: skip
    referee = referee_of(*data.draw(st.lists(row, max_size=5))).sort("t_ns", maintain_order=True)
    decisions, commands = decisions_of(data.draw(st.integers(0, 30))), commands_of(data.draw(st.integers(0, 30)))
    told = options_of(data.draw(st.integers(0, 30)))
    log = MatchLog(INFO, frames_of(counts, t_ns=times), referee, decisions, commands=commands, options=told)
    chunk_bytes = data.draw(st.sampled_from([1, 700, 5000, 1 << 20]))
    back = matches.read(written(log, chunk_bytes=chunk_bytes), where="a.mcap")
    assert same(back, log)
    assert back.info.complete
    assert back.quality.is_empty()
    Referee.validate(back.referee)
    Decisions.validate(back.decisions)
    Commands.validate(back.commands)


def test_memory():
    """A log leaves memory with its last use: no cycle keeps it until Python looks for garbage."""
    log = matches.read(written(match()), where="a.mcap")
    bodies = weakref.ref(log.frames.robots.base)
    del log
    assert bodies() is None


def test_same_bytes():
    """The same log gives the same bytes, whatever lies in the padding."""
    log = match()
    dirty = Frames(log.frames.number, log.frames.t_ns, log.frames.ball, log.frames.offsets, log.frames.robots.copy())
    dirty.robots.view(np.uint8)[1::ROBOT_DTYPE.itemsize] = 0xAB
    assert written(log) == written(MatchLog(INFO, dirty, log.referee, log.decisions, commands=log.commands))


def test_flaws_of_importer():
    """Flaws that an importer found travel with the log; one that was salvaged stays incomplete."""
    quality = pl.DataFrame(
        [(INFO.match_id, "gap", 5, 9, "home", 3, 2, "no samples"), (INFO.match_id, "skipped", None, None, None, None, 1, None)],
        schema=Quality.dtypes(), orient="row",
    )  # fmt: skip
    log = match()
    salvaged = INFO.model_copy(update={"complete": False, "incomplete_reason": "chunk 3 of 9 is gone"})
    for info in (INFO, salvaged):
        back = matches.read(written(MatchLog(info, log.frames, quality=quality)), where="a.mcap")
        assert back.quality.equals(quality)
        assert back.info == info


# --- the recorder ------------------------------------------------------------------------------


def one_by_one(recorder: matches.Recorder, frames: Frames) -> None:
    for i in range(len(frames)):
        a, b = frames.offsets[i], frames.offsets[i + 1]
        recorder.frames(Frames(
            frames.number[i:i + 1], frames.t_ns[i:i + 1], frames.ball[i:i + 1],
            np.array([0, b - a], dtype=np.int64), frames.robots[a:b],
        ))  # fmt: skip


def test_live_recording():
    """A match may be recorded while it is played."""
    log = match()
    stream = io.BytesIO()
    final = INFO.model_copy(update={"away": "Panthers"})
    recorder = matches.Recorder(stream, INFO, chunk_bytes=SMALL)
    recorder.referee(log.referee[:1])
    one_by_one(recorder, log.frames)
    recorder.decisions(log.decisions)
    recorder.commands(log.commands)
    recorder.referee(log.referee[1:])
    recorder.close(info=final)
    back = matches.read(stream.getvalue(), where="a.mcap")
    assert same(back, MatchLog(final, log.frames, log.referee, log.decisions, commands=log.commands))
    assert back.info.complete


def test_unfit_log():
    """A negative time or score is refused."""
    with pytest.raises(BadRecording, match="before time zero"):
        written(MatchLog(INFO, frames_of([1, 1], t_ns=[0, -1])))
    with pytest.raises(SchemaMismatch, match="score_home"):
        written(MatchLog(INFO, frames_of([1]), referee_of((0, "goal", None, -5, None, None))))


# --- the table ---------------------------------------------------------------------------------


def test_row():
    """The row of a match has its names, time, rate, score and pitch."""
    frames = frames_of([0, 3, 4, 2], t_ns=[0, 20_000_000, 20_000_000, 60_000_000])
    frames.robots["team"] = [0, 0, 1, 1, 1, 1, 0, 0, 1]
    referee = referee_of(
        (0, "kick-off", None, None, None, None), (10, "goal", "home", 1, 0, None), (20, "end", None, None, None, None)
    )
    row, = Matches.validate(matches.row(MatchLog(INFO, frames, referee))).rows(named=True)
    assert row == {
        "match_id": INFO.match_id, "source": "final.rcg", "home": "Löwen", "away": "Tigers",
        "started_at": datetime(2024, 5, 1, 12, 0, tzinfo=UTC), "duration_s": 0.06,
        "hz": pytest.approx(1 / 0.03),  # the median of 20 and 40 ms; equal times are no interval
        "robots_per_team": 3, "score_home": 1, "score_away": 0, "complete": True, "incomplete_reason": None,
        "kind": "vsss", "pitch_length": 1.5, "pitch_width": 1.3, "goal_width": 0.4, "frames": 4, "format": "rcg",
        "direction_inferred": True, "shoot_out_home": None, "shoot_out_away": None,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("events", "score"),
    [
        ([(10, "goal", None, None, None, None)], (None, None)),
        ([(10, "goal", None, None, None, None), (20, "goal", "home", None, None, None)], (None, None)),
        ([(10, "goal", None, None, None, None), (20, "end", None, 0, 1, None)], (0, 1)),
        ([(10, "goal", None, 1, 0, None), (20, "end", None, None, None, None)], (1, 0)),
        ([(10, "stop", None, None, None, None)], (0, 0)),
    ],
)
def test_goal_of_unknown_team(events, score):
    """The score after a goal of unknown team is null until it is reported."""
    referee = referee_of((0, "kick-off", None, 0, 0, None), *events)
    row, = Matches.validate(matches.row(MatchLog(INFO, frames_of([2, 2]), referee))).rows(named=True)
    assert (row["score_home"], row["score_away"]) == score


def test_unknown_facts():
    """Facts of a match that are not known are null."""
    info = INFO.model_copy(update={"started_at": None})
    row, = Matches.validate(matches.row(MatchLog(info, frames_of([])))).rows(named=True)
    assert [row[name] for name in ("started_at", "hz", "score_home", "score_away")] == [None] * 4
    assert (row["duration_s"], row["frames"], row["robots_per_team"]) == (0.0, 0, 0)
