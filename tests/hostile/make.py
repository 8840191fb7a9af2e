"""Recordings that mean harm. Each is made by code, and has bounds on what reading it may cost.

A case that a fuzz run finds (`make fuzz`) is kept here.
"""

import gzip
import io
import json
import os
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, ChunkIndex, Metadata
from recordings import make
from support import ssl_messages as ssl
from support.tracking import parquet

_HEADER = b"frame,t,team,player,x,y\n"
_JSON_LOG = b'[\n{"type":"header","version":"18.0.0"},\n'
_MAGIC = b"\x89MCAP0\r\n"


class Hostile(NamedTuple):
    """A recording that means harm.

    Attributes:
        name: name of the file.
        content: makes its bytes.
        said: part of what it is refused with; "" if it is read, as far as it is whole.
        seconds: most that reading it may take, on a busy machine.
        megabytes: most memory that it may take, besides its own bytes thrice.
        mapping: text of its map.
    """

    name: str
    content: Callable[[], bytes]
    said: str = ""
    seconds: float = 10.0
    megabytes: float = 200.0
    mapping: str | None = None


def _unfinished() -> bytes:
    """A log without its DataEnd and what follows."""
    whole = make.mcap()
    return whole[:whole.rindex(b"\x0f" + struct.pack("<Q", 4))]


def _encoded(*records: object) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)  # type: ignore[attr-defined]
    return builder.end()  # type: ignore[no-any-return, no-untyped-call]


def landmarks_that_lead_nowhere() -> bytes:
    """A summary whose chunk index names 20,000 places between the records: each search begins anew."""
    whole = make.mcap()
    filling = b"".join(b"\x20" + struct.pack("<Q", 1) + b"\0" for _ in range(200_000))
    data = whole[:8] + filling
    indexes = [ChunkIndex(chunk_length=10, chunk_start_offset=8 + 90 * i + 1, compression="", compressed_size=0,
                          message_index_length=0, message_index_offsets={}, message_end_time=0,
                          message_start_time=0, uncompressed_size=0) for i in range(20_000)]
    summary = _encoded(*indexes)
    footer = struct.pack("<BQQQ", 0x02, 20, len(data), 0)
    crc = zlib.crc32(summary + footer)
    return data + summary + footer + struct.pack("<I", crc) + _MAGIC


def lengths_that_lie() -> bytes:
    """Every record's length is that of the rest of the file."""
    data = bytearray(make.mcap()[:8])
    for i in range(100_000):
        data += b"\x05" + struct.pack("<Q", 10 * (100_000 - i)) + b"\0"
    return bytes(data)


def deep_metadata() -> bytes:
    """Metadata whose JSON is nested 100,000 deep, with a CRC that holds."""
    deep = "[" * 100_000 + "]" * 100_000
    texts = {"info": deep, "quality": deep}
    crc = zlib.crc32(json.dumps(texts, sort_keys=True).encode())
    return make.mcap()[:8] + _encoded(Metadata(name="pitchlore", metadata={**texts, "crc32": f"{crc:08x}"})) + _MAGIC


def bomb_in_a_chunk() -> bytes:
    """A chunk of a kilobyte that unpacks to a gigabyte."""
    return _unfinished() + _encoded(_chunk(zstandard.ZstdCompressor(level=3).compress(bytes(1 << 30)), 1 << 30))


def _chunk(packed: bytes, size: int) -> Chunk:
    return Chunk("zstd", packed, message_end_time=9, message_start_time=0, uncompressed_crc=0, uncompressed_size=size)


def many_rows() -> bytes:
    """A Parquet file of a few kilobytes with 5 million rows."""
    rows = 5_000_000
    table = pa.table({"frame": pa.array(np.zeros(rows, np.int64)), "t": pa.array(np.zeros(rows)),
                      "team": pa.array(["ball"] * rows).dictionary_encode(), "player": pa.nulls(rows, pa.string()),
                      "x": pa.array(np.zeros(rows)), "y": pa.array(np.zeros(rows))})
    buffer = io.BytesIO()
    pq.write_table(table, buffer, compression="zstd")
    return buffer.getvalue()


def lying_rows() -> bytes:
    """A Parquet file of 5 million rows whose footer says, at its head, that there are a thousand."""
    data = many_rows()
    (length,) = struct.unpack("<I", data[-8:-4])
    head, footer = data[:-8 - length], data[-8 - length:-8]
    # field 3, an i64 in zigzag varint: type 6 (i64), one field after the schema
    said, lie = ssl.varint(2 * 5_000_000), bytearray(ssl.varint(2 * 1_000))
    while len(lie) < len(said):  # the same number, with zeros that count nothing
        lie[-1] |= 0x80
        lie.append(0)
    assert said in footer
    return head + footer.replace(b"\x16" + said, b"\x16" + bytes(lie), 1) + data[-8:]


