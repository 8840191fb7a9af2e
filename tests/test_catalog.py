"""The catalogue: views over what the receipts vouch for, safe to query."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import duckdb
import polars as pl
import pytest
from support.outputs import put_goal
from support.processes import COMMAND_LINES, closed

import pitchlore
from pitchlore.pipeline.base.errors import BadQuery
from pitchlore.pipeline.engine import look
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.store import Store, catalog, sealed
from pitchlore.pipeline.store.catalog import FILES, VARIABLE, pattern, quote
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.store.sealed import stamp_of
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import PUBLIC, Goals

COUNT = "select count(*) from goals"


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory):
    """The catalogue of a folder with one goal."""
    store = Store(tmp_path_factory.mktemp("catalogue"))
    put_goal(store, "m-1", 1)
    return refresh(store)[0]


def test_empty_tables(tmp_path):
    """Every public table is a view, even when it is empty."""
    path = refresh(Store(tmp_path))[0]
    for name, schema in PUBLIC.items():
        frame = ask(path, f"select * from {name}")
        assert frame.columns == list(schema.dtypes())
        assert frame.height == 0


def test_types_when_empty(tmp_path, catalogue):
    """An empty view has the types of a full one."""
    empty = ask(refresh(Store(tmp_path))[0], "select * from goals").schema
    assert ask(catalogue, "select * from goals").schema == empty


def test_only_receipts(tmp_path):
    """Views show what receipts list, and nothing else that lies in the folder."""
    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    old = put_goal(store, "m-2", 2)
    new = put_goal(store, "m-2", 3)
    (tmp_path / "goals" / "stray.goals.parquet").write_bytes(b"not parquet at all")
    assert old != new
    assert old.exists()
    rows = ask(refresh(store)[0], "select match_id, robot from goals order by all").rows()
    assert rows == [("m-1", 1), ("m-2", 3)]


def test_older_look_ends_last(tmp_path, monkeypatch):
    """A catalogue whose look began before a match came does not replace one that has it."""
    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    build = catalog.build

    def slowly(*arguments):
        build(*arguments)
        monkeypatch.setattr(catalog, "build", build)
        put_goal(store, "m-2", 2)
        assert ask(refresh(store)[0], COUNT).item() == 2

    monkeypatch.setattr(catalog, "build", slowly)
    assert ask(refresh(store)[0], COUNT).item() == 2
    assert ask(refresh(store)[0], COUNT).item() == 2


def test_change_within_a_tick(tmp_path, monkeypatch):
    """A match that comes while others are looked at is seen, though its folder's size and time are as before."""
    monkeypatch.setattr(sealed, "stamp_of", lambda path: stamp_of(path) if Path(path).is_file() else (
        stamp_of(path)[0], 0, stamp_of(path)[2]))
    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    folders = [tmp_path / "matches", tmp_path / "goals"]

    def slowly(*arguments, **named):
        found = look.look_over(*arguments, **named)
        before = [folder.stat() for folder in folders]
        put_goal(store, "m-2", 2)
        for folder, was in zip(folders, before, strict=True):
            os.utime(folder, ns=(was.st_atime_ns, was.st_mtime_ns))
        time.sleep(1.1)
        return found

    with monkeypatch.context() as patch:
        patch.setattr("pitchlore.pipeline.engine.catalog.look_over", slowly)
        refresh(store)
    assert ask(refresh(store)[0], COUNT).item() == 2


def test_folders_without_times(tmp_path, monkeypatch):
    """On a disk that does not touch a folder's time when a file comes, each question looks at all files."""
    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    for module in (look, sealed):
        monkeypatch.setattr(
            module, "stamp_of", lambda path: stamp_of(path) if Path(path).is_file() else (stamp_of(path)[0], 0, 0))
    assert ask(refresh(store)[0], COUNT).item() == 1
    put_goal(store, "m-2", 2)
    assert ask(refresh(store)[0], COUNT).item() == 2


def test_look_at_young_folders(tmp_path, monkeypatch):
    """A look at folders that changed just now is noted if it takes long enough, so that the next one is a glance."""
    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    with monkeypatch.context() as patch:
        patch.setattr("pitchlore.pipeline.engine.catalog.look_over", lambda *given, **named: (
            time.sleep(1.1), look.look_over(*given, **named))[1])
        path = refresh(store)[0]
    assert look.stands_at_a_glance(store, path, look.folders_of(store))


