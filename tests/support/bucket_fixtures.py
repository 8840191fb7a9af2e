"""Stores in a bucket, each with the copy of a machine of its own."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import clip
from support.bucket_stores import brought
from support.buckets import Served, files, served
from support.sessions import once

from pitchlore.pipeline.store import Store, buckets, mirrors


@pytest.fixture(scope="module")
def server() -> Iterator[Served]:
    with served() as own:
        yield own


@pytest.fixture
def machine(server, tmp_path, monkeypatch):
    """A function that gives the store of a URL as another machine has it, with a copy of its own."""
    server.mend()
    for name, value in server.environment.items():
        monkeypatch.setenv(name, value)

    def store(url: str, name: str = "one") -> Store:
        buckets._opened.cache_clear()
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / name))
        monkeypatch.setattr(mirrors, "_copies", {})
        return Store(Path(url))

    yield store
    server.mend()


@pytest.fixture(scope="session")
def recordings(tmp_path_factory) -> Path:
    """A folder with a recording of ten seconds."""
    def make(folder: Path) -> None:
        folder.mkdir()
        clip(60.0, 70.0).write_csv(folder / "derby.csv")

    return once(tmp_path_factory, "bucket-recordings", make)


@pytest.fixture(scope="session")
def local(recordings, tmp_path_factory) -> dict[str, bytes]:
    """The files of a local folder after a run."""
    return files(once(tmp_path_factory, "bucket-local", lambda folder: brought(Store(folder), recordings)))


@pytest.fixture
def two(server, machine):
    """The stores of two machines on one bucket; each knows that it is empty."""
    url = server.new()
    stores = [machine(url, name) for name in ("one", "two")]
    for store in stores:
        store.catch_up()
        assert store.mirror is not None
    assert stores[0].root != stores[1].root
    return stores
