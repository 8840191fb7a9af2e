"""Damaged SSL logs: what is whole is read, what is not is flagged."""

import gzip
import struct
import tempfile
import tracemalloc
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import zstandard
from support import ssl_messages as ssl
from support.recordings import same
from support.ssl_games import EPOCH, STEP, Referee, flaws, frames, match, ns, ordered
from support.ssl_long import HZ, long_log
from support.ssl_messages import Message, Seen, Team, log

from pitchlore.pipeline.base.errors import BadRecording, StorageFailed
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.importers import packing
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.importers.ssl_logs.survey import survey
from pitchlore.pipeline.matches.frame import ROBOT_DTYPE, MatchLog
from pitchlore.pipeline.settings import ImportSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.files import Files

HEAD = 16
WHOLE = frames(60)
#: Flaws of a log without a referee.
UNREFEREED = {"direction inferred", "goals unknown"}


def start(message: int) -> int:
    """Where a message of the whole log begins."""
    return 16 + sum(HEAD + len(other.content) for other in WHOLE[:message])


def numbers(game: MatchLog) -> list[int]:
    return [int(number) for number in game.frames.number]


def notes(game: MatchLog, flaw: str) -> list[str]:
    return game.quality.filter(pl.col("flaw") == flaw)["note"].to_list()


@pytest.mark.parametrize("inside", [1, HEAD - 1, HEAD, HEAD + 20])
def test_cut_off(inside: int) -> None:
    """A log that ends within a message is read up to it."""
    game = match(log(WHOLE)[: start(40) + inside])
    assert numbers(game) == list(range(40))
    assert game.info.incomplete_reason == "the log is cut off"
    assert notes(game, "truncated") == [f"the log is cut off: its last {inside} bytes are no whole message"]


@pytest.mark.parametrize(("size", "lost"), [
    (-1, 1), (1 << 30, 1), (70_000, 1),  # no length of a message
    (20, 1), (0, 1),  # too short: what follows is no head
    (200, 1),  # reaches into the next message, or takes it in; those after it are found again
    (1_000, 1), (60_000, 1),
])
def test_a_broken_length(size: int, lost: int) -> None:
    """Messages go on after a broken length; only the one whose length it is is lost."""
    data, at = log(WHOLE), start(30) + 12
    game = match(data[:at] + struct.pack(">i", size) + data[at + 4 :])
    missing = sorted(set(range(60)) - set(numbers(game)))
    assert len(missing) <= lost + 1
    assert set(missing) <= {30, 31}
    assert not game.info.complete
    assert flaws(game)["damaged record"] >= 1


@pytest.mark.parametrize("junk", [
    np.random.default_rng(3).bytes(3_000), b"\xee" * 3_000_000], ids=["little", "more than is held at once"])
def test_garbage_between_messages(junk: bytes) -> None:
    """Bytes that are no message are skipped and counted."""
    data = log(WHOLE)
    game = match(data[: start(20)] + junk + data[start(20) :])
    assert numbers(game) == list(range(60))
    assert notes(game, "damaged record") == [f"{len(junk)} bytes in which no message was found: left out"]
    assert game.info.incomplete_reason == "1 damaged places"


def test_an_index_with_a_broken_length() -> None:
    """A damaged type that looks like an index takes nothing with it."""
    data = bytearray(log(WHOLE))
    data[start(30) + 11] = ssl.INDEX
    data[start(30) + 12 : start(30) + 16] = struct.pack(">i", 1 << 29)
    assert numbers(match(bytes(data))) == [*range(30), *range(31, 60)]


def test_damaged_content() -> None:
    """A packet that cannot be decoded is left out and counted."""
    broken = [m._replace(content=m.content[:40]) if i == 5 else m for i, m in enumerate(WHOLE)]
    game = match(broken)
    assert numbers(game) == [n for n in range(60) if n != 5]
    assert notes(game, "damaged record") == ["vision packets that cannot be decoded"]


def test_other_types() -> None:
    """Messages of types that are not read are counted."""
    game = match(ordered(WHOLE, [Message(ns(0.1), 1, b"x"), Message(ns(0.2), 9, b"yy"), Message(ns(0.3), 9, b"")]))
    assert len(game.frames) == 60
    assert notes(game, "skipped") == ["messages of type 1, which is not read", "messages of type 9, which is not read"]
    assert flaws(game)["skipped"] == 3


# --- clocks ---------------------------------------------------------------------------------------


def shifted(messages: list[Message], by: float) -> list[Message]:
    """Frames whose capture clock is another; when they were received stays."""
    return [
        message._replace(content=ssl.vision(n, EPOCH + n * STEP + by, balls=[Seen(n * 0.01, 0)], yellow=[Seen(1, 1, 1)]))
        for n, message in enumerate(frames(60)) if message in messages
    ]


