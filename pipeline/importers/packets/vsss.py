"""Recordings of VSSS packets: FIRASim's vision and VSSReferee's commands, read as a tracking table.

Field numbers are facts, from the descriptors of the Python package vsss-client 0.1.3 (MIT) and rsoccer-gym 1.4,
which agree, and from VSSSLeague/VSSReferee (``include/protobuf/vssreferee/vssref_command.proto`` at cd7e842,
``example/include/protobuf/vssreferee/vssref_common.proto`` at a9f22e9). FIRASim itself does not send goals;
forks that count them do, in two fields more. VSSReferee's half has no number in the files that we could read: the
next free one is read, and without it no half time is known.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import polars as pl
from numba import njit

from pipeline.arrays import F64, I64, U8, Bools
from pipeline.errors import BadRecording
from pipeline.importers.source import SourceFile
from pipeline.importers.ssl_logs.wire import BROKEN, SPAN, VARINT, field, real
from pipeline.importers.tracking.mapping import PitchMap, Teams, TrackingMap
from pipeline.importers.tracking.match import match_of
from pipeline.matches.frame import MatchLog
from pipeline.matches.quality import Flaw
from pipeline.packets.recording import Recording
from pipeline.packets.streams import LEAGUES
from pipeline.pitch import Kind

# FIRASim's environment; its goals are of forks
_STEP, _FRAME, _FIELD, _GOALS_BLUE, _GOALS_YELLOW = 1, 2, 3, 4, 5
_FRAME_BALL, _FRAME_YELLOW, _FRAME_BLUE = 1, 2, 3
# a ball has x, y and z from 1 on; a robot its number, x, y and orientation
_BALL_X, _BALL_Y = 1, 2
_ROBOT_ID, _ROBOT_X, _ROBOT_Y, _ROBOT_ORIENTATION = 1, 2, 3, 4
_FIELD_WIDTH, _FIELD_LENGTH, _FIELD_GOAL_WIDTH, _FIELD_GOAL_DEPTH = 1, 2, 3, 4

# VSSReferee's command
_FOUL, _COLOUR, _HALF = 1, 2, 5
#: The words of its fouls, as a table's states have them (``tracking.states.WORDS``).
_FOULS = ("freekick", "penaltykick", "goalkick", "freeball", "kickoff", "stop", "gameon", "halt")
_COLOURS = ("blue", "yellow")
_MOST_GOALS = 9_999

#: Columns of a decoded frame, and of a body. The ball is team 2.
STEP, BLUE_GOALS, YELLOW_GOALS, LENGTH, WIDTH, GOAL_WIDTH, GOAL_DEPTH = range(7)
TEAM, ID, X, Y, THETA = range(5)
_TEAMS = ("yellow", "blue", "ball")


class Environments(NamedTuple):
    """Frames of FIRASim, in their order.

    Attributes:
        sound: bool [M], which of the packets are among them.
        frames: float64 [F, 7], step, goals of blue and yellow, length, width, width and depth of the goals (m);
            NaN where the packet does not say.
        offsets: int64 [F + 1]; the bodies of frame i are ``bodies[offsets[i]:offsets[i + 1]]``.
        bodies: float64 [D, 5], team (0 yellow, 1 blue, 2 the ball), number, x, y (m), theta (radians).
    """

    sound: Bools
    frames: F64
    offsets: I64
    bodies: F64


def environments(data: U8, start: I64, end: I64) -> Environments:
    """Frames of packets; one that cannot be decoded, or has no frame, is none."""
    counts = _count(data, start, end)
    sound = counts >= 0
    frames, bodies, offsets = _decode(data, start[sound], end[sound], int(counts[sound].sum()))
    return Environments(sound, frames, offsets, bodies)


class Said(NamedTuple):
    """A command of the referee.

    Attributes:
        t_ns: when it was received.
        half: its number; -1 where the packet does not say.
        state: the words for it.
    """

    t_ns: int
    half: int
    state: str


def commands(data: U8, t_ns: I64, start: I64, end: I64) -> tuple[list[Said], int]:
    """The referee's commands, and the number of packets that are none."""
    rows = _decode_commands(data, start, end)
    known = (rows[:, 0] >= 0) & (rows[:, 0] < len(_FOULS))
    said = []
    for (foul, colour, half), at in zip(rows[known].tolist(), t_ns[known].tolist(), strict=True):
        word = _FOULS[foul]
        said.append(Said(at, half, f"{word}_{_COLOURS[colour]}" if 0 <= colour < len(_COLOURS) else word))
    return said, int((~known).sum())


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a recording of VSSS packets; blue is home unless the map names a team.

    The clock is that of the receiver. The score is that of the packets, if they have one; else goals are found
    as in a table of positions.

    Raises:
        BadRecording: if it has no frame of bodies, or exceeds a limit.
        DamagedLog: if the recording does not say whose packets it has.
    """
    table, pitch, lost = _table(source)
    teams = mapping.teams
    if teams.home is None and teams.away is None:
        teams = teams.model_copy(update={"home": "blue", "away": "yellow"})
    told = PitchMap.model_validate(pitch | mapping.pitch.model_dump(exclude_none=True))
    flaws = [Flaw("skipped", f"{lost} packets that cannot be decoded", count=lost)] if lost else []
    match = match_of(table, source, mapping.model_copy(update={"teams": teams, "pitch": told}), flaws=flaws)
    return replace(match, info=match.info.model_copy(update={"format": "vsss-packets"}))


def _table(source: SourceFile) -> tuple[pl.DataFrame, dict[str, object], int]:
    """The recording as a tracking table of the plain form, what it says of the pitch, and packets lost."""
    channel = {stream.name: stream.channel for stream in LEAGUES["vsss"]}
    parts, times, said, lost = [], [], list[Said](), 0
    for packets in Recording(source.content, source.name).packets():
        seen = packets.channel == channel["vision"]
        found = environments(packets.data, packets.start[seen], packets.end[seen])
        parts.append(found)
        times.append(packets.t_ns[seen][found.sound])
        more, broken = commands(packets.data, packets.t_ns[~seen], packets.start[~seen], packets.end[~seen])
        said += more
        lost += int((~found.sound).sum()) + broken
        if sum(map(len, times)) > source.limits.rows:
            raise source.too_much(f"more than {source.limits.rows} frames", "rows")
    t_ns = np.concatenate(times) if times else np.empty(0, np.int64)
    if not len(t_ns):
        raise BadRecording("has no frame that can be decoded", where=source.name, next_step="Record it again")
    frames = np.concatenate([part.frames for part in parts])
    counts = np.concatenate([np.diff(part.offsets) for part in parts])
    bodies = np.concatenate([part.bodies for part in parts])
    of = np.repeat(np.arange(len(t_ns)), counts)
    team = bodies[:, TEAM].astype(np.int64)
    table = pl.DataFrame({
        "frame": of, "t": (t_ns[of] - t_ns[0]) / 1e9, "team": np.array(_TEAMS)[team],
        "player": bodies[:, ID], "x": bodies[:, X], "y": bodies[:, Y], "heading": bodies[:, THETA],
        **_score(frames, of), "game_state": pl.Series(_states(said, t_ns), dtype=pl.String).gather(of),
    }).with_columns(
        pl.when(pl.col("team") == "ball").then(None).otherwise(pl.col("player").cast(pl.Int64)).alias("player"),
        pl.col("heading").fill_nan(None),
    )
    return table, _pitch(frames), lost


def _score(frames: F64, of: I64) -> dict[str, pl.Series]:
    """Columns of the score, if the packets count goals."""
    goals = np.nan_to_num(frames[:, [BLUE_GOALS, YELLOW_GOALS]])
    if not goals.any():
        return {}
    return {f"score_{side}": pl.Series(goals[of, i].astype(np.int64)) for i, side in enumerate(("home", "away"))}


def _states(said: list[Said], t_ns: I64) -> list[str | None]:
    """State of the game of each frame: the last command's, with a half where that has changed."""
    states: list[str | None] = [None] * len(t_ns)
    last = -1
    starts = np.searchsorted(t_ns, [command.t_ns for command in said]).tolist()
    for command, first, end in zip(said, starts, [*starts[1:], len(t_ns)], strict=True):
        new_half = command.half > last >= 1
        last = max(last, command.half)
        states[first:end] = [f"half+{command.state}" if new_half else command.state] * (end - first)
    return states


