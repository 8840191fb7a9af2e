"""The match log: what is written is read back, by us and by mcap; what is damaged is said."""

from __future__ import annotations

import io
import json
import struct
import tracemalloc
import zlib
from datetime import UTC, datetime

import lz4.frame
import numpy as np
import polars as pl
import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex, DataEnd, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2._dynamic import serialize_dynamic
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer as Ros2Writer

from pitchlore.pipeline import matches
from pitchlore.pipeline.base.errors import BadRecording, DamagedLog, NoFrames, SchemaMismatch
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.matches import description, mcap_file
from pitchlore.pipeline.matches.channels import COMMAND, DECISION, FRAME, REFEREE, TOPICS
from pitchlore.pipeline.matches.chunks import unseal
from pitchlore.pipeline.matches.frame import BALL_DTYPE, ROBOT_DTYPE, Frames, MatchInfo, MatchLog, Period
from pitchlore.pipeline.matches.records import FRAMING_BYTES, as_array, walk
from pitchlore.schemas import Commands, Decisions, Matches, Quality, Referee
from pitchlore.schemas.commands import COMMANDS

INFO = MatchInfo(
    match_id="final-0123456789ab", source="final.rcg", format="rcg", home="Löwen", away="Tigers",
    started_at=datetime(2024, 5, 1, 12, 0, tzinfo=UTC), pitch=PITCHES[Kind.VSSS],
    periods=(Period(start_ns=0, end_ns=10**12, home_attacks=1, inferred=True),), seed=7,
    settings={"noise": 0.1}, software="pitchlore 0.1.0",
)  # fmt: skip
SMALL = 2048  # bytes a chunk: a handful of frames


def frames_of(counts: list[int], *, t_ns: list[int] | None = None, seed: int = 0) -> Frames:
    """Random bodies, with so many robots in each frame; the ball is unseen in every fifth."""
    rng = np.random.default_rng(seed)
    ball = np.zeros(len(counts), BALL_DTYPE)
    robots = np.zeros(sum(counts), ROBOT_DTYPE)
    for array in (ball, robots):
        for name in set(array.dtype.names) - {"team", "id"}:
            array[name] = rng.normal(size=len(array))
            array[name][::5] = np.nan
    robots["team"], robots["id"] = rng.integers(0, 2, len(robots)), rng.integers(0, 2**16, len(robots))
    times = [i * 16_666_667 for i in range(len(counts))] if t_ns is None else t_ns
    return Frames(
        number=np.arange(len(counts), dtype=np.uint32) + 100, t_ns=np.array(times, dtype=np.int64), ball=ball,
        offsets=np.concatenate(([0], np.cumsum(counts))).astype(np.int64), robots=robots,
    )


def referee_of(*rows: tuple) -> pl.DataFrame:
    names = [name for name in Referee.dtypes() if name != "match_id"]
    table = pl.DataFrame(rows, schema={name: Referee.dtypes()[name] for name in names}, orient="row")
    return table.with_columns(match_id=pl.lit(INFO.match_id)).select(*Referee.dtypes())


def decisions_of(count: int) -> pl.DataFrame:
    rows = [
        (
            INFO.match_id, ("home", "away")[i % 2], i % 3 + 1, ("goalkeeper", "midfield", "striker")[i % 3],
            i * 10**7, i * 10**7 + 5, i * 7**15, None if i % 4 == 0 else f"striker-{i % 7 + 1:03d}-002", True, i % 5 == 0,
            -1.0 if i % 6 == 0 else 0.25, i // 10, (None, "terminal", "truncated")[i % 3], i / 1000,
        )
        for i in range(count)
    ]  # fmt: skip
    return pl.DataFrame(rows, schema=Decisions.dtypes(), orient="row").sort("team", "robot", "t_ns")