@pytest.mark.parametrize(("number", "cure"), [(99, "Update Pitchlore."), (0, "Run `pitchlore run` to make it anew.")])
def test_table_of_another_version(tmp_path, call, number, cure):
    """A table that a newer or much older version wrote is left out, and said with what to do."""
    class Other(Goals):
        VERSION = number

    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    path = put_goal(store, "m-2", 2)
    receipt = store.commit(Work("goals", "m-2", {}, version=1, schemas=(Other,)), Made([(pl.read_parquet(path), Other)]))
    for query, rows in (("select robot from goals", "robot\n1\n"), ("select count(*) n from matches", "n\n0\n")):
        code, out, err = call("sql", query, "--csv", "--data", tmp_path)
        assert (code, out) == (3, rows)
        assert f"{tmp_path / receipt.files['goals'].path}: is a table goals/{number}, which this version does not read (" in err
        assert cure in err


def test_wildcards_in_the_path(tmp_path):
    """A data folder whose name has wildcards shows its own rows, to `sql` and to notebooks, and no other's."""
    for robot, name in enumerate(("ab", "a*", "a[b]", "*"), 1):
        store = Store(tmp_path / name)
        put_goal(store, "m-1", robot)
        path = refresh(store)[0]
        assert ask(path, "select robot from goals").rows() == [(robot,)]
        with duckdb.connect(str(path), read_only=True) as notebook:
            notebook.execute(f"set variable {VARIABLE} = {quote(pattern(str(path.parent)))}")
            assert notebook.sql("select robot from goals").fetchall() == [(robot,)]


def test_older_clients(catalogue):
    """The file is in the format that every DuckDB from 1.0 on reads: the head names 64, where 2.0 writes 999."""
    head = catalogue.read_bytes()[8:20]
    assert (head[:4], int.from_bytes(head[4:], "little")) == (b"DUCK", 64)


def test_column_comments(catalogue):
    """Columns have a comment with their meaning and unit."""
    comments = dict(ask(
        catalogue, "select column_name, comment from duckdb_columns() where table_name = 'trajectories'").rows())
    assert comments["vx"] == "estimated velocity along x; null where it cannot be estimated [m/s]"


def test_parameters_are_bound(catalogue):
    """A parameter is a value and never part of the SQL."""
    assert ask(catalogue, "select count(*) from goals where match_id = ?", ["m-1"]).item() == 1
    assert ask(catalogue, "select count(*) from goals where match_id = ?", ["' or 1=1 --"]).item() == 0


@pytest.mark.parametrize(("sql", "said"), [
    ("select 1; select 2", "2 statements were given, not one"),
    ("drop view goals; select 1", "2 statements were given, not one"),
    ("", "0 statements"),
    ("/* nothing */", "0 statements were given, not one"),
    ("select 1 as a, 2 as a", "column a occurs twice"),
    ("select interval 1 day as x", "column x is of type INTERVAL"),
    ("select [{'a': interval 1 day}] as x", "column x is of type"),
    ("select map {'a': [interval 1 day]} as x", "column x is of type"),
    ("select union_value(k := 1) as x", "column x is of type UNION"),
    ("select '12:00+01'::timetz as x", "column x is of type TIME WITH TIME ZONE"),
    ("select 'infinity'::date as x", "column x has times outside the years 1 to 9999"),
    ("select date '0001-01-01' - interval 3000 year as x", "column x has times outside the years 1 to 9999"),
])
def test_unfit_queries(catalogue, sql, said):
    """A query whose answer does not fit one table is refused with the reason."""
    with pytest.raises(BadQuery, match=said):
        ask(catalogue, sql)


def test_semicolon_and_comment(catalogue):
    """One statement may have a semicolon, comments and nested values."""
    frame = ask(catalogue, "-- why\nselect [1, 2]::integer[2] a, {'b': ['c']} s, null::date d; -- ;")
    assert frame.rows() == [([1, 2], {"b": ["c"]}, None)]


def test_open_notebook(tmp_path):
    """A notebook that has the catalogue open does not block its refresh, and goes on reading."""
    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    path = refresh(store)[0]
    with duckdb.connect(str(path), read_only=True) as notebook:
        notebook.execute(f"set variable {VARIABLE} = {quote(str(tmp_path))}")
        put_goal(store, "m-2", 2)
        assert ask(refresh(store)[0], "select count(*) from goals").item() == 2
        assert notebook.execute("select count(*) from goals").fetchone() == (1,)


