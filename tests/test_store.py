"""The data folder: nothing half-written is ever seen, nothing good is ever lost."""

import errno
import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import dataframely as dy
import polars as pl
import pytest

from pitchlore.pipeline.base.errors import BadSettings, CorruptFile, NotFound, SchemaMismatch, StorageFailed
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.tables import SCHEMA_KEY, from_parquet, to_parquet
from pitchlore.pipeline.store.verification import verify
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import (
    SIDES,
    Decisions,
    Goals,
    Grams,
    Matches,
    Occasions,
    Patterns,
    Policies,
    Situations,
    Trajectories,
)


def goals(robot: int = 1, rows: int = 3) -> pl.DataFrame:
    return pl.DataFrame(
        {"match_id": ["m-1"] * rows, "t_ns": list(range(rows)), "team": ["home"] * rows,
         "robot": [robot] * rows, "kind": ["direct"] * rows, "origin": ["referee"] * rows, "confidence": [None] * rows},
        schema=Goals.dtypes(),
    )


def work(robot: int, name: str = "m-1", **other: object) -> Work:
    return Work("goals", name, {"robot": robot}, **{"version": 1, "schemas": (Goals,)} | other)


def put(store: Store, robot: int, of: Work | None = None) -> Receipt:
    made = Made([(goals(robot), Goals)], blobs={"note": ("txt", b"n%d" % robot)})
    return store.commit(of or work(robot), made)


def current_robot(store: Store) -> int:
    receipt = store.receipt("goals", "m-1")
    assert receipt is not None
    table = store.read_table(receipt, "goals", Goals)
    assert store.read(receipt, "note") == b"n%d" % table["robot"][0]
    return int(table["robot"][0])


def put_version(store: Store, robot: int) -> int:
    with store.claim("knowledge") as version:
        parent = store.latest("knowledge")
        made = Made([(goals(robot), Goals)], blobs={"map": ("npz", b"x" * robot)})
        store.commit_version(
            Work("knowledge", "knowledge", {"robot": robot}, version=1), made, version,
            parent=parent.version if parent else None,
        )
        return version


class Crash(BaseException):
    """A power cut: nothing may catch it."""


@contextmanager
def failing_at(monkeypatch: pytest.MonkeyPatch, step: int, error: Callable[[], BaseException]) -> Iterator[list[int]]:
    """Let the ``step``-th system call that changes the disk fail; counts the calls."""
    calls = [0]

    def wrap(function):
        def wrapped(*args, **kwargs):
            calls[0] += 1
            if calls[0] == step:
                raise error()
            return function(*args, **kwargs)
        return wrapped

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", wrap(os.replace))
        patch.setattr(os, "rename", wrap(os.rename))
        patch.setattr(os, "fsync", wrap(os.fsync))
        patch.setattr(Path, "write_bytes", wrap(Path.write_bytes))
        yield calls


def test_held_work(tmp_path):
    """The store holds the same work, and no work of other settings or another name, or that has lost a file."""
    store = Store(tmp_path)
    receipt = put(store, 1)
    assert store.holding(work(1)) == receipt
    assert store.holding(work(2)) is None
    assert store.holding(work(1, "m-2")) is None
    (tmp_path / receipt.files["goals"].path).unlink()
    assert store.holding(work(1)) is None


@pytest.mark.parametrize("other", [
    {"version": 2}, {"inputs": {"a": "1"}}, {"seed": 1}, {"schemas": ()}, {"through": {"arena": 1}},
    {"deciding": {}},
])
def test_work_key(other):
    """Equal work has an equal key, and work that differs in anything that decides it another."""
    assert work(1).key == work(1).key
    assert work(1, **other).key != work(1).key
    assert work(1, deciding={"robot": 1}).key == work(1).key


