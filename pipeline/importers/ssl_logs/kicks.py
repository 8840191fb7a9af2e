"""Kicks that a tracker tells: where from, how fast, and where the ball would come to rest.

Field numbers are those of RoboCup-SSL/ssl-game-controller,
``proto/tracker/ssl_vision_detection_tracked.proto`` at 78a9b3b. A tracker repeats a kick in each frame while
the ball rolls, and estimates it better and better.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pitchlore.pipeline.importers.ssl_logs.home import HomeColour
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, YELLOW
from pitchlore.pipeline.importers.ssl_logs.wire import Fields, fields
from pitchlore.pipeline.numbers.arrays import F64, I64, U8
from pitchlore.schemas import SIDES

_KICKED_BALL = 5
_PLACE, _VELOCITY, _START, _STOP, _STOP_PLACE, _ROBOT = range(1, 7)
#: Columns of a kick, and those of its vectors; packet and frame time first.
_ORDER, _FRAME, _AT, _UNTIL, _TEAM, _ID, _X, _Y, _VX, _VY, _VZ, _END_X, _END_Y = range(13)
_VECTORS = ((_PLACE, (_X, _Y)), (_VELOCITY, (_VX, _VY, _VZ)), (_STOP_PLACE, (_END_X, _END_Y)))
#: Estimates of one kick differ by less, seconds; one that is older is none.
_SAME_S, _OLDEST_S = 0.15, 60.0
_MOST = 20_000


class KickLog:
    """Kicks of one tracker, as they come: of each the last estimate.

    Args:
        source: name of the tracker.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self._done: list[F64] = []
        self._last = np.empty((0, 13))

    def add(self, data: U8, frames: Fields, order: I64, captured: F64) -> None:
        """Take up the kicks of frames.

        Args:
            data: bytes that hold them.
            frames: fields of the frames, by packet.
            order: int64 [M], number of each packet.
            captured: float64 [M], time of its frame, seconds; NaN if it is not used.
        """
        spans = frames.spans(_KICKED_BALL)
        spans = spans.at(np.flatnonzero(np.isfinite(captured[spans.of])))
        if not len(spans.of):
            return
        told, damaged = fields(data, spans.value, spans.end)
        rows = np.full((len(spans.of), 13), np.nan)
        rows[:, _ORDER], rows[:, _FRAME] = order[spans.of], captured[spans.of]
        for number, column in ((_START, _AT), (_STOP, _UNTIL)):
            of, values = told.reals(data, number)
            rows[of, column] = values
        for number, columns in _VECTORS:
            vectors = told.spans(number)
            inner, _ = fields(data, vectors.value, vectors.end)
            for axis, column in enumerate(columns, 1):
                of, values = inner.reals(data, axis)
                rows[vectors.of[of], column] = values
        robot = told.spans(_ROBOT)
        inner, _ = fields(data, robot.value, robot.end)
        for number, column in ((1, _ID), (2, _TEAM)):
            of, whole = inner.varints(number)
            rows[robot.of[of], column] = whole
        sound = ~damaged & (np.abs(rows[:, _FRAME] - rows[:, _AT]) < _OLDEST_S)
        rows = np.vstack((self._last, rows[sound]))
        if not len(rows):
            return
        before, after = rows[:-1], rows[1:]
        robots = [np.nan_to_num(part[:, [_TEAM, _ID]], nan=-1) for part in (before, after)]
        same = (np.abs(after[:, _AT] - before[:, _AT]) < _SAME_S) & (robots[0] == robots[1]).all(axis=1)
        ended = rows[:-1][~same]
        if len(self._done) < _MOST:
            self._done.extend(ended)
        self._last = rows[-1:]

    def rows(self, home: HomeColour, t_ns: Callable[[int, float], int]) -> list[dict[str, object]]:
        """Rows of schema Kicks without ``match_id``, in order of time.

        Args:
            home: the colour of home in the course of the match.
            t_ns: time of a moment by the number of the message that tells it and the tracker's clock.
        """
        found = []
        for kick in [*self._done, *self._last]:
            order = int(kick[_ORDER])
            row: dict[str, object] = {
                "t_ns": max(t_ns(order, kick[_AT]), 0), "source": self._source,
                "team": None, "robot": None,
            }
            colour = {1: YELLOW, 2: BLUE}.get(int(np.nan_to_num(kick[_TEAM])))
            if colour is not None and 0 <= kick[_ID] < 1 << 15:
                row |= {"team": SIDES[int(colour != home.now(order))], "robot": int(kick[_ID])}
            numbers = [float(value) if abs(value) < 1e6 else None for value in kick[_X:]]
            row |= dict(zip(("x", "y", "vx", "vy", "vz", "stop_x", "stop_y"), numbers, strict=True))
            rolls = abs(kick[_UNTIL] - kick[_FRAME]) < _OLDEST_S
            row["stop_ns"] = t_ns(order, kick[_UNTIL]) if rolls else None
            found.append(row)
        return sorted(found, key=lambda row: row["t_ns"])  # type: ignore[arg-type, return-value]