def _pitch(frames: F64) -> dict[str, object]:
    """What the packets say of the pitch, in metres; the last packet that does counts."""
    told = np.flatnonzero((frames[:, [LENGTH, WIDTH, GOAL_WIDTH, GOAL_DEPTH]] > 0).all(axis=1))
    if not len(told):
        return {"kind": Kind.VSSS}
    length, width, goal_width, goal_depth = frames[told[-1], LENGTH:].tolist()
    return {"kind": Kind.VSSS, "length": length, "width": width, "goal_width": goal_width, "goal_depth": goal_depth}


@njit(cache=True, nogil=True)
def _count(data: U8, start: I64, end: I64) -> I64:
    """Number of bodies of each packet, int64 [M]; -1 if it cannot be decoded or has no frame."""
    counts = np.full(len(start), -1, np.int64)
    for i in range(len(start)):
        at, stop, broken = int(start[i]), int(end[i]), False
        while at < stop:
            number, kind, value, after = field(data, at, stop)
            at = after
            if number == BROKEN or (number == _STEP and kind != VARINT):
                broken = True
            elif number == _FRAME and kind == SPAN:
                counts[i] = max(counts[i], 0)
                inner = value
                while inner < after:
                    number, kind, _, inner = field(data, inner, after)
                    if number == BROKEN:
                        broken = True
                    elif number in (_FRAME_BALL, _FRAME_YELLOW, _FRAME_BLUE) and kind == SPAN:
                        counts[i] += 1
        if broken:
            counts[i] = -1
    return counts


