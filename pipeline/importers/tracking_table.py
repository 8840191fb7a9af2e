"""The columns of a tracking table, from Parquet or CSV: found, typed, and nothing more."""

from __future__ import annotations

import io
from difflib import get_close_matches

import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.errors import BadRecording
from pipeline.importers.rows import MAX_SCORE
from pipeline.importers.source import separator
from pipeline.importers.tracking_map import Columns, TrackingMap
from pipeline.matches.quality import Flaw

REQUIRED = ("t", "team", "player", "x", "y")
_WHOLE = ("frame", "score_home", "score_away")
_REAL = ("x", "y", "heading", "vx", "vy", "omega")
_TEXT = ("team", "player", "game_state", "segment")

#: Of a Parquet file, before it is read: a season's worth of samples, and what it unpacks to.
_MAX_ROWS = 100_000_000
_MAX_BYTES = 8 << 30
#: A match of more than a day is a wrong unit of time.
_MAX_SPAN_NS = 86_400_000_000_000
#: Words for a value that is not there; not-a-number is one too where a name is expected.
_ABSENT = ("", "null", "None", "NA")
_NOTHING = (*_ABSENT, "nan", "NaN")

_SECOND = 1_000_000_000
_MAP = "Name the columns in a map's [columns] table"


def load(data: bytes, mapping: TrackingMap, name: str) -> tuple[pl.DataFrame, list[Flaw]]:
    """A tracking table's columns under our names, in the file's units, axes and order of rows.

    Args:
        data: Parquet, or CSV with a header.
        mapping: how to read it.
        name: the file's name, for messages.

    Returns:
        The table and what was found wrong. ``frame`` Int64 (the rank of ``t`` where the file has
        none), ``t_ns`` Int64 from the earliest sample, ``team`` and ``player`` String, ``x`` and
        ``y`` Float64, and those of the other columns that are there. Null is a value that is not
        there; NaN one that is not a number. Rows without a frame, time or team are left out.

    Raises:
        BadRecording: if the file cannot be read, lacks a required column, has one twice or of a
            wrong type, or has frames, scores or times that cannot be.
    """
    parquet = data.startswith(b"PAR1")
    flaws = []
    if not parquet and _is_cut(data):
        data = data[: data.rindex(b"\n") + 1]
        flaws.append(Flaw("truncated", "the incomplete last line was left out"))
    raw = _read_parquet(data, mapping.columns, name) if parquet else _read_csv(data, mapping.columns, name)
    columns = [_typed(raw, ours, name, text=not parquet) for ours in raw.columns if ours != "t"]
    columns.append(_times(raw["t"], mapping.units.nanoseconds, name, text=not parquet))
    table = pl.DataFrame(columns)
    if "frame" not in table.columns:
        table = table.with_columns((pl.col("t_ns").rank("dense").cast(pl.Int64) - 1).alias("frame"))
    whole = table.drop_nulls(["frame", "t_ns", "team"])
    if len(whole) < len(table):
        flaws.append(Flaw("skipped", "rows without a frame, time or team", len(table) - len(whole)))
    if whole.is_empty():
        raise BadRecording("has no row with a time and a team", where=name, next_step=_MAP)
    _check(whole, name)
    return whole.with_columns(pl.col("t_ns") - pl.col("t_ns").min()), flaws


def _chosen(found: list[str], columns: Columns, name: str) -> dict[str, str]:
    """Our name to the file's name of the columns to read."""
    wanted = columns.model_dump()
    needed = {ours for ours in wanted if ours in REQUIRED or ours in columns.model_fields_set}
    missing = [wanted[ours] for ours in wanted if ours in needed and wanted[ours] not in found]
    if missing:
        told = ", ".join(column + _meant(column, found) for column in missing)
        raise BadRecording(
            f"has no column {told}; it has {', '.join(found[:20]) or 'none'}", where=name, next_step=_MAP
        )
    chosen = {ours: theirs for ours, theirs in wanted.items() if theirs in found}
    twice = [theirs for theirs in chosen.values() if found.count(theirs) > 1]
    if twice:
        raise BadRecording(f"has the column {twice[0]} twice", where=name, next_step="Rename one of them")
    return chosen


def _meant(column: str, found: list[str]) -> str:
    close = get_close_matches(column, found, 1)
    return f" (did you mean {close[0]}?)" if close else ""


def _read_parquet(data: bytes, columns: Columns, name: str) -> pl.DataFrame:
    try:
        # checked against what the footer promises before anything is unpacked
        file = pq.ParquetFile(io.BytesIO(data))
        meta = file.metadata
        size = sum(meta.row_group(i).total_byte_size for i in range(meta.num_row_groups))
        if meta.num_rows > _MAX_ROWS or size > _MAX_BYTES:
            raise BadRecording(
                f"has {meta.num_rows} rows that unpack to {size >> 20} MiB", where=name,
                next_step="Split it into matches",
            )
        chosen = _chosen(file.schema_arrow.names, columns, name)
        arrow = file.read(columns=list(chosen.values()))
        # polars takes text for valid UTF-8 and panics if it is not: in values, and in metadata too
        arrow.validate(full=True)
        table = pl.from_arrow(pa.table(arrow.columns, names=list(chosen.values())))
    except (pa.ArrowException, OSError, ValueError, pl.exceptions.PolarsError) as error:
        first = str(error).partition("\n")[0][:120]
        raise BadRecording(
            f"cannot be read as Parquet ({first})", where=name, next_step="Copy or write it again"
        ) from error
    assert isinstance(table, pl.DataFrame)
    return table.select(pl.col(theirs).alias(ours) for ours, theirs in chosen.items())