def test_same_bytes(tmp_path):
    """Other work that makes the same bytes changes no file but the receipt."""
    store = Store(tmp_path)
    first = put(store, 1)
    before = {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*") if p.is_file()}
    second = put(store, 1, work(1, version=2))
    assert second.files == first.files
    assert (second.key != first.key, second.digests() == first.digests()) == (True, True)
    changed = {p.name for p in tmp_path.rglob("*") if p.is_file() and p.stat().st_mtime_ns != before.get(p)}
    assert changed == {"m-1.receipt.json"}


def test_bytes_of_pieces():
    """A table has the same bytes in however many pieces it came."""
    whole = goals(rows=2).with_columns(team=pl.Series([None, "away"], dtype=pl.Enum(SIDES)))
    pieces = pl.concat([whole[:1], whole[1:]], rechunk=False)
    assert (whole.n_chunks(), pieces.n_chunks()) == (1, 2)
    assert to_parquet(whole, Goals, where="goals") == to_parquet(pieces, Goals, where="goals")


def test_other_code(tmp_path, monkeypatch):
    """The same work done by other code keeps its receipt."""
    store = Store(tmp_path)
    first = put(store, 1)
    monkeypatch.setattr("pitchlore.pipeline.store.outputs.software", lambda: "pitchlore 9.9+00000000")
    assert put(store, 1) == first
    assert put(store, 2).software == "pitchlore 9.9+00000000"


def test_confirmed_version(tmp_path):
    """The content found in a version is remembered as long as it is the newest."""
    store = Store(tmp_path)
    put_version(store, 1)
    later = Work("knowledge", "knowledge", {"robot": 1}, version=2)
    assert store.standing(later) is None
    store.confirm(later, 1)
    assert store.standing(later).version == 1
    put_version(store, 2)
    assert store.standing(later) is None, "it is not the newest any more"


@pytest.mark.parametrize("error", [lambda: OSError(errno.ENOSPC, "No space left on device"), Crash])
def test_crash(tmp_path, monkeypatch, error):
    """A crash or full disk at any step leaves a whole output, the old one or the new one."""
    store = Store(tmp_path)
    put(store, 1)
    with failing_at(monkeypatch, 0, error) as calls:
        put(store, 2)
    steps = calls[0]
    assert steps >= 9
    put(store, 1)
    for step in range(1, steps + 1):
        with pytest.raises((StorageFailed, Crash)), failing_at(monkeypatch, step, error):
            put(store, 2)
        assert current_robot(store) in (1, 2)
        assert not list(tmp_path.rglob("*.tmp"))
        put(store, 1)
        store.prune("goals")  # what was written of the other: each step is tried with all of them to do
    put(store, 2)
    assert current_robot(store) == 2


@pytest.mark.parametrize("error", [lambda: OSError(errno.ENOSPC, "No space left on device"), Crash])
def test_crash_of_version(tmp_path, monkeypatch, error):
    """A crash or full disk at any step of a version leaves only whole versions."""
    store = Store(tmp_path)
    put_version(store, 1)
    with failing_at(monkeypatch, 0, error) as calls:
        put_version(Store(tmp_path / "dry"), 2)
    for step in range(1, calls[0] + 1):
        before = store.versions("knowledge")
        with pytest.raises((StorageFailed, Crash)), failing_at(monkeypatch, step, error):
            put_version(store, 2)
        after = store.versions("knowledge")
        assert after[: len(before)] == before
        for version in after:
            assert verify(store, (), [("knowledge", version)]).problems == []
    assert put_version(store, 3) == len(store.versions("knowledge"))


def test_synced_before_its_name(tmp_path, monkeypatch):
    """A file is on the disk before it has its name, and its folder is synced after it: a power cut leaves no torn file."""
    done, fsync, replace = [], os.fsync, os.replace

    def synced(number):
        done.append(str(Path(f"/proc/self/fd/{number}").readlink()))
        fsync(number)

    def renamed(source, target):
        done.append((str(source), str(target)))
        replace(source, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", renamed)
    put(Store(tmp_path), 1)
    renames = [place for place, what in enumerate(done) if isinstance(what, tuple)]
    assert len(renames) == 3
    for place in renames:
        source, target = done[place]
        assert (done[place - 1], done[place + 1]) == (source, str(Path(target).parent))


def test_killed_writer(tmp_path):
    """A writer that is killed leaves the old file; what it had begun is swept, the number that it claimed is free again."""
    store = Store(tmp_path)
    put(store, 1)
    script = textwrap.dedent("""
        import os, signal, sys
        from pathlib import Path
        from pitchlore.pipeline.store import Store
        store = Store(Path(sys.argv[1]))
        path = next(Path(sys.argv[1]).glob("goals/*.parquet"))
        with store.claim("knowledge"), store.aside(path) as temporary:
            temporary.write_bytes(b"half")
            os.kill(os.getpid(), signal.SIGKILL)
    """)
    done = subprocess.run([sys.executable, "-c", script, str(tmp_path)], check=False)
    assert done.returncode == -signal.SIGKILL
    assert current_robot(store) == 1
    assert len(list(tmp_path.rglob(".*.tmp"))) == 1
    assert store.sweep() == 1
    assert not list(tmp_path.rglob(".*.tmp"))
    assert put_version(store, 1) == 1


def test_verify(tmp_path):
    """Verify names every damaged, missing and foreign file."""
    store = Store(tmp_path)
    version = put_version(store, 2)
    assert verify(store, (), [("knowledge", version)]).problems == []
    folder = store.version_folder("knowledge", version)
    (folder / "goals.parquet").write_bytes(b"PAR1 no")
    (folder / "map.npz").unlink()
    (folder / "extra").write_bytes(b"")
    problems = verify(store, (), [("knowledge", version)]).problems
    assert len(problems) == 3
    assert any("goals.parquet" in p and "SHA-256" in p for p in problems)
    assert any("map.npz" in p and "cannot be read" in p for p in problems)
    assert any("extra" in p for p in problems)
    with pytest.raises(CorruptFile):
        store.read_table(store.manifest("knowledge", version), "goals", Goals)


def test_removed_meanwhile(tmp_path):
    """A reader is told to try again if the output was forgotten or made anew since its receipt was read."""
    store = Store(tmp_path)
    before = put(store, 1)
    put(store, 2)
    store.prune("goals")
    with pytest.raises(CorruptFile, match="made anew meanwhile: call the command again"):
        store.read(before, "note")
    now = store.receipt("goals", "m-1")
    (tmp_path / now.files["note"].path).unlink()
    with pytest.raises(CorruptFile, match="Run `pitchlore run` to make it anew"):
        store.read(now, "note")
    store.forget("goals", "m-1")
    with pytest.raises(CorruptFile, match="removed or made anew meanwhile"):
        store.read(now, "note")


def test_versions(tmp_path):
    """Versions count up and name their parent."""
    store = Store(tmp_path)
    assert [put_version(store, r) for r in (1, 2, 3)] == [1, 2, 3]
    assert [store.manifest("knowledge", v).parent for v in (1, 2, 3)] == [None, 1, 2]
    with pytest.raises(NotFound, match="no version 9 \\(there are: 1, 2, 3\\)"):
        store.manifest("knowledge", 9)


@pytest.mark.slow
def test_emitters_at_once(tmp_path):
    """Versions that several processes make at once all land, and all are whole."""
    script = textwrap.dedent("""
        import sys
        sys.path.insert(0, sys.argv[3])
        from pathlib import Path
        from test_store import put_version
        from pitchlore.pipeline.store import Store
        for _ in range(5):
            put_version(Store(Path(sys.argv[1])), int(sys.argv[2]))
    """)
    tests = str(Path(__file__).parent)
    processes = [subprocess.Popen([sys.executable, "-c", script, str(tmp_path), str(robot), tests])
                 for robot in (3, 4)]
    assert [p.wait(60) for p in processes] == [0, 0]
    store = Store(tmp_path)
    assert store.versions("knowledge") == list(range(1, 11))
    robots = []
    for version in store.versions("knowledge"):
        assert verify(store, (), [("knowledge", version)]).problems == []
        manifest = store.manifest("knowledge", version)
        robot = int(store.read_table(manifest, "goals", Goals)["robot"][0])
        assert store.read(manifest, "map") == b"x" * robot
        robots.append(robot)
    assert sorted(robots) == [3] * 5 + [4] * 5


def test_held_number(tmp_path):
    """A process that wants a number that another holds waits: a number that comes to nothing is no gap."""
    store, found = Store(tmp_path), []
    other = Thread(target=lambda: found.append(put_version(store, 1)))
    with store.claim("knowledge") as first:
        other.start()
        other.join(0.2)
        assert (first, found) == (1, [])
    other.join()
    assert found == [1]


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        (goals().drop("kind"), "missing kind"),
        (goals().with_columns(extra=1), "unknown extra"),
        (goals().with_columns(pl.col("t_ns").cast(pl.Float64)), "t_ns is Float64, not Int64"),
        (goals().select(reversed(goals().columns)), "out of order"),
        (goals().with_columns(t_ns=pl.lit(None, dtype=pl.Int64)), r"t_ns\|nullability \(3 rows\)"),
    ],
)
def test_broken_schema(tmp_path, frame, said):
    """A table that breaks its schema is not written."""
    store = Store(tmp_path)
    with pytest.raises(SchemaMismatch, match=said):
        store.commit(work(1), Made([(frame, Goals)]))
    assert not list(tmp_path.rglob("*.parquet"))


