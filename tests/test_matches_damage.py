"""The log of a match, damaged: what is sound is kept, what is not is named."""

import io
import json
import tracemalloc
import zlib

import lz4.frame
import numpy as np
import polars as pl
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex
from support.mcap_logs import (
    INFO,
    SMALL,
    foreign,
    frames_of,
    match,
    rows_of,
    with_chunk,
    written,
)
from support.recordings import same, same_frames

from pitchlore.pipeline import matches
from pitchlore.pipeline.base.errors import DamagedLog, NoFrames
from pitchlore.pipeline.matches import description
from pitchlore.pipeline.matches.channels import COMMAND
from pitchlore.pipeline.matches.chunks import unseal
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.records import FRAMING_BYTES
from pitchlore.pipeline.matches.zstd import Decompressor
from pitchlore.schemas import Commands, Decisions, Quality, Referee


def chunk_indexes(data: bytes) -> list[ChunkIndex]:
    return make_reader(io.BytesIO(data)).get_summary().chunk_indexes


def flipped(data: bytes, bit: int) -> bytes:
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def test_damaged_chunk():
    """A damaged chunk is reported, and the others are kept."""
    log = match([6] * 100, decisions=0, commands=0)
    data = written(log, chunk_bytes=SMALL)
    indexes = chunk_indexes(data)
    broken = indexes[3]
    where = broken.chunk_start_offset + broken.chunk_length - 20
    back = matches.read(flipped(data, 8 * where), where="final.mcap")
    lost = [i for i, t in enumerate(log.frames.t_ns) if broken.message_start_time <= t <= broken.message_end_time]
    assert rows_of(back.frames) == [row for i, row in enumerate(rows_of(log.frames)) if i not in lost]
    assert not back.info.complete
    assert f"chunk 4 of {len(indexes)}" in back.info.incomplete_reason
    assert f"{len(lost)} of 103 messages are missing" in back.info.incomplete_reason
    row, = back.quality.rows(named=True)
    assert (row["flaw"], row["start_ns"], row["end_ns"]) == (
        "damaged chunk", broken.message_start_time, broken.message_end_time + 1,
    )  # fmt: skip
    assert "final.mcap: chunk 4" in row["note"]


def test_damaged_commands():
    """Commands in a damaged chunk are lost with it; the other ones are kept."""
    log = match([6] * 100, commands=200)
    data = written(log, chunk_bytes=SMALL)
    broken = next(chunk for chunk in chunk_indexes(data) if set(chunk.message_index_offsets) == {COMMAND})
    back = matches.read(flipped(data, 8 * (broken.chunk_start_offset + broken.chunk_length - 20)), where="a.mcap")
    lost = pl.col("t_ns").is_between(broken.message_start_time, broken.message_end_time)
    assert back.commands.equals(log.commands.filter(~lost))
    assert 0 < len(back.commands) < 200
    assert same_frames(back.frames, log.frames)
    assert not back.info.complete
    assert back.quality["flaw"].to_list() == ["damaged chunk"]


def test_truncated_commands():
    """A part of the file is a part of the match: commands lie beside the frames of their time."""
    log = match([6] * 2000, commands=4000)
    data = written(log, chunk_bytes=SMALL)
    back = matches.read(data[: int(0.7 * len(data))], where="a.mcap")
    last = back.commands["t_ns"].max()
    assert 1000 * 16_666_667 < last < back.frames.t_ns.max() < log.frames.t_ns.max()  # written by 1,024 frames
    assert back.commands.equals(log.commands.filter(pl.col("t_ns") <= last))
    assert back.quality["flaw"].to_list() == ["truncated"]


def test_chunk_length():
    """A wrong length of a chunk loses nothing, as the index knows better."""
    log = match([6] * 100)
    data = written(log, chunk_bytes=SMALL)
    for index in chunk_indexes(data)[::5]:
        for bit in (0, 3, 9, 20, 40, 63):  # of the length, from a byte too many to half of all there is
            back = matches.read(flipped(data, 8 * (index.chunk_start_offset + 1) + bit), where="a.mcap")
            assert same_frames(back.frames, log.frames)
            assert back.decisions.equals(log.decisions)
            assert not back.info.complete


@pytest.mark.slow
def test_flipped_bits():
    """No single flipped bit passes unnoticed."""
    log = match([3, 3, 2, 3] * 10, decisions=6)
    data = written(log, chunk_bytes=SMALL)
    whole = set(rows_of(log.frames))
    rng = np.random.default_rng(1)
    bits = np.unique(np.concatenate([
        rng.choice(len(data) * 8, 150, replace=False),  # anywhere
        8 * 8 * 5 + np.arange(0, 8 * 400, 73),  # the metadata and definitions at its start
        len(data) * 8 - 1 - np.arange(0, 8 * 700, 59),  # the summary, the footer, the magic
    ]))  # fmt: skip
    unharmed = 0
    for bit in bits.tolist():
        try:
            back = matches.read(flipped(data, bit), where="a.mcap")
        except DamagedLog:
            continue
        if same(back, log):
            unharmed += 1
            continue
        assert not back.info.complete, f"bit {bit} changed the log without notice"
        assert back.info.incomplete_reason
        assert set(rows_of(back.frames)) <= whole, f"bit {bit} made up a frame"
        assert not back.quality.is_empty()
    assert unharmed == 0  # every byte of the file is under a checksum


