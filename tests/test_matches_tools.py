"""The log of a match beside mcap's own tools: they read ours, ours reads theirs."""

import io
import struct
import zlib

import numpy as np
import polars as pl
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.records import Chunk, DataEnd, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
from support.mcap_logs import (
    INFO,
    SMALL,
    foreign,
    frames_of,
    match,
    with_chunk,
    written,
)
from support.recordings import same

from pitchlore.pipeline import matches
from pitchlore.pipeline.base.errors import DamagedLog
from pitchlore.pipeline.matches.channels import COMMAND, DECISION, FRAME, REFEREE, TOPICS
from pitchlore.pipeline.matches.frame import MatchLog


def records(data: bytes, kind: type) -> list:
    return [r for r in StreamReader(io.BytesIO(data), emit_chunks=True).records if isinstance(r, kind)]


def test_checksums():
    """The mcap library reads our file and finds every checksum right."""
    data = written(match(), chunk_bytes=SMALL)
    kinds = [type(r).__name__ for r in StreamReader(io.BytesIO(data), validate_crcs=True).records]
    assert kinds[:2] == ["Header", "Metadata"]  # a file cut off anywhere still says what it is
    assert records(data, DataEnd)[0].data_section_crc != 0
    assert all(chunk.uncompressed_crc for chunk in records(data, Chunk))


def test_ros2_decoder():
    """The mcap-ros2 library decodes our messages."""
    log = match(options=20)
    reader = make_reader(io.BytesIO(written(log, chunk_bytes=SMALL)), True, [DecoderFactory()])
    decoded = {topic.name: [] for topic in TOPICS.values()}
    for _, channel, message, value in reader.iter_decoded_messages(log_time_order=False):
        assert message.publish_time == message.log_time
        decoded[channel.topic].append((message.log_time, value))
    offsets = log.frames.offsets
    for i, (t_ns, value) in enumerate(decoded["/frame"]):
        assert (t_ns, value.frame) == (log.frames.t_ns[i], log.frames.number[i])
        np.testing.assert_array_equal([value.ball_x, value.ball_y, value.ball_vx, value.ball_vy], list(log.frames.ball[i]))
        theirs = [(r.team, r.id, r.x, r.y, r.theta, r.vx, r.vy, r.omega) for r in value.robots]
        np.testing.assert_array_equal(theirs, [tuple(r) for r in log.frames.robots[offsets[i]:offsets[i + 1]]])
    assert len(decoded["/frame"]) == len(log.frames)
    assert [(t, v.event, v.team, v.score_home, v.score_away, v.note) for t, v in decoded["/referee"]] == [
        (0, "kick-off", "", -1, -1, ""), (5 * 10**8, "goal", "away", 0, 1, "GOAL_BLUE"), (10**9, "end", "", 0, 1, ""),
    ]  # fmt: skip
    by_time = log.decisions.sort("t_ns")
    assert [(t, v.state, v.behaviour_id, v.reward, v.random, v.end_ns) for t, v in decoded["/decision"]] == list(
        by_time.with_columns(pl.col("behaviour_id").fill_null(""))
        .select("t_ns", "state", "behaviour_id", "reward", "random", "end_ns").iter_rows()
    )  # fmt: skip
    assert [(t, v.option, v.robot, v.team) for t, v in decoded["/option"]] == log.options.tolist()


def test_commands_channel():
    """The mcap library decodes commands, a message a sample; only a log with commands declares their channel."""
    log = match()
    reader = make_reader(io.BytesIO(written(log, chunk_bytes=SMALL)), True, [DecoderFactory()])
    found = [
        (message.log_time, each.team, each.robot, each.command, each.count)
        for _, _, message, value in reader.iter_decoded_messages("/command", log_time_order=False)
        for each in value.commands
    ]
    codes = pl.col("team", "command").to_physical()
    wanted = log.commands.sort("t_ns", maintain_order=True).with_columns(codes)
    assert found == wanted.select("t_ns", "team", "robot", "command", "count").rows()
    without = make_reader(io.BytesIO(written(match(commands=0)))).get_summary()
    assert {channel.topic for channel in without.channels.values()} == {"/frame", "/referee", "/decision"}
    assert {schema.name for schema in without.schemas.values()} == {
        f"pitchlore/msg/{name}" for name in ("Frame", "RefereeEvent", "Decision")}