BACK, AHEAD = "clock jump back", "clock leap ahead"


@pytest.mark.parametrize(("until", "by", "wanted"), [
    (60, -3_600.0, {BACK: 1}), (60, 86_400.0, {AHEAD: 1}), (60, -1.7e9, {BACK: 1}), (31, -1.0e9, {BACK: 1, AHEAD: 1})])
def test_the_capture_clock_jumps(until: int, by: float, wanted: dict[str, int]) -> None:
    """Times go on as packets were received, and each jump is flagged, also that of a single frame."""
    game = match([*WHOLE[:30], *shifted(WHOLE[30:until], by), *WHOLE[until:]])
    np.testing.assert_allclose(game.frames.t_ns / 1e9, np.arange(60) * STEP, atol=1e-6)
    assert wanted.items() <= flaws(game).items()


@pytest.mark.parametrize(("every", "at", "wanted"), [
    (1, 0.0, {BACK: 1}), (1, 5e8, {BACK: 1}), (10, 0.0, {BACK: 1, AHEAD: 1}), (7, 1.0, {BACK: 1, AHEAD: 1})])
def test_the_capture_clock_is_not_set(every: int, at: float, wanted: dict[str, int]) -> None:
    """Frames without a capture time come when they were received, and are one row of a kind, with their count."""
    game = match([
        message if n % every else Message(message.received, ssl.VISION_2014, ssl.vision(n, at, balls=[ssl.Seen(0.01 * n, 0)], blue=[ssl.Seen(1, 0, 1)]))
        for n, message in enumerate(frames(60))][1 - (every == 1):])
    np.testing.assert_allclose(game.frames.t_ns / 1e9, np.arange(len(game.frames)) * STEP, atol=1e-6)
    rows = game.quality.filter(pl.col("flaw").cast(pl.String).is_in([BACK, AHEAD]))
    assert rows.group_by("flaw").len().height == len(rows) == len(wanted)
    assert set(rows["count"]) == {60 if every == 1 else len(range(every, 60, every))}


def test_the_receive_clock_jumps() -> None:
    """The recorder's clock decides nothing while the capture clock goes on."""
    game = match([m._replace(received=m.received - (n >= 30) * 10**12) for n, m in enumerate(WHOLE)])
    np.testing.assert_allclose(game.frames.t_ns / 1e9, np.arange(60) * STEP, atol=1e-6)
    assert set(flaws(game)) == UNREFEREED


def test_a_gap() -> None:
    """A gap by both clocks is a gap."""
    game = match([*frames(30), *[m._replace(received=m.received) for m in frames(30, first=6_000)]])
    assert (np.diff(game.frames.t_ns) / 1e9).max() == pytest.approx((6_000 - 29) * STEP, abs=1e-6)
    assert game.info.complete


def test_clocks_that_are_no_numbers() -> None:
    """Frames without a usable time are damaged."""
    bad = [Message(ns(n * STEP), ssl.VISION_2014, ssl.vision(n, t)) for n, t in enumerate([float("nan"), 1e300, float("inf")])]
    game = match([*bad, *frames(20, first=3)])
    assert numbers(game) == list(range(3, 23))
    assert flaws(game)["damaged record"] == 3


# --- several logs, versions, streams --------------------------------------------------------------


def test_two_logs_of_one_match() -> None:
    """A log that goes on where the one before ends is read on, and said."""
    game = match(log(WHOLE[:30], index=True) + log(WHOLE[30:]))
    assert numbers(game) == list(range(60))
    assert game.info.complete
    assert notes(game, "skipped") == ["the header of a further log in the file: read on, it is of the same match"]


@pytest.mark.parametrize("later", [-7_200.0, 7_200.0])
def test_two_logs_of_two_matches(later: float) -> None:
    """A log of another time is another match."""
    gc = Referee()
    other = [gc.says(0, blue=Team("Others", 5)), *frames(60)]
    other = [m._replace(received=m.received + round(later * 1e9)) for m in other]
    game = match(log(WHOLE) + log(other))
    assert numbers(game) == list(range(60))
    assert game.info.home == "blue"
    assert (game.info.complete, flaws(game)["several matches"]) == (True, 2)
    second = read(open_source(log(WHOLE) + log(other), "game.log").numbered(2))
    assert (numbers(second), second.info.home) == (list(range(60)), "Others")
    with pytest.raises(BadRecording, match=r"game.log: has no match number 3: it has 2"):
        read(open_source(log(WHOLE) + log(other), "game.log").numbered(3))


