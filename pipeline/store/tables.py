"""Tables as bytes: Parquet with its schema's name and version. No function here touches the disk."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

import polars as pl
import pyarrow.parquet

from pitchlore.pipeline.base.errors import CorruptFile, SchemaMismatch
from pitchlore.schemas import Table

SCHEMA_KEY = "pitchlore.schema"


def to_parquet(frame: pl.DataFrame, schema: type[Table], *, where: str) -> bytes:
    """The table as Parquet bytes, tagged with its schema, after checking it.

    Floats are stored as split byte streams (their exponents compress, their last bits do not) and
    times as differences: three quarters of what plain zstd pages take.

    Raises:
        SchemaMismatch: if a column is missing, superfluous, of another type, or out of bounds.
    """
    check(frame, schema, where=where)
    # in one piece: Parquet's pages and statistics follow the pieces that a table came in
    table = frame.rechunk().to_arrow().replace_schema_metadata({SCHEMA_KEY: schema.tag()})
    buffer = io.BytesIO()
    pyarrow.parquet.write_table(table, buffer, **written_as(frame.schema))
    return buffer.getvalue()


def written_as(columns: pl.Schema) -> dict[str, Any]:
    """How columns are stored, as arguments of pyarrow's writer (see :func:`to_parquet`)."""
    floats = [name for name, dtype in columns.items() if dtype.is_float()]
    times = [name for name, dtype in columns.items() if dtype in (pl.Int64, pl.UInt32)]
    return {
        "compression": "zstd", "compression_level": 1,
        "use_dictionary": [name for name in columns if name not in (*floats, *times)],
        "use_byte_stream_split": floats, "column_encoding": dict.fromkeys(times, "DELTA_BINARY_PACKED"),
    }


def check(frame: pl.DataFrame, schema: type[Table], *, where: str) -> None:
    """Check a table against its schema.

    Raises:
        SchemaMismatch: naming the first columns or rules that do not hold.
    """
    _check_columns(frame, schema, where)
    if not schema.holds(frame):
        _, failure = schema.filter(frame)
        broken = ", ".join(f"{rule} ({count} rows)" for rule, count in sorted(failure.counts().items())[:4])
        raise SchemaMismatch(
            f"breaks the rules of table {schema.tag()}: {broken}",
            where=where, next_step="Look for NaN, infinite or impossible values in the source",
        )


def _check_columns(frame: pl.DataFrame, schema: type[Table], where: str) -> None:
    wanted = schema.dtypes()
    if list(frame.schema.items()) != list(wanted.items()):
        missing = [c for c in wanted if c not in frame.columns]
        extra = [c for c in frame.columns if c not in wanted]
        retyped = [f"{c} is {frame.schema[c]}, not {t}" for c, t in wanted.items()
                   if c in frame.columns and frame.schema[c] != t]
        problems = [f"missing {c}" for c in missing] + [f"unknown {c}" for c in extra] + retyped
        raise SchemaMismatch(
            f"does not fit table {schema.tag()}: " + ("; ".join(problems[:4]) or "columns are out of order"),
            where=where, next_step="Make it again with this version of pitchlore",
        )


def joined(data: Sequence[bytes], schema: type[Table], *, where: Sequence[str]) -> pl.DataFrame:
    """The tables in Parquet bytes one after the other, each as for :func:`from_parquet`."""
    if not data:
        return schema.empty()
    with suppress(pl.exceptions.PolarsError):
        tags = {pl.read_parquet_metadata(io.BytesIO(each)).get(SCHEMA_KEY) for each in data}
        if tags == {schema.tag()}:
            frame = pl.read_parquet(list(data))
            _check_columns(frame, schema, where[0])
            return frame
    # one of them is of an earlier version, or damaged
    return pl.concat(from_parquet(each, schema, where=at) for each, at in zip(data, where, strict=True))