def many_columns() -> bytes:
    """A Parquet file with 20,000 columns."""
    return parquet(make.plain().with_columns(pl.lit(0).alias(f"c{i}") for i in range(20_000)))


def many_robots() -> bytes:
    """A table in which each row is another robot."""
    rows = "".join(f"{i // 100},{i // 100}.0,{'ab'[i % 2]},{i},0,0\n" for i in range(60_000))
    return _HEADER + b"0,0.0,ball,,0,0\n" + rows.encode()


def score_up_and_down() -> bytes:
    """A table whose score is 0 and 9,999 in turns."""
    rows = "".join(f"{i},{i / 10},{team},{player},0,0,{9_999 * (i % 2)},0\n" for i in range(400)
                   for team, player in (("ball", ""), ("a", 1), ("b", 1)))
    return b"frame,t,team,player,x,y,score_home,score_away\n" + rows.encode()


def one_long_word() -> bytes:
    """A Parquet table that names a text of a megabyte in each of its 20,000 rows."""
    rows = 20_000
    number = np.arange(rows)
    team = pa.DictionaryArray.from_arrays(pa.array(number % 3, pa.int32()), pa.array(["ball", "a", "b"]))
    state = pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows), pa.int32()), pa.array(["x" * (1 << 20)]))
    table = pa.table({"frame": number // 3, "t": number // 3 / 10, "team": team, "player": np.ones(rows, np.int64),
                      "x": np.zeros(rows), "y": np.zeros(rows), "game_state": state})
    buffer = io.BytesIO()
    pq.write_table(table, buffer, store_schema=False)
    return buffer.getvalue()


def ssl_packets(content: Callable[[int], bytes], count: int, kind: int = ssl.VISION_2014) -> bytes:
    """An SSL log of so many packets, by their number; it is received at 100 Hz."""
    return ssl.log(ssl.Message(10**18 + i * 10**7, kind, content(i)) for i in range(count))


def ssl_balls(balls: int, frames: int) -> bytes:
    """A log whose frames have so many balls each, at one place."""
    ball = ssl.span(5, ssl.f32(1, 0.9) + ssl.f32(3, 10.0) + ssl.f32(4, 10.0))
    return ssl_packets(lambda i: ssl.span(1, ssl.f64(2, i / 100) + ssl.integer(4, 0) + ball * balls), frames)