def commands_of(count: int) -> pl.DataFrame:
    """Two or three commands a sample."""
    rows = [
        (INFO.match_id, ("home", "away")[i % 2], i % 11 + 1, i * 2 // 5 * 16_666_667, COMMANDS[i % 5], i % 3 + 1)
        for i in range(count)
    ]
    return pl.DataFrame(rows, schema=Commands.dtypes(), orient="row").sort("team", "robot", "t_ns", "command")


def match(counts: list[int] | None = None, *, decisions: int = 20, commands: int = 30) -> MatchLog:
    counts = [6, 6, 5, 6, 0, 6, 6, 4] * 8 if counts is None else counts
    referee = referee_of(
        (0, "kick-off", None, None, None, None),
        (5 * 10**8, "goal", "away", 0, 1, "GOAL_BLUE"),
        (10**9, "end", None, 0, 1, None),
    )
    return MatchLog(INFO, frames_of(counts), referee, decisions_of(decisions), commands=commands_of(commands))


def written(log: MatchLog, **options: int) -> bytes:
    stream = io.BytesIO()
    matches.write(log, stream, **options)
    return stream.getvalue()


def assert_same_frames(ours: Frames, theirs: Frames) -> None:
    for name in ("number", "t_ns", "offsets"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
    for name in ("ball", "robots"):
        one, other = getattr(ours, name), getattr(theirs, name)
        for column in one.dtype.names:
            np.testing.assert_array_equal(one[column], other[column])


def same(one: MatchLog, other: MatchLog) -> bool:
    try:
        assert_same_frames(one.frames, other.frames)
    except AssertionError:
        return False
    tables = ("referee", "decisions", "commands")
    return one.info == other.info and all(getattr(one, name).equals(getattr(other, name)) for name in tables)


def rows_of(frames: Frames) -> list[tuple]:
    """Each frame as bytes that can be compared, NaN or not."""
    robots = [frames.robots[a:b] for a, b in zip(frames.offsets, frames.offsets[1:], strict=False)]
    packed = [b"".join(r[name].tobytes() for name in r.dtype.names) for r in robots]
    return list(zip(frames.number.tolist(), frames.t_ns.tolist(),
                    [b.tobytes() for b in frames.ball], packed, strict=True))  # fmt: skip


def records(data: bytes, kind: type) -> list:
    return [r for r in StreamReader(io.BytesIO(data), emit_chunks=True).records if isinstance(r, kind)]


def chunk_indexes(data: bytes) -> list[ChunkIndex]:
    return make_reader(io.BytesIO(data)).get_summary().chunk_indexes


def flipped(data: bytes, bit: int) -> bytes:
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


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
    log = MatchLog(INFO, frames_of(counts, t_ns=times), referee, decisions, commands=commands)
    chunk_bytes = data.draw(st.sampled_from([1, 700, 5000, 1 << 20]))
    back = matches.read(written(log, chunk_bytes=chunk_bytes), where="a.mcap")
    assert same(back, log)
    assert back.info.complete
    assert back.quality.is_empty()
    Referee.validate(back.referee)
    Decisions.validate(back.decisions)
    Commands.validate(back.commands)


def test_same_bytes():
    """The same log gives the same bytes, whatever lies in the padding."""
    log = match()
    dirty = Frames(log.frames.number, log.frames.t_ns, log.frames.ball, log.frames.offsets, log.frames.robots.copy())
    dirty.robots.view(np.uint8)[1::ROBOT_DTYPE.itemsize] = 0xAB
    assert written(log) == written(MatchLog(INFO, dirty, log.referee, log.decisions, commands=log.commands))


def test_flaws_of_importer():
    """Flaws that an importer found travel with the log."""
    quality = pl.DataFrame(
        [(INFO.match_id, "gap", 5, 9, "home", 3, 2, "no samples"), (INFO.match_id, "skipped", None, None, None, None, 1, None)],
        schema=Quality.dtypes(), orient="row",
    )  # fmt: skip
    log = match()
    back = matches.read(written(MatchLog(INFO, log.frames, quality=quality)), where="a.mcap")
    assert back.quality.equals(quality)
    assert back.info.complete


def test_empty_log():
    """A log without frames is read back the same."""
    log = MatchLog(INFO, frames_of([]))
    assert same(matches.read(written(log), where="a.mcap"), log)


def test_salvaged_log():
    """A log that was salvaged stays incomplete when it is written again."""
    info = INFO.model_copy(update={"complete": False, "incomplete_reason": "chunk 3 of 9 is gone"})
    log = match()
    assert matches.read(written(MatchLog(info, log.frames)), where="a.mcap").info == info


# --- mcap's own tools ------------------------------------------------------------------------


def test_checksums():
    """The mcap library reads our file and finds every checksum right."""
    data = written(match(), chunk_bytes=SMALL)
    kinds = [type(r).__name__ for r in StreamReader(io.BytesIO(data), validate_crcs=True).records]
    assert kinds[:2] == ["Header", "Metadata"]  # a file cut off anywhere still says what it is
    assert records(data, DataEnd)[0].data_section_crc != 0
    assert all(chunk.uncompressed_crc for chunk in records(data, Chunk))


def test_ros2_decoder():
    """The mcap-ros2 library decodes our messages."""
    log = match()
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


def frame_dict(frames: Frames, i: int) -> dict:
    names = ROBOT_DTYPE.names
    ball = frames.ball[i]
    robots = [
        {name: value.item() for name, value in zip(names, robot, strict=True)}
        for robot in frames.robots[frames.offsets[i]:frames.offsets[i + 1]]
    ]
    return {"frame": int(frames.number[i]), **{f"ball_{k}": float(ball[k]) for k in BALL_DTYPE.names}, "robots": robots}


def foreign(
    log: MatchLog, *, epoch: int = 0, chunked: bool = True, compression: CompressionType = CompressionType.NONE,
    crcs: bool = True,
) -> bytes:  # fmt: skip
    """The log as another program writes it: message by message, channels interleaved."""
    stream = io.BytesIO()
    writer = McapWriter(
        stream, SMALL, compression, use_chunking=chunked, enable_crcs=crcs, enable_data_crcs=crcs
    )
    writer.start("ros2")
    channel, encode = {}, {}
    for i, topic in TOPICS.items():
        name = f"other_msgs/msg/{topic.message}"
        text = topic.definition().replace("pitchlore/", "other_msgs/")
        schema = writer.register_schema(name, "ros2msg", text.encode())
        channel[i] = writer.register_channel(topic.name, "cdr", schema)
        encode[i] = serialize_dynamic(name, text)[name]
    events = [(t, FRAME, frame_dict(log.frames, i)) for i, t in enumerate(log.frames.t_ns.tolist())]
    for event in log.referee.iter_rows(named=True):
        scores = {k: -1 if event[k] is None else event[k] for k in ("score_home", "score_away")}
        texts = {k: event[k] or "" for k in ("event", "team", "note")}
        events.append((event["t_ns"], REFEREE, scores | texts))
    for row in log.decisions.iter_rows(named=True):
        codes = {
            "team": ("home", "away").index(row["team"]), "ends": (None, "terminal", "truncated").index(row["ends"]),
            "role": ("goalkeeper", "midfield", "striker").index(row["role"]), "end_ns": row["end_ns"] + epoch,
            "behaviour_id": row["behaviour_id"] or "",
        }  # fmt: skip
        events.append((row["t_ns"], DECISION, row | codes))
    for (t_ns,), rows in log.commands.sort("t_ns", maintain_order=True).group_by("t_ns", maintain_order=True):
        numbers = rows.with_columns(pl.col("team", "command").to_physical()).drop("match_id", "t_ns")
        events.append((t_ns, COMMAND, {"commands": numbers.to_dicts()}))
    for t_ns, i, value in sorted(events, key=lambda event: event[0]):
        writer.add_message(channel[i], t_ns + epoch, encode[i](value), t_ns + epoch)
    writer.finish()
    return stream.getvalue()


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("chunked", [True, False])
def test_foreign_log(compression, chunked):
    """A log that another program writes on our definitions is read."""
    log = match()
    data = foreign(log, epoch=1_700_000_000 * 10**9, chunked=chunked, compression=compression)
    with pytest.raises(DamagedLog, match="does not say which match it is"):
        matches.read(data, where="other.mcap")
    back = matches.read(data, where="other.mcap", default_info=INFO)
    assert same(back, log)
    assert back.quality.is_empty()


def test_ros2_writer():
    """A log that the ROS 2 writer writes is read."""
    log = match()
    stream = io.BytesIO()
    writer = Ros2Writer(stream, chunk_size=SMALL)
    schema = writer.register_msgdef("pitchlore/msg/Frame", TOPICS[FRAME].definition())
    for i, t_ns in enumerate(log.frames.t_ns.tolist()):
        writer.write_message("/frame", schema, frame_dict(log.frames, i), t_ns)
    writer.finish()
    back = matches.read(stream.getvalue(), where="ros.mcap", default_info=INFO)
    assert_same_frames(back.frames, log.frames)
    assert back.info == INFO


def with_messages(*messages: tuple[str, str, str, bytes]) -> bytes:
    """A file of ours as to its metadata, with messages (topic, encoding, definition, payload) of any kind."""
    stream = io.BytesIO()
    writer = McapWriter(stream)
    writer.start("ros2")
    writer.add_metadata(**_first_metadata(match()))
    ids = {}
    for t_ns, (topic, encoding, text, payload) in enumerate(messages):
        if topic not in ids:
            schema = writer.register_schema("x/msg/X", "ros2msg", text.encode())
            ids[topic] = writer.register_channel(topic, encoding, schema)
        writer.add_message(ids[topic], t_ns, payload, t_ns)
    writer.finish()
    return stream.getvalue()


def _first_metadata(log: MatchLog) -> dict:
    record = records(written(log), Metadata)[0]
    return {"name": record.name, "data": record.metadata}


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


def test_killed_recorder():
    """A killed recorder loses at most one chunk."""
    log = match([6] * 100)
    stream = io.BytesIO()
    one_by_one(matches.Recorder(stream, INFO, chunk_bytes=SMALL), log.frames)  # never closed
    back = matches.read(stream.getvalue(), where="a.mcap")
    assert 100 - SMALL // 227 <= len(back.frames) < 100
    assert rows_of(back.frames) == rows_of(log.frames)[:len(back.frames)]
    assert not back.info.complete
    assert back.quality["flaw"].to_list() == ["truncated"]


def test_unfit_log():
    """A negative time or score is refused."""
    with pytest.raises(BadRecording, match="before time zero"):
        written(MatchLog(INFO, frames_of([1, 1], t_ns=[0, -1])))
    with pytest.raises(SchemaMismatch, match="score_home"):
        written(MatchLog(INFO, frames_of([1]), referee_of((0, "goal", None, -5, None, None))))


def test_full_disk():
    """An error of the stream is not hidden."""
    class Full(io.BytesIO):
        def write(self, data):
            if self.tell() > 3000:
                raise OSError(28, "No space left on device")
            return super().write(data)

    with pytest.raises(OSError, match="No space"):
        matches.write(match([6] * 500), Full(), chunk_bytes=SMALL)


# --- damage ------------------------------------------------------------------------------------


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
    assert_same_frames(back.frames, log.frames)
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
            assert_same_frames(back.frames, log.frames)
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
    for _ in range(150):
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
    assert refused < 50


@settings(max_examples=60, deadline=None)
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
    content = unseal(memoryview(whole)[start + FRAMING_BYTES:start + index.chunk_length])[0].tobytes()
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


def test_cut_bomb():
    """A cut chunk that unpacks to more than it declares, or declares too much, takes no memory."""
    for size in (256 << 20, 1000):
        data = with_chunk("zstd", BOMB, size)
        tracemalloc.start()
        back = matches.read(data[:-5], where="a.mcap")
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 4 << 20
        assert len(back.frames) == 1


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
        assert_same_frames(back.frames, log.frames)


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
    ],
)
def test_bad_metadata_field(change, says):
    """Metadata that cannot be used are refused with the name of the field."""
    texts = description.describe(INFO, Quality.empty())
    texts["info"] = json.dumps(json.loads(texts["info"]) | change)
    with pytest.raises(DamagedLog, match=rf"^a\.mcap: {says}") as error:
        description.parse(texts, where="a.mcap")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("quality", ["[{}", "3", '[{"flaw": "of tomorrow"}]'])