def scan(paths: Sequence[str], schema: type[Table]) -> pl.LazyFrame:
    """Tables in Parquet files one after the other, as a lazy frame of the present version of the schema.

    Columns that are newer than a file are null, or as ``FORMER`` says; its enumerations get the words that
    are newer than it.
    """
    if not paths:
        return schema.empty().lazy()
    by_tag: dict[str | None, list[str]] = {}
    for path in paths:
        by_tag.setdefault(pl.read_parquet_metadata(path).get(SCHEMA_KEY), []).append(path)
    present = by_tag.pop(schema.tag(), [])
    parts = [pl.scan_parquet(present, glob=False)] if present else []
    for earlier in by_tag.values():
        part = pl.scan_parquet(earlier, glob=False)
        there = part.collect_schema()
        parts.append(part.select(
            pl.col(name).cast(dtype) if name in there else _former(schema, name)
            for name, dtype in schema.dtypes().items()))
    return pl.concat(parts)


def in_pieces(data: bytes, schema: type[Table], *, where: str) -> Iterator[pl.DataFrame]:
    """The table in Parquet bytes, a row group at a time; errors as for :func:`from_parquet`."""
    with suppress(pyarrow.ArrowException):
        groups = pyarrow.parquet.ParquetFile(io.BytesIO(data)).metadata
        if (groups.metadata or {}).get(SCHEMA_KEY.encode()) == schema.tag().encode():
            first, scanned = 0, pl.scan_parquet(io.BytesIO(data))
            for place in range(groups.num_row_groups):
                rows = groups.row_group(place).num_rows
                frame = scanned.slice(first, rows).collect()
                _check_columns(frame, schema, where)
                yield frame
                first += rows
            return
    # it is of an earlier version, or damaged
    yield from_parquet(data, schema, where=where)


def _former(schema: type[Table], name: str) -> pl.Expr:
    """A column that a file of an earlier version lacks."""
    return pl.lit(schema.FORMER.get(name), dtype=schema.dtypes()[name]).alias(name)


def _widened(frame: pl.DataFrame, schema: type[Table]) -> Iterator[tuple[str, pl.DataType]]:
    """Enumerations of an earlier version of a table that have more words now, or any: column and type."""
    for name, before in frame.schema.items():
        now = schema.dtypes()[name]
        if not isinstance(before, pl.Enum) or before == now:
            continue
        if now == pl.String or (isinstance(now, pl.Enum) and set(before.categories) <= set(now.categories)):
            yield name, now


def from_parquet(data: bytes, schema: type[Table], *, where: str) -> pl.DataFrame:
    """The table in Parquet bytes that :func:`to_parquet` made, as the present version of the schema has it.

    Columns that are newer than the file are null, or as ``FORMER`` says; its enumerations get the words that
    are newer than it.

    Raises:
        SchemaMismatch: if it is tagged as another table or version, or has other columns.
        CorruptFile: if it is not Parquet at all.
    """
    try:
        tag = pl.read_parquet_metadata(io.BytesIO(data)).get(SCHEMA_KEY)
        frame = pl.read_parquet(io.BytesIO(data)) if tag in schema.readable() else None
    except pl.exceptions.PolarsError as error:
        raise CorruptFile(f"is not Parquet ({str(error)[:80]})", where=where,
                          next_step="Delete it and run again") from error
    if frame is None:
        raise SchemaMismatch(
            f"holds table {tag or 'of unknown origin'}, not {schema.tag()}", where=where,
            next_step="Make it again with this version of pitchlore",
        )
    if tag != schema.tag():
        added = [name for name, column in schema.columns().items()
                 if column.nullable and name not in frame.columns]
        frame = frame.with_columns(_former(schema, name) for name in added)
        frame = frame.select([name for name in schema.dtypes() if name in frame.columns])
        frame = frame.with_columns(pl.col(name).cast(wider) for name, wider in _widened(frame, schema))
    _check_columns(frame, schema, where)
    return frame
