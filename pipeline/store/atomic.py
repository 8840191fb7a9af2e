"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pitchlore.pipeline.base.digests import Content
from pitchlore.pipeline.base.errors import StorageFailed, unwritable
from pitchlore.pipeline.base.system import sync_file, sync_folder
from pitchlore.pipeline.store.buckets import check_local
from pitchlore.pipeline.store.temporaries import temporary_beside


@contextmanager
def aside(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path``; what is there in the end is moved to ``path``.

    The file is there whole or not at all, even through a crash.

    Raises:
        BadSettings: if the path is a URL.
        StorageFailed: if the disk refuses, or if there is a device or a folder; the old file, if any, is as
            it was.
    """
    check_local(path)
    temporary = temporary_beside(path, "tmp")
    try:
        if not path.name or (path.exists() and not path.is_file()):
            raise StorageFailed("is no regular file, and is not replaced by one", where=str(path),
                                next_step="Name a file")
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield temporary
            sync_file(temporary)
            os.replace(temporary, path)  # noqa: PTH105 (the tests make os.replace fail)
            sync_folder(path.parent)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise unwritable(path, error) from error


def write_bytes(path: Path, data: Content) -> None:
    """Atomically write bytes (see :func:`aside`)."""
    with aside(path) as temporary:
        temporary.write_bytes(data)