def test_flaws_of_other_version(quality):
    """Flaws of another version are refused."""
    texts = description.describe(INFO, Quality.empty()) | {"quality": quality}
    with pytest.raises(DamagedLog, match=r"^a\.mcap: its metadata's list of flaws .* Read it with the version"):
        description.parse(texts, where="a.mcap")


@pytest.mark.parametrize(
    ("texts", "says"),
    [
        ({"info": "{", "quality": "[]"}, "the field info of its metadata is not usable"),
        ({"quality": "[]"}, "its metadata do not describe the match"),
    ],
)
def test_bad_info(texts, says):
    """Info that is no JSON or not there is refused."""
    with pytest.raises(DamagedLog, match=rf"^a\.mcap: {says}"):
        description.parse(texts, where="a.mcap")


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
        matches.read(flipped(data, 8 * (index.chunk_start_offset + 60)), where="a.mcap")


def with_chunk(compression: str, blob: bytes, size: int, crc: int = 0) -> bytes:
    """A cut-off log whose second chunk is as given."""
    stream = io.BytesIO()
    recorder = matches.Recorder(stream, INFO, chunk_bytes=1)
    recorder.frames(frames_of([3, 3]))
    builder = RecordBuilder()
    Chunk(compression, blob, message_end_time=9, message_start_time=5, uncompressed_crc=crc, uncompressed_size=size).write(builder)
    return stream.getvalue() + builder.end()


