"""How a recording is opened, told and named; the recordings that nobody here simulated."""

import gzip
import hashlib
import random
import re
import zlib
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from conftest import ROOT
from hypothesis import given
from hypothesis import strategies as st
from recordings.make import FILES
from support import recordings
from support.mcap_logs import SMALL, match, written
from support.recordings import ALL, INSPER, RCSS, RSIM, SSL, assert_sound, imported

from pitchlore.pipeline.base.errors import BadRecording, NoFrames
from pitchlore.pipeline.base.text import date_in
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.importers import readers, source
from pitchlore.pipeline.importers.football.providers import PROVIDERS
from pitchlore.pipeline.importers.readers import READERS, open_source, read
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.foreign import ForeignFile


@pytest.mark.parametrize("name", ALL)
def test_real_recording(name: str) -> None:
    """A real recording becomes a sound match."""
    match = imported(name)
    frames, info = match.frames, match.info
    assert_sound(match)
    assert (np.diff(frames.t_ns) > 0).all()
    assert match.referee["t_ns"].is_between(0, int(frames.t_ns[-1])).all()
    assert info.periods[-1].end_ns == frames.t_ns[-1] + 1
    # no body is further out than players and balls go: into the net and over the line
    margin = 0.1 * info.pitch.length
    for bodies in (frames.robots, frames.ball):
        assert np.nanmax(np.abs(bodies["x"])) < info.pitch.length / 2 + margin
        assert np.nanmax(np.abs(bodies["y"])) < info.pitch.width / 2 + margin
    assert not np.isnan(frames.robots["theta"]).any()


@pytest.mark.parametrize(
    ("name", "home", "away", "score"),
    [
        (RSIM, "blue", "yellow", (21, 4)),
        (SSL, "TIGERs", "RoboCIn", (1, 0)),
        (RCSS, "KickRunA", "KickRunB", (0, 3)),
        (INSPER, "finalmente", "final", (0, 0)),
    ],
)
def test_teams_and_goals(
    name: str, home: str, away: str, score: tuple[int, int]
) -> None:
    """Teams and goals are those of the match."""
    match = imported(name)
    assert (match.info.home, match.info.away) == (home, away)
    assert match.referee.select("score_home", "score_away").row(-1) == score
    goals = match.referee.filter(pl.col("event") == "goal")["team"].cast(pl.String).to_list()
    assert (goals.count("home"), goals.count("away")) == score


@pytest.mark.parametrize("name", [RSIM, SSL, RCSS])
def test_goals_of_real_matches(name: str) -> None:
    """Teams, scores and directions are found apart from each other; here they must agree."""
    match = imported(name)
    goals = match.referee.filter(pl.col("event") == "goal")
    for t_ns, team in goals.select("t_ns", pl.col("team").cast(pl.String)).iter_rows():
        period = next(p for p in match.info.periods if p.start_ns <= t_ns < p.end_ns)
        attacks = period.home_attacks * (1 if team == "home" else -1)
        before = (match.frames.t_ns > t_ns - 1_000_000_000) & (match.frames.t_ns <= t_ns)
        x = match.frames.ball["x"][before]
        assert np.nanmax(x * attacks) > 0.9 * match.info.pitch.goal_x, (t_ns, team)


# --- what a file is -----------------------------------------------------------------------------

PLAIN = FILES["tracking-csv/plain.csv"]()
CSV = b"frame,t,team,player,x,y\n0,0.0,ball,,0,0\n0,0.0,a,1,0.1,0\n0,0.0,b,1,-0.1,0\n"


@pytest.mark.parametrize(
    ("head", "is_a"),
    [
        (b"\x89MCAP0\r\n and more", "mcap"),
        (b"ULG5\n(show 0)", "rcg"),
        (b"ULG\x03\x00", "rcg"),
        (b"PAR1....PAR1", "tracking-parquet"),
        (CSV, "tracking-csv"),
        (b"\xef\xbb\xbf" + CSV, "tracking-csv"),
    ],
)
def test_format_by_content(head: bytes, is_a: str) -> None:
    """The format is found from the content, whatever the file's name."""
    assert open_source(head, "liar.txt").format == is_a
    assert open_source(gzip.compress(head), "liar.mcap").format == is_a


