"""Times of a table that are no numbers: dates, durations, clocks of a match, and counts of samples."""

from __future__ import annotations

import math
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from typing import Literal

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.tracking.texts import is_number

TimeUnit = Literal["s", "ms", "us", "ns", "days"]

_NS = 1_000_000_000
#: Nanoseconds of each unit of time.
UNITS_NS = {"s": _NS, "ms": 10**6, "us": 1_000, "ns": 1, "min": 60 * _NS, "days": 86_400 * _NS}
#: Where times of a calendar count from, and days of spreadsheets; a match is of one of these years.
_EPOCH, _DAY_0 = datetime(1970, 1, 1, tzinfo=UTC), datetime(1899, 12, 30, tzinfo=UTC)
_YEARS = range(2000, 2100)
#: A clock, as text: days, hours, minutes, seconds; and minutes and seconds of stoppage time after a plus.
_CLOCK = (r"^(?:(?P<d>\d+) days?,? *\+?)?(?:(?P<h>\d+):)?(?P<m>\d+):(?P<s>\d+(?:[.,]\d+)?)"
          r"(?: ?\+ ?(?P<am>\d+):(?P<as>\d+(?:[.,]\d+)?))?$")
#: A duration as ISO 8601 writes it, and a day of the calendar with a time.
_DURATION = r"^P(?:(?P<d>\d+)D)?T?(?:(?P<h>\d+)H)?(?:(?P<m>\d+)M)?(?:(?P<s>\d+(?:[.,]\d+)?)S)?$"
_DATE = r"^\d{4}-?\d\d-?\d\d[T ]\d\d:?\d\d"
#: A date in any order, perhaps by the month's name, a clock, perhaps of twelve hours, and a zone.
_DAY = (r"^(?P<day>\d{1,4}[./-]\d{1,2}[./-]\d{1,4}|[A-Za-z]{3,9}\.? \d{1,2},? \d{4}"
        r"|\d{1,2}\.? [A-Za-z]{3,9}\.? \d{4}),?[T ]+(?P<h>\d{1,2}):(?P<m>\d\d)(?::(?P<s>\d\d(?:[.,]\d+)?))?"
        r" ?(?:(?P<half>[AaPp])\.?[Mm]\.?)? ?(?:Z|UTC|GMT|\[UTC\]|[+-]\d\d:?\d\d)?$")
#: Dates of a match: it may go on after midnight.
_DAYS = 2
#: Seconds of each part of a clock.
_SECONDS = {"d": 86_400, "h": 3_600, "m": 60, "s": 1, "am": 60, "as": 1}
#: Rows that are looked at for the unit of times, and steps from which on these tell.
_LOOK, _STEPS = 10_000, 100
#: Steps of units other than the second: at 1 to 250 samples a second; days are those of spreadsheets.
_STEP_IN: dict[TimeUnit, tuple[float, float]] = {
    "ms": (4.0, 1e3), "us": (4e3, 1e6), "ns": (4e6, 1e9), "days": (1e-9, 1 / 86_400)}
#: A step from which on several frames may have one time, of a clock that shows seconds.
_WHOLE = 0.5
#: Share of a column's values that may be no times.
_STRAY = 0.01


def in_nanoseconds(column: pl.Series, name: str) -> pl.Series | None:
    """Times that are no numbers as Int64 nanoseconds; None if the column has numbers.

    Read are dates and times, durations, times of day; and as text ``0 days 00:01:02.5``, ``01:02.5``,
    ``45:00+1:30``, ``PT62.5S``, ``2026-05-01T15:00:02.5Z``.

    Args:
        column: the column, as the file has it.
        name: the file's name, for messages.

    Raises:
        BadRecording: if values are neither numbers nor such times.
    """
    kind = column.dtype
    if isinstance(kind, pl.Datetime):
        return column.dt.cast_time_unit("ns").to_physical()
    if isinstance(kind, pl.Duration):
        return column.dt.total_nanoseconds()
    if isinstance(kind, pl.Time):
        return column.to_physical()
    known = column.drop_nulls() if kind == pl.String else pl.Series([], dtype=pl.String)
    first = next((text for text in known[:100] if text), "")
    if not first or is_number(first):
        return None
    found = _parsed(known.to_frame("t").select(pl.col("t").str.strip_chars()).to_series(), first)
    if found is None or found.null_count() > _STRAY * len(known):
        wrong = first if found is None else known.filter(found.is_null())[0]
        raise BadRecording(
            f"has the time {wrong!r}, no number, clock or date{_row(column, wrong)}", where=name, next_step=(
            "Name the column of the time in a map's [columns] table, or write it as seconds"))
    there = pl.DataFrame({"at": column.is_not_null().arg_true(), "ns": found})
    return column.to_frame("t").with_row_index("at").join(there, "at", "left", maintain_order="left")["ns"]


def _row(column: pl.Series, wrong: str) -> str:
    """Words for the first row with a value; row 1 is the first under the header."""
    rows = (column == wrong).arg_true()
    return f" (row {rows[0] + 1})" if len(rows) else ""


