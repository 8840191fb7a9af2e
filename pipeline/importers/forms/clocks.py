"""Times of a table that are no numbers: dates, durations, clocks of a match, and counts of samples."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.tracking.texts import is_number

_NS = 1_000_000_000
#: A clock, as text: days, hours, minutes, seconds; and minutes and seconds of stoppage time after a plus.
_CLOCK = (r"^(?:(?P<d>\d+) days?,? *\+?)?(?:(?P<h>\d+):)?(?P<m>\d+):(?P<s>\d+(?:[.,]\d+)?)"
          r"(?: ?\+ ?(?P<am>\d+):(?P<as>\d+(?:[.,]\d+)?))?$")
#: A duration as ISO 8601 writes it, and a day of the calendar with a time.
_DURATION = r"^P(?:(?P<d>\d+)D)?T?(?:(?P<h>\d+)H)?(?:(?P<m>\d+)M)?(?:(?P<s>\d+(?:[.,]\d+)?)S)?$"
_DATE = r"^\d{4}-?\d\d-?\d\d[T ]\d\d:?\d\d"
#: Seconds of each part of a clock.
_SECONDS = {"d": 86_400, "h": 3_600, "m": 60, "s": 1, "am": 60, "as": 1}
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
        raise BadRecording(f"has the time {wrong!r}, no number, clock or date", where=name, next_step=(
            "Name the column of the time in a map's [columns] table, or write it as seconds"))
    there = pl.DataFrame({"at": column.is_not_null().arg_true(), "ns": found})
    return column.to_frame("t").with_row_index("at").join(there, "at", "left", maintain_order="left")["ns"]


def _parsed(texts: pl.Series, first: str) -> pl.Series | None:
    """Nanoseconds of texts, by the form of the first; None if it is of no known form."""
    if pl.Series([first]).str.contains(_DATE)[0]:
        zoned = texts.str.replace(" ", "T", literal=True).str.replace(",", ".", literal=True)
        zone = pl.col("t").str.contains(r"(Z|[+-]\d\d:?\d\d)$")
        whole = zoned.to_frame("t").select(pl.when(zone).then("t").otherwise(pl.col("t") + "Z")).to_series()
        return whole.str.to_datetime("%+", time_unit="ns", strict=False).to_physical()
    form = next((form for form in (_CLOCK, _DURATION) if pl.Series([first]).str.contains(form)[0]), None)
    if form is None:
        return None
    parts = texts.str.extract_groups(form).struct.unnest()
    seconds = [pl.col(part).str.replace(",", ".", literal=True).cast(pl.Float64) * _SECONDS[part]
               for part in parts.columns]
    some = pl.any_horizontal(pl.all().is_not_null())
    total = (pl.sum_horizontal(seconds) * _NS).round().cast(pl.Int64)
    return parts.select(pl.when(some).then(total)).to_series()


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
