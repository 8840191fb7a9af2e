"""Recordings of VSSS packets (FIRASim's vision, VSSReferee's commands, teams' options) as tracking tables.

Field numbers are facts, from the descriptors of the Python packages vsss-client 0.1.3 (MIT) and rsoccer-gym
1.4, which agree, and from VSSSLeague/VSSReferee (``include/protobuf/vssreferee/vssref_command.proto`` at
cd7e842, ``example/include/protobuf/vssreferee/vssref_common.proto`` at a9f22e9). FIRASim itself does not send
goals; forks that count them do, in two fields more. The number of VSSReferee's half is that of the package
V3SProtoComm 2.1.0, with whose messages the others' numbers agree.
"""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime
from operator import itemgetter
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.importers.packets.recording import PacketRecording
from pitchlore.pipeline.importers.packets.streams import OPTIONS, channels
from pitchlore.pipeline.importers.packets.told import ToldOption, told_option
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.ssl_logs.wire import VARINT, Fields, fields
from pitchlore.pipeline.importers.tracking.mapping import PitchMap, TrackingMap
from pitchlore.pipeline.importers.tracking.match import match_of
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import F64, I64, U8, Bools
from pitchlore.schemas import SIDES

# FIRASim's environment; its goals are of forks
_STEP, _FRAME, _FIELD, _GOALS_BLUE, _GOALS_YELLOW = 1, 2, 3, 4, 5
_FRAME_BALL, _FRAME_YELLOW, _FRAME_BLUE = 1, 2, 3
# a ball has x, y and z from 1 on; a robot its number, x, y and orientation
_BALL_X, _BALL_Y = 1, 2
_BALL_VX, _BALL_VY = 4, 5
_ROBOT_ID, _ROBOT_X, _ROBOT_Y, _ROBOT_ORIENTATION = 1, 2, 3, 4
_ROBOT_VX, _ROBOT_VY, _ROBOT_TURN = 5, 6, 7
_FIELD_WIDTH, _FIELD_LENGTH, _FIELD_GOAL_WIDTH, _FIELD_GOAL_DEPTH = 1, 2, 3, 4

# VSSReferee's command
_FOUL, _COLOUR, _TIMESTAMP, _HALF = 1, 2, 4, 5
#: The words of its fouls, as a table's states have them (``tracking.states.WORDS``).
_FOULS = ("freekick", "penaltykick", "goalkick", "freeball", "kickoff", "stop", "gameon", "halt")
_COLOURS = ("blue", "yellow")
#: No robot has so great a number, and no team so many goals.
_MOST = 1 << 15

#: Columns of a decoded frame, and of a body. The ball is team 2.
STEP, BLUE_GOALS, YELLOW_GOALS, LENGTH, WIDTH, GOAL_WIDTH, GOAL_DEPTH = range(7)
TEAM, ID, X, Y, THETA, VX, VY, OMEGA = range(8)
#: Its first column of velocities.
VELOCITY = VX
_TEAMS = ("yellow", "blue", "ball")
YELLOW, BLUE, BALL = range(3)


class Environments(NamedTuple):
    """Frames of FIRASim, in their order.

    Attributes:
        sound: bool [M], which of the packets are among them.
        frames: float64 [F, 7], step, goals of blue and yellow, length and width (m), width and depth of the
            goals (m); NaN where the packet does not say.
        offsets: int64 [F + 1]; the bodies of frame i are ``bodies[offsets[i]:offsets[i + 1]]``.
        bodies: float64 [D, 8], team (0 yellow, 1 blue, 2 the ball), number, x, y (m), theta (radians), vx, vy
            (m/s) and turn rate (rad/s). Velocities are 0 where a simulator does not send them.
    """

    sound: Bools
    frames: F64
    offsets: I64
    bodies: F64


