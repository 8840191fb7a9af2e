"""Parquet files that are filled one after the other, as LeRobot numbers them."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

import pyarrow as pa
import pyarrow.parquet as pq

from pitchlore.pipeline.views.lerobot.layout import FILES_OF_CHUNK, MEGABYTES, PLACE


class NumberedFiles:
    """Tables of one schema in files of at most so many bytes, but for the last table of each.

    Args:
        folder: folder of the chunks.
        most: bytes from which on a file takes no further table.

    Attributes:
        place: numbers of the chunk and of the file that takes the next table.
    """

    def __init__(self, folder: Path, most: int = MEGABYTES << 20) -> None:
        self._folder, self._most = folder, most
        self.place = 0, 0
        self._stream: pa.NativeFile | None = None
        self._writer: pq.ParquetWriter | None = None

    def write(self, table: pa.Table) -> None:
        """Add a table as a group of rows of its own."""
        if self._writer is None:
            chunk, file = self.place
            path = self._folder / PLACE.format(chunk_index=chunk, file_index=file)
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = pa.OSFile(str(path), "wb")
            self._writer = pq.ParquetWriter(self._stream, table.schema, compression="snappy")
        self._writer.write_table(table)
        assert self._stream is not None
        if self._stream.tell() >= self._most:
            self.close()
            chunk, file = self.place
            self.place = (chunk, file + 1) if file + 1 < FILES_OF_CHUNK else (chunk + 1, 0)

    def close(self) -> None:
        """End the file that is being filled."""
        if self._writer is not None:
            self._writer.close()
        if self._stream is not None:
            self._stream.close()
        self._writer = self._stream = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