@pytest.mark.slow
@pytest.mark.parametrize("chunked", [True, False])
def test_unchecked_garbage(chunked):
    """Garbage that no checksum covers is read or refused, and never crashes the reader."""
    data = foreign(match([2, 1] * 6, decisions=4), chunked=chunked, crcs=False)
    rng = np.random.default_rng(2)
    refused = 0
    for _ in range(60):
        changed = bytearray(data)
        for place in rng.integers(0, len(data), rng.integers(1, 4)):
            changed[place] = rng.choice([0, 1, 5, 127, 128, 255])
        try:
            back = matches.read(bytes(changed), where="a.mcap", default_info=INFO)
            Referee.validate(back.referee)
            Decisions.validate(back.decisions)
            Commands.validate(back.commands)
            Quality.validate(back.quality)
        except DamagedLog:
            refused += 1
    assert refused < 20


@settings(max_examples=60)
@given(share=st.floats(0, 1, exclude_max=True))
def test_truncated_file(share):
    """Every whole chunk of a truncated file is salvaged."""
    log = MatchLog(INFO, frames_of([6, 5] * 30))
    data = written(log, chunk_bytes=SMALL)
    end = int(share * len(data))
    ends = [c.chunk_start_offset + c.chunk_length for c in chunk_indexes(data)]
    if end < ends[0]:
        with pytest.raises(DamagedLog):
            matches.read(data[:end], where="a.mcap")
        return
    back = matches.read(memoryview(data)[:end], where="a.mcap")
    after = [c.message_start_time for c in chunk_indexes(data) if c.chunk_start_offset + c.chunk_length > end]
    kept = [row for row in rows_of(log.frames) if not after or row[1] < after[0]]
    assert rows_of(back.frames) == kept
    assert not back.info.complete
    assert "truncated" in back.quality["flaw"].to_list()


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_cut_chunk(compression):
    """The part of a file's last chunk that can be unpacked is kept: whole messages, in order, from its start."""
    rng = np.random.default_rng(1)
    log = MatchLog(INFO, frames_of([6] * 1800))  # 30 s
    log.frames.robots["x"] = rng.normal(size=len(log.frames.robots))
    whole = written(log, chunk_bytes=8 << 20)
    (index,) = chunk_indexes(whole)
    start = index.chunk_start_offset
    content = unseal(memoryview(whole)[start + FRAMING_BYTES:start + index.chunk_length], Decompressor())[0].tobytes()
    packed = {"zstd": zstandard.compress, "lz4": lz4.frame.compress, "": bytes}[compression](content)
    builder = RecordBuilder()
    Chunk(compression, packed, message_end_time=index.message_end_time, message_start_time=0,
          uncompressed_crc=zlib.crc32(content), uncompressed_size=len(content)).write(builder)
    data, last = whole[:start] + builder.end(), 0
    for share in (0.1, 0.3, 0.47, 0.7, 0.9, 0.999):
        cut = data[:start + int(share * (len(data) - start))]
        try:
            back = matches.read(cut, where="a.mcap")
        except NoFrames:
            assert share < 0.4
            continue
        assert rows_of(back.frames) == rows_of(log.frames)[:len(back.frames)]
        assert len(back.frames) >= max(last, (share - 0.35) * 1800)
        last = len(back.frames)
        assert back.quality["flaw"].sort().to_list() == ["damaged chunk", "truncated"]
        assert "no CRC vouches for" in back.info.incomplete_reason
        assert not back.info.complete
    assert last > 1200


@pytest.mark.parametrize("sizes", [True, False])
def test_several_zstd_frames(sizes):
    """A chunk is read whole, in however many frames of zstd it is, whether they say their sizes or not; a bomb behind the first is refused."""
    log = match([6] * 100)
    whole = written(log, chunk_bytes=SMALL)
    index = chunk_indexes(whole)[3]
    start, end = index.chunk_start_offset, index.chunk_start_offset + index.chunk_length
    content = unseal(memoryview(whole)[start + FRAMING_BYTES:end], Decompressor())[0].tobytes()
    pack = zstandard.ZstdCompressor(write_content_size=sizes).compress
    for packed, complete in ((pack(content[:70]) + pack(b"") + pack(content[70:]), True), (pack(content[:70]) + BOMB, False)):
        builder = RecordBuilder()
        Chunk("zstd", packed, message_end_time=index.message_end_time, message_start_time=index.message_start_time,
              uncompressed_crc=zlib.crc32(content), uncompressed_size=len(content)).write(builder)
        back = matches.read(whole[:start] + builder.end() + whole[end:], where="a.mcap")
        lost = [i for i, t in enumerate(log.frames.t_ns) if index.message_start_time <= t <= index.message_end_time]
        assert rows_of(back.frames) == [row for i, row in enumerate(rows_of(log.frames)) if complete or i not in lost]
        assert ("damaged chunk" in back.quality["flaw"].to_list()) != complete


