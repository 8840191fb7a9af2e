"""Columns of a tracking table: found, named and typed, and nothing more."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.forms.clocks import UNITS_NS
from pitchlore.pipeline.importers.forms.words import meant
from pitchlore.pipeline.importers.rows import MAX_SCORE
from pitchlore.pipeline.importers.tracking.mapping import Columns, TrackingMap
from pitchlore.pipeline.matches.quality import Flaw

REQUIRED = ("t", "team", "player", "x", "y")
_WHOLE = ("frame", "score_home", "score_away")
#: Greatest distance of a whole number that a program wrote as a real from one.
_OFF = 1e-6
TEXT = ("team", "player", "game_state", "period", "segment")

#: Longest match, one day; a longer one is a wrong unit of time.
_MAX_SPAN_NS = 86_400_000_000_000
#: Words for an absent value, and for an absent name.
_ABSENT = ("", "null", "None", "NA")
_NOTHING = (*_ABSENT, "nan", "NaN")

#: A number with a decimal comma, in two parts.
_DECIMAL_COMMA = r"^([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)$"
#: Columns of a file that are named where one is missing.
_SHOWN = 20
_MAP = "Name the columns in a map's [columns] table"


def typed(raw: pl.DataFrame, mapping: TrackingMap, name: str) -> tuple[pl.DataFrame, list[Flaw]]:
    """A tracking table's columns with our types, in the file's units, axes and order of rows.

    Args:
        raw: one row per body and sample; columns under our names (:func:`columns_to_read`). Columns that are
            not ``TEXT`` are numbers, or text that is yet to be parsed.
        mapping: for the unit of time.
        name: the file's name, for messages.

    Returns:
        The table and what was found wrong. ``frame`` Int64 (the rank of ``t`` where the file has
        none), ``t_ns`` Int64 from the earliest sample, ``team`` and ``player`` String, ``x`` and
        ``y`` Float64, and the other columns that the file has. Null is an absent value, NaN a value that
        is not a number. Rows without a frame, time or team are left out.

    Raises:
        BadRecording: if a column has a wrong type, or frames, scores or times cannot be a match's.
    """
    flaws = []
    columns = [_typed(column, name) for column in raw if column.name != "t"]
    columns.append(_times(raw["t"], UNITS_NS[mapping.units.time], name))
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


def columns_to_read(
    found: list[str], columns: Columns, name: str, required: Collection[str] = REQUIRED
) -> dict[str, str]:
    """Columns to read: our name to the file's name.

    Args:
        found: the names of the file's columns.
        columns: the map's names.
        name: the file's name, for messages.
        required: our names of the columns that have to be there.

    Raises:
        BadRecording: if the file lacks a required column or one that the map names, or has one twice.
    """
    wanted = {ours: column_name(theirs, found) for ours, theirs in columns.model_dump().items()}
    needed = {ours for ours in wanted if ours in required or ours in columns.model_fields_set}
    missing = [ours for ours in wanted if ours in needed and wanted[ours] not in found]
    if missing:
        numbered = {ours for ours, theirs in columns if isinstance(theirs, int)}
        lost = ", ".join(
            wanted[ours] + ("" if ours in numbered else _meant(ours, wanted, found)) for ours in missing)
        raise BadRecording(f"has no column {lost}; it has {first_columns(found)}", where=name, next_step=_MAP)
    read = {ours: theirs for ours, theirs in wanted.items() if theirs in found}
    twice = [theirs for theirs in read.values() if found.count(theirs) > 1]
    if twice:
        raise BadRecording(f"has the column {twice[0]} twice", where=name, next_step="Rename one of them")
    return read


def unmatched(table: pl.DataFrame, mapping: TrackingMap) -> list[Flaw]:
    """Flaw that names the words of a map that match nothing in a table; none if all do.

    A state of the game may be missing in a whole match; a misspelt one is, too.
    """
    words = []
    states = {*table["game_state"].unique()} if "game_state" in table.columns else set[str]()
    parts = {part.strip() for state in states if state is not None for part in (state, *state.split("+"))}
    if left := [word for word in mapping.states if word not in parts]:
        words.append(f"[states] {', '.join(left)}")
    teams = {*table["team"].unique()}
    if "ball" in mapping.teams.model_fields_set and mapping.teams.ball not in teams:
        there = ", ".join(sorted(team for team in teams if team is not None)[:_SHOWN])
        words.append(f"[teams] ball = {mapping.teams.ball} (teams are {there})")
    if unknown := [name for name in mapping.teams.names if name not in teams]:
        words.append(f"[teams.names] {', '.join(unknown)}")
    if not words:
        return []
    return [Flaw("unmatched map", f"words of the map that are nowhere in the table: {'; '.join(words)}")]


def first_columns(found: Sequence[str]) -> str:
    """The first columns of a file, for messages."""
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return f"{', '.join(found[:_SHOWN]) or 'none'}{more}"


def column_name(theirs: str | int, found: Sequence[str]) -> str:
    """The file's name of a column that a map names or numbers, the first is 1."""
    if isinstance(theirs, str):
        return theirs
    return found[theirs - 1] if theirs <= len(found) else f"number {theirs}"


