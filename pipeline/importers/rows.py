"""Referee events and packed frames, as every importer writes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.matches.frame import BALL_DTYPE, ROBOT_DTYPE, Frames
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.schemas import AWAY, HOME, Referee, Side

#: A higher score is a damaged file, not a match.
MAX_SCORE = 9999


@dataclass(frozen=True, slots=True)
class Event:
    """One row of schema Referee; the score is None where it is not known."""

    t_ns: int
    event: str
    team: Side | None = None
    score_home: int | None = None
    score_away: int | None = None
    note: str | None = None


def other(team: Side) -> Side:
    """Opponent of a team."""
    return "away" if team == "home" else "home"


def referee(match_id: str, events: Sequence[Event]) -> pl.DataFrame:
    """Rows of schema Referee in order of time; events of one time keep their order."""
    rows = [{"match_id": match_id, **asdict(event)} for event in sorted(events, key=lambda e: e.t_ns)]
    return Referee.of(rows)


def pack(
    number: npt.NDArray[np.uint32],
    t_ns: I64,
    ball: dict[str, F64],
    frame_of: I64,
    robots: dict[str, npt.NDArray[np.generic]],
) -> Frames:
    """Frames from columns.

    Args:
        number: [F] the source's frame number.
        t_ns: [F] time since the first sample, ns.
        ball: x, y, vx, vy [F], metres and m/s; an absent column is NaN.
        frame_of: [R] frame index of each robot row, in any order.
        robots: team, id, x, y and optionally theta, vx, vy, omega [R]; an absent column is NaN.

    Returns:
        Frames whose robots are ordered by frame, team, id.
    """
    balls = np.full(len(t_ns), np.nan, dtype=BALL_DTYPE)
    for column, values in ball.items():
        balls[column] = values
    order = np.lexsort((robots["id"], robots["team"], frame_of))
    packed = np.zeros(len(order), dtype=ROBOT_DTYPE)
    for column in ("theta", "vx", "vy", "omega"):
        packed[column] = np.nan
    for column, known in robots.items():
        packed[column] = known[order]
    counts = np.bincount(frame_of, minlength=len(t_ns))
    offsets = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    return Frames(number=number, t_ns=t_ns, ball=balls, offsets=offsets, robots=packed)


def few_frames(late: bool = False) -> Frames:
    """Half a second of two robots a side and a ball, maybe one frame late, to compile what reads frames."""
    t_ns = np.arange(30, dtype=np.int64) * 16_000_000
    t_ns[[10, 11]] = t_ns[[11, 10]] if late else t_ns[[10, 11]]
    frame_of = np.repeat(np.arange(len(t_ns)), 4)
    team, number = np.tile([HOME, HOME, AWAY, AWAY], len(t_ns)), np.tile([0, 1, 0, 1], len(t_ns))
    x = (2.0 * team - 1.0) * (0.1 + 0.2 * number) + frame_of * 0.01
    return pack(
        np.arange(len(t_ns), dtype=np.uint32), t_ns, {"x": t_ns / 1e9, "y": t_ns / 1e9}, frame_of,
        {"team": team.astype(np.uint8), "id": number.astype(np.uint16), "x": x, "y": 0.1 * x, "theta": x},
    )
