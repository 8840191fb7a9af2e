"""Closed parts: the same answers from fewer files, whatever becomes of the matches or of the parts."""

from __future__ import annotations

import os
import random
import shutil
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import polars as pl
import pyarrow.parquet
import pytest
from conftest import run
from test_damage import flip

from pitchlore.pipeline.engine import look
from pitchlore.pipeline.engine.catalog import catalog_path, files_of, forget_match, renew
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.store import Store, parts
from pitchlore.pipeline.store.receipts import FileRecord
from pitchlore.pipeline.views.card import answer
from pitchlore.schemas import PUBLIC, Choices, Sequences, Sides


@pytest.fixture
def store(copied, monkeypatch) -> Store:
    """A league of two matches, which are in one part."""
    shutil.rmtree(copied / "inbox")
    monkeypatch.setattr(parts, "MATCHES", 2)
    store = Store(copied)
    anew(store)
    assert len(list(parts.closed_parts(store))) == 1
    return store


def anew(store: Store) -> None:
    """Make the catalogue from nothing."""
    catalog_path(store).unlink(missing_ok=True)
    renew(store)


def answers(store: Store) -> dict[str, list[object]]:
    """How many rows each table has, and a number that tells these rows, without what is damaged: one question of all."""
    store.leave_out = lambda _: None
    asked = (f"select '{table}', count(*), sum(hash(asked))::varchar from {table} asked" for table in PUBLIC)
    return {table: found for table, *found in League(store).ask(" union all ".join(asked)).rows()}


def of_singles(store: Store, monkeypatch) -> dict[str, list[object]]:
    """The same, by a catalogue without parts; the parts are gone then."""
    shutil.rmtree(store.root / parts.FOLDER, ignore_errors=True)
    with monkeypatch.context() as patch:
        patch.setattr(parts, "MATCHES", 1 << 20)
        anew(store)
    return answers(store)


def joined(store: Store, table: str) -> Path:
    """The joined file of a table."""
    (part,) = parts.closed_parts(store)
    return store.root / part.files[table].path


def single(store: Store, noun: str) -> FileRecord:
    """A file of a match of its own."""
    return next(iter(next(store.receipts(noun)).files.values()))


def test_same_answers(store, monkeypatch):
    """Each table has the rows that it has without parts, from one file a table; so does a lazy frame."""
    found, lazy = answers(store), League(store).lazy("situations").collect()
    for table in ("matches", "situations", "quality", "goals"):
        assert files_of(store, table) == [str(joined(store, table))]
    assert found == of_singles(store, monkeypatch)
    assert len(files_of(store, "situations")) == 2
    assert lazy.equals(League(store).lazy("situations").collect())


def test_part_that_is_taken_apart_meanwhile(store):
    """The end of a run is told, from what stands, where another command took a part apart since the run's look."""
    before = answer(store).cards
    for path in (store.root / parts.FOLDER).glob("*.parquet"):
        path.unlink()
    (store.root / ".answer.json").unlink()
    assert answer(store, refreshed=True).cards == before


def test_parts_stay(store):
    """A part whose matches are as they were keeps its files when something else has changed."""
    before = {path: path.stat() for path in (store.root / parts.FOLDER).iterdir()}
    os.utime(next((store.root / "behaviours").glob("*.receipt.json")), ns=(1, 1))
    renew(store)
    assert {path: path.stat() for path in (store.root / parts.FOLDER).iterdir()} == before


@pytest.mark.parametrize("spoil", [
    pytest.param(lambda store: forget_match(store, next(store.receipts("matches")).name), id="match forgotten"),
    pytest.param(lambda store: store.forget("sequences", next(store.receipts("matches")).name), id="output removed"),
    pytest.param(lambda store: (flip(store.root / single(store, "situations").path, random.Random(1)),
                                (store.root / single(store, "goals").path).unlink()), id="files flipped and removed"),
    pytest.param(lambda store: (flip(joined(store, "situations"), random.Random(2)), joined(store, "worths").unlink()),
                 id="joined files flipped and removed"),
    pytest.param(lambda store: flip(next((store.root / "closed").glob("*.json")), random.Random(3)), id="index flipped"),
    pytest.param(lambda store: shutil.rmtree(store.root / "closed"), id="parts removed"),
])
def test_whatever_happens(store, monkeypatch, spoil: Callable[[Store], object]):
    """The next question is answered from what stands; the next run makes all whole."""
    spoil(store)
    assert answers(store)["matches"][0]
    assert run(store.root).failures == {}
    found = answers(store)
    assert verify_all(store).problems == []
    assert found == of_singles(store, monkeypatch)