BOMB = zstandard.ZstdCompressor(level=3).compress(bytes(256 << 20))


@pytest.mark.parametrize(
    ("compression", "blob", "size", "why"),
    [
        ("zstd", BOMB, 256 << 20, "over the limit"),
        ("zstd", BOMB, 2**63, "over the limit"),
        ("zstd", BOMB, 1000, "two different sizes"),
        ("zstd", zstandard.ZstdCompressor(write_content_size=False).compress(bytes(8 << 20)), 1000, "does not decompress"),
        ("zstd", zstandard.compress(bytes(100)) + b"more", 100, "does not decompress"),
        ("lz4", b"nonsense", 100, "does not decompress"),
        ("", bytes(100), 200, "size"),
        ("brotli", bytes(100), 100, "neither zstd nor lz4"),
        ("zstd", zstandard.compress(bytes(range(100))), 100, "whole records"),
    ],
)  # fmt: skip
def test_false_chunk(compression, blob, size, why):
    """A chunk that is not what it declares is reported and costs little memory."""
    data = with_chunk(compression, blob, size)
    tracemalloc.start()
    back = matches.read(data, where="a.mcap")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 << 20
    assert len(back.frames) == 1
    assert why in back.quality["note"].str.join(" ")[0]
    assert back.quality.filter(flaw="damaged chunk").select("start_ns", "end_ns").rows() == [(5, 10)]


