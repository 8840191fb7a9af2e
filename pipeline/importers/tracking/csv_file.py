"""Tracking tables in text: fields separated by commas, semicolons, tabs or bars, with a header or without."""

from __future__ import annotations

import io

import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.forms.offer import offering
from pitchlore.pipeline.importers.forms.plan import plan_of
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.columns import REQUIRED
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.importers.tracking.match import match_of
from pitchlore.pipeline.importers.tracking.texts import (
    as_utf8,
    fields_of_line,
    headless,
    is_number,
    separator,
)
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.quality import Flaw

#: Numbers in a row from which on a text without a header is a table.
_NUMBERS = 3
#: How JSON and XML begin, and no table.
_MARKUP = (b"{", b"[", b"<")


def detects(head: bytes) -> bool:
    """True if the content begins with a header of names and a row of as many fields, one a number.

    Or with two rows that are alike, each with at least three numbers: a table without a header. A row of more
    fields, by commas, may have decimal commas; reading it says so.
    """
    # lossy, as the rows are read: a name in another encoding does not make it another format
    text = as_utf8(head).utf8.decode("utf-8", "replace")
    lines = text.splitlines()[:2]
    if not lines or "\0" in text or is_markup(head):
        return False
    mark = separator(lines[0])
    names = fields_of_line(lines[0], mark)
    if len(names) < len(REQUIRED):
        return False
    rows = [fields_of_line(line, mark) for line in lines[1:]]
    if headless(names):
        return any(_alike(names, row) for row in rows)
    return all(names[1:-1]) and all(  # pandas gives its index no name, others end each line with a comma
        (len(row) == len(names) or (mark == "," and len(row) > len(names))) and any(map(is_number, row))
        for row in rows)


def is_markup(head: bytes) -> bool:
    """True if the content begins as JSON or XML does."""
    return as_utf8(head).utf8.lstrip()[:1] in _MARKUP


def _alike(one: list[str], two: list[str]) -> bool:
    """True if two rows are of one table: as long, with numbers in the same places, where neither is empty."""
    numbers = min(sum(map(is_number, row)) for row in (one, two))
    return numbers >= _NUMBERS and len(one) == len(two) and all(
        is_number(a) == is_number(b) for a, b in zip(one, two, strict=True) if a and b)


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a tracking table in text; see :func:`pipeline.importers.tracking.match.match_of`.

    A last line that has no end and too few fields is left out and flagged. An encoding that the file does not
    say itself is flagged, too.

    Raises:
        BadRecording: if the file is not such a table; the message says what it lacks.
    """
    content, note = as_utf8(source.content)
    header, _, rows = content.partition(b"\n")
    line = header.decode("utf-8", "replace").rstrip("\r")
    mark = separator(line)
    found = fields_of_line(line, mark)
    bare = headless(found)
    if bare:
        rows, found = content, _numbered(found, line, mapping, source.name)
    last = rows[rows.rfind(b"\n") + 1 :]
    cut = None
    if last and len(fields_of_line(last.decode("utf-8", "replace"), mark)) < len(found):
        rows = rows[: -len(last)]
        cut = "the incomplete last line was left out"
    with offering(found, mapping):
        plan = plan_of(found, mapping, source.name)
        if not rows.strip():
            raise BadRecording("has a header and no row", where=source.name, next_step="Write it again")
        text = rows if bare else content[: len(header) + 1 + len(rows)]
        table = _fields(text, found, plan.names(), source.name, mark=mark, skip=0 if bare else 1)
        named, mapped, more = plan.applied(table, source)
        flaws = [Flaw("text encoding", note)] if note is not None else []
        return match_of(named, source, mapped, cut, [*flaws, *more])


def _fields(
    text: bytes, found: list[str], wanted: list[str], name: str, *, mark: str, skip: int
) -> pl.DataFrame:
    """Columns of a text as text, for a value that is no number is another thing than one that is not there.

    Raises:
        BadRecording: if it is no such text.
    """
    try:
        table = pl.read_csv(
            io.BytesIO(text), has_header=False, skip_rows=skip, separator=mark, infer_schema=False,
            new_columns=[str(at) for at in range(len(found))],  # a name may stand twice
            encoding="utf8-lossy", columns=sorted({found.index(their) for their in wanted}),
        ).select(pl.col(str(found.index(their))).alias(their) for their in wanted)
    except pl.exceptions.PolarsError as error:
        first = str(error).partition("\n")[0][:120]
        mend = "Mend or write it again"
        if mark == ",":
            mend += "; numbers with decimal commas need semicolons between them"
        raise BadRecording(f"cannot be read as CSV ({first})", where=name, next_step=mend) from error
    return table.with_columns(pl.all().str.strip_chars())


def _numbered(first: list[str], line: str, mapping: TrackingMap, name: str) -> list[str]:
    """Names for the columns of a table without a header: their numbers.

    Raises:
        BadRecording: if no map numbers them.
    """
    if not mapping.numbers_columns():
        raise BadRecording(
            f"has no header; its first line is {line[:60]!r}", where=name, next_step=(
                "Number its columns from 1 in a map: [columns] t = 1, team = 2, player = 3, x = 4, y = 5, or "
                '[bodies] ball = {x = 2, y = 3}, "blue 0" = {x = 4, y = 5}'
            ))
    return [f"number {number}" for number in range(1, len(first) + 1)]
