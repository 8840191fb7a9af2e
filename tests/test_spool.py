"""Bytes that are too many for memory."""

import gc
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pitchlore.pipeline.base.errors import StorageFailed
from pitchlore.pipeline.base.spool import Spool


@given(st.lists(st.binary(max_size=10_000)))
def test_there_and_back(parts):
    """Bytes written in parts are read whole, also when the spool is closed."""
    with Spool() as spool:
        for part in parts:
            spool.write(part)
        found = spool.mapped()
    assert bytes(found) == b"".join(parts)
    assert len(found) == sum(map(len, parts))


def test_its_file(tmp_path, monkeypatch):
    """Its file has no name, and is gone when nobody has its bytes any more."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))

    def held() -> int:
        return sum(str(tmp_path) in str(entry.readlink()) for entry in Path("/proc/self/fd").iterdir()
                   if entry.is_symlink())  # that of the listing is gone

    with Spool() as spool:
        spool.write(b"x" * 5_000)
        assert (list(tmp_path.iterdir()), held()) == ([], 1)
        found = spool.mapped()
    assert held() == 1  # the map's
    del found
    gc.collect()
    assert held() == 0


def test_no_folder(tmp_path, monkeypatch):
    """A temporary folder that is not there, or is full, is named."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    with pytest.raises(StorageFailed, match="none: cannot be written"):
        Spool()
