"""Numbers that stand for "not seen": found in a table, and made null."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools

#: Times that a number recurs before it may stand for something.
_RECURS = 3
#: A number so many times the reach of all others beyond the next one is no place.
_FAR = 1.0
#: Values that are looked at to find that reach; fewer different ones tell none.
_LOOK, _LEAST = 20_000, 20
#: Least jump into a number and out of it, or way beyond others, as a share of the reach of all others, ...
_JUMP = 0.1
#: ... and share of its visits that begin and end with one.
_VISITS = 0.8
#: Places so near the middle of all others are the pitch's centre, as a share of their reach.
_CENTRAL = 0.05
#: Visits of the ball there, and their length in ns, from which on it was not put there.
_OFTEN, _SHORT_NS = 10, 300_000_000
#: Share of samples before an earlier one of their body from which on the order of a file is not that of time.
_FALLS = 0.01
#: The ball's side.
_BALL = 2
#: Most numbers of one table that stand for it.
_MOST = 4
#: A turn in radians, and in the smallest unit of headings, gradians.
_TURN, _LARGEST_TURN = 2 * np.pi, 400.0
#: Larger numbers are none of a table: what is damaged is not looked at.
_NUMBERS = 1e12


def nothing_seen(table: pl.DataFrame) -> tuple[pl.DataFrame, list[Flaw]]:
    """Table with places and headings null where a number stands for "not seen", and a flaw for each number.

    Such a number recurs exactly. Either it is far off all other places, or it stands for both x and y, and is
    beyond all other places, or bodies jump to it and from it.

    Args:
        table: in the file's units: ``x``, ``y`` Float64, ``side``, ``id``, ``t_ns``, and optionally
            ``heading`` and velocities.
    """
    flaws: list[Flaw] = []
    moving = [column for column in ("heading", "vx", "vy", "omega") if column in table.columns]
    while len(flaws) < _MOST:
        far = _far_off(table, ("x", "y"))
        found = _jumped_to(table) if far is None else (far, True)
        if found is None:
            break
        value, of_ball = found
        one, two = pl.col("x") == value, pl.col("y") == value
        at = one & two & (of_ball | (pl.col("side") != _BALL)) if far is None else one | two
        count = int(table.select(at.sum()).item())
        table = table.with_columns(
            pl.when(at).then(None).otherwise(pl.col(column)).alias(column) for column in ("x", "y", *moving))
        note = f"places of {value:g} recur exactly and are no places: taken for not seen"
        flaws.append(Flaw("assumed", note, count))
    for column in moving:
        far = _far_off(table, (column,))
        if far is not None and not (column == "heading" and _is_direction(far, table[column])):
            note = f"{column} is {far:g} in rows where it is not known: left out"
            flaws.append(Flaw("assumed", note, int((table[column] == far).sum())))
            table = table.with_columns(pl.when(pl.col(column) != far).then(pl.col(column)))
    return table, flaws


def _finite(column: pl.Series) -> F64:
    """Numbers of a column, but for damage."""
    values: F64 = column.fill_null(float("nan")).to_numpy()
    return values[np.abs(values) < _NUMBERS]


def _is_direction(value: float, column: pl.Series) -> bool:
    """True if a number is within a turn, as headings of robots that face one way may be, exactly."""
    others = np.abs(_finite(column.filter(column != value)))
    return abs(value) <= (_TURN if others.max(initial=0.0) <= _TURN else _LARGEST_TURN)


def _far_off(table: pl.DataFrame, axes: Sequence[str]) -> float | None:
    """A number of columns that recurs and is far off all others; None if there is none."""
    for axis in axes:
        column = table[axis]
        some = np.unique(_finite(column.gather_every(max(1, len(column) // _LOOK))))
        if len(some) < _LEAST:
            continue
        low, high = np.quantile(some, (0.02, 0.98))  # of different values: one that recurs counts once
        reach = _FAR * (high - low)
        if _at(column.max()) <= high + reach and _at(column.min()) >= low - reach:
            continue
        values = _finite(column)
        for end, beyond in ((values.max(), high), (values.min(), low)):
            if abs(end - beyond) <= reach:
                continue
            rest = values[values != end]
            near = rest.max() if end > high else rest.min()
            if abs(end - near) > reach and len(values) - len(rest) >= _RECURS:
                return float(end)
    return None


def _at(end: object) -> float:
    """An end of a column; beyond all numbers if it has none."""
    return float(end) if isinstance(end, float) else np.inf


def _jumped_to(table: pl.DataFrame) -> tuple[float, bool] | None:
    """A number that is both x and y of bodies that jump there and away again, and whether of the ball, too.

    The ball is put to the pitch's centre, so that of its visits there only many short ones tell.
    """
    x, y = (table[axis].fill_null(float("nan")).to_numpy() for axis in ("x", "y"))
    same = np.flatnonzero(x == y)
    values, counts = np.unique(x[same], return_counts=True)
    often = np.flatnonzero(counts >= _RECURS)
    if not len(often):
        return None
    often = often[np.argsort(-counts[often], kind="stable")][:_MOST]
    side = table["side"].to_numpy()
    who = side * (1 << 16) + table["id"].to_numpy()
    rows = np.flatnonzero(np.isin(who, np.unique(who[same])))
    rows = rows[np.argsort(who[rows], kind="stable")]
    t_ns = table["t_ns"].to_numpy()
    if np.count_nonzero((np.diff(t_ns[rows]) < 0) & (np.diff(who[rows]) == 0)) > _FALLS * len(rows):
        rows = rows[np.lexsort((t_ns[rows], who[rows]))]
    samples = _Samples(side[rows], who[rows], t_ns[rows], np.stack([x[rows], y[rows]], axis=1))
    ball = samples.side == _BALL
    for value in values[often]:
        ends = [(rest.min(), rest.max()) for axis in (x, y)
                if len(rest := axis[(axis != value) & (np.abs(axis) < _NUMBERS)])]
        if len(ends) < 2:
            continue
        if any(max(value - high, low - value) > _JUMP * (high - low) > 0 for low, high in ends):
            return float(value), True
        jump = _JUMP * float(np.hypot(*(high - low for low, high in ends)))
        central = all(abs(value - (low + high) / 2) < _CENTRAL * (high - low) for low, high in ends)
        of_robots = _visited(samples.of(~ball) if central else samples, value, jump)
        of_ball = central and _visited(samples.of(ball), value, jump, short=True)
        if of_robots or of_ball:
            return float(value), of_ball or not central
    return None


class _Samples(NamedTuple):
    """Samples of bodies, body after body: side, a number of the body's own, time in ns, and places [N, 2]."""

    side: I64
    who: I64
    t_ns: I64
    places: F64

    def of(self, rows: Bools) -> _Samples:
        """Some of them."""
        return _Samples(self.side[rows], self.who[rows], self.t_ns[rows], self.places[rows])


def _visited(samples: _Samples, value: float, jump: float, *, short: bool = False) -> bool:
    """True if bodies jump to a place of one number and away, in nearly all visits; if these are short."""
    places, there = samples.places, (samples.places == value).all(axis=1)
    edge = np.diff(there.astype(np.int8), prepend=0, append=0)
    begin, end = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1) - 1
    inside = (begin > 0) & (end < len(there) - 1)
    begin, end = begin[inside], end[inside]
    who = samples.who
    same = (who[begin - 1] == who[begin]) & (who[end + 1] == who[end])
    begin, end = begin[same], end[same]
    if len(begin) < (_OFTEN if short else _RECURS):
        return False
    if short and np.median(samples.t_ns[end] - samples.t_ns[begin]) > _SHORT_NS:
        return False
    into = np.hypot(*(places[begin] - places[begin - 1]).T)
    out = np.hypot(*(places[end] - places[end + 1]).T)
    return bool(np.mean((into >= jump) & (out >= jump)) >= _VISITS)