def _meant(ours: str, wanted: Mapping[str, str], found: list[str]) -> str:
    near = meant(ours, wanted[ours], found, {name for name in wanted.values() if name in found})
    return f" (did you mean {near}?)" if near else ""


def _typed(column: pl.Series, name: str) -> pl.Series:
    """Column as whole numbers, reals or text, by its name."""
    if column.name in TEXT:
        return _texts(column, name)
    real = _reals(column, name)
    if column.name not in _WHOLE:
        return real
    known = real.set(~real.is_finite().fill_null(False), None)
    broken = known.filter((known - known.round()).abs() > _OFF)
    if not broken.is_empty():
        raise BadRecording(
            f"column {column.name} has {broken[0]:g}, not whole numbers", where=name, next_step=_MAP)
    return known.round().cast(pl.Int64, strict=False)


def _texts(column: pl.Series, name: str) -> pl.Series:
    """Column as text; whole numbers that are stored as reals are written without a fraction."""
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


def _reals(column: pl.Series, name: str) -> pl.Series:
    """Column as Float64; text that is not a number becomes NaN."""
    if column.dtype != pl.String:
        return column.cast(pl.Float64)
    numbers = column.cast(pl.Float64, strict=False)
    if numbers.null_count() == column.null_count():
        return numbers
    given = column.set(column.is_in(_ABSENT), None)
    numbers = given.str.replace(_DECIMAL_COMMA, "$1.$2").cast(pl.Float64, strict=False)
    wrong = given.is_not_null() & numbers.is_null()
    if wrong.any() and wrong.sum() == given.is_not_null().sum():
        raise BadRecording(
            f"column {column.name} has {given.drop_nulls()[0]!r}, not numbers", where=name, next_step=_MAP
        )
    return numbers.set(wrong, float("nan"))


def _times(column: pl.Series, unit: int, name: str) -> pl.Series:
    """Nanoseconds from the earliest sample, Int64; null where the time is absent."""
    integral = column.dtype.is_integer() or (column.dtype == pl.String and unit < UNITS_NS["s"])
    whole = column.cast(pl.Int64, strict=False) if integral else column
    if not whole.dtype.is_integer() or whole.null_count() > column.null_count():
        real = _reals(column, name)
        whole = real.set(~real.is_finite().fill_null(False), None)
    # the first time is subtracted before the multiplication: nanoseconds since 1970 do not fit a float
    since = whole - whole.min()
    if (since > _MAX_SPAN_NS // unit).any() or (since < 0).any():  # an int64 that overflows is negative
        raise BadRecording(
            "spans more than a day", where=name, next_step="Give the unit of t in a map's [units] table"
        )
    return (since * unit).round().cast(pl.Int64).alias("t_ns")


def _check(table: pl.DataFrame, name: str) -> None:
    """Raise on frame numbers and scores that no match can have."""
    if not table["frame"].is_between(0, 2**32 - 1).all():
        raise BadRecording("has frame numbers below 0 or above 4294967295", where=name, next_step=_MAP)
    for score in ("score_home", "score_away"):
        if score in table.columns and not table[score].drop_nulls().is_between(0, MAX_SCORE).all():
            raise BadRecording(f"has a {score} below 0 or above {MAX_SCORE}", where=name, next_step=_MAP)
