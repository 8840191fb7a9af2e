"""Tracking tables in Parquet."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager

import polars as pl
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.forms.offer import offering
from pitchlore.pipeline.importers.forms.plan import plan_of
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.columns import TEXT
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.importers.tracking.match import match_of
from pitchlore.pipeline.matches.frame import MatchLog

_MAGIC = b"PAR1"


def detects(head: bytes) -> bool:
    """True if the content begins with Parquet's magic bytes."""
    return head.startswith(_MAGIC)


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a tracking table in Parquet; see :func:`pipeline.importers.tracking.match.match_of`.

    Raises:
        BadRecording: if the file is not such a table; the message says what it lacks.
    """
    with _sound(source.name):
        # the footer's promises are checked before anything is inflated
        file = pq.ParquetFile(io.BytesIO(source.content))
        meta = file.metadata
        size = sum(meta.row_group(i).total_byte_size for i in range(meta.num_row_groups))
    rows = _rows(meta)
    if rows > source.limits.rows:
        raise source.too_much(f"{rows} rows", "rows")
    if size > source.limits.megabytes << 20:
        raise source.too_much(f"{size >> 20} MiB when it is unpacked", "megabytes")
    with offering(file.schema_arrow.names, mapping):
        plan = plan_of(file.schema_arrow.names, mapping, source.name)
        wanted = plan.names()
        with _sound(source.name):
            arrow = _read(source, wanted)
            # polars takes text for valid UTF-8 and panics if it is not, in values and in metadata
            arrow.validate(full=True)
            table = pl.DataFrame(pl.from_arrow(pa.table(arrow.columns, names=wanted)))
        named, mapped, flaws = plan.applied(table, source)
        for column, dtype in named.schema.items():
            if column not in TEXT and not dtype.is_numeric() and dtype != pl.Null:
                raise BadRecording(f"column {column} is {dtype}, not numbers", where=source.name,
                                   next_step="Write it as numbers")
        return match_of(named, source, mapped, flaws=flaws)


@contextmanager
def _sound(name: str) -> Iterator[None]:
    """Errors of the libraries within the body are refusals of the file."""
    try:
        yield
    except (pa.ArrowException, OSError, ValueError, pl.exceptions.PolarsError) as error:
        first = str(error).partition("\n")[0][:120]
        raise BadRecording(
            f"cannot be read as Parquet ({first})", where=name, next_step="Copy or write it again"
        ) from error


def _rows(meta: pq.FileMetaData) -> int:
    """The most rows that any part of the footer speaks of: what is read is not what its head says."""
    groups = [meta.row_group(i) for i in range(meta.num_row_groups)]
    flat = [j for j in range(meta.num_columns) if not meta.schema.column(j).max_repetition_level]
    values = (sum(group.column(j).num_values for group in groups) for j in flat)
    return int(max(meta.num_rows, sum(group.num_rows for group in groups), *values))


def _read(source: SourceFile, columns: list[str]) -> pa.Table:
    """Columns of a file; texts are decoded only if all of them together are within the limit.

    A page that names one long text many times is small, and so says the footer.
    """
    whole = pq.ParquetFile(io.BytesIO(source.content))
    texts = [name for name in columns if pa.types.is_string(kind := whole.schema_arrow.field(name).type)
             or pa.types.is_large_string(kind) or pa.types.is_binary(kind) or pa.types.is_large_binary(kind)]
    table = pq.ParquetFile(io.BytesIO(source.content), read_dictionary=texts).read(columns=columns)
    size = 0
    for name in texts:
        for chunk in table.column(name).chunks:
            if pa.types.is_dictionary(chunk.type):
                lengths = pc.binary_length(chunk.dictionary)  # a sum skips nulls; fill_null loads pandas
                size += pc.sum(pc.take(lengths, chunk.indices)).as_py() or 0
    if size > source.limits.megabytes << 20:
        raise source.too_much(f"{size >> 20} MiB of text", "megabytes")
    for name in texts:
        column = table.column(name)
        if pa.types.is_dictionary(column.type):
            decoded = column.cast(column.type.value_type)
            table = table.set_column(table.schema.get_field_index(name), name, decoded)
    return table