def environments(data: U8, start: I64, end: I64) -> Environments:
    """Frames of packets; one that cannot be decoded, or has no frame, is none."""
    top, damaged = fields(data, start, end)
    inner = top.spans(_FRAME)
    parts, broken = fields(data, inner.value, inner.end)
    damaged[inner.of[broken]] = True
    damaged[top.of[(top.number == _STEP) & (top.kind != VARINT)]] = True
    sound = ~damaged & np.isin(np.arange(len(start)), inner.of)
    bodies, of = _bodies(data, parts._replace(of=inner.of[parts.of]))
    kept = sound[of]
    counts = np.bincount(of[kept], minlength=len(start))[sound]
    frames = _frames(data, top, len(start))[sound]
    return Environments(sound, frames, np.concatenate(([0], np.cumsum(counts))), bodies[kept])


def goals_counted(found: Environments) -> tuple[int, int] | None:
    """Goals of blue and of yellow in the last frame; None if it counts none."""
    goals = found.frames[-1:, [BLUE_GOALS, YELLOW_GOALS]]
    if not np.isfinite(goals).any():
        return None
    blue, yellow = np.nan_to_num(goals[0]).astype(int).tolist()  # what is 0 need not be sent
    return blue, yellow


class RefereeCommand(NamedTuple):
    """A command of the referee.

    Attributes:
        t_ns: when it was received.
        half: its number; -1 where the packet does not say.
        state: the words for it.
        clock_s: time of the half, seconds; None where the packet does not say.
    """

    t_ns: int
    half: int
    state: str
    clock_s: float | None


def are_commands(data: U8, start: I64, end: I64) -> Bools:
    """Mask of the referee's commands among the packets, bool [M]."""
    return _known(_decode_commands(data, start, end))


