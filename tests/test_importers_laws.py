"""The laws of importers, imposed on every reader of ``READERS`` with its synthetic recordings.

A recording is synthetic if ``recordings/make.py`` wrote it: it tells the sketch, so that all readers
must make the same match. No file from outside is needed.
"""

import gzip
import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recordings.make import FILES, sketch
from support.recordings import assert_sound, same

from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.importers.readers import READERS, Reader, open_source
from pitchlore.pipeline.importers.readers import read as read_source
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap, load_map
from pitchlore.pipeline.matches.frame import MatchLog, home_attacks

FOLDER = Path(__file__).parent / "recordings"
#: In float32, of numbers that a text log has with four decimals.
TOLERANCE = 2e-4


def recordings(reader: Reader) -> list[Path]:
    """The synthetic recordings of a reader."""
    return sorted(path for path in (FOLDER / reader.name).glob("*") if path.suffix != ".toml")


CASES = [pytest.param(path, id=f"{reader.name}-{path.stem}") for reader in READERS for path in recordings(reader)]
each_recording = pytest.mark.parametrize("path", CASES)


def mapping(path: Path) -> TrackingMap:
    beside = path.with_name(f"{path.name}.toml")
    return load_map(beside.read_text(encoding="utf-8")) if beside.exists() else TrackingMap()


def read(path: Path, data: bytes | None = None, name: str | None = None) -> MatchLog:
    """A recording as a match, or what ``data`` makes of it under another name."""
    source = open_source(path.read_bytes() if data is None else data, name or path.name)
    return read_source(source, mapping(path))


def outcome(path: Path, data: bytes) -> MatchLog | None:
    """The match of a damaged recording, or None if it was refused as it should be."""
    try:
        return read(path, data)
    except PitchloreError as error:
        refusal = error
    line = str(refusal)
    assert line.startswith(f"{path.name}: "), line
    assert "\n" not in line
    assert refusal.next_step, line
    return None


def without_name(log: MatchLog) -> MatchLog:
    """A log without what a file's name decides."""
    tables = {
        name: getattr(log, name).with_columns(match_id=pl.lit("x-0")) for name in ("referee", "decisions", "quality", "commands")
    }
    return replace(log, info=log.info.model_copy(update={"source": "", "match_id": "x-0"}), **tables)


def test_recordings() -> None:
    """Every recording has a maker and a reader, and every reader a recording."""
    # `goals` has clips of matches that were played here, which judges have looked at
    files = {path.relative_to(FOLDER).as_posix() for path in FOLDER.glob("*/*")
             if not {"__pycache__", "goals"} & set(path.parts)}
    assert files == set(FILES)
    assert {name.split("/")[0] for name in FILES} == {reader.name for reader in READERS}, (
        "a reader has no synthetic recording: in tests/recordings/make.py write the sketch in its format as "
        "FILES['READER/NAME'], run it, and commit tests/recordings/READER/NAME")


@pytest.mark.parametrize("name", FILES)
def test_made_recording(name: str) -> None:
    """A recording has the bytes that its maker writes or, as Parquet or MCAP, makes an equal match."""
    path = FOLDER / name
    made = FILES[name]()
    if path.suffix in (".parquet", ".mcap"):
        assert same(without_name(read(path, made)), without_name(read(path)))
    else:
        assert path.read_bytes() == made


@each_recording
def test_detection(path: Path) -> None:
    """Exactly one reader recognises the content, whatever the file's name."""
    data = path.read_bytes()
    for name in (path.name, "liar.txt", ""):
        assert open_source(data, name).format == path.parent.name
    assert [reader.name for reader in READERS if reader.detects(data[:65536])] == [path.parent.name]


