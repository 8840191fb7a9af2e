"""CDR payloads of the log's messages: samples, referee events, decisions, commands, heights and options.

Sources: OMG CDR (XCDR1, little-endian; alignment counts from the end of the four bytes of
encapsulation), and the definitions in ``schemas/*.msg``.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.matches.frame import BALL_DTYPE, OPTION_DTYPE, ROBOT_DTYPE, Frames, Heights
from pitchlore.pipeline.matches.messages import RECORD, Heads, Messages, bytes_of
from pitchlore.pipeline.numbers.arrays import I64, Bools
from pitchlore.schemas import ROLES, SIDES, Commands, Decisions, Referee
from pitchlore.schemas.commands import COMMANDS
from pitchlore.schemas.decisions import ENDS
from pitchlore.schemas.matches import EVENTS
from pitchlore.schemas.options import OPTIONS
from pitchlore.schemas.table import named

#: The bytes 00 01 00 00: plain CDR, little-endian, no options.
LITTLE_ENDIAN_CDR = 0x0000_0100

#: Fixed part up to and including the length word of ``robots``; the tail is ROBOT_DTYPE [robots].
FRAME_HEAD = np.dtype([*RECORD, ("number", "<u4"), ("ball", BALL_DTYPE), ("robots", "<u4")])
_RAW_BALL = np.dtype((np.void, BALL_DTYPE.itemsize))
#: Fixed part; the tail is three strings: event, team, note.
REFEREE_HEAD = np.dtype([*RECORD, ("score_home", "<i2"), ("score_away", "<i2")])
#: Fixed part up to and including the length word of ``behaviour_id``; the tail is its bytes.
DECISION_HEAD = np.dtype([
    *RECORD,
    ("end_ns", "<i8"), ("state", "<i8"), ("reward", "<f8"), ("value", "<f8"), ("episode", "<i4"),
    ("robot", "<i2"), ("team", "u1"), ("role", "u1"), ("random", "u1"), ("ends", "u1"),
    ("padding", "V2"), ("name_bytes", "<u4"),
])  # fmt: skip
#: Fixed part: the length word of ``commands``; the tail is _COMMAND_DTYPE [commands].
COMMANDS_HEAD = np.dtype([*RECORD, ("commands", "<u4")])
#: Whole messages: these have no tails.
HEIGHT_HEAD = np.dtype([*RECORD, ("z", "<f4")])
OPTION_HEAD = np.dtype([*RECORD, ("option", "<i2"), ("robot", "<i2"), ("team", "u1")])
_COMMAND_DTYPE = np.dtype([("count", "<i4"), ("robot", "<i2"), ("team", "u1"), ("command", "u1")])


def _heads(head: np.dtype[np.void], channel: int, t_ns: I64) -> Heads:
    heads = np.zeros(len(t_ns), dtype=head)
    heads["channel"] = channel
    heads["log_time"] = heads["publish_time"] = t_ns
    heads["encapsulation"] = LITTLE_ENDIAN_CDR
    return heads


def pack_frames(frames: Frames, channel: int) -> Messages:
    """Messages of `schemas/Frame.msg` of samples."""
    heads = _heads(FRAME_HEAD, channel, frames.t_ns)
    heads["number"] = frames.number
    heads["ball"] = frames.ball
    heads["robots"] = frames.counts()
    tails = bytes_of(frames.robots[int(frames.offsets[0]):]).copy()
    tails[1::ROBOT_DTYPE.itemsize] = 0  # the padding after `team` may hold anything in memory
    return Messages(heads, tails, (frames.offsets - frames.offsets[0]) * ROBOT_DTYPE.itemsize)


def sound_frames(messages: Messages) -> Bools:
    """Mask of the messages [K] that are whole messages of `schemas/Frame.msg`."""
    robots = messages.heads["robots"].astype(np.int64)
    whole: Bools = messages.tail_bytes() == robots * ROBOT_DTYPE.itemsize
    return whole & _addressed(messages)


def unpack_frames(messages: Messages) -> Frames:
    """Samples of messages that are all sound, in order."""
    heads = messages.heads
    return Frames(
        number=heads["number"].copy(),
        t_ns=heads["log_time"].copy(),
        ball=heads["ball"].view(_RAW_BALL).copy().view(BALL_DTYPE),  # one move per ball, not one per field
        offsets=messages.offsets // ROBOT_DTYPE.itemsize,
        robots=messages.tails.view(ROBOT_DTYPE),
    )


def _addressed(messages: Messages) -> Bools:
    """Mask of messages with a time that fits int64 and the plain little-endian encapsulation, bool [K]."""
    heads = messages.heads
    fits: Bools = (heads["log_time"] >= 0) & (heads["encapsulation"] & 0xFFFF == LITTLE_ENDIAN_CDR)
    return fits


def pack_referee(referee: pl.DataFrame, channel: int) -> Messages:
    """Messages of `schemas/RefereeEvent.msg` of rows of schema Referee, in order."""
    heads = _heads(REFEREE_HEAD, channel, referee["t_ns"].to_numpy())
    for score in ("score_home", "score_away"):
        heads[score] = referee[score].fill_null(-1).to_numpy()
    rows = referee.select(pl.col("event", "team", "note").cast(pl.String).fill_null("")).iter_rows()
    tails = [_strings(row) for row in rows]
    offsets = np.cumsum([0, *map(len, tails)], dtype=np.int64)
    return Messages(heads, np.frombuffer(b"".join(tails), dtype=np.uint8), offsets)


def unpack_referee(messages: Messages) -> tuple[pl.DataFrame, Bools]:
    """Rows of schema Referee without ``match_id``, and a mask of the messages [K] that they come from."""
    mask = _addressed(messages)
    rows = []
    tails = messages.tails.tobytes()
    for i, (start, end) in enumerate(pairwise(messages.offsets.tolist())):
        strings = _read_strings(tails[start:end], 3)
        head = messages.heads[i]
        mask[i] &= strings is not None and strings[0] in EVENTS and strings[1] in ("", *SIDES)
        if mask[i] and strings is not None:
            scores = (int(head["score_home"]), int(head["score_away"]))
            rows.append((
                int(head["log_time"]), strings[0], strings[1] or None,
                *(None if score == -1 else score for score in scores), strings[2] or None,
            ))
    schema = {name: dtype for name, dtype in Referee.dtypes().items() if name != "match_id"}
    return pl.DataFrame(rows, schema=schema, orient="row"), mask


def _strings(values: Sequence[str]) -> bytes:
    out = bytearray()
    for value in values:
        out += bytes(-len(out) % 4)
        data = value.encode() + b"\0"
        out += len(data).to_bytes(4, "little") + data
    return bytes(out)


def _read_strings(data: bytes, count: int) -> list[str] | None:
    """CDR strings, ``count`` of them; None if they are malformed."""
    out, at = [], 0
    for _ in range(count):
        at += -at % 4
        length = int.from_bytes(data[at:at + 4], "little")
        text = _text(data[at + 4:at + 4 + length], length)
        if len(data) < at + 4 or text is None:
            return None
        out.append(text)
        at += 4 + length
    return out if at == len(data) else None


def _text(data: bytes, length: int) -> str | None:
    # serialisers differ on whether the length of an empty string is 0 or 1
    if len(data) != length or (length and data[-1] != 0):
        return None
    try:
        return data[:-1].decode()
    except UnicodeDecodeError:
        return None


def pack_decisions(decisions: pl.DataFrame, channel: int) -> Messages:
    """Messages of `schemas/Decision.msg` of rows of schema Decisions, in order.

    Every decision in a log was chosen, so the message does not carry that column.
    """
    heads = _heads(DECISION_HEAD, channel, decisions["t_ns"].to_numpy())
    for name in ("end_ns", "state", "reward", "value", "episode", "robot", "random"):
        heads[name] = decisions[name].to_numpy()
    for name in ("team", "role"):
        heads[name] = decisions[name].to_physical().to_numpy()
    heads["ends"] = (decisions["ends"].to_physical().cast(pl.Int16) + 1).fill_null(0).to_numpy()
    tails = [(name or "").encode() + b"\0" for name in decisions["behaviour_id"]]
    heads["name_bytes"] = [len(tail) for tail in tails]
    offsets = np.cumsum([0, *map(len, tails)], dtype=np.int64)
    return Messages(heads, np.frombuffer(b"".join(tails), dtype=np.uint8), offsets)


def unpack_decisions(messages: Messages) -> tuple[pl.DataFrame, Bools]:
    """Rows of schema Decisions without ``match_id``, and a mask of the messages [K] that they come from."""
    heads = messages.heads
    mask = _addressed(messages) & (messages.tail_bytes() == heads["name_bytes"])
    for name, values in (("team", len(SIDES)), ("role", len(ROLES)), ("random", 2), ("ends", 1 + len(ENDS))):
        mask &= heads[name] < values
    tails = messages.tails.tobytes()
    texts = [tails[start:end] for start, end in pairwise(messages.offsets.tolist())]
    names = {text: _text(text, len(text)) for text in set(texts)}  # few behaviours, many decisions
    mask &= np.array([names[text] is not None for text in texts], dtype=np.bool_)
    kept = heads[mask]
    dtypes = Decisions.dtypes()
    codes = {"team": kept["team"], "role": kept["role"], "ends": kept["ends"] - np.uint8(1)}  # goes on: 255
    columns = {
        **{name: kept[name] for name in ("end_ns", "state", "reward", "value", "episode", "robot")},
        **{name: named(pl.Series(code).replace(255, None), dtypes[name]) for name, code in codes.items()},
        "t_ns": kept["log_time"],
        "random": kept["random"].astype(np.bool_),
        "chosen": np.ones(len(kept), dtype=np.bool_),
        "behaviour_id": pl.Series([names[texts[i]] or None for i in np.flatnonzero(mask)], dtype=pl.String),
    }
    return pl.DataFrame(columns, schema_overrides=dtypes), mask


def pack_commands(commands: pl.DataFrame, channel: int) -> Messages:
    """Messages of `schemas/Commands.msg` of rows of schema Commands: one for each time, in order of time."""
    commands = commands.sort("t_ns", maintain_order=True)
    t_ns, first = np.unique(commands["t_ns"].to_numpy(), return_index=True)
    offsets = np.concatenate((first, [len(commands)])).astype(np.int64)
    heads = _heads(COMMANDS_HEAD, channel, t_ns)
    heads["commands"] = np.diff(offsets)
    rows = np.zeros(len(commands), dtype=_COMMAND_DTYPE)
    for name in ("count", "robot"):
        rows[name] = commands[name].to_numpy()
    for name in ("team", "command"):
        rows[name] = commands[name].to_physical().to_numpy()
    return Messages(heads, bytes_of(rows), offsets * _COMMAND_DTYPE.itemsize)


def unpack_commands(messages: Messages) -> tuple[pl.DataFrame, Bools]:
    """Rows of schema Commands without ``match_id``, and a mask of the messages [K] that they come from."""
    announced = messages.heads["commands"].astype(np.int64)
    mask = _addressed(messages) & (messages.tail_bytes() == announced * _COMMAND_DTYPE.itemsize)
    whole = messages.keep(mask)
    rows = whole.tails.view(_COMMAND_DTYPE)
    message = np.repeat(np.arange(len(whole)), whole.tail_bytes() // _COMMAND_DTYPE.itemsize)
    sound = (rows["team"] < len(SIDES)) & (rows["command"] < len(COMMANDS)) & (rows["count"] > 0)
    kept = np.bincount(message[~sound], minlength=len(whole)) == 0
    mask[mask] = kept
    rows, t_ns = rows[kept[message]], whole.heads["log_time"][message[kept[message]]]
    dtypes = {name: dtype for name, dtype in Commands.dtypes().items() if name != "match_id"}
    columns = {
        **{name: rows[name] for name in ("count", "robot")},
        **{name: named(pl.Series(rows[name]), dtypes[name]) for name in ("team", "command")},
        "t_ns": t_ns,
    }
    return pl.DataFrame(columns, schema_overrides=dtypes), mask


def pack_heights(heights: Heights, channel: int) -> Messages:
    """Messages of `schemas/BallHeight.msg` of the ball's heights, in order."""
    return _whole(HEIGHT_HEAD, channel, heights.t_ns, z=heights.z)