def commands(data: U8, t_ns: I64, start: I64, end: I64) -> tuple[list[RefereeCommand], int]:
    """The referee's commands, and the number of packets that are none."""
    rows, clocks = _decode_commands(data, start, end), _clocks(data, start, end)
    known = _known(rows)
    said = []
    for (foul, colour, half), at, clock in zip(
        rows[known].tolist(), t_ns[known].tolist(), clocks[known].tolist(), strict=True
    ):
        word = _FOULS[foul]
        state = f"{word}_{_COLOURS[colour]}" if 0 <= colour < len(_COLOURS) else word
        said.append(RefereeCommand(at, half, state, clock if math.isfinite(clock) else None))
    return said, int((~known).sum())


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a recording of VSSS packets; blue is home unless the map names a team.

    The clock is that of the receiver. The score is that of the packets, if they have one; else goals are
    found as in a table of positions.

    Raises:
        BadRecording: if it has no frame of bodies, or exceeds a limit.
        DamagedLog: if the recording does not say whose packets it has.
    """
    teams = mapping.teams
    blue_is_home = teams.home != _TEAMS[YELLOW] and teams.away != _TEAMS[BLUE]
    table, pitch, lost, started = _table(source, blue_is_home=blue_is_home)
    if teams.home is None and teams.away is None:
        teams = teams.model_copy(update={"home": "blue", "away": "yellow"})
    sized = PitchMap.model_validate(pitch | mapping.pitch.model_dump(exclude_none=True))
    flaws = [Flaw("skipped", f"{lost} packets that cannot be decoded", count=lost)] if lost else []
    axes = mapping.axes.model_copy(update={"origin": mapping.axes.origin})  # theirs is known
    told = mapping.model_copy(update={"teams": teams, "pitch": sized, "axes": axes})
    match = match_of(table, source, told, flaws=flaws)
    own = {"format": "vsss-packets", "started_at": started}
    return replace(match, info=match.info.model_copy(update=own))


def _table(
    source: SourceFile, *, blue_is_home: bool
) -> tuple[pl.DataFrame, dict[str, object], int, datetime]:
    """The recording as a tracking table of the plain form, its pitch, packets lost, when it began."""
    channel = channels("vsss")
    parts, times, said, lost = [], [], list[RefereeCommand](), 0
    told = list[tuple[int, ToldOption | None]]()
    for packets in PacketRecording(source.content, source.name).packets():
        seen = packets.channel == channel["vision"]
        found = environments(packets.data, packets.start[seen], packets.end[seen])
        parts.append(found)
        times.append(packets.t_ns[seen][found.sound])
        heard = packets.channel == channel["referee"]
        more, broken = commands(packets.data, packets.t_ns[heard], packets.start[heard], packets.end[heard])
        said += more
        told += [(int(packets.t_ns[i]), told_option(packets.data[packets.start[i]:packets.end[i]].tobytes()))
                 for i in np.flatnonzero(packets.channel == OPTIONS.channel)]
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
    options = [(at, option) for at, option in told if option is not None]
    lost += len(told) - len(options)
    team = bodies[:, TEAM].astype(np.int64)
    table = pl.DataFrame({
        "frame": of, "t": (t_ns[of] - t_ns[0]) / 1e9, "team": np.array(_TEAMS)[team],
        "player": bodies[:, ID], "x": bodies[:, X], "y": bodies[:, Y], "heading": bodies[:, THETA],
        **_options(options, t_ns[of], bodies), **_score(frames, of, blue_is_home=blue_is_home),
        "game_state": pl.Series(_states(said, t_ns), dtype=pl.String).gather(of),
    }).with_columns(
        player=pl.when(pl.col("team") != "ball").then(pl.col("player").cast(pl.Int64)),
        heading=pl.col("heading").fill_nan(None),
    )
    return table, _pitch(frames), lost, datetime.fromtimestamp(int(t_ns[0]) / 1e9, tz=UTC)


def _options(told: list[tuple[int, ToldOption]], t_ns: I64, bodies: F64) -> dict[str, pl.Series]:
    """Column of what teams told last of each body before its frame, if they told anything.

    Args:
        told: options and their times.
        t_ns: int64 [D], time of each body's frame.
        bodies: float64 [D, 8].
    """
    codes = np.zeros(len(t_ns), dtype=np.int64)
    for team, robot in {(option.team, option.robot) for _, option in told}:
        mine = sorted(
            ((at, option.option or 0) for at, option in told if (option.team, option.robot) == (team, robot)),
            key=itemgetter(0))
        rows = (bodies[:, TEAM] == _TEAMS.index(team)) & (bodies[:, ID] == robot)
        latest = np.searchsorted([at for at, _ in mine], t_ns[rows], side="right")
        codes[rows] = np.array([0, *(code for _, code in mine)])[latest]
    return {"option": pl.Series(codes).replace(0, None)} if told else {}


def _score(frames: F64, of: I64, *, blue_is_home: bool) -> dict[str, pl.Series]:
    """Columns of the score, if the packets count goals."""
    goals = frames[:, [BLUE_GOALS, YELLOW_GOALS]]
    if not np.isfinite(goals).any():
        return {}
    goals = np.nan_to_num(goals)  # what is 0 need not be sent
    sides = SIDES if blue_is_home else SIDES[::-1]
    return {f"score_{side}": pl.Series(goals[of, i].astype(np.int64)) for i, side in enumerate(sides)}


def _states(said: list[RefereeCommand], t_ns: I64) -> list[str | None]:
    """State of the game of each frame: the commands since the frame before, else what held there.

    Where the half has changed, a word says so.
    """
    states: list[str | None] = [None] * len(t_ns)
    half, state, words = -1, "", list[str]()
    starts = np.searchsorted(t_ns, [command.t_ns for command in said]).tolist()
    for command, first, end in zip(said, starts, [*starts, len(t_ns)][1:], strict=True):
        words += ["half"] * (command.half > half >= 1) + [command.state]
        half = max(half, command.half)
        if first == end:
            continue
        if words != state.split("+")[-1:]:  # else what holds is said again
            state = "+".join(dict.fromkeys(words))
        states[first:end] = [state] * (end - first)
        words = []
    return states


def _pitch(frames: F64) -> dict[str, object]:
    """Pitch as the packets give it, in metres; the last packet with one that can be counts."""
    size = frames[:, LENGTH:]
    known = (size >= (0.1, 0.1, 0.01, 1e-9)) & (size <= (1000, 1000, 1000, 100))
    reported = np.flatnonzero(known.all(axis=1))
    if not len(reported):
        return {"kind": Kind.VSSS}
    length, width, goal_width, goal_depth = frames[reported[-1], LENGTH:].tolist()
    return {"kind": Kind.VSSS, "length": length, "width": width, "goal_width": goal_width,
            "goal_depth": goal_depth}


def _frames(data: U8, top: Fields, count: int) -> F64:
    """Content of packets besides bodies, float64 [count, 7]; NaN where they say nothing."""
    frames = np.full((count, 7), np.nan)
    for number, column in ((_STEP, STEP), (_GOALS_BLUE, BLUE_GOALS), (_GOALS_YELLOW, YELLOW_GOALS)):
        of, value = top.varints(number)
        frames[of, column] = np.clip(value, 0, (1 << 31) if number == _STEP else _MOST)
    sizes = top.spans(_FIELD)
    reported, _ = fields(data, sizes.value, sizes.end)
    for number, column in ((_FIELD_WIDTH, WIDTH), (_FIELD_LENGTH, LENGTH), (_FIELD_GOAL_WIDTH, GOAL_WIDTH),
                           (_FIELD_GOAL_DEPTH, GOAL_DEPTH)):
        sized, metres = reported.reals(data, number)
        frames[sizes.of[sized], column] = metres
    return frames


def _bodies(data: U8, parts: Fields) -> tuple[F64, I64]:
    """Bodies [D, 8] among the fields of frames, in order of their packets, and the packet of each.

    A body that cannot be decoded, or has no place, is left out. What is 0 is not sent.
    """
    spans = parts.spans(_FRAME_BALL, _FRAME_YELLOW, _FRAME_BLUE)
    reported, broken = fields(data, spans.value, spans.end)
    bodies = np.zeros((len(spans.of), 8))
    ball = spans.number == _FRAME_BALL
    bodies[:, TEAM] = np.where(ball, BALL, spans.number - _FRAME_YELLOW)
    bodies[ball, THETA] = np.nan
    of, own = reported.varints(_ROBOT_ID)
    bodies[of, ID] = np.where(ball[of], 0, own)
    for number, of_ball, column in (
        (_BALL_X, True, X), (_BALL_Y, True, Y), (_BALL_VX, True, VX), (_BALL_VY, True, VY),
        (_ROBOT_X, False, X), (_ROBOT_Y, False, Y), (_ROBOT_ORIENTATION, False, THETA),
        (_ROBOT_VX, False, VX), (_ROBOT_VY, False, VY), (_ROBOT_TURN, False, OMEGA),
    ):
        of, value = reported.reals(data, number)
        mine = ball[of] == of_ball
        bodies[of[mine], column] = value[mine]
    usable = ~broken & np.isfinite(bodies[:, [X, Y]]).all(axis=1)
    usable &= (bodies[:, ID] >= 0) & (bodies[:, ID] < _MOST)
    return bodies[usable], spans.of[usable]


def _clocks(data: U8, start: I64, end: I64) -> F64:
    """Time of the half in each command, seconds, float64 [M]; NaN where it is absent."""
    clocks = np.full(len(start), np.nan)
    of, value = fields(data, start, end)[0].reals(data, _TIMESTAMP)
    clocks[of] = value
    return clocks


def _known(rows: I64) -> Bools:
    return (rows[:, 0] >= 0) & (rows[:, 0] < len(_FOULS))


def _decode_commands(data: U8, start: I64, end: I64) -> I64:
    """Foul, colour and half of each packet, int64 [M, 3]; foul -1 if it cannot be decoded, half -1 if absent.

    What is 0 is not sent; a packet without anything is none.
    """
    rows = np.zeros((len(start), 3), np.int64)
    rows[:, 2] = -1
    reported, damaged = fields(data, start, end)
    for column, number in enumerate((_FOUL, _COLOUR, _HALF)):
        of, value = reported.varints(number)
        rows[of, column] = value
        damaged[reported.of[(reported.number == number) & (reported.kind != VARINT)]] = True
    rows[damaged | (start == end), 0] = -1
    return rows