def test_indexes():
    """The mcap library finds messages by time through our indexes."""
    log = match([6] * 200)
    reader = make_reader(io.BytesIO(written(log, chunk_bytes=SMALL)), True)
    found = [m.log_time for _, _, m in reader.iter_messages("/frame", starting_at=10**9, ending_before=2 * 10**9)]
    assert found == [t for t in log.frames.t_ns.tolist() if 10**9 <= t < 2 * 10**9]
    statistics = reader.get_summary().statistics
    assert statistics.channel_message_counts == {FRAME: 200, REFEREE: 3, DECISION: 20, COMMAND: 12}
    assert (statistics.message_start_time, statistics.message_end_time) == (0, log.frames.t_ns[-1])


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("chunked", [True, False])
def test_foreign_log(compression, chunked):
    """A log that another program writes on our definitions is read."""
    log = match(options=20)
    data = foreign(log, epoch=1_700_000_000 * 10**9, chunked=chunked, compression=compression)
    with pytest.raises(DamagedLog, match="does not say which match it is"):
        matches.read(data, where="other.mcap")
    back = matches.read(data, where="other.mcap", default_info=INFO)
    assert same(back, log)
    assert back.quality.is_empty()


def with_messages(*messages: tuple[str, str, str, bytes]) -> bytes:
    """A file of ours as to its metadata, with messages (topic, encoding, definition, payload) of any kind."""
    stream = io.BytesIO()
    writer = McapWriter(stream)
    writer.start("ros2")
    (first, *_) = records(written(match()), Metadata)
    writer.add_metadata(first.name, first.metadata)
    ids = {}
    for t_ns, (topic, encoding, text, payload) in enumerate(messages):
        if topic not in ids:
            schema = writer.register_schema("x/msg/X", "ros2msg", text.encode())
            ids[topic] = writer.register_channel(topic, encoding, schema)
        writer.add_message(ids[topic], t_ns, payload, t_ns)
    writer.finish()
    return stream.getvalue()


ENCAPSULATION = bytes([0, 1, 0, 0])
NO_ROBOTS = ENCAPSULATION + struct.pack("<I4fI", 7, 1, 2, 3, 4, 0)


@pytest.mark.parametrize(
    ("payload", "why"),
    [
        (NO_ROBOTS[:-1] + b"\x01", "a robot is announced that does not follow"),
        (NO_ROBOTS[:-4] + struct.pack("<I", 1) + bytes(29), "a byte too many"),
        (NO_ROBOTS[:10], "shorter than any frame"),
        (b"", "nothing at all"),
        (bytes(4) + NO_ROBOTS[4:], "big-endian"),
    ],
)
def test_malformed_messages(payload, why):
    """Malformed messages are counted and left out."""
    text = TOPICS[FRAME].definition()
    back = matches.read(with_messages(("/frame", "cdr", text, NO_ROBOTS), ("/frame", "cdr", text, payload)), where="a")
    assert back.frames.number.tolist() == [7], why
    assert back.quality.select("flaw", "count", "start_ns", "end_ns").rows() == [("skipped", 1, 1, 2)]
    assert back.info.complete  # the file is as its writer meant it