def cheaply(data: bytes) -> MatchLog:
    """A log of which one frame can be read, with little memory."""
    tracemalloc.start()
    back = matches.read(data, where="a.mcap")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 << 20
    assert len(back.frames) == 1
    return back


def test_cut_bomb():
    """A cut chunk that unpacks to more than it declares, or declares too much, takes no memory."""
    for size in (256 << 20, 1000):
        cheaply(with_chunk("zstd", BOMB, size)[:-5])


def copies_of_metadata(data: bytes) -> list[int]:
    places = [i for i in range(len(data)) if data.startswith(b"final.rcg", i)]
    assert len(places) == 2
    return places


def test_damaged_metadata():
    """One damaged copy of the metadata is named, and the other serves."""
    log = match()
    data = written(log)
    for place in copies_of_metadata(data):
        back = matches.read(flipped(data, 8 * place), where="a.mcap")
        assert back.info.source == "final.rcg"
        assert "metadata" in back.info.incomplete_reason
        assert back.quality["flaw"].to_list() == ["damaged record"]
        assert same_frames(back.frames, log.frames)


def test_no_sound_metadata():
    """Without a sound copy of the metadata the user is asked which match it is."""
    data = written(match())
    for place in copies_of_metadata(data):
        data = flipped(data, 8 * place)
    with pytest.raises(DamagedLog, match=r"a\.mcap: a copy of the metadata .* is damaged\. Copy the log again"):
        matches.read(data, where="a.mcap")
    assert not matches.read(data, where="a.mcap", default_info=INFO).info.complete


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"match_id": "Final 2024"}, r"the field match_id of its metadata is not usable: .*\(it is 'Final 2024'\)\. Mend it"),
        ({"pitch": {}}, r"the field pitch\.kind of its metadata is missing: they are of another version"),
        ({"weather": "rain"}, r"the field weather of its metadata is not known: they are of another version"),
        ({"format": 3}, r"the field format of its metadata is not usable: .*\(it is '3'\)"),
        ("info: {", "the field info of its metadata is not usable"),
        ("info", "its metadata do not describe the match"),
        *((f"quality: {text}", "its metadata's list of flaws .* Read it with the version")
          for text in ("[{}", "3", '[{"flaw": "of tomorrow"}]')),
    ],
)
def test_bad_metadata_field(change, says):
    """Metadata that cannot be used, or are of another version, are refused with the name of the field."""
    texts = description.description_of(INFO, Quality.empty())
    if isinstance(change, dict):
        texts["info"] = json.dumps(json.loads(texts["info"]) | change)
    else:
        name, _, text = change.partition(": ")
        texts |= {name: text}
    if change == "info":
        del texts["info"]
    with pytest.raises(DamagedLog, match=rf"^a\.mcap: {says}") as error:
        description.parse(texts, where="a.mcap")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("data", [b"", b"PAR1", b"\x89MCAP0\r", bytes(5000), b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" * 2])
def test_no_log(data):
    """A file that is no log is refused in one line."""
    with pytest.raises(DamagedLog) as error:
        matches.read(data, where="a.mcap")
    assert str(error.value).startswith("a.mcap: ")
    assert "\n" not in str(error.value)


def test_no_readable_frame():
    """A log without a single readable frame is refused."""
    data = written(match([6] * 8))  # one chunk
    index, = chunk_indexes(data)
    with pytest.raises(DamagedLog, match="none of its frames can be read"):
        matches.read(flipped(data, 8 * (index.chunk_start_offset + 65)), where="a.mcap")


BOMB = zstandard.ZstdCompressor(level=3).compress(bytes(256 << 20))


@pytest.mark.parametrize(
    ("compression", "blob", "size", "why"),
    [
        ("zstd", BOMB, 256 << 20, "over the limit"),
        ("zstd", BOMB, 2**63, "over the limit"),
        ("zstd", BOMB, 1000, "two different sizes"),
        ("zstd", zstandard.ZstdCompressor(write_content_size=False).compress(bytes(8 << 20)), 1000, "does not have the size"),
        ("zstd", zstandard.compress(bytes(100)) + b"more", 100, "does not decompress"),
        ("lz4", b"nonsense", 100, "does not decompress"),
        ("", bytes(100), 200, "size"),
        ("brotli", bytes(100), 100, "neither zstd nor lz4"),
        ("zstd", zstandard.compress(bytes(range(100))), 100, "whole records"),
    ],
)  # fmt: skip
def test_false_chunk(compression, blob, size, why):
    """A chunk that is not what it declares is reported and costs little memory."""
    back = cheaply(with_chunk(compression, blob, size))
    assert why in back.quality["note"].str.join(" ")[0]
    assert back.quality.filter(flaw="damaged chunk").select("start_ns", "end_ns").rows() == [(5, 10)]
