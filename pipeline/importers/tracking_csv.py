"""Tracking tables in CSV: a header line, fields separated by commas, semicolons or tabs."""

from __future__ import annotations

import io

import polars as pl

from pipeline.errors import BadRecording
from pipeline.importers.source import SourceFile
from pipeline.importers.tracking import match_of
from pipeline.importers.tracking_map import Columns, TrackingMap
from pipeline.importers.tracking_table import REQUIRED, chosen
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
    """Match of a tracking table in CSV; see :func:`pipeline.importers.tracking.match_of`.

    A last line that has no end and too few fields is left out and flagged.

    Raises:
        BadRecording: if the file is not such a table; the message says what it lacks.
    """
    data, cut = source.content, None
    if _is_cut(data):
        data = data[: data.rindex(b"\n") + 1]
        cut = "the incomplete last line was left out"
    return match_of(_columns(data, mapping.columns, source.name), source, mapping, cut)


def _columns(data: bytes, columns: Columns, name: str) -> pl.DataFrame:
    header = data.partition(b"\n")[0].decode("utf-8-sig", "replace").rstrip("\r")
    mark = _separator(header)
    found = _fields(header, mark)
    theirs = chosen(found, columns, name)
    if not data.partition(b"\n")[2].strip():
        raise BadRecording("has a header and no row", where=name, next_step="Copy or write it again")
    try:
        # as text: a value that is no number is told apart from one that is not there
        table = pl.read_csv(
            io.BytesIO(data), has_header=False, skip_rows=1, new_columns=found, separator=mark,
            infer_schema=False, encoding="utf8-lossy",
            columns=[found.index(their) for their in theirs.values()],
        )
    except pl.exceptions.PolarsError as error:
        first = str(error).partition("\n")[0][:120]
        raise BadRecording(
            f"cannot be read as CSV ({first})", where=name, next_step="Mend or write it again"
        ) from error
    return table.select(pl.col(their).str.strip_chars().alias(our) for our, their in theirs.items())


def _separator(header: str) -> str:
    """Character that separates the fields of a header line."""
    return max((",", ";", "\t"), key=header.count)


def _fields(line: str, mark: str) -> list[str]:
    return [field.strip(' "') for field in line.split(mark)]


def _is_cut(csv: bytes) -> bool:
    """Whether the last line has no end and fewer fields than the header."""
    header, ended, rest = csv.partition(b"\n")
    last = rest[rest.rfind(b"\n") + 1 :]
    mark = _separator(header.decode("utf-8", "replace")).encode()
    return bool(ended) and bool(last) and last.count(mark) < header.count(mark)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