def test_other_channels():
    """Channels that are not the log's are counted and left out."""
    text = TOPICS[FRAME].definition()
    data = with_messages(
        ("/frame", "cdr", text, NO_ROBOTS), ("/rosout", "cdr", "string data", b"abc"), ("/rosout", "", "", b"abc"),
        ("/referee", "cdr", "string event", b"abc"), ("/decision", "json", TOPICS[DECISION].definition(), b"{}"),
        ("/command", "cdr", TOPICS[COMMAND].definition().replace("int16 robot", "int32 robot"), b"abc"),
    )  # fmt: skip
    back = matches.read(data, where="a.mcap")
    assert len(back.frames) == 1
    assert back.quality.select("flaw", "count").rows() == [("skipped", 1)] * 3 + [("skipped", 2)]
    assert "messages on /command, which are defined otherwise" in back.quality["note"][0]
    assert "/rosout" in back.quality["note"][3]


COMMAND_ROW = struct.pack("<ihBB", 2, 7, 1, 4)  # two tackles of away 7


def of_commands(*rows: bytes, announced: int | None = None) -> bytes:
    return ENCAPSULATION + struct.pack("<I", len(rows) if announced is None else announced) + b"".join(rows)


@pytest.mark.parametrize("payload", [
    of_commands(COMMAND_ROW, announced=2), of_commands(COMMAND_ROW, announced=0),
    of_commands(COMMAND_ROW, announced=2**32 - 1), of_commands(COMMAND_ROW, b"\0"), of_commands(COMMAND_ROW)[:6], b"",
    bytes(4) + of_commands(COMMAND_ROW)[4:],
    *(of_commands(COMMAND_ROW, struct.pack("<ihBB", *row))
      for row in [(0, 7, 1, 4), (-1, 7, 1, 4), (2, 7, 2, 4), (2, 7, 1, 5)]),
])
def test_malformed_commands(payload):
    """A message of commands that is not whole, or has one that cannot be, is left out and counted."""
    text = TOPICS[COMMAND].definition()
    sound, nothing = of_commands(COMMAND_ROW, COMMAND_ROW), of_commands()
    data = with_messages(
        ("/frame", "cdr", TOPICS[FRAME].definition(), NO_ROBOTS), ("/command", "cdr", text, sound),
        ("/command", "cdr", text, payload), ("/command", "cdr", text, nothing), ("/command", "cdr", text, sound),
    )  # fmt: skip
    back = matches.read(data, where="a.mcap")
    row = (INFO.match_id, "away", 7, "tackle", 2)
    assert back.commands.drop("t_ns").rows() == [row] * 4
    assert back.commands["t_ns"].to_list() == [1, 1, 4, 4]
    assert back.quality.select("flaw", "count", "start_ns", "end_ns").rows() == [("skipped", 1, 2, 3)]
    assert "malformed messages on /command" in back.quality["note"][0]


@pytest.mark.parametrize("event", ["penalty", "goal"])
def test_unfit_event(event):
    """An event that does not fit the table is left out, and a flaw says so."""
    text = event.encode() + b"\0"
    score = -2 if event == "goal" else 0
    payload = ENCAPSULATION + struct.pack("<hhI", score, 0, len(text)) + text
    payload += bytes(-(len(payload)) % 4) + bytes(8)  # two empty strings of length 0
    data = with_messages(
        ("/frame", "cdr", TOPICS[FRAME].definition(), NO_ROBOTS), ("/referee", "cdr", TOPICS[REFEREE].definition(), payload)
    )
    back = matches.read(data, where="a.mcap")
    assert back.referee.is_empty()
    assert back.quality.select("flaw", "count", "start_ns").rows() == [("skipped", 1, 1)]


def test_chunk_without_crc():
    """A chunk without a CRC is read, and one with a wrong CRC is not."""
    content = io.BytesIO(written(MatchLog(INFO, frames_of([2]))))
    chunk = records(content.getvalue(), Chunk)[0]
    raw = zstandard.decompress(chunk.data)
    assert len(matches.read(with_chunk("", raw, len(raw)), where="a.mcap").frames) == 2
    bad = with_chunk("", raw, len(raw), zlib.crc32(raw) ^ 1)
    assert len(matches.read(bad, where="a.mcap").frames) == 1
