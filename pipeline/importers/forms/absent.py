"""Numbers that stand for "not seen": found in a table, and made null."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.importers.forms.angles import is_within_a_turn
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
#: ... and on one axis, where bodies seldom jump to places beside it and from them.
_SOME, _RARELY = 0.5, 0.1
#: Places so near the middle of all others are the pitch's centre, as a share of their reach.
_CENTRAL = 0.05
#: The ball is put there from a goal, but does not leave it by such a jump, as a share of their reach, within
#: so many ns; one that comes from nearer, as a share of half of how far places reach along, was in no goal.
_LEAP, _AT_ONCE_NS, _SHORT_OF_GOAL = 0.25, 150_000_000, 0.8
#: A number so many times the reach of all others beyond the next one is no place of a body that stands still.
_FURTHER = 10.0
#: A kick-off takes as long, ns.
_KICK_OFF_NS = 1_000_000_000
#: Samples of a body that is at one place from which on it was never seen, if x is y there.
_TELLING = 100
#: Rows of each of the three windows in which jumps on one axis are looked for.
_WINDOW = 6_000
#: Share of samples before an earlier one of their body from which on the order of a file is not that of time.
_FALLS = 0.01
#: The ball's side.
_BALL = 2
#: Most numbers of one table that stand for it.
_MOST = 4
#: Larger numbers are none of a table: what is damaged is not looked at.
_NUMBERS = 1e12


def nothing_seen(table: pl.DataFrame) -> tuple[pl.DataFrame, list[Flaw]]:
    """Table with places and headings null where a number stands for "not seen", and a flaw for each number.

    Such a number recurs exactly. It is far off all other places. Or it stands for both x and y, and is beyond
    all other places, or bodies jump to it and from it, or a body is nowhere else. Or bodies jump to it and
    from it on one axis.

    Args:
        table: in the file's units: ``x``, ``y`` Float64, ``side``, ``id``, ``t_ns``, and optionally
            ``heading`` and velocities.
    """
    flaws: list[Flaw] = []
    moving = [column for column in ("heading", "vx", "vy", "omega") if column in table.columns]
    while len(flaws) < _MOST:
        far = _far_off(table, ("x", "y"))
        if far is not None:
            value, at = far, ((table["x"] == far) | (table["y"] == far)).fill_null(False).to_numpy()
        else:
            found = _jumped_to(table) or _jumped_on_an_axis(table)
            if found is None:
                break
            value, at = found
        table = table.with_columns(
            pl.when(pl.Series(at)).then(None).otherwise(pl.col(column)).alias(column)
            for column in ("x", "y", *moving))
        note = f"places of {value + 0.0:g} recur exactly and are no places: taken for not seen"
        flaws.append(Flaw("assumed", note, int(at.sum())))
    for column in moving:
        far = _far_off(table, (column,))
        if far is None or (column == "heading" and is_within_a_turn(
                far, _finite(table[column].filter(table[column] != far)))):
            continue
        note = f"{column} is {far:g} in rows where it is not known: left out"
        flaws.append(Flaw("assumed", note, int((table[column] == far).sum())))
        table = table.with_columns(pl.when(pl.col(column) != far).then(pl.col(column)))
    return table, flaws


def _finite(column: pl.Series) -> F64:
    """Numbers of a column, but for damage."""
    values: F64 = column.fill_null(float("nan")).to_numpy()
    return values[np.abs(values) < _NUMBERS]


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
            if abs(end - near) > reach and len(values) - len(rest) >= _RECURS and (
                    abs(end - near) > _FURTHER * reach or not _stands(table, axis, end)):
                return float(end)
    return None


def _stands(table: pl.DataFrame, axis: str, value: float) -> bool:
    """True if the bodies with a number on an axis always have it there, and another on the other axis."""
    there = table.group_by("side", "id").agg(
        (pl.col(axis) == value).any().alias("any"), (pl.col(axis) == value).all().alias("all"),
        (pl.col("x") == pl.col("y")).all().alias("same"))
    return there.filter(pl.col("any") & (~pl.col("all") | pl.col("same"))).is_empty()


def _at(end: object) -> float:
    """An end of a column; beyond all numbers if it has none."""
    return float(end) if isinstance(end, float) else np.inf


def _jumped_to(table: pl.DataFrame) -> tuple[float, Bools] | None:
    """A number that is both x and y of bodies that jump there and away again, and the rows in which it is.

    The ball is put to the pitch's centre, so that of its visits there only those tell that end with a leap.
    """
    x, y = (table[axis].fill_null(float("nan")).to_numpy() for axis in ("x", "y"))
    same = np.flatnonzero(x == y)
    values, counts = np.unique(x[same], return_counts=True)
    often = np.flatnonzero(counts >= _RECURS)
    if not len(often):
        return None
    often = often[np.argsort(-counts[often], kind="stable")][:_MOST]
    who = _who(table)
    samples = _Samples.of(table, np.flatnonzero(np.isin(who, np.unique(who[same]))))
    ball = table["side"].to_numpy() == _BALL
    ends_of = {}
    for value in values[often].tolist():
        ends = [(rest.min(), rest.max()) for axis in (x, y)
                if len(rest := axis[(axis != value) & (np.abs(axis) < _NUMBERS)])]
        if len(ends) == len("xy"):
            ends_of[value] = ends
            if any(max(value - high, low - value) > _JUMP * (high - low) > 0 for low, high in ends):
                return value, (x == value) & (y == value)
    for value, ends in ends_of.items():
        at = (x == value) & (y == value)
        reach = float(np.hypot(*(high - low for low, high in ends)))
        central = all(abs(value - (low + high) / 2) < _CENTRAL * (high - low) for low, high in ends)
        visits = samples.visits(at)
        of_ball = ball[visits.first] & central
        in_play = np.abs(visits.came_from - value) < _SHORT_OF_GOAL * (ends[0][1] - ends[0][0]) / 2
        leaps = of_ball & (visits.away >= _LEAP * reach) & (visits.leaves_ns <= _AT_ONCE_NS) & in_play
        jumps = (visits.into >= _JUMP * reach) & (visits.away >= _JUMP * reach)
        others = jumps[~of_ball]
        gone = np.zeros(len(at), np.bool_)
        if len(others) >= _RECURS and others.mean() >= _VISITS:
            gone |= at & ~(ball & central)
        if np.count_nonzero(leaps & jumps) >= _RECURS:
            gone[visits.rows(jumps & of_ball & (in_play | (visits.lasts_ns < _KICK_OFF_NS)))] = True
        never = [body for body, rows in samples.bodies() if len(rows) >= _TELLING and at[rows].all()]
        if never and len(never) < table.select("side", "id").n_unique():
            gone |= at & np.isin(who, never)
        if gone.any():
            return value, gone
    return None


def _jumped_on_an_axis(table: pl.DataFrame) -> tuple[float, Bools] | None:
    """A number that bodies jump to and away from on one axis, and the rows in which it is.

    Looked for in three windows of the file; then it counts in all of it.
    """
    who = _who(table)
    starts = sorted({0, max(0, (len(table) - _WINDOW) // 2), max(0, len(table) - _WINDOW)})
    windows = [start + np.argsort(who[start:start + _WINDOW], kind="stable") for start in starts]
    for axis in ("x", "y"):
        values = table[axis].fill_null(np.nan).to_numpy()
        some = np.concatenate([values[rows] for rows in windows])
        some = some[np.abs(some) < _NUMBERS]
        if not len(some) or (reach := float(some.max() - some.min())) <= 0:
            continue
        found = np.concatenate([_jumped(values[rows], who[rows], _JUMP * reach) for rows in windows])
        often, counts = np.unique(found, return_counts=True)
        if len(often) and counts.max() >= _RECURS:
            value = float(often[np.argmax(counts)])
            at = _jumps(table, axis, values, value, some)
            if at is not None:
                return value, at
    return None


def _jumped(values: F64, who: I64, jump: float) -> F64:
    """Numbers that bodies jump to, and then leave by a jump; ``who`` is in order."""
    same = who[1:] == who[:-1]
    step = np.abs(np.diff(values))
    into = np.flatnonzero(same & (step >= jump)) + 1
    ends = np.flatnonzero(~same | (step != 0))
    into = into[into <= ends[-1]] if len(ends) else into[:0]
    away = ends[np.searchsorted(ends, into)]
    left: F64 = values[into[same[away] & (step[away] >= jump)]]
    return left


def _jumps(table: pl.DataFrame, axis: str, values: F64, value: float, some: F64) -> Bools | None:
    """Rows with a number on an axis, if bodies jump to it and away, but not to places beside it; or None."""
    reach = float(some.max() - some.min())
    central = abs(value - (some.max() + some.min()) / 2) < _CENTRAL * reach
    ball = table["side"].to_numpy() == _BALL  # which is put there
    samples = _Samples.of(table, np.flatnonzero(~(ball & central)))
    at = (values == value) & ~(ball & central)
    visits = samples.visits(at, axis)
    near = samples.visits((np.abs(values - value) < _JUMP * reach / 2) & ~at, axis)
    telling, usual = ((each.into >= _JUMP * reach) & (each.away >= _JUMP * reach) for each in (visits, near))
    if np.count_nonzero(telling) < _RECURS or telling.mean() < _SOME:
        return None
    return at if not len(usual) or usual.mean() < _RARELY else None


def _who(table: pl.DataFrame) -> I64:
    """A number of its own for the body of each row."""
    who: I64 = table["side"].to_numpy() * (1 << 16) + table["id"].to_numpy()
    return who


class _Visits(NamedTuple):
    """Stays of bodies where something holds: their samples, and the steps into and out of them.

    Attributes:
        order: int64 [N], row of each sample.
        begin, end: int64 [V], first and last sample of each.
        into, away: float64 [V], lengths of the steps before and after it.
        leaves_ns, lasts_ns: int64 [V], time of the step after it, and from its first sample to its last.
        came_from: float64 [V], x of the sample before it.
    """

    order: I64
    begin: I64
    end: I64
    into: F64
    away: F64
    leaves_ns: I64
    lasts_ns: I64
    came_from: F64

    @property
    def first(self) -> I64:
        """The first row of each."""
        return self.order[self.begin]

    def rows(self, chosen: Bools) -> I64:
        """The rows of some."""
        parts = [self.order[a:b + 1] for a, b in zip(self.begin[chosen], self.end[chosen], strict=True)]
        return np.concatenate([np.empty(0, np.int64), *parts])


class _Samples(NamedTuple):
    """Samples of bodies, body after body, in order of time.

    Attributes:
        rows: int64 [N], row of each.
        who: int64 [N], a number of the body's own.
        t_ns: int64 [N], time.
        places: float64 [N, 2].
    """

    rows: I64
    who: I64
    t_ns: I64
    places: F64

    @classmethod
    def of(cls, table: pl.DataFrame, rows: I64) -> _Samples:
        """Samples of some rows of a table."""
        who, t_ns = _who(table), table["t_ns"].to_numpy()
        rows = rows[np.argsort(who[rows], kind="stable")]
        if np.count_nonzero((np.diff(t_ns[rows]) < 0) & (np.diff(who[rows]) == 0)) > _FALLS * len(rows):
            rows = rows[np.lexsort((t_ns[rows], who[rows]))]
        places = np.stack([table[axis].fill_null(np.nan).to_numpy()[rows] for axis in ("x", "y")], axis=1)
        return cls(rows, who[rows], t_ns[rows], places)

    def bodies(self) -> list[tuple[int, I64]]:
        """Each body's number and rows."""
        who, first = np.unique(self.who, return_index=True)
        return list(zip(who.tolist(), np.split(self.rows, first[1:]), strict=True))

    def visits(self, holds: Bools, axis: str | None = None) -> _Visits:
        """Stays of bodies where something holds, bool [rows of the table]; steps are on one axis or both."""
        there = holds[self.rows]
        edge = np.diff(there.astype(np.int8), prepend=0, append=0)
        begin, end = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1) - 1
        inside = (begin > 0) & (end < len(there) - 1)
        begin, end = begin[inside], end[inside]
        same = (self.who[begin - 1] == self.who[begin]) & (self.who[end + 1] == self.who[end])
        begin, end = begin[same], end[same]
        into, away = self.places[begin] - self.places[begin - 1], self.places[end + 1] - self.places[end]
        if axis is None:
            lengths = np.hypot(*into.T), np.hypot(*away.T)
        else:
            lengths = np.abs(into[:, "xy".index(axis)]), np.abs(away[:, "xy".index(axis)])
        return _Visits(self.rows, begin, end, *lengths, self.t_ns[end + 1] - self.t_ns[end],
                       self.t_ns[end] - self.t_ns[begin], self.places[begin - 1, 0])
