"""Periods of a table: where its time begins anew, and how they follow each other."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import I64

#: A clock that goes back by less is late or mended, ns.
_BACK_NS = 1_000_000_000
#: One that goes back by so much is a new period, or one that goes back to the first tenth of the period.
_ANEW_NS, _BEGIN = 60_000_000_000, 0.1
#: Least number of samples of each of two periods at times that both have.
_BOTH = 5
#: Samples from which on a clock that went back is told.
_TELLING = 20
#: Most periods of a match: halves, extra time, penalties.
_MOST = 8
#: Share of samples after which another period's follows, from which on the table is sorted by time.
_MIXED = 0.2
#: Share of equal samples from which on a later part is a copy of an earlier one, and no period.
_COPY = 0.5


class Periods(NamedTuple):
    """A table in one time.

    Attributes:
        table: with ``t_ns`` from the first sample, rising over all periods.
        breaks: int64 [P], first time of each period but the first, ns.
        flaws: a note where periods were put one after the other.
    """

    table: pl.DataFrame
    breaks: I64
    flaws: list[Flaw]


def in_one_time(table: pl.DataFrame, name: str) -> Periods:
    """A table whose periods follow each other.

    A period begins where the time falls and then rises again over times that were there before; or where the
    column ``period`` changes. Its times become those after the last sample of the period before. The body
    with the most rows tells where that is; the other rows belong to the period that the columns ``period``
    or ``segment``, or else frame numbers, or else the order of the file say.

    Args:
        table: one row a body and sample, in the order of the file: ``t_ns`` Int64, ``frame``, ``side``,
            ``id``, ``x``, ``y``, and optionally ``period`` and ``segment``.
        name: the file's name, for messages.

    Raises:
        BadRecording: if times begin anew, and nothing tells to which period a row belongs; or too often.
    """
    label = next((column for column in ("period", "segment") if column in table.columns), None)
    rising = bool((table["t_ns"].diff().drop_nulls() >= 0).all())
    if rising and label is None:
        return Periods(table, np.empty(0, np.int64), [])
    bodies = table.group_by("side", "id").len()
    most = bodies.sort("len", "side", "id", descending=[True, False, False]).row(0)
    body = np.flatnonzero(((table["side"] == most[0]) & (table["id"] == most[1])).to_numpy())
    sample = table[body]
    t_ns = sample["t_ns"].to_numpy()
    words = None if label is None else sample[label].cast(pl.String).fill_null("").to_numpy()
    piece = _anew(t_ns, words, sample.select("x", "y").to_numpy(), name)
    if piece is None:
        breaks = _changes(t_ns, words) if label == "period" else np.empty(0, np.int64)
        return Periods(table, breaks, _went_back(t_ns))
    of_rows = _of_rows(table, body, _numbered(piece, words), label, name)
    steps = np.diff(np.unique(t_ns))
    step = int(np.median(steps)) if len(steps) else 1
    times = table["t_ns"].to_numpy().copy()
    begins, end = [], None
    for number in range(int(piece.max()) + 1):
        rows = of_rows == number
        low = times[rows].min()
        if end is not None:
            times[rows] += max(0, end + step - low)
            begins.append(int(times[rows].min()))
        end = int(times[rows].max())
    breaks = np.array(begins, dtype=np.int64) - times.min()
    times -= times.min()
    how = "by time itself" if label is None else f"by {label}"
    note = f"time begins anew: {len(breaks) + 1} periods were put one after the other, {how}"
    return Periods(table.with_columns(t_ns=pl.Series(times)), breaks,
                   [Flaw("assumed", note, len(breaks), int(breaks[0]), int(breaks[0]) + 1)])


def _numbered(piece: I64, words: npt.NDArray[np.object_] | None) -> I64:
    """Periods in the order of their numbers, if each has one number of its own; else in that of the file."""
    if words is None:
        return piece
    named = {(part, word) for part, word in zip(piece.tolist(), words.tolist(), strict=True)}
    numbers = {part: float(word) for part, word in named if re.fullmatch(r"\d+(\.0*)?", word)}
    if not len(named) == len(numbers) == len({*numbers.values()}) == int(piece.max()) + 1:
        return piece
    order = sorted(numbers, key=numbers.__getitem__)
    return np.array([order.index(part) for part in range(len(order))])[piece]


def _went_back(t_ns: I64) -> list[Flaw]:
    """Flaw of a clock that goes back by seconds to no new period; none if the file is sorted otherwise."""
    back = -np.diff(t_ns)
    at = np.flatnonzero(back >= _BACK_NS)
    if len(t_ns) < _TELLING or not 0 < len(at) <= _MOST:
        return []
    note = (f"time goes back by {back[at].max() / 1e9:g} s; samples that are not later than all before are "
            "left out: if a half begins there, write the half of each row in a column period")
    return [Flaw("assumed", note, len(at), int(t_ns[at].min()), int(t_ns[at].max()) + 1)]


def _changes(t_ns: I64, words: npt.NDArray[np.object_] | None) -> I64:
    """Times at which the word for the period changes; none if words come back, as those of stoppages do."""
    assert words is not None
    order = np.argsort(t_ns, kind="stable")
    at = np.flatnonzero(words[order][1:] != words[order][:-1]) + 1
    if not 0 < len(at) < min(_MOST, len(set(words.tolist()))):
        return np.empty(0, np.int64)
    return t_ns[order][at]


def _anew(
    t_ns: I64, words: npt.NDArray[np.object_] | None, places: npt.NDArray[np.float64], name: str
) -> I64 | None:
    """Period of each sample of a body, from 0; None if its time does not begin anew."""
    falls = np.diff(t_ns) < 0
    if len(t_ns) < 2 * _BOTH or falls.mean() > 0.5:  # in falling order
        return None
    if words is not None and np.mean(words[1:] != words[:-1]) > _MIXED:  # sorted by time, two halves at once
        known = sorted(set(words.tolist()), key=lambda word: (len(word), word))
        return None if len(known) > _MOST else np.array([known.index(word) for word in words.tolist()])
    begins = [0]
    drops = np.flatnonzero(falls) + 1
    for at, until in pairwise([*drops.tolist(), len(t_ns)]):
        before, after = t_ns[begins[-1]:at], t_ns[at:until]
        shared = before[before >= t_ns[at]]
        if (before.max() - t_ns[at] < _BACK_NS or len(shared) < _BOTH
                or np.count_nonzero(after <= before.max()) < _BOTH
                or shared.min() - max(t_ns[at], before.min()) > _BACK_NS):
            continue
        renamed = words is not None and words[at] != words[at - 1]
        begin = before.min() + _BEGIN * (before.max() - before.min())
        if (renamed or before.max() - t_ns[at] >= _ANEW_NS or t_ns[at] <= begin) and not _copied(
                (t_ns, places), begins[-1], at, until):
            begins.append(at)
    if len(begins) > _MOST:
        raise BadRecording(
            f"has time that begins anew {len(begins) - 1} times, so that it is no single match", where=name,
            next_step="Write a file for each match or play")
    if len(begins) == 1:
        return None
    piece = np.zeros(len(t_ns), dtype=np.int64)
    piece[begins[1:]] = 1
    return np.cumsum(piece)


def _copied(samples: tuple[I64, npt.NDArray[np.float64]], begin: int, at: int, until: int) -> bool:
    """True if samples from ``at`` on are those from ``begin`` on once more."""
    t_ns, places = samples
    keys = [{*zip(t_ns[low:high].tolist(), *places[low:high].T.tolist(), strict=True)}
            for low, high in ((begin, at), (at, until))]
    moved = len(np.unique(places[at:until][np.isfinite(places[at:until]).all(axis=1)], axis=0)) > 1
    return moved and len(keys[0] & keys[1]) > _COPY * len(keys[1])


def _of_rows(table: pl.DataFrame, body: I64, piece: I64, label: str | None, name: str) -> I64:
    """Period of each row, from those of a body's samples."""
    sample = table[body]
    for column in (label, "frame"):
        if column is None:
            continue
        known = pl.DataFrame({"word": sample[column], "piece": piece}).group_by("word").agg(
            pl.col("piece").unique())
        if (known["piece"].list.len() > 1).any():
            continue
        words = known.with_columns(pl.col("piece").list.first())
        joined = table.select(word=pl.col(column)).join(
            words, "word", "left", maintain_order="left", nulls_equal=True)
        # frames that this body lacks are of the period of the frame before
        found = joined["piece"]
        if column == "frame" and found.null_count():
            order = table["frame"].arg_sort()
            found = found[order].forward_fill().fill_null(0)[order.arg_sort()]
        if not found.null_count():
            return found.to_numpy().astype(np.int64)
    t_ns = table["t_ns"].to_numpy()
    if np.count_nonzero(np.diff(t_ns) < -_BACK_NS) > 2 * int(piece.max()):
        raise BadRecording(
            "has time that begins anew, and nothing tells to which half a row belongs", where=name,
            next_step="Write the half of each row in a column period, or sort the rows by half and time")
    at = np.searchsorted(body, np.arange(len(t_ns)), side="right") - 1
    found_rows = piece[np.maximum(at, 0)]
    for number in range(int(piece.max())):  # rows of the new period before the body's own
        last, first = body[piece == number][-1], body[piece == number + 1][0]
        between = np.arange(last + 1, first)
        found_rows[between] = number + (t_ns[between] < (t_ns[last] + t_ns[first]) / 2)
    return found_rows
