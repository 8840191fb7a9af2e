"""Match logs of chosen frames, their bytes, and the records in them."""

import io
from datetime import UTC, datetime

import numpy as np
import polars as pl
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2._dynamic import serialize_dynamic

from pitchlore.pipeline import matches
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.matches.channels import COMMAND, DECISION, FRAME, OPTION, REFEREE, TOPICS
from pitchlore.pipeline.matches.frame import (
    BALL_DTYPE,
    OPTION_DTYPE,
    ROBOT_DTYPE,
    Frames,
    MatchInfo,
    MatchLog,
    Period,
)
from pitchlore.schemas import Commands, Decisions, Referee
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


def options_of(count: int) -> np.ndarray:
    return np.array([(i // 3 * 10**7, (44, 0, 184)[i % 3], i % 5, i % 2) for i in range(count)], dtype=OPTION_DTYPE)


def match(counts: list[int] | None = None, *, decisions: int = 20, commands: int = 30, options: int = 0) -> MatchLog:
    counts = [6, 6, 5, 6, 0, 6, 6, 4] * 8 if counts is None else counts
    referee = referee_of(
        (0, "kick-off", None, None, None, None),
        (5 * 10**8, "goal", "away", 0, 1, "GOAL_BLUE"),
        (10**9, "end", None, 0, 1, None),
    )
    return MatchLog(INFO, frames_of(counts), referee, decisions_of(decisions), commands=commands_of(commands),
                    options=options_of(options))


def written(log: MatchLog, **options: int) -> bytes:
    stream = io.BytesIO()
    matches.write(log, stream, **options)
    return stream.getvalue()


def rows_of(frames: Frames) -> list[tuple]:
    """Each frame as bytes that can be compared, NaN or not."""
    robots = [frames.robots[a:b] for a, b in zip(frames.offsets, frames.offsets[1:], strict=False)]
    packed = [b"".join(r[name].tobytes() for name in r.dtype.names) for r in robots]
    return list(zip(frames.number.tolist(), frames.t_ns.tolist(),
                    [b.tobytes() for b in frames.ball], packed, strict=True))  # fmt: skip


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
    events += [(int(row["t_ns"]), OPTION, {name: int(row[name]) for name in ("option", "robot", "team")}) for row in log.options]
    for t_ns, i, value in sorted(events, key=lambda event: event[0]):
        writer.add_message(channel[i], t_ns + epoch, encode[i](value), t_ns + epoch)
    writer.finish()
    return stream.getvalue()


def with_chunk(compression: str, blob: bytes, size: int, crc: int = 0) -> bytes:
    """A cut-off log whose second chunk is as given."""
    stream = io.BytesIO()
    recorder = matches.Recorder(stream, INFO, chunk_bytes=1)
    recorder.frames(frames_of([3, 3]))
    builder = RecordBuilder()
    Chunk(compression, blob, message_end_time=9, message_start_time=5, uncompressed_crc=crc, uncompressed_size=size).write(builder)
    return stream.getvalue() + builder.end()