def ssl_scattered() -> bytes:
    """A log of 32 cameras that see 400 balls each, all far from each other."""
    balls = [ssl.span(5, ssl.f32(1, 0.9) + ssl.f32(3, 300.0 * (i % 20)) + ssl.f32(4, 300.0 * (i // 20))) for i in range(400)]
    return ssl_packets(lambda i: ssl.span(1, ssl.f64(2, i / 3_200) + ssl.integer(4, i % 32) + b"".join(balls)), 2_500)


def ssl_robots() -> bytes:
    """A log whose frames have 450 robots each, many of one number, at places of their own."""
    robots = b"".join(ssl.span(6, ssl.integer(2, i % 40) + ssl.f32(3, 100.0 * i) + ssl.f32(4, 0.0)) for i in range(450))
    return ssl_packets(lambda i: ssl.span(1, ssl.f64(2, i / 100) + ssl.integer(4, i % 4) + robots), 1_500)


def ssl_false_heads() -> bytes:
    """A log with heads at every sixteenth byte, whose lengths lead beyond each other into damage."""
    head = ssl.log([ssl.Message(10**18, 4, b"")])[16:12 + 16] + (60_000).to_bytes(4, "big")
    return ssl.header() + head * (60 << 16)


DERBY = _HEADER + b"".join(b"%d,%.1f,ball,,0,0\n%d,%.1f,a,1,0.1,0\n%d,%.1f,b,1,-0.1,0\n" % (i, i / 10, i, i / 10, i, i / 10)
                           for i in range(20))


def pickle_in_a_type() -> bytes:
    """A table whose column's type is a pickle that ends the process that loads it."""
    class Evil:
        def __reduce__(self) -> tuple[object, ...]:
            return os._exit, (3,)

    table = pl.read_csv(DERBY).to_arrow()
    kind = {b"ARROW:extension:name": b"arrow.py_extension_type", b"ARROW:extension:metadata": pickle.dumps(Evil())}
    out = io.BytesIO()
    pq.write_table(table.cast(pa.schema([field.with_metadata(kind) for field in table.schema])), out)
    return out.getvalue()


def archive() -> bytes:
    """A zip file whose entries lead out of the folder, are a bomb, and a recording."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("../../derby.csv", DERBY)
        file.writestr("bomb.csv", bytes(64 << 20))
    return out.getvalue()


def wide_of_many() -> bytes:
    """A table with a row a sample, and columns for 2,000 robots."""
    names = [f"{axis}_a{i}" for i in range(2_000) for axis in "xy"]
    rows = b"".join(b"%d,%d.0%s\n" % (i, i, b",0" * len(names)) for i in range(20))
    return ",".join(["frame", "t", *names]).encode() + b"\n" + rows


HOSTILE = (
    Hostile("wide.csv", wide_of_many, "columns for 1999 robots, more than the limit robots = 128"),
    # UTF-16 that says so, of halves of characters
    Hostile("halves.csv", lambda: b"\xff\xfe" + b"\x00\xd8,\x00" * 200_000 + b"\n\x00",
            "has no column t, team, player, x, y"),
    Hostile("headless.csv", lambda: DERBY.partition(b"\n")[2], r"has no header; its first line is .*Number its columns"),
    Hostile("turning.csv", lambda: b"frame,t,team,player,x,y,heading\n" + b"".join(
        b"%d,%.1f,%s,1,0.%d,0,%d\n" % (i, i / 10, t, i, 3 * i) for i in range(40) for t in (b"a", b"b")),
        "nothing tells their unit"),
    Hostile("quadratic.mcap", landmarks_that_lead_nowhere, "does not say which match it is|damaged"),
    Hostile("lying.mcap", lengths_that_lie, "does not say which match it is|cut off"),
    Hostile("deep.mcap", deep_metadata, "none of its frames"),
    Hostile("bomb.mcap", bomb_in_a_chunk),
    # chunks that each declare 60 MB: together more than a log may have
    Hostile("chunks.mcap", lambda: _unfinished() + _encoded(*[_chunk(b"", 60 << 20)] * 200), "declares more than"),
    Hostile("line.csv", lambda: _HEADER + b"0,0.0,ball,,0,0\n0,0.0,a,1," + b"1" * (50 << 20) + b",0\n",
            "line_kilobytes = 1024", megabytes=50),
    Hostile("line.rcg", lambda: b"ULG5\n" + b"(show 1 " + b"9" * (50 << 20), "line_kilobytes = 1024", megabytes=50),
    Hostile("rows.parquet", many_rows, "5000000 rows, more than the limit rows = 4000000", megabytes=50),
    Hostile("liar.parquet", lying_rows, "5000000 rows, more than the limit rows = 4000000", megabytes=50),
    Hostile("columns.parquet", many_columns, megabytes=400),
    Hostile("header.csv", lambda: _HEADER[:-1] + b"".join(b",c%d" % i for i in range(100_000)) + b"\n" + _HEADER,
            "has a header|known format|has no|cannot be read|line", megabytes=400),
    Hostile("lines.csv", lambda: _HEADER + b"0,0,ball,,0,0\n" * 5_000_000, "5000001 lines, more than the limit rows", megabytes=50),
    Hostile("robots.csv", many_robots, "has 30000 robots of a team, more than the limit robots = 128", megabytes=600,
            seconds=30),
    Hostile("score.csv", score_up_and_down, "more than the limit goals = 1000", mapping='teams = {home = "a"}'),
    Hostile("score.rcg", lambda: b"ULG5\n" + b"".join(
        b"(team %d l r %d 0)\n(show %d ((b) 0 0 0 0))\n" % (i, 9_999 * (i % 2), i) for i in range(1, 2_000)),
            "more than the limit goals = 1000"),
    Hostile("goals.rcg", lambda: b"ULG5\n" + b"(playmode 1 goal_l)\n" * 100_000 + b"(show 1 ((b) 0 0 0 0))\n",
            "more than the limit goals = 1000"),
    Hostile("words.parquet", one_long_word, "MiB of text, more than the limit megabytes = 1024", megabytes=200),
    Hostile("streams.csv.gz", lambda: gzip.compress(b"", mtime=0) * 500_000, "has more than 1000 gzip streams"),
    Hostile("times.csv", lambda: _HEADER + b"".join(b"0,%d,%s,1,0,0\n" % (t, team) for t in (-2**63, 0, 2**63 - 1)
                                                    for team in (b"a", b"b")), "spans more than a day|not numbers"),
    # show lines with groups within groups
    Hostile("groups.rcg", lambda: b"ULG5\n" + b"(show 1 ((b) 0 0 0 0)" + b" ((l 1) 0 0x1 0 0 0 0 0 0" * 10_000 + b")" * 10_001 + b"\n",
            "no whole show line|"),
    # opened brackets, for expressions that go back
    Hostile("strings.rcg", lambda: _JSON_LOG + (b'{"a":"' + b"x" * 50 + b"\n") * 100_000, "is damaged at more than 1000 places"),
    Hostile("objects.rcg", lambda: _JSON_LOG + b'{"a":[\n' * 900 + b'{"b":0},\n' * 100_000, "has no whole show line"),
    Hostile("number.rcg", lambda: _JSON_LOG + b'{"show":{"time":1,"players":[],"ball":{"x":%d,"y":0,"vx":0,"vy":0}}}' % 10**400,
            "has no whole show line"),
    Hostile("brackets.rcg", lambda: b"ULG5\n" + b"(show 1 (pm 1" * 50_000 + b"\n", "has no whole show line"),
    Hostile("bomb.csv.zst", lambda: zstandard.compress(_HEADER + bytes(512 << 20)), "unpacks to more than", megabytes=150),
    # gzip in gzip: one layer is unpacked
    Hostile("twice.csv.gz", lambda: gzip.compress(gzip.compress(bytes(512 << 20))), "is packed twice. Unpack it once", megabytes=50),
    Hostile("archive.zip", archive, "is a zip archive. Unpack it", megabytes=50),
    Hostile("pickle.parquet", pickle_in_a_type),
    Hostile("bomb.csv.gz", lambda: gzip.compress(bytes(128 << 20), compresslevel=9), "unpacks to more than", megabytes=100),
    Hostile("deep.csv", lambda: DERBY, "is nested too deeply", mapping="a = " + "[\n" * 100_000 + "]\n" * 100_000),
    Hostile("tables.csv", lambda: DERBY, "has a line of 200001 characters", mapping="[" + ".".join("a" * 100_000) + "]"),
    Hostile("pitch.csv", lambda: DERBY, "length", mapping="[pitch]\nlength = 1e308\nwidth = 1e-308\n"),
    Hostile("infinite.csv", lambda: DERBY, "", mapping="[pitch]\nlength = 1000\nwidth = 0.1\n"),
    Hostile("states.csv", lambda: DERBY, "has 1000022 characters|has a line of 1000011 characters", mapping='[states]\n"' + "x" * 1_000_000 + '" = "goal"\n'),
    Hostile("balls.log", lambda: ssl_balls(500, 1_800), seconds=5),
    Hostile("crowd.log", lambda: ssl_balls(3_500, 500), "only 500 vision packets that cannot be decoded"),
    Hostile("scattered.log", ssl_scattered, seconds=5),
    Hostile("heads.log", ssl_false_heads, "has no vision or tracker frames|is damaged at more than 10000 places"),
    Hostile("robots.log", ssl_robots, seconds=5),
    Hostile("trackers.log", lambda: ssl_packets(
        lambda i: ssl.span(1, f"{i:08x}") + ssl.span(3, ssl.integer(1, 1) + ssl.f64(2, 5.0)), 50_000, ssl.TRACKER),
        seconds=5),
    Hostile("cameras.log", lambda: ssl_packets(
        lambda i: ssl.span(1, ssl.f64(2, i / 100) + ssl.integer(4, i) + ssl.span(5, ssl.f32(3, 1.0) + ssl.f32(4, 1.0))),
        50_000), seconds=5),
    Hostile("referees.log", lambda: ssl_packets(
        lambda i: ssl.referee(0, 0, i, source=str(i)), 25_000, ssl.REFEREE),
        "has no vision or tracker frames", seconds=5),
    Hostile("commands.log", lambda: ssl_packets(lambda i: ssl.referee(0, i % 2, i), 25_000, ssl.REFEREE),
            "a referee who says something else more than 20000 times"),
    Hostile("blank.log", lambda: ssl.header() + bytes(62 << 20), "more than 4000000 messages, more than the limit rows"),
    Hostile("headers.log", lambda: ssl.header() * 100_000, "has more than 1000 logs in it"),
    Hostile("torn.log", lambda: ssl.header() + (b"\xff" * 40 + ssl.log([
        ssl.Message(10**18, 4, b"\0"), ssl.Message(10**18, 4, b"\0")])[16:]) * 100_000,
            "is damaged at more than 10000 places"),
    Hostile("noise.log", lambda: ssl.header() + np.random.default_rng(1).bytes(20 << 20), "has no vision or tracker"),
    Hostile("unending.log", lambda: ssl.header() + b"\xff" * (50 << 20), "has no vision or tracker", megabytes=50),
    Hostile("bomb.log.gz", lambda: gzip.compress(ssl.header() + bytes(128 << 20), compresslevel=9), "unpacks to more than"),
    Hostile("empty.csv", lambda: b"", "is empty"),
    Hostile("nothing.csv", lambda: b"\0" * 1_000_000, "not a recording of a known format"),
)
