"""Tracking tables in CSV: a header line, fields separated by commas, semicolons or tabs."""

from __future__ import annotations

import io

import polars as pl

from pipeline.errors import BadRecording
from pipeline.importers.source import SourceFile
from pipeline.importers.tracking.columns import REQUIRED, chosen
from pipeline.importers.tracking.mapping import TrackingMap
from pipeline.importers.tracking.match import match_of
from pipeline.matches.frame import MatchLog


def tells(head: bytes) -> bool:
    """Whether the content begins with a header of names and a row of as many fields, one a number."""
    # lossy, as the rows are read: a name in another encoding does not make it another format
    text = head.decode("utf-8-sig", "replace")
    lines = text.splitlines()[:2]
    if not lines or "\0" in text:
        return False
    mark = _separator(lines[0])
    names = _fields(lines[0], mark)
    if len(names) < len(REQUIRED) or any(not name or _is_number(name) for name in names):
        return False
    if len(lines) == 1:
        return True
    fields = _fields(lines[1], mark)
    return len(fields) == len(names) and any(_is_number(field) for field in fields)


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a tracking table in CSV; see :func:`pipeline.importers.tracking.match.match_of`.

    A last line that has no end and too few fields is left out and flagged.

    Raises:
        BadRecording: if the file is not such a table; the message says what it lacks.
    """
    header, _, rows = source.content.partition(b"\n")
    line = header.decode("utf-8-sig", "replace").rstrip("\r")
    mark = _separator(line)
    last = rows[rows.rfind(b"\n") + 1 :]
    cut = None
    if last and last.count(mark.encode()) < line.count(mark):
        rows = rows[: -len(last)]
        cut = "the incomplete last line was left out"
    found = _fields(line, mark)
    theirs = chosen(found, mapping.columns, source.name)
    if not rows.strip():
        raise BadRecording("has a header and no row", where=source.name, next_step="Copy or write it again")
    try:
        # as text: a value that is no number is told apart from one that is not there
        table = pl.read_csv(
            io.BytesIO(source.content[: len(header) + 1 + len(rows)]),
            has_header=False, skip_rows=1, new_columns=found, separator=mark,
            infer_schema=False, encoding="utf8-lossy",
            columns=[found.index(their) for their in theirs.values()],
        )
    except pl.exceptions.PolarsError as error:
        first = str(error).partition("\n")[0][:120]
        raise BadRecording(
            f"cannot be read as CSV ({first})", where=source.name, next_step="Mend or write it again"
        ) from error
    named = table.select(pl.col(their).str.strip_chars().alias(our) for our, their in theirs.items())
    return match_of(named, source, mapping, cut)


def _separator(header: str) -> str:
    """Character that separates the fields of a header line."""
    return max((",", ";", "\t"), key=header.count)


def _fields(line: str, mark: str) -> list[str]:
    return [field.strip(' "') for field in line.split(mark)]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
