"""The table of commands in a data folder, and data folders that were made before it."""

import dataclasses
import json
from pathlib import Path

import duckdb
import pytest
from test_importers_rcg import PARAMS, counted, group, log, player

from pitchlore.pipeline.engine import catalog as views
from pitchlore.pipeline.engine import matches as flow
from pitchlore.pipeline.engine.catalog import catalog_path, forget_match, refresh
from pitchlore.pipeline.engine.chain import Chain
from pitchlore.pipeline.engine.imports import import_all
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store, catalog
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.store.verification import verify
from pitchlore.schemas import PUBLIC, Commands, Matches, Quality, Referee

SETTINGS = Settings()


def recording(folder: Path, name: str, kicks: int) -> Recording:
    """A log of 2D in which home 1 kicks so often, once in each cycle."""
    lines = [
        counted(cycle, player(group(kick=min(cycle, kicks))), player(group(), number="r 2")) for cycle in range(30)]
    file = folder / name
    file.write_bytes(log(PARAMS, "(playmode 0 play_on)", *lines, "(playmode 30 time_over)"))
    return Recording(file=file)


def rows_of(store: Store, query: str = "select match_id, count(*) from commands group by all order by all") -> list[tuple]:
    return ask(refresh(store)[0], query).rows()


@pytest.fixture
def old(tmp_path, monkeypatch) -> Store:
    """A data folder with a match and a catalogue as they were made before the table was there."""
    without = dataclasses.replace(STAGES["matches"], schemas=(Matches, Referee, Quality))
    tables = {name: schema for name, schema in PUBLIC.items() if schema is not Commands}

    def forgetful(store, work, made):
        kept = [(table, schema) for table, schema in made.tables if schema is not Commands]
        return commit(store, work, dataclasses.replace(made, tables=kept))

    commit = Store.commit
    store = Store(tmp_path / "data")
    with monkeypatch.context() as before:
        before.setattr(flow, "STAGES", Chain(*(without if noun == "matches" else STAGES[noun] for noun in STAGES)))
        before.setattr(Store, "commit", forgetful)
        before.setattr(views, "PUBLIC", tables)
        before.setattr(catalog, "PUBLIC", tables)
        take_in(store, recording(tmp_path, "old.rcg", 3))
        refresh(store)
    with duckdb.connect(str(catalog_path(store))) as connection:
        connection.execute(f"drop table {catalog.TAGS}")  # it came with the table of commands
    with duckdb.connect(str(catalog_path(store)), read_only=True) as connection, pytest.raises(duckdb.CatalogException):
        connection.execute("from commands")
    return store


def test_commands_in_a_store(tmp_path):
    """Commands are a file of their match and a view; they go when the match is forgotten."""
    store = Store(tmp_path / "data")
    receipt, *_ = take_in(store, recording(tmp_path, "new.rcg", 4))
    assert receipt.files["commands"].rows == 4
    assert rows_of(store, "select team, robot, t_ns, command, count from commands where t_ns < 2.5e8 order by t_ns") == [
        ("home", 1, 100_000_000, "kick", 1), ("home", 1, 200_000_000, "kick", 1)]
    file = store.root / receipt.files["commands"].path
    assert verify(store, ["matches"], ()).problems == []
    stray = file.with_name(file.name.replace(receipt.files["commands"].sha256[:12], "0" * 12))
    stray.write_bytes(b"old")
    assert store.prune("matches") == [stray]
    assert file.exists()
    forget_match(store, receipt.name)
    assert not file.exists()
    assert rows_of(store) == []


def test_old_catalogue(old):
    """A catalogue without the table is made anew, though no file has changed."""
    assert rows_of(old) == []
    assert rows_of(old, "select count(*) from matches") == [(1,)]
    before = catalog_path(old).stat().st_ino
    assert rows_of(old) == []
    assert catalog_path(old).stat().st_ino == before


def test_unreadable_catalogue(tmp_path):
    """A catalogue that is none is made anew."""
    catalog_path(Store(tmp_path)).write_bytes(b"no database")
    assert rows_of(Store(tmp_path)) == []


def test_old_store_beside_new(old, tmp_path, call):
    """A match that was imported before runs on as it is; commands are those of the matches that have them."""
    new, *_ = take_in(old, recording(tmp_path, "new.rcg", 5))
    chain = ("trajectories", "situations", "goals")
    STAGES.make(old, SETTINGS, scope_of(old), chain)
    assert all(len(list(old.receipts(noun))) == 2 for noun in chain)
    assert not list(old.quarantined())
    assert rows_of(old) == [(new.name, 5)]
    code, out, err = call("sql", "select count(*) as n from commands", "--json", "--data", old.root)
    assert (code, json.loads(out), err) == (0, [{"n": 5}], "")
    assert verify(old, ["matches"], ()).problems == []


def test_old_match_is_imported_anew(old, tmp_path):
    """The recording of a match that was imported before gives the match its commands, once."""
    again = recording(tmp_path, "old.rcg", 3)
    (before,) = old.receipts("matches")
    receipt, new, _ = take_in(old, again)
    assert new
    assert receipt.name == before.name
    assert rows_of(old) == [(receipt.name, 3)]
    assert not take_in(old, again)[1]
    assert import_all(old, [again]).kept == 1