@pytest.mark.parametrize("version", [2, -1, 1 << 24])
def test_unknown_versions(version: int) -> None:
    """A log of an unknown version is refused: its messages may be other ones."""
    with pytest.raises(BadRecording, match=f"x.log: is an SSL log of version {version}. Convert it to version 1"):
        read(open_source(log(WHOLE, version=version), "x.log"))


@pytest.mark.parametrize("data", [b"SSL_LOG_FILE", log([]), log([])[:14], log(WHOLE)[: start(0) + 10]])
def test_nothing_in_it(data: bytes) -> None:
    """A log without a frame is refused in one line."""
    with pytest.raises(BadRecording, match=r"x\.log: has no vision or tracker frames"):
        read(open_source(data, "x.log"))


def test_zstd() -> None:
    """A log that is packed with Zstandard is the same match, also of several frames; its damage is flagged."""
    data = log(WHOLE)
    pack = zstandard.ZstdCompressor().compress
    plain = read(open_source(data, "game.log"))
    for packed in (pack(data), pack(data[:5_000]) + pack(data[5_000:]), gzip.compress(data)):
        source = open_source(packed, "game.log.zst")
        assert source.content == b""
        assert b"".join(source.pieces()) == data
        assert source.match_id == open_source(data, "game.log").match_id
        same_name = read(open_source(packed, "game.log"))
        assert same(same_name, plain)
    # raw blocks: what comes before the cut is there
    cut = zstandard.ZstdCompressor(level=1).compressobj()
    packed = b"".join(cut.compress(data[at : at + 1_000]) + cut.flush(zstandard.COMPRESSOBJ_FLUSH_BLOCK)
                      for at in range(0, len(data), 1_000))
    game = match(packed[: len(packed) * 2 // 3])
    assert 10 < len(game.frames) < 60
    assert str(game.info.incomplete_reason).startswith("the zstd stream is cut off")
    with pytest.raises(BadRecording, match="the zstd stream is corrupt"):
        open_source(b"\x28\xb5\x2f\xfd" + b"\xff" * 50, "x.log")


def test_a_bomb_in_zstd(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stream that unpacks to too much is refused."""
    bomb = zstandard.ZstdCompressor().compress(b"SSL_LOG_FILE\0\0\0\1" + bytes(100 << 20))
    with pytest.raises(BadRecording, match="unpacks to more than"):
        open_source(bomb, "x.log")
    monkeypatch.setattr(packing, "MAX_RATIO", 1 << 20)
    with pytest.raises(BadRecording, match="unpacks to more than"):
        open_source(bomb, "x.log", ImportSettings(megabytes=6))


@pytest.mark.slow
def test_flat_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The survey of a log four times as long needs no more memory; its import needs what a sample's times take.

    That is less than three robots take, of 22. ``tracemalloc`` counts what Python and numpy allocate, and no maps
    of files. The look for situations is at two minutes at most, whatever the length, and is left out.
    """
    monkeypatch.setattr("pitchlore.pipeline.engine.matches.with_recognition", lambda match: match)
    monkeypatch.setattr("pitchlore.pipeline.engine.matches.warm", lambda: None)
    peaks, frames = [], []
    for seconds in (45, 180):
        file = tmp_path / f"{seconds}.log"
        file.write_bytes(long_log(seconds))
        with Files(tmp_path).opened(file, megabytes=64) as data:
            source = open_source(data, file.name)
            tracemalloc.start()
            survey(source)
            surveyed = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        receipt, *_ = take_in(Store(tmp_path / f"of {seconds}"), Recording(file=file))
        peaks.append((surveyed, tracemalloc.get_traced_memory()[1]))
        tracemalloc.stop()
        frames.append(receipt.details["frames"])
    assert frames == [45 * HZ, 180 * HZ]
    assert peaks[1][0] < 1.1 * peaks[0][0]
    assert peaks[1][1] - peaks[0][1] < 3 * ROBOT_DTYPE.itemsize * (frames[1] - frames[0])


def test_a_full_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is no room for what is read, one line says so; the recording is good, and comes in when there is."""
    file = tmp_path / "game.log"
    file.write_bytes(log(WHOLE))
    store = Store(tmp_path / "data")
    with monkeypatch.context() as full:
        full.setattr("pitchlore.pipeline.base.spool.TemporaryFile", partial(Path("/dev/full").open, "w+b"))
        with pytest.raises(StorageFailed) as reported:
            take_in(store, Recording(file=file))
    assert str(reported.value) == (
        f"{tempfile.gettempdir()}: cannot be written (No space left on device). Free space or mend the folder, "
        "then run again; nothing that was there is lost.")
    assert list(store.receipts("matches")) == []
    assert store.quarantined() == []
    assert take_in(store, Recording(file=file))[1]