def first_time(column: pl.Series, unit: str) -> datetime | None:
    """The day and time of the earliest time of a calendar, taken as UTC; None of times that are of none.

    Args:
        column: times as numbers, or as text that has such: since 1970, days as spreadsheets count them.
        unit: their unit: s, ms, us, ns, min or days.
    """
    earliest = column.cast(pl.Int64 if column.dtype.is_integer() else pl.Float64, strict=False).min()
    if not isinstance(earliest, (int, float)) or not math.isfinite(earliest):
        return None
    with suppress(OverflowError):
        since = timedelta(microseconds=int(earliest * UNITS_NS[unit] // 1000))
        start = (_DAY_0 if unit == "days" else _EPOCH) + since
        return start if start.year in _YEARS else None
    return None


def _parsed(texts: pl.Series, first: str) -> pl.Series | None:
    """Nanoseconds of texts, by the form of the first; None if it is of no known form."""
    found = None
    if pl.Series([first]).str.contains(_DATE)[0]:
        zoned = texts.str.replace(" ", "T", literal=True).str.replace(",", ".", literal=True)
        zone = pl.col("t").str.contains(r"(Z|[+-]\d\d:?\d\d)$")
        whole = zoned.to_frame("t").select(pl.when(zone).then("t").otherwise(pl.col("t") + "Z")).to_series()
        found = whole.str.to_datetime("%+", time_unit="ns", strict=False).to_physical()
    if found is None or found.null_count() > _STRAY * len(found):
        found = _on_a_day(texts)
    if found is not None:
        return found
    form = next((form for form in (_CLOCK, _DURATION) if pl.Series([first]).str.contains(form)[0]), None)
    if form is None:
        return None
    parts = texts.str.extract_groups(form).struct.unnest()
    seconds = [pl.col(part).str.replace(",", ".", literal=True).cast(pl.Float64) * _SECONDS[part]
               for part in parts.columns]
    some = pl.any_horizontal(pl.all().is_not_null())
    total = (pl.sum_horizontal(seconds) * _NS).round().cast(pl.Int64)
    return parts.select(pl.when(some).then(total)).to_series()


def _on_a_day(texts: pl.Series) -> pl.Series | None:
    """Nanoseconds since midnight of texts with a date, however written; None if there are many dates."""
    parts = texts.str.extract_groups(_DAY).struct.unnest()
    days = parts["day"].drop_nulls()
    if not len(days) or days.n_unique() > _DAYS:
        return None
    h, m = (pl.col(name).cast(pl.Float64) for name in ("h", "m"))
    s = pl.col("s").str.replace(",", ".", literal=True).cast(pl.Float64).fill_null(0.0)
    late = pl.col("half").str.to_lowercase() == "p"
    hour = pl.when(late.is_not_null()).then(h % 12 + 12 * late.cast(pl.Float64)).otherwise(h)
    since = 86_400 * (pl.col("day") != days[0]).cast(pl.Float64)
    return parts.select(((since + hour * 3_600 + m * 60 + s) * _NS).round().cast(pl.Int64)).to_series()


def unit_by_steps(column: pl.Series, frames: pl.Series | None, name: str) -> tuple[TimeUnit, str]:
    """Unit of times that are numbers, by how far they step, and words for a flaw where it is not seconds.

    Args:
        column: the column, as the file has it.
        frames: column of the frames, if there is one.
        name: the file's name, for messages.

    Raises:
        BadRecording: if most values are no numbers, or if each of several frames has the same whole second.
    """
    some = column.gather_every(max(1, len(column) // 1000)).drop_nulls()
    begin = column[:_LOOK]
    if some.dtype == pl.String:
        some = some.filter(some != "")
        numbers, begin = (texts.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)
                          for texts in (some, begin))
        if numbers.null_count() > len(some) / 2:
            wrong = some.filter(numbers.is_null())[0]
            said = f"has the time {wrong!r}, no number, in most rows{_row(column, wrong)}"
            raise BadRecording(
                said, where=name, next_step="Write times as seconds, without marks between thousands")
    every = begin.cast(pl.Float64).diff()
    steps = every.filter(every > 0)
    if len(steps) < _STEPS:
        return "s", ""
    step = float(np.median(steps.to_numpy()))
    if frames is not None and step >= _WHOLE:
        check_fine(begin, frames[:_LOOK].cast(pl.String), name)
    for unit, (low, high) in _STEP_IN.items():
        if low <= step <= high and (unit != "days" or float(steps.sum()) < 1):
            note = f"a step of the time is {step:.4g}: taken for {unit}"
            return unit, f'{note}; a map settles it, [units] time = "s"'
    return "s", ""


def sampled(column: pl.Series, hz: float) -> pl.Series:
    """Times of numbers that count samples, Int64 nanoseconds; null where a value is no number."""
    numbers = column.cast(pl.Float64, strict=False)
    return (numbers.set(~numbers.is_finite().fill_null(False), None) * (_NS / hz)).round().cast(
        pl.Int64, strict=False)


def check_fine(t_ns: pl.Series, frames: pl.Series, name: str) -> None:
    """Refuse clocks that show one time for several samples.

    Raises:
        BadRecording: if at least every second frame has the time of the frame before.
    """
    steps = pl.DataFrame({"t": t_ns, "frame": frames}).unique(maintain_order=True)["t"].diff().drop_nulls()
    same = int((steps == 0).sum())
    if same >= len(steps) / 2 > 0:
        raise BadRecording(
            f"has a clock that shows one time for several frames, {same} of {len(steps) + 1}", where=name,
            next_step=("Say in a map how many samples a second has: [time] hz = "
                       f"{round(len(steps) / max(1, len(steps) - same))}, if it shows seconds"))
