"""Tables of one match in several files, as home and away: put together before they are read."""

from __future__ import annotations

import io
from collections.abc import Sequence

import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.forms.words import WORDS, bare
from pitchlore.pipeline.importers.source import slug
from pitchlore.pipeline.importers.tracking.texts import as_utf8, separator
from pitchlore.pipeline.importers.tracking.wide import OF_A_SAMPLE, named_bodies


def one_table(parts: Sequence[tuple[str, bytes]]) -> bytes:
    """The table of several files, as text: rows below each other, or columns of bodies beside each other.

    A file with a row a body and without a column for the team is of the team that the file is called.

    Args:
        parts: name and content of each file, unpacked.

    Raises:
        BadRecording: if they are no tables, or share no column of the time.
    """
    tables = [_table(*part) for part in parts]
    first, *others = tables
    if any(len(named_bodies(table.columns, "ball")) > 1 for table in tables):
        for (name, _), other in zip(parts[1:], others, strict=True):
            key = [column for column in first.columns if column in other.columns
                   and WORDS.get(bare(column)) in OF_A_SAMPLE]
            if not key:
                raise BadRecording(f"shares no column of the time or frame with {parts[0][0]}", where=name,
                                   next_step="Name these columns alike in all files")
            new = [column for column in other.columns if column not in first.columns]
            theirs = other.select(*key, *new).unique(key, maintain_order=True)
            first = first.join(theirs, key, "full", coalesce=True, maintain_order="left_right")
    else:
        named = [table if any(WORDS.get(bare(column)) == "team" for column in table.columns)
                 else table.with_columns(team=pl.lit(slug(name)))
                 for (name, _), table in zip(parts, tables, strict=True)]
        whole = pl.concat(named, how="diagonal")
        given = all(one.equals(table) for one, table in zip(named, tables, strict=True))
        alike = [column for column in whole.columns if given or column != "team"]
        first = whole.unique(alike, maintain_order=True, keep="first")  # all may have the ball
    return first.write_csv().encode()


def _table(name: str, content: bytes) -> pl.DataFrame:
    """A table as text."""
    try:
        text = as_utf8(content).utf8
        mark = separator(text.partition(b"\n")[0].decode("utf-8", "replace"))
        return pl.read_csv(io.BytesIO(text), separator=mark, infer_schema=False, encoding="utf8-lossy")
    except pl.exceptions.PolarsError as error:
        first = str(error).partition("\n")[0][:120]
        raise BadRecording(f"cannot be read as a table ({first})", where=name,
                           next_step="Give tables of positions in CSV") from error