@pytest.mark.parametrize(
    "junk",
    [
        b"", gzip.compress(b"", mtime=0), b"Dear referee, the match was good, fast, fair, and short.\nYours, a fan\n",
        b"\x00" * 100, b"{}", b"TEAMLOG\x00\x01\x02private", b"SSL_LOG\0\0\0\1" + bytes(40),
        b"\0" * 16 + b"SSL_LOG_FILE", b"1,2,3,4,5\n1,2,x,4,5\n", b"\x1f\x8b not gzip",
    ],
)
def test_refusal_of_other_files(junk: bytes) -> None:
    """A file of no known format is refused in one line that says what to do."""
    with pytest.raises(BadRecording, match=r"\. .*(Give one of these, .*MCAP log|Copy or record)") as refusal:
        read(open_source(junk, "junk.bin"))
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).startswith("junk.bin: ")


def test_inflate() -> None:
    """A gzip stream is inflated whole, in parts, or refused."""
    noise = random.Random(1).randbytes(300_000)
    packed = gzip.compress(noise)
    assert source.inflate(noise, "a.gz") == (noise, None)
    assert source.inflate(packed, "a.gz") == (noise, None)
    assert source.inflate(packed + packed, "a.gz") == (noise + noise, None)
    assert source.inflate(packed + b"\0" * 512, "a.gz") == (noise, None)

    data, damage = source.inflate(packed[: len(packed) // 2], "a.gz")
    assert noise.startswith(data)
    assert len(data) > 100_000
    assert damage == "the gzip stream is cut off"

    data, damage = source.inflate(packed + b"tail", "a.gz")
    assert data == noise
    assert damage is not None

    wrong_sum = packed[:-8] + bytes(8)
    assert source.inflate(wrong_sum, "a.gz")[1] is not None

    with pytest.raises(BadRecording, match=r"^a\.gz: .*cut off"):
        source.inflate(packed[:11], "a.gz")

    stored = gzip.compress(noise, compresslevel=0)  # the damage is met at a block's head
    half = len(stored) // 2
    data, damage = source.inflate(stored[:half] + b"\xff" * half, "a.gz")
    assert damage is not None
    assert "corrupt" in damage
    assert len(data) > 0.45 * len(noise)
    assert noise.startswith(data[: int(0.45 * len(noise))])


@pytest.mark.parametrize(
    ("name", "slug"),
    [
        ("rsim-vss-3v3.parquet", "rsim-vss-3v3"),
        ("20220712-A_0-vs-B_3.rcg.gz", "20220712-a-0-vs-b-3"),
        ("../../etc/passwd", "passwd"),
        ("C:\\logs\\Jogo Único.csv", "jogo-unico"),
        ("'; DROP TABLE matches; --.csv", "drop-table-matches"),
        ("", "match"),
        (".parquet", "parquet"),
        ("x" * 39 + "--y", "x" * 39),
    ],
)
def test_hostile_names_become_safe(name: str, slug: str) -> None:
    """A hostile file name becomes a safe match id."""
    assert open_source(b"data", name).match_id == f"{slug}-3a6eb0790f39"


@pytest.mark.parametrize(("name", "day"), [
    ("foxes-wolves-2026-09-12.csv", "2026-09-12 00:00:00+00:00"), ("20180504161434-MT2018_2-vs-B_0.rcg", "2018-05-04 16:14:34+00:00"),
    ("2019-07-05_15-20_A-vs-B.log.gz", "2019-07-05 15:20:00+00:00"), ("a_20260912-2500.csv", "2026-09-12 00:00:00+00:00"),
    ("ssl-2025-robocin-345s.parquet", "None"), ("2026-13-40.csv", "None"), ("123202609121.csv", "None")])
def test_days_in_names(name: str, day: str) -> None:
    """The day of a match is in its file's name, however written; numbers that are no day are none."""
    assert str(date_in(name)) == day


@given(st.text(max_size=80), st.binary(max_size=40))
def test_valid_identity(name: str, data: bytes) -> None:
    """Every file name makes a valid match id."""
    assert re.fullmatch(r"[a-z0-9][a-z0-9-]{0,63}", open_source(b"x" + data, name).match_id)


# --- what an import does to a file ----------------------------------------------------------------


class CountedStream:
    """A gzip stream that counts the bytes it inflates."""

    open = staticmethod(zlib.decompressobj)
    inflated = 0

    def __init__(self, wbits: int) -> None:
        self._stream = CountedStream.open(wbits)

    def decompress(self, data: bytes) -> bytes:
        out = self._stream.decompress(data)
        CountedStream.inflated += len(out)
        return out

    eof = property(lambda self: self._stream.eof)
    unused_data = property(lambda self: self._stream.unused_data)


@pytest.mark.parametrize("name", [name for name in FILES if not name.endswith((".toml", "mapped.csv"))])
def test_opened_once(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An import reads, inflates and hashes a recording once, also if its match is there already.

    A streamed one is inflated twice more when its match is made, and never held whole.
    """
    content = FILES[name]()
    if name.startswith("mcap"):
        content = content[:-8]  # or the log that is written would be the same bytes, and hashed too
    file = tmp_path / "packed"
    file.write_bytes(gzip.compress(content))
    reads: list[Path] = []
    hashes: list[bool] = []
    opened, sha256 = Store.opened, hashlib.sha256
    identity = sha256(content).hexdigest()

    def open_file(store: Store, path: Path, **limits: int) -> AbstractContextManager[ForeignFile]:
        reads.append(path)
        return opened(store, path, **limits)

    def hashed(data: bytes) -> object:
        hashes.append(data == content)
        return sha256(data)

    monkeypatch.setattr(Store, "opened", open_file)
    monkeypatch.setattr(hashlib, "sha256", hashed)
    monkeypatch.setattr(readers, "sha256", hashed)
    monkeypatch.setattr(zlib, "decompressobj", CountedStream)
    monkeypatch.setattr(CountedStream, "inflated", 0)
    store = Store(tmp_path / "data")
    streamed = next(reader for reader in READERS if reader.name == name.partition("/")[0]).streamed
    for times, new in ((1, True), (2, False)):
        receipt, is_new, _ = take_in(store, Recording(file=file))
        assert (is_new, receipt.inputs) == (new, {"source": identity})
        inflated = times + 2 * streamed
        assert (len(reads), sum(hashes), CountedStream.inflated) == (times, times, inflated * len(content))


def test_hopeless_gzip(tmp_path: Path) -> None:
    """A file that cannot be inflated goes into quarantine until one of its name can be."""
    store = Store(tmp_path / "data")
    file = tmp_path / "Final 2026.csv.gz"
    file.write_bytes(gzip.compress(CSV)[:11])
    with pytest.raises(BadRecording, match="cut off"):
        take_in(store, Recording(file=file))
    (record,) = store.quarantined()
    assert (record.noun, record.name, record.error) == ("matches", "final-2026", "BadRecording")
    file.write_bytes(gzip.compress(CSV))
    take_in(store, Recording(file=file))
    assert store.quarantined() == []


def test_table_of_readers() -> None:
    """The page's table of formats has the rows of READERS and football's, and a refusal names them all."""
    page = (ROOT / "docs" / "how-to" / "import.md").read_text(encoding="utf-8")
    table = page.partition("| recording | what is read |\n|---|---|\n")[2].partition("\n\n")[0]
    *rows, football = table.splitlines()
    assert rows == [f"| {reader.title} | {reader.about} |" for reader in READERS]
    assert all(provider.title.partition(",")[0].partition(" (")[0] in football for provider in PROVIDERS.values())
    assert len({reader.name for reader in READERS}) == len(READERS)
    with pytest.raises(BadRecording) as refusal:
        read(open_source(b"no recording", "x"))
    assert all(reader.title in str(refusal.value) for reader in READERS)


# --- identity ---------------------------------------------------------------------------------------


def log_called(path: Path, match_id: str, **changes: Any) -> Recording:
    """A log of ours with another id, other teams, and so on."""
    log = recordings.read(PLAIN, "plain.csv", match_id=match_id)
    path.write_bytes(written(replace(log, info=log.info.model_copy(update=changes))))
    return Recording(file=path)


@pytest.mark.parametrize("ids", [("a-1", "b-1"), ("derby", "final"), ("a", "b-a"), ("x-0123456789ab", "y-0123456789ab")])
def test_ids_that_end_alike(tmp_path: Path, ids: tuple[str, str]) -> None:
    """Two different logs are two matches, whatever their ids."""
    store = Store(tmp_path / "data")
    for name, home in zip(ids, ("Lions", "Tigers"), strict=True):
        receipt, new, _ = take_in(store, log_called(tmp_path / f"{name}.mcap", name, home=home, recording=None))
        assert (receipt.name, new) == (name, True)
    assert {receipt.name for receipt in store.receipts("matches")} == set(ids)


def test_one_recording_under_two_names(tmp_path: Path) -> None:
    """A log from another machine, of a recording that is here under another name, is the match that is here."""
    store = Store(tmp_path / "data")
    (tmp_path / "derby.csv").write_bytes(PLAIN)
    receipt, *_ = take_in(store, Recording(file=tmp_path / "derby.csv"))
    other = log_called(tmp_path / "final.mcap", "final-0123456789ab")
    assert take_in(store, other)[:2] == (receipt, False)
    assert take_in(store, Recording(file=tmp_path / "derby.csv"))[:2] == (receipt, False)


def test_same_id_other_match(tmp_path: Path) -> None:
    """The second of two different matches with the same id is refused in one line, and the first stands."""
    store = Store(tmp_path / "data")
    receipt, *_ = take_in(store, log_called(tmp_path / "a.mcap", "derby-1", home="Lions", recording=None))
    with pytest.raises(BadRecording, match="another match is here, with the same id derby-1"):
        take_in(store, log_called(tmp_path / "b.mcap", "derby-1", home="Tigers", recording=None))
    assert store.receipt("matches", "derby-1") == receipt


def test_copies_that_are_cut(tmp_path: Path) -> None:
    """The longer of two copies of a log stays if both are cut off, whichever comes first."""
    log, frames = match([6] * 200), []
    log.frames.robots["team"], log.frames.robots["id"] = np.divmod(np.arange(1200) % 6, 3)
    whole = written(log, chunk_bytes=SMALL)
    for order in ((2, 3), (3, 2)):
        store = Store(tmp_path / f"data-{order[0]}")
        for quarters in order:
            path = tmp_path / f"{quarters}.mcap"
            path.write_bytes(whole[:len(whole) * quarters // 4])
            receipt, new, _ = take_in(store, Recording(file=path))
            assert not receipt.details["complete"]
            assert new == (quarters == 3 or order[0] == 2)
            frames.append(receipt.details["frames"])
    assert 0 < frames[0] < frames[1] == frames[2] == frames[3]


def test_log_that_is_cut_before_its_frames(tmp_path: Path) -> None:
    """The refusal of a log of ours without a readable frame says that it is cut off, not that a map is missing."""
    whole = written(match([6] * 8))
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole[:whole.index(b"zstd") + 8])
    with pytest.raises(NoFrames, match=r"none of its frames can be read \(the file is cut off"):
        take_in(Store(tmp_path / "data"), Recording(file=path))