def _read_csv(data: bytes, columns: Columns, name: str) -> pl.DataFrame:
    header = data.partition(b"\n")[0].decode("utf-8-sig", "replace").rstrip("\r")
    mark = separator(header)
    found = [field.strip(' "') for field in header.split(mark)]
    chosen = _chosen(found, columns, name)
    if not data.partition(b"\n")[2].strip():
        raise BadRecording("has a header and no row", where=name, next_step="Copy or write it again")
    try:
        # as text: what cannot be read as a number is told apart from what is not there
        table = pl.read_csv(
            io.BytesIO(data), has_header=False, skip_rows=1, new_columns=found, separator=mark,
            infer_schema=False, encoding="utf8-lossy",
            columns=[found.index(theirs) for theirs in chosen.values()],
        )
    except pl.exceptions.PolarsError as error:
        first = str(error).partition("\n")[0][:120]
        raise BadRecording(
            f"cannot be read as CSV ({first})", where=name, next_step="Mend or write it again"
        ) from error
    return table.select(pl.col(theirs).str.strip_chars().alias(ours) for ours, theirs in chosen.items())


def _is_cut(csv: bytes) -> bool:
    """Whether the last line has no end and fewer fields than the header."""
    header, ended, rest = csv.partition(b"\n")
    last = rest[rest.rfind(b"\n") + 1 :]
    mark = separator(header.decode("utf-8", "replace")).encode()
    return bool(ended) and bool(last) and last.count(mark) < header.count(mark)


def _typed(raw: pl.DataFrame, ours: str, name: str, *, text: bool) -> pl.Series:
    """A column as whole numbers, reals or text."""
    column = raw[ours]
    if ours in _TEXT:
        return _texts(column, name)
    real = _reals(column, name, text=text)
    if ours in _REAL:
        return real
    assert ours in _WHOLE, ours
    return real.set(~real.is_finite().fill_null(False), None).round().cast(pl.Int64, strict=False)


def _texts(column: pl.Series, name: str) -> pl.Series:
    """As text; whole numbers that are stored as reals are written as whole numbers."""
    if column.dtype.is_nested():
        raise BadRecording(
            f"column {column.name} is {column.dtype}, not names", where=name, next_step="Write it as text"
        )
    if column.dtype.is_float():
        known = column.drop_nans().drop_nulls()
        if (known.is_finite() & (known == known.round())).all():
            column = column.fill_nan(None).cast(pl.Int64, strict=False)
    column = column.cast(pl.String)
    return column.set(column.is_in(_NOTHING), None)


def _reals(column: pl.Series, name: str, *, text: bool) -> pl.Series:
    """As Float64; text that is not a number becomes NaN."""
    if column.dtype.is_numeric() or column.dtype == pl.Null:
        return column.cast(pl.Float64)
    if not text:
        raise BadRecording(
            f"column {column.name} is {column.dtype}, not numbers", where=name,
            next_step="Write it as numbers",
        )
    given = column.set(column.is_in(_ABSENT), None)
    numbers = given.cast(pl.Float64, strict=False)
    wrong = given.is_not_null() & numbers.is_null()
    if wrong.any() and wrong.sum() == given.is_not_null().sum():
        raise BadRecording(
            f"column {column.name} has {given.drop_nulls()[0]!r}, not numbers", where=name, next_step=_MAP
        )
    return numbers.set(wrong, float("nan"))


def _times(column: pl.Series, unit: int, name: str, *, text: bool) -> pl.Series:
    """Nanoseconds from the earliest sample, Int64; null where there is no time."""
    integral = column.dtype.is_integer() or (text and unit < _SECOND)
    whole = column.cast(pl.Int64, strict=False) if integral else column
    if not whole.dtype.is_integer() or whole.null_count() > column.null_count():
        real = _reals(column, name, text=text)
        whole = real.set(~real.is_finite().fill_null(False), None)
    # counted from the first before they are multiplied: nanoseconds since 1970 do not fit a float
    since = whole - whole.min()
    if (since > _MAX_SPAN_NS // unit).any():
        raise BadRecording(
            "spans more than a day", where=name, next_step="Give the unit of t in a map's [units] table"
        )
    return (since * unit).round().cast(pl.Int64).alias("t_ns")


def _check(table: pl.DataFrame, name: str) -> None:
    """Raises on numbers that no match can have."""
    if not table["frame"].is_between(0, 2**32 - 1).all():
        raise BadRecording("has frame numbers below 0 or above 4294967295", where=name, next_step=_MAP)
    for score in ("score_home", "score_away"):
        if score in table.columns and not table[score].drop_nulls().is_between(0, MAX_SCORE).all():
            raise BadRecording(f"has a {score} below 0 or above {MAX_SCORE}", where=name, next_step=_MAP)