@njit(cache=True, nogil=True)
def _decode(data: U8, start: I64, end: I64, most: int) -> tuple[F64, F64, I64]:
    """Frames [M, 7], bodies [D, 5] and offsets [M + 1] of sound packets; ``most`` is the number of bodies."""
    frames = np.full((len(start), 7), np.nan)
    bodies = np.empty((most, 5))
    offsets = np.zeros(len(start) + 1, np.int64)
    count = 0
    for i in range(len(start)):
        at, stop = int(start[i]), int(end[i])
        while at < stop:
            number, kind, value, at = field(data, at, stop)
            if number == _STEP and kind == VARINT:
                frames[i, STEP] = value
            elif number in (_GOALS_BLUE, _GOALS_YELLOW) and kind == VARINT:
                column = BLUE_GOALS if number == _GOALS_BLUE else YELLOW_GOALS
                frames[i, column] = min(max(value, 0), _MOST_GOALS)
            elif number == _FIELD and kind == SPAN:
                _size(data, value, at, frames[i])
            elif number == _FRAME and kind == SPAN:
                while value < at:
                    inner, wire, place, value = field(data, value, at)
                    if inner in (_FRAME_BALL, _FRAME_YELLOW, _FRAME_BLUE) and wire == SPAN:
                        team = 2 if inner == _FRAME_BALL else inner - _FRAME_YELLOW
                        if _body(data, place, value, team, bodies[count]):
                            count += 1
        offsets[i + 1] = count
    return frames, bodies[:count].copy(), offsets


@njit(cache=True, nogil=True)
def _size(data: U8, at: int, end: int, out: F64) -> None:
    while at < end:
        number, kind, value, at = field(data, at, end)
        if number == _FIELD_WIDTH:
            out[WIDTH] = real(data, kind, value)
        elif number == _FIELD_LENGTH:
            out[LENGTH] = real(data, kind, value)
        elif number == _FIELD_GOAL_WIDTH:
            out[GOAL_WIDTH] = real(data, kind, value)
        elif number == _FIELD_GOAL_DEPTH:
            out[GOAL_DEPTH] = real(data, kind, value)


@njit(cache=True, nogil=True)
def _body(data: U8, at: int, end: int, team: int, out: F64) -> bool:
    """Decode a body into ``out`` [5]; whether it has a place. Fields that are 0 are not sent."""
    out[:] = 0.0
    out[TEAM] = team
    ball = team == 2
    if ball:
        out[THETA] = np.nan
    while at < end:
        number, kind, value, at = field(data, at, end)
        if number == BROKEN:
            return False
        if ball and number == _BALL_X:
            out[X] = real(data, kind, value)
        elif ball and number == _BALL_Y:
            out[Y] = real(data, kind, value)
        elif not ball and number == _ROBOT_ID and kind == VARINT:
            out[ID] = value
        elif not ball and number == _ROBOT_X:
            out[X] = real(data, kind, value)
        elif not ball and number == _ROBOT_Y:
            out[Y] = real(data, kind, value)
        elif not ball and number == _ROBOT_ORIENTATION:
            out[THETA] = real(data, kind, value)
    return bool(np.isfinite(out[X]) and np.isfinite(out[Y]) and 0 <= out[ID] < 1 << 15)


@njit(cache=True, nogil=True)
def _decode_commands(data: U8, start: I64, end: I64) -> I64:
    """Foul, colour and half of each packet, int64 [M, 3]; foul -1 if it cannot be decoded, half -1 if absent.

    What is 0 is not sent; a packet without anything is none.
    """
    rows = np.zeros((len(start), 3), np.int64)
    rows[:, 2] = -1
    for i in range(len(start)):
        at, stop = int(start[i]), int(end[i])
        if at == stop:
            rows[i, 0] = -1
        while at < stop:
            number, kind, value, at = field(data, at, stop)
            known = number in (_FOUL, _COLOUR, _HALF)
            if number == BROKEN or (known and kind != VARINT):
                rows[i, 0] = -1
                break
            if known:
                rows[i, 0 if number == _FOUL else 1 if number == _COLOUR else 2] = value
    return rows