def test_foreign_table(tmp_path):
    """A file of another schema version, of unknown origin or of another format is refused."""
    path = tmp_path / "old.parquet"
    goals().write_parquet(path, metadata={SCHEMA_KEY: "goals/0"})
    with pytest.raises(SchemaMismatch, match="holds table goals/0, not goals/2"):
        from_parquet(path.read_bytes(), Goals, where=str(path))
    goals().write_parquet(path)
    with pytest.raises(SchemaMismatch, match="of unknown origin"):
        from_parquet(path.read_bytes(), Goals, where=str(path))
    with pytest.raises(CorruptFile, match="is not Parquet"):
        from_parquet(b"nonsense", Goals, where="x")


@pytest.mark.parametrize("name", ["../m", "a/b", "", "M 1", "a\x00b", ".hidden", "x" * 200])
def test_hostile_names(tmp_path, name):
    """A hostile name never becomes a path."""
    with pytest.raises(BadSettings, match="not a safe file name"):
        Store(tmp_path / "data").commit(work(1, name), Made())
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
@pytest.mark.parametrize(("schema", "column"), [
    (Trajectories, "x"), (Trajectories, "vx"), (Situations, "strength"), (Grams, "value_sum"),
    (Patterns, "value"), (Decisions, "reward"), (Occasions, "value"), (Policies, "q"), (Matches, "hz"),
])
def test_nan_and_infinity(schema, column, value):
    """NaN and infinity never get into a table."""
    row = schema.sample(1, generator=dy.random.Generator(seed=1))
    to_parquet(row, schema, where="x")
    bad = row.with_columns(pl.lit(value, dtype=schema.dtypes()[column]).alias(column))
    with pytest.raises(SchemaMismatch, match=column):
        to_parquet(bad, schema, where="x")
