"""Samples of the bodies and counted commands of the players, from show lines.

The server carries out a player's command and counts it at once (``player.cpp``), then moves all bodies, then
writes the show line (``Stadium::step``). So the line that first counts a kick has the ball's new velocity.
"""

from __future__ import annotations

from itertools import chain
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.importers.rcg.lines import COUNTED, PLACES, ParsedLines
from pitchlore.pipeline.importers.rows import pack
from pitchlore.pipeline.matches.frame import Frames, wrap
from pitchlore.pipeline.numbers.arrays import I64, Bools
from pitchlore.schemas import Commands
from pitchlore.schemas.commands import COMMANDS
from pitchlore.schemas.table import named

#: Bit of a player's state: it is on the pitch.
_STANDS = 0x1


class Players(NamedTuple):
    """The players of all show lines, one after another.

    Attributes:
        line: int64 [R], index of the show line.
        right: whether the player is of the right team, bool [R].
        number: int64 [R].
        there: whether the player is on the pitch, bool [R].
        body: x, y, vx, vy and body angle as the server wrote them, [5][R].
    """

    line: I64
    right: Bools
    number: I64
    there: Bools
    body: list[tuple[bytes, ...]]


def players_of(record: ParsedLines) -> Players:
    """The players of a log's show lines."""
    counts = np.array([len(players) for players in record.players], dtype=np.int64)
    fields = list(zip(*chain.from_iterable(record.players), strict=True)) or [()] * 8
    states = {text: int(text, 16 if b"x" in text else 10) for text in {*fields[2]}}
    state = np.array([states[text] for text in fields[2]], dtype=np.int64)
    return Players(
        line=np.repeat(np.arange(len(counts), dtype=np.int64), counts),
        right=np.array(fields[0], dtype="S1") == b"r",
        number=np.array(fields[1], dtype="S2").astype(np.int64),
        there=(state & _STANDS) != 0,
        body=fields[3:8],
    )


def shown_frames(record: ParsedLines, players: Players) -> Frames:
    """Samples in our axes and units."""
    per_second = 1000 / record.server.step_ms
    t_ns = np.array(record.ticks, dtype=np.int64) * (record.server.step_ms * 1_000_000)
    ball = np.array(record.balls, dtype="S").astype(np.float64)
    there = players.there
    x, y, vx, vy, body = np.array(players.body, dtype="S").astype(np.float64)[:, there]
    return pack(
        np.array(record.numbers, dtype=np.uint32),
        t_ns,
        {
            "x": ball[:, 0], "y": 0 - ball[:, 1],
            "vx": ball[:, 2] * per_second, "vy": 0 - ball[:, 3] * per_second,
        },
        players.line[there],
        {
            "team": players.right.astype(np.uint8)[there],
            "id": players.number.astype(np.uint16)[there],
            "x": x, "y": 0 - y, "vx": vx * per_second, "vy": 0 - vy * per_second,
            "theta": wrap(-np.radians(body)),
        },
    )


def commands_of(record: ParsedLines, players: Players, t_ns: I64, match_id: str) -> pl.DataFrame:
    """Rows of schema Commands: where a player's counters are greater than in the player's line before.

    A player's first line gives no row, because the log did not see what it counts. A line in which one of
    the player's counters is less than before gives none either: the server counts anew. A player who is not
    on the pitch gives none.
    """
    if not len(players.line):
        return Commands.empty()
    counts = np.fromstring(b" ".join(record.counters), dtype=np.int64, sep=" ").reshape(-1, COUNTED)
    robot = players.number + 100 * players.right
    order = np.argsort(robot * len(t_ns) + players.line, kind="stable")
    order = order[counts[order, 0] >= 0]
    if not len(order):
        return Commands.empty()
    line, robot = players.line[order], robot[order]
    rises = np.diff(np.ascontiguousarray(counts[order].T))  # [COUNTED, R - 1]
    known = (np.diff(robot) == 0) & (rises.min(axis=0) >= 0) & players.there[order][1:]
    rises = np.ascontiguousarray((rises[[PLACES[name] for name in COMMANDS]] * known).T)
    row, place = np.nonzero(rises)
    dtypes = Commands.dtypes()
    table = pl.DataFrame({
        "team": named(pl.Series(robot[row + 1] // 100, dtype=pl.UInt8), dtypes["team"]),
        "robot": robot[row + 1] % 100,
        "t_ns": t_ns[line[row + 1]],
        "command": named(pl.Series(place, dtype=pl.UInt8), dtypes["command"]),
        "count": rises[row, place],
    })
    return Commands.validate(table.select(pl.lit(match_id).alias("match_id"), pl.all()), cast=True)