#: Opens a catalogue as DuckDB's own shell does, to write, and puts another view in the place of ours.
WRITER = """
import duckdb, sys
connection = duckdb.connect(sys.argv[1])
connection.execute("create or replace view goals as select 7 as robot")
print("open", flush=True)
sys.stdin.readline()
"""


@pytest.mark.parametrize("killed", [False, True])
def test_open_to_write(tmp_path, call, killed):
    """A program that holds the catalogue to write, or was killed so, blocks no question, and changes no answer."""
    put_goal(Store(tmp_path), "m-1", 1)
    path, words = refresh(Store(tmp_path))[0], ("sql", "select robot from goals order by 1", "--csv", "--data", tmp_path)
    with subprocess.Popen([sys.executable, "-c", WRITER, path], text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as writer:
        assert writer.stdout.readline() == "open\n"
        if killed:
            writer.kill()
            writer.wait()
        assert call(*words) == (0, "robot\n1\n", "")
        put_goal(Store(tmp_path), "m-2", 2)
        assert call(*words) == (0, "robot\n1\n2\n", "")
        if not killed:
            writer.communicate("\n")
    assert call(*words) == (0, "robot\n1\n2\n", "")


def test_open_to_write_here(tmp_path):
    """A notebook that has connected to the catalogue to write asks Pitchlore all the same."""
    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    with duckdb.connect(str(refresh(store)[0])):
        for robots in ([(1,)], [(1,), (2,)]):
            assert pitchlore.open(tmp_path).sql("select robot from goals order by 1").fetchall() == robots
            put_goal(store, "m-2", 2)


def test_moved_folder(tmp_path):
    """A catalogue moves with its folder, and stands: no path in it is absolute; other programs say where it is."""
    put_goal(Store(tmp_path / "a"), "m-1", 1)
    path = refresh(Store(tmp_path / "a"))[0]
    with duckdb.connect(str(path), read_only=True) as connection:
        assert str(tmp_path) not in str(connection.execute("select sql from duckdb_views()").fetchall())
        assert str(tmp_path) not in str(connection.execute(f"from {FILES}").fetchall())
        with pytest.raises(duckdb.IOException, match=f"say first where the data folder is: set variable {VARIABLE} ="):
            connection.execute("from goals")
    there = path.stat()
    (tmp_path / "a").rename(tmp_path / "b")
    moved = refresh(Store(tmp_path / "b"))[0]
    assert (moved.stat().st_ino, moved.stat().st_mtime_ns) == (there.st_ino, there.st_mtime_ns)
    assert ask(moved, "select count(*) from goals").item() == 1
    with duckdb.connect(str(moved), read_only=True) as other:
        other.execute(f"set variable {VARIABLE} = {quote(str(tmp_path / 'b'))}")
        assert other.execute("select count(*) from goals").fetchone() == (1,)


def test_closed_folder(finished, tmp_path):
    """A copy elsewhere in which nothing can be written answers every question, and pages of it are written elsewhere."""
    data, out = shutil.copytree(finished, tmp_path / "data", copy_function=shutil.copyfile), tmp_path / "out"
    match = sorted(data.glob("matches/*.receipt.json"))[0].name.removesuffix(".receipt.json")
    code = "select count(*) n from situations"
    words = [["sql", code, "--csv"], ["kb", "list"], ["kb", "show"], ["kb", "verify"], ["policy", "show"], ["runs"],
             ["quarantine"], ["verify"], ["run", "--plan"], ["commentary", match, "--goals"],
             ["replay", match, "--output", str(out / "replay.html")], ["scout", "--out", str(out / "scout")],
             ["export", match, "--to", "csv", "--output", str(out)]]
    lines = json.dumps([[*each, "--data", str(data)] for each in words])
    face = ("import pitchlore; league = pitchlore.open(sys.argv[2]); m = league.matches[sys.argv[3]]; print(m.score); "
            "print([league.sql('select count(*) from situations').fetchall() for _ in range(2)], league.lazy('goals').collect().height)")
    rows = ask(refresh(Store(finished))[0], code).item()
    with closed(data) as other:
        before = sorted(data.rglob("*"))
        done = subprocess.run([*other, sys.executable, "-c", COMMAND_LINES + face, lines, str(data), match], text=True, capture_output=True)
        assert (done.returncode, "pitchlore:" in done.stderr) == (0, False), done.stderr
        assert done.stdout.startswith(f"n\n{rows}\n\0")
        assert f"[[({rows},)], [({rows},)]]" in done.stdout.rpartition("\0")[2]
        assert sorted(data.rglob("*")) == before
    assert (out / "scout" / "index.html").exists()