def unpack_heights(messages: Messages) -> tuple[Heights, Bools]:
    """The ball's heights in order of time, and a mask of the messages [K] that they come from."""
    mask = _addressed(messages) & (messages.tail_bytes() == 0) & np.isfinite(messages.heads["z"])
    kept = messages.heads[mask]
    order = np.argsort(kept["log_time"], kind="stable")
    return Heights(kept["log_time"][order].copy(), kept["z"][order].copy()), mask


def pack_options(options: npt.NDArray[np.void], channel: int) -> Messages:
    """Messages of `schemas/Option.msg` of OPTION_DTYPE [O], in order."""
    return _whole(OPTION_HEAD, channel, **{name: options[name] for name in OPTION_DTYPE.names or ()})


def unpack_options(messages: Messages) -> tuple[npt.NDArray[np.void], Bools]:
    """Changes of logged options in order of time, OPTION_DTYPE [O], and a mask of their messages [K]."""
    heads = messages.heads
    mask = _addressed(messages) & (messages.tail_bytes() == 0) & np.isin(heads["option"], (0, *OPTIONS))
    mask &= (heads["team"] < len(SIDES)) & (heads["robot"] >= 0)
    found = heads[mask][["log_time", "option", "robot", "team"]].astype(OPTION_DTYPE)
    return found[np.argsort(found["t_ns"], kind="stable")], mask


def _whole(head: np.dtype[np.void], channel: int, t_ns: I64, **columns: npt.NDArray[np.generic]) -> Messages:
    """Messages that have no tails."""
    heads = _heads(head, channel, t_ns)
    for name, values in columns.items():
        heads[name] = values
    return Messages(heads, np.empty(0, dtype=np.uint8), np.zeros(len(heads) + 1, dtype=np.int64))