@each_recording
def test_bodies(path: Path) -> None:
    """A whole recording is sound and complete; times, axes, units, numbers are ours; who was not seen is not there."""
    log, truth = read(path), sketch()
    assert_sound(log)
    assert log.info.complete, log.info.incomplete_reason
    assert (log.info.home, log.info.away) == (truth.info.home, truth.info.away)
    assert log.info.pitch == truth.info.pitch
    assert (home_attacks(log.info.periods, log.frames.t_ns) == 1).all()
    assert log.frames.t_ns.tolist() == truth.frames.t_ns.tolist()
    assert log.frames.number.tolist() == truth.frames.number.tolist()
    assert log.frames.offsets.tolist() == truth.frames.offsets.tolist()
    for got, wanted in ((log.frames.ball, truth.frames.ball), (log.frames.robots, truth.frames.robots)):
        for column in wanted.dtype.names:
            exact = column in ("team", "id")
            known = ~np.isnan(got[column])
            assert known.all() or column in ("vx", "vy", "omega"), column  # not every format has these
            np.testing.assert_allclose(
                got[column][known], wanted[column][known], rtol=0, atol=0 if exact else TOLERANCE, err_msg=column
            )


@each_recording
def test_referee(path: Path) -> None:
    """Kick-offs, goals, half-time and the end are those of the sketch, with their teams and scores."""
    def course(log: MatchLog) -> list[tuple[object, ...]]:
        # where play goes on after a kick-off need not be said
        reported = log.referee.filter(pl.col("event") != "play")
        return reported.select("t_ns", pl.col("event", "team").cast(pl.String), "score_home", "score_away").rows()

    assert course(read(path)) == course(sketch())


@each_recording
def test_gzipped_recording(path: Path) -> None:
    """A recording that is imported again, gzipped, is the same match, of the same identity."""
    data = path.read_bytes()
    packed = gzip.compress(data)
    assert same(read(path), read(path, packed))
    assert open_source(packed, path.name) == open_source(data, path.name)


@each_recording
def test_name(path: Path) -> None:
    """The file's name decides the slug of the match id and ``source``, and nothing else."""
    data = path.read_bytes()
    one, two = open_source(data, path.name), open_source(data, "../Another Name.bin.gz")
    digits = hashlib.sha256(data).hexdigest()
    assert (one.match_id, two.match_id) == (f"{path.stem}-{digits[:12]}", f"another-name-{digits[:12]}")
    assert one.sha256 == two.sha256 == digits
    assert same(without_name(read(path)), without_name(read(path, name="../Another Name.bin.gz")))


@each_recording
@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("packed", [False, True], ids=["plain", "gzipped"])
def test_cut_recording(path: Path, share: float, packed: bool) -> None:
    """A cut recording is refused in one line, or its match is incomplete and flagged."""
    data = path.read_bytes()
    if packed:
        data = gzip.compress(data)
        at = int(share * len(data))
    else:  # within a line, if the format has lines
        at = max(int(share * len(data)), data.find(b"\n", int(share * len(data)), -60) + 6)
    log = outcome(path, data[:at])
    if log is not None:
        assert_sound(log)
        assert not log.info.complete
        assert log.info.incomplete_reason
        assert not set(log.quality["flaw"]).isdisjoint({"truncated", "damaged chunk", "damaged record"})


@each_recording
def test_damaged_gzip_stream(path: Path) -> None:
    """Damage of the gzip stream is flagged, also if the content is whole."""
    log = read(path, gzip.compress(path.read_bytes()) + b"tail")
    assert log.frames.t_ns.tolist() == sketch().frames.t_ns.tolist()
    assert not log.info.complete
    assert "gzip stream" in str(log.info.incomplete_reason)
    assert "truncated" in log.quality["flaw"]


@each_recording
@given(st.floats(0, 1, exclude_max=True),
       st.sampled_from([b"\xff" * 8, b"\0" * 8, b",;\n\"", b"9" * 30]) | st.binary(max_size=8))
def test_damaged_recording(path: Path, share: float, junk: bytes) -> None:
    """Some bytes are overwritten anywhere: nothing but a refusal or a sound match may come of it."""
    data = path.read_bytes()
    at = int(share * len(data))
    log = outcome(path, data[:at] + junk + data[at + len(junk) :])
    if log is not None:
        assert_sound(log)
