"""Shared disks: temporaries, locks and clocks of other machines."""

import errno
import fcntl
import os
import time
from pathlib import Path

import pytest

from pitchlore.pipeline.base.errors import StorageFailed
from pitchlore.pipeline.store import Store, parts, temporaries
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.sealed import read_model, sealed
from pitchlore.pipeline.store.temporaries import machine, temporary_beside
from pitchlore.pipeline.store.work import Made, Work

#: No process has this number: Linux's are at most 2**22.
NOBODY = (1 << 22) + 1
OTHER = "0" * 8


def left(root: Path, *names: str) -> None:
    for name in names:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.mkdir() if name.endswith("staging") else path.touch()


def test_temporaries_of_other_machines(tmp_path):
    """A dead process's temporary is removed; another machine's is not, whatever process has its number here."""
    own, dead = f"{machine()}.{os.getpid()}-0a", f"{machine()}.{NOBODY}-0a"
    theirs = f"{OTHER}.{NOBODY}-0a"
    left(tmp_path, f"sides/.a.{own}.tmp", f"sides/.a.{dead}.tmp", f"sides/.a.{theirs}.tmp", f".c.{dead}.tmp.wal",
         f"knowledge/.v0001.{dead}.staging", f"knowledge/.v0001.{theirs}.staging", f"knowledge/v0001/.b.{dead}.tmp",
         f"sides/.old.{NOBODY}-0a.tmp", f"sides/.old.{os.getpid()}-0a.tmp", "inbox/.mine", "sides/kept.tmp")
    assert Store(tmp_path).sweep() == 5
    assert sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.suffix) == sorted([
        f"sides/.a.{own}.tmp", f"sides/.a.{theirs}.tmp", f"knowledge/.v0001.{theirs}.staging",
        f"sides/.old.{os.getpid()}-0a.tmp", "sides/kept.tmp"])


def test_old_temporaries_of_other_machines(tmp_path):
    """Temporaries of another machine are removed after a day, by the disk's clock."""
    young, old = temporary_beside(tmp_path / "young", "tmp"), temporary_beside(tmp_path / "old", "tmp")
    for path, age in ((young, 3600), (old, 25 * 3600)):
        path = path.with_name(path.name.replace(machine(), OTHER))
        path.touch()
        os.utime(path, (time.time() - age,) * 2)
    assert Store(tmp_path).sweep() == 1
    assert [path.name.split(".")[1] for path in tmp_path.iterdir()] == ["young"]


@pytest.mark.parametrize(("words", "where"), [
    (("prune",), "data/situations"), (("verify", "--restore-from", "data"), "data/knowledge"), (("scout", "-o", "pages"), "pages"),
    (("export", "early", "--to", "csv", "-o", "out"), "out"), (("export", "--to", "lerobot", "-o", "sets/x"), "sets"),
    (("forget", "late"), "data/closed")])
def test_half_files_of_the_dead_go(copied, call, tmp_path, monkeypatch, words, where):
    """The next command of a kind removes what a kill of one has left, also outside the data folder."""
    monkeypatch.chdir(tmp_path)
    (copied / "catalog.duckdb").unlink()
    monkeypatch.setattr(parts, "MATCHES", 2)
    dead = f"{machine()}.{NOBODY}-0a"
    left(tmp_path, f"{where}/.a.{dead}.tmp", f"{where}/.b.{dead}.staging", f"{where}/.c.{machine()}.{os.getpid()}-0a.tmp")
    assert call(*words, "--data", copied)[0] == 0
    assert [path.name[:3] for path in (tmp_path / where).iterdir() if path.suffix in (".tmp", ".staging")] == [".c."]


def test_machine(monkeypatch):
    """A machine is another after a restart, and a container is another machine."""
    def said() -> str:
        machine.cache_clear()
        return machine()

    try:
        before = said()
        assert said() == before
        monkeypatch.setattr(temporaries, "node", lambda: "another")
        assert said() != before
    finally:
        monkeypatch.undo()
        machine.cache_clear()
    assert machine() == before


@pytest.mark.parametrize("skew_s", [-3600.0, -0.5, 0.0, 0.5, 3600.0])
def test_clocks(tmp_path, skew_s):
    """A receipt that another machine changes is read as it is now, however its clock differs from this one's."""
    store = Store(tmp_path)
    path = str(tmp_path / "sides" / "m.receipt.json")
    when = time.time() + skew_s
    for number in range(20):
        store.commit(Work("sides", "m", {"number": number % 10}, version=1), Made())
        os.utime(path, (when, when))  # all in one tick of the disk's clock, and of one size
        found = store.receipt("sides", "m")
        assert found is not None
        assert found.settings == {"number": number % 10}


def test_read_once(tmp_path, monkeypatch):
    """An old receipt is read once; a removed one is gone."""
    store = Store(tmp_path)
    receipt = store.commit(Work("sides", "m", {}, version=1), Made())
    path = tmp_path / "sides" / "m.receipt.json"
    os.utime(path, (0, 0))
    assert read_model(str(path), Receipt) == receipt
    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", lambda _: pytest.fail("it was read again"))
        assert read_model(str(path), Receipt) is read_model(str(path), Receipt)
    path.write_bytes(sealed(receipt.model_copy(update={"key": "0" * 16})))
    assert read_model(str(path), Receipt).key == "0" * 16
    path.unlink()
    assert read_model(str(path), Receipt) is None


@pytest.mark.parametrize("error", [errno.ENOLCK, errno.EOPNOTSUPP])
def test_disk_without_locks(tmp_path, monkeypatch, error):
    """A disk without locks is one line before anything is written; what is there can be read."""
    store = Store(tmp_path)
    receipt = store.commit(Work("sides", "m", {}, version=1), Made())

    def refuse(*_: object) -> None:
        raise OSError(error, os.strerror(error))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with pytest.raises(StorageFailed, match=r"cannot be locked .*\. Mount the disk") as refused:
        store.commit(Work("sides", "n", {}, version=1), Made())
    assert "\n" not in str(refused.value)
    assert store.receipt("sides", "n") is None
    with store.keeping():
        assert store.receipt("sides", "m") == receipt


def test_set_aside(tmp_path):
    """A file that was growing moves with a number that no other has; one that grows stays where it is."""
    store = Store(tmp_path)

    def grown(text):
        with store.growing("playing", "x.mcap") as (path, stream):
            stream.write(text)
            stream.flush()
            assert store.set_aside(path, "left") is None
        return store.set_aside(path, "left")

    paths = [grown(text) for text in (b"one", b"two", b"three")]
    assert [path.relative_to(tmp_path).as_posix() for path in paths] == [f"left/x-{number}.mcap" for number in (1, 2, 3)]
    paths[0].unlink()
    (tmp_path / "left" / "x-y-9.mcap").write_bytes(b"another's")
    assert store.were_set_aside("left", "x.mcap") == paths[1:]
    assert grown(b"four").name == "x-4.mcap"
    assert paths[1].read_bytes() == b"two"
    assert store.set_aside(tmp_path / "playing" / "x.mcap", "left") is None  # it is gone