def rows_of(tables: Iterable[pl.DataFrame]) -> list[tuple[object, ...]]:
    """The rows of tables, each match's as they follow each other."""
    return pl.concat(tables).sort("match_id", maintain_order=True).rows()


@pytest.mark.parametrize(("spoil", "singles"), [
    pytest.param(lambda store: None, 0, id="as it is"),
    pytest.param(lambda store: flip(joined(store, "sequences"), random.Random(5)), 2, id="joined file flipped"),
    pytest.param(lambda store: joined(store, "sequences").unlink(), 2, id="joined file removed"),
    pytest.param(lambda store: flip(next((store.root / "closed").glob("*.json")), random.Random(6)), 2, id="index flipped"),
    pytest.param(lambda store: store.forget("sequences", next(store.receipts("sequences")).name), 1, id="one forgotten"),
])
def test_stages_read_parts(store, monkeypatch, spoil: Callable[[Store], object], singles: int):
    """A stage of all matches reads what is joined of exactly the files that it is made from, else these."""
    spoil(store)
    read = list[str]()
    for noun, schema in (("sequences", Sequences), ("sequences", Choices), ("sides", Sides)):
        receipts = list(store.receipts(noun))
        alone = rows_of(store.batches(receipts, schema.NAME, schema))
        with monkeypatch.context() as patch:
            batches = store.batches
            patch.setattr(store, "batches", lambda some, *args, batches=batches: batches(
                [(read.append(args[0]), each)[1] for each in some], *args))
            assert rows_of(parts.read_joined(store, receipts, schema)) == alone
    assert read.count("sequences") == singles
    assert len(rows_of(parts.read_joined(store, receipts[:1], Sides))) == 2


def test_same_bytes_by_parts(store):
    """Behaviours and decisions have the same bytes when they are made from parts as they had before there were any."""
    before = {noun: next(store.receipts(noun)).files for noun in ("behaviours", "decisions")}
    for noun in before:
        store.forget(noun, "all")
    assert run(store.root).failures == {}
    assert {noun: next(store.receipts(noun)).files for noun in before} == before


def test_match_in_quarantine(store, monkeypatch):
    """A match that a stage refuses leaves its part, with its rows."""
    name = next(store.receipts("matches")).name
    store.quarantine("situations", name, ValueError("no"))
    renew(store)
    assert not list(parts.closed_parts(store))
    assert {*League(store).ask("select match_id from situations").to_series()} == {each.name for each in store.receipts("matches")} - {name}


def test_silent_damage(store):
    """`verify` names a joined file whose bytes changed while its time did not, and the next run joins it anew."""
    path = joined(store, "situations")
    seen = path.stat()
    flip(path, random.Random(4))
    os.utime(path, ns=(seen.st_atime_ns, seen.st_mtime_ns))
    (problem,) = verify_all(store).problems
    assert problem.startswith(f"{path}: is not what was written")
    anew(store)
    assert verify_all(store).problems == []


def test_at_a_glance(store, monkeypatch):
    """Where no folder has changed, a question looks at no file of a closed match; of others it sees each change."""
    past = time.time() - 60
    for folder in (store.root, *filter(Path.is_dir, store.root.iterdir())):
        os.utime(folder, (past, past))
    before = answers(store)  # it notes that all is as it was
    looked = list[str]()
    glance = look.glance
    monkeypatch.setattr(look, "glance", lambda path: (looked.append(str(path)), glance(path))[1])
    assert answers(store) == before
    assert looked
    closed = {f"{store.root}/{record.path}" for noun in ("matches", "situations") for each in store.receipts(noun)
              for record in each.files.values()}
    assert not closed & set(looked)
    forget_match(store, next(store.receipts("matches")).name)
    assert answers(store)["matches"][0] == 1


def test_no_room_to_join(store, monkeypatch, caplog):
    """Where the disk is full, the catalogue reads the matches' own files, and what was begun is removed."""
    shutil.rmtree(store.root / parts.FOLDER)

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    before = answers(store)
    with monkeypatch.context() as patch:
        patch.setattr(pyarrow.parquet.ParquetWriter, "write_table", full)
        anew(store)
    assert "could not be joined" in caplog.text
    assert answers(store) == before
    (store.root / parts.FOLDER / "goals-0123456789ab.parquet").write_bytes(b"begun")
    anew(store)
    (part,) = parts.closed_parts(store)
    assert sorted(path.name for path in (store.root / parts.FOLDER).iterdir()) == sorted(
        Path(name).name for name in (part.index, *(record.path for record in part.files.values())))