def test_bomb_of_chunks(monkeypatch):
    """Many chunks that are small on their own are refused as a bomb together."""
    monkeypatch.setattr(mcap_file, "MAX_LOG_BYTES", 10 * SMALL)
    with pytest.raises(DamagedLog, match="declares more than"):
        matches.read(written(match([6] * 200), chunk_bytes=SMALL), where="a.mcap")


def test_chunk_without_crc():
    """A chunk without a CRC is read, and one with a wrong CRC is not."""
    content = io.BytesIO(written(MatchLog(INFO, frames_of([2]))))
    chunk = records(content.getvalue(), Chunk)[0]
    raw = zstandard.decompress(chunk.data)
    assert len(matches.read(with_chunk("", raw, len(raw)), where="a.mcap").frames) == 2
    bad = with_chunk("", raw, len(raw), zlib.crc32(raw) ^ 1)
    assert len(matches.read(bad, where="a.mcap").frames) == 1


def test_record_length():
    """Walking records stops at a length that leads out of the file."""
    for length in (2**63, 2**64 - 1, 10**15, 5):
        content = as_array(struct.pack("<BQ", 5, 4) + bytes(4) + struct.pack("<BQ", 5, length) + bytes(4))
        found, end = walk(content, 0, len(content))
        assert (len(found.opcodes), end) == (1, 13)


def test_message_layout():
    """Message records are laid out as the mcap library lays them out."""
    frames = frames_of([2])
    builder = RecordBuilder()
    encode = serialize_dynamic("pitchlore/msg/Frame", TOPICS[FRAME].definition())["pitchlore/msg/Frame"]
    Message(FRAME, log_time=0, data=encode(frame_dict(frames, 0)), publish_time=0, sequence=0).write(builder)
    chunk = records(written(MatchLog(INFO, frames)), Chunk)[0]
    assert zstandard.decompress(chunk.data) == builder.end()


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
        "direction_inferred": True,
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
    """The score after a goal of unknown team is null until it is told."""
    referee = referee_of((0, "kick-off", None, 0, 0, None), *events)
    row, = Matches.validate(matches.row(MatchLog(INFO, frames_of([2, 2]), referee))).rows(named=True)
    assert (row["score_home"], row["score_away"]) == score


def test_unknown_facts():
    """Facts of a match that are not known are null."""
    info = INFO.model_copy(update={"started_at": None})
    row, = Matches.validate(matches.row(MatchLog(info, frames_of([])))).rows(named=True)
    assert [row[name] for name in ("started_at", "hz", "score_home", "score_away")] == [None] * 4
    assert (row["duration_s"], row["frames"], row["robots_per_team"]) == (0.0, 0, 0)
