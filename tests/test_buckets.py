"""A data folder in a bucket: the bytes of a local one, whatever the network does and whoever else writes."""

from __future__ import annotations

import errno
import io
import json
import logging
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from pydoc import locate

import pytest
from conftest import ROOT, clip
from support import at_once
from support.buckets import CREDENTIALS, FAULTS, Served, files, served
from support.google import google
from support.notebooks import NOTEBOOKS, executed, shown
from support.processes import eventually

pytest.importorskip("obstore", reason="the extra bucket is not installed")

from pitchlore.pipeline.base.errors import BadSettings, NotFound, Overtaken, StorageFailed
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine.catalog import distrust, look, refresh
from pitchlore.pipeline.engine.matches import Recording, import_recording, inbox
from pitchlore.pipeline.engine.stage import Inputs, Per, Plan, Scope, Stage
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.store import Store, buckets, mirrors
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.pipeline.store.work import Made, Work

pytestmark = pytest.mark.slow

ROUNDS = int(os.environ.get("PITCHLORE_ROUNDS", "1"))
EVERYTHING = Scope(matches=())


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


@pytest.fixture(scope="module")
def recordings(tmp_path_factory) -> Path:
    """A folder with a recording of ten seconds."""
    folder = tmp_path_factory.mktemp("recordings")
    clip(60.0, 70.0).write_csv(folder / "derby.csv")
    return folder


@pytest.fixture(scope="module")
def local(recordings, tmp_path_factory) -> dict[str, bytes]:
    """The files of a local folder after a run."""
    store = Store(tmp_path_factory.mktemp("local") / "league")
    brought(store, recordings)
    return files(store.root)


def brought(store: Store, recordings: Path) -> None:
    """Import the recordings, and run every stage."""
    store.catch_up()
    for file in sorted(recordings.iterdir()):
        import_recording(store, Recording(file=file))
    at_once.run(store)


def plain(objects: dict[str, bytes]) -> dict[str, bytes]:
    """The objects of a bucket by the names of a local folder's files, without the log of runs."""
    return {re.sub(r"(/v\d{4,}/)[0-9a-f]{12}\.", r"\1", key): data for key, data in objects.items()
            if not key.startswith("runs/")}


def work(noun: str = "goals", name: str = "m-1", version: int = 1) -> Work:
    return Work(noun=noun, name=name, settings={}, version=version)


def made(text: str) -> Made:
    return Made(blobs={"note": ("txt", text.encode())})


# --- one machine ------------------------------------------------------------------------------------


def test_same_bytes(server, machine, recordings, local):
    """A bucket holds the bytes of a local folder; so does its copy; another machine finds it all done."""
    url = server.new()
    one = machine(url)
    brought(one, recordings)
    assert plain(server.objects(url)) == local == files(one.root)
    two = machine(url, "two")
    two.catch_up()
    server.asked = 0
    assert at_once.run(two) == "False False"
    assert server.asked <= len(local), "what is done is known without reading it"
    assert plain(server.objects(url)) == local
    found = verify_all(two)
    assert (found.problems, found.files) == ([], len(local))
    assert files(two.root) == local


def test_another_library(server, machine, local, recordings, tmp_path):
    """A copy by another program into a bucket, file by file, is a data folder; and back."""
    url = server.new()
    for key, data in local.items():
        server.put(url, key, data)
    store = machine(url)
    store.catch_up()
    assert at_once.run(store) == "False False"
    assert verify_all(store).problems == []


def test_sql(server, machine, recordings):
    """Questions are answered from the files that a copy fetches, and without the bucket from those it has."""
    url = server.new()
    brought(machine(url), recordings)
    reader = machine(url, "reader")
    reader.catch_up()
    path, _ = refresh(reader)
    question = "select count(*) n, count(distinct match_id) from situations"
    answer = ask(path, question).rows()
    assert answer[0][0] > 100
    server.fault = lambda _: "cut before"
    path, left_out = refresh(reader)
    assert (ask(path, question).rows(), left_out) == (answer, [])


def test_lost_copy(server, machine, recordings, local):
    """The copy is a cache: damaged or removed, it is brought again."""
    url = server.new()
    store = machine(url)
    brought(store, recordings)
    for path in store.root.rglob("*.parquet"):
        path.write_bytes(b"x" * path.stat().st_size)
    (receipt,) = store.receipts("situations")
    assert store.read(receipt, "situations") == local[receipt.files["situations"].path]
    shutil.rmtree(store.root)
    again = machine(url, "again")
    again.catch_up()
    assert at_once.run(again) == "False False"
    assert verify_all(again).problems == []


def test_damaged_object(server, machine, recordings, local):
    """`verify` names an object that is not what was written, and the next run makes it anew."""
    url = server.new()
    store = machine(url)
    brought(store, recordings)
    (receipt,) = store.receipts("situations")
    path = receipt.files["situations"].path
    server.put(url, path, b"x" * receipt.files["situations"].size)
    (problem,) = verify_all(store).problems
    assert problem.startswith(f"{url}/{path}: is lost or damaged in the bucket. ")
    distrust(store)  # as the command does
    store.catch_up()
    look(store)
    at_once.run(store)
    assert plain(server.objects(url)) == local
    assert verify_all(store).problems == []


def test_forget_and_prune(server, machine, recordings):
    """`forget` removes objects; `prune` leaves those of the last day, which may be another machine's."""
    url = server.new()
    store = machine(url)
    store.commit(work(), made("one"))
    store.commit(work(version=2), made("two"))
    assert sorted(data for key, data in server.objects(url).items() if key.endswith("txt")) == [b"one", b"two"]
    assert store.prune("goals") == []
    long_ago = store.mirror.older
    store.mirror.older = lambda folder, _: long_ago(folder, -60)
    (left,) = store.prune("goals")
    assert not left.exists()
    assert [data for key, data in server.objects(url).items() if key.endswith("txt")] == [b"two"]
    other = machine(url, "two")
    other.catch_up()
    assert other.receipt("goals", "m-1") is not None
    assert store.forget("goals", "m-1")
    assert server.objects(url) == {}
    other.catch_up()
    assert other.receipt("goals", "m-1") is None


def copied(server: Served, objects: dict[str, bytes]) -> str:
    """The URL of a bucket's folder with these objects."""
    url = server.new()
    for key, data in objects.items():
        server.put(url, key, data)
    return url


def test_notebook(server, machine, local, tmp_path):
    """A notebook opens a bucket by its URL: it builds the catalogue, and says of when it is."""
    url = copied(server, local)
    machine(url, "reader")
    (path,) = (path for path in NOTEBOOKS if "PITCHLORE_DATA" in path.read_text())
    notebook = executed(path, url)
    said = [output.text for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs
            if output.output_type == "stream"]
    assert len(said) == 1
    assert re.search(rf"{url}: as of \d{{4}}-\d\d-\d\d", said[0])
    (table,) = shown(notebook)[0]
    assert "derby" in table


@pytest.fixture(scope="module")
def raw(server, recordings, local, tmp_path_factory) -> dict[str, bytes]:
    """The objects of a bucket after a run."""
    with pytest.MonkeyPatch.context() as patch:
        home = tmp_path_factory.mktemp("raw")
        for name, value in {**server.environment, "XDG_CACHE_HOME": str(home)}.items():
            patch.setenv(name, value)
        url = server.new()
        brought(Store(Path(url)), recordings)
    return server.objects(url)


def test_restore(server, machine, call, local, raw, tmp_path):
    """Damage in a bucket is mended from a folder, from a copy of the objects, and from a bucket; and in a folder."""
    folder, objects = tmp_path / "backup", tmp_path / "objects"
    for root, entries in ((folder, local), (objects, raw)):
        for key, data in entries.items():
            (root / key).parent.mkdir(parents=True, exist_ok=True)
            (root / key).write_bytes(data)
    other, url = copied(server, raw), copied(server, raw)
    damaged = [next(key for key in raw if re.search(pattern, key)) for pattern in (
        r"situations/.*parquet$", r"goals/.*receipt.json$", r"knowledge/v0001/(?!manifest)", r"policies/v0001/manifest")]
    store = machine(url)
    for backup in (folder, objects, other):
        for key in damaged:
            server.put(url, key, b"x")
        code, out, err = call("verify", "--data", url, "--restore-from", backup)
        assert code == 0, out + err
        assert f"{len(damaged)} restored, 0 problems" in out
        assert out.count(f": restored from {backup}") == len(damaged)
        assert all(line.startswith(f"{url}/") for line in out.splitlines() if ": restored from " in line)
        assert server.objects(url) == raw
    place = re.sub(r"(/v\d{4,}/)[0-9a-f]{12}\.", r"\1", damaged[2])
    for key in (place, damaged[0]):
        (folder / key).write_bytes(b"y")
    assert call("verify", "--data", folder, "--restore-from", other)[0] == 0
    assert files(folder) == local
    assert store.mirror is not None


def test_no_backup(server, machine, call, raw):
    """A backup that is not there is one line."""
    url = copied(server, raw)
    machine(url)
    code, out, err = call("verify", "--data", url, "--restore-from", f"{url}-backup")
    assert (code, out, err) == (
        1, "", f"pitchlore: {url}-backup: there is no data folder. Name a copy of the data folder.\n")


def test_memory(monkeypatch):
    """A bucket in memory is that of one process."""
    store = Store(Path("memory:///of-a-test"))
    receipt = store.commit(work(), made("one"))
    assert store.where == "memory:///of-a-test"
    assert Store(Path("memory:///of-a-test")).read(receipt, "note") == b"one"
    monkeypatch.setattr(os, "getpid", lambda: -1)
    mirrors._mirror.cache_clear()
    with pytest.raises(BadSettings, match=r"is that of one process\. Work on threads"):
        Store(store.root).read(receipt, "note")


def test_file_url(tmp_path):
    """A file's URL is a folder like any other."""
    store = Store(Path(f"file://{tmp_path}/league"))
    store.commit(work(), made("one"))
    assert store.mirror is None
    assert (tmp_path / "league" / "goals" / "m-1.receipt.json").exists()


# --- a network that fails ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def requests(server, recordings, tmp_path_factory) -> int:
    """The number of requests of a run from nothing."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {**server.environment, "XDG_CACHE_HOME": str(tmp_path_factory.mktemp("count"))}.items():
            patch.setenv(name, value)
        server.mend()
        brought(Store(Path(server.new())), recordings)
    return server.asked


def test_passing_faults(server, machine, recordings, local, monkeypatch):
    """Requests that fail once are sent again, those whose answer was lost, too."""
    monkeypatch.setattr(buckets, "REQUEST_S", 1.0)
    url = server.new()
    store = machine(url)
    server.fault = lambda number: FAULTS[number // 9 % 4] if number % 9 == 0 else None
    brought(store, recordings)
    assert server.asked > 9 * len(FAULTS)
    server.mend()
    assert plain(server.objects(url)) == local
    assert verify_all(machine(url, "two")).problems == []


@pytest.mark.parametrize("fault", FAULTS)
def test_outage(server, machine, recordings, local, requests, fault, monkeypatch):
    """An outage between any two requests is one line; nobody sees half an output; a run again ends it."""
    for step in range(ROUNDS):
        begins = 1 + (requests - 2) * (FAULTS.index(fault) + len(FAULTS) * step) // (len(FAULTS) * ROUNDS)
        url, name = server.new(), f"{step}"
        server.mend()
        server.fault = lambda number, begins=begins: fault if number >= begins else None
        with monkeypatch.context() as impatient:  # what follows may take its time
            impatient.setattr(buckets, "REQUEST_S", 0.3)
            impatient.setattr(buckets, "AGAIN_S", 0.2)
            store = machine(url, name)
            with pytest.raises(StorageFailed) as failed:
                brought(store, recordings)
        assert re.fullmatch(rf"{url}\S*: the bucket cannot be used \((it is too busy|it answers 500|"
                            r"it does not answer)\)\. Look at its address, .*", str(failed.value))
        server.mend()
        witness = machine(url, f"witness-{step}")
        assert [line for line in verify_all(witness).problems if "match is gone" not in line] == []
        store = machine(url, name)  # as the next command of the machine finds it
        mirrors._mirror.cache_clear()
        brought(store, recordings)
        assert plain(server.objects(url)) == local, begins
        assert verify_all(store).problems == []


def test_nobody_answers(machine, monkeypatch, call):
    """A bucket that nobody serves is one line within seconds; so is an unknown one, and one without a name."""
    monkeypatch.setattr(buckets, "AGAIN_S", 0.2)
    machine("s3://league/somewhere")
    said = call("kb", "list", "--data", "s3://no-such-bucket/x")
    assert said[:2] == (1, "")
    assert said[2].startswith("pitchlore: s3://no-such-bucket/x: the bucket cannot be used (there is no such bucket).")
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    buckets._opened.cache_clear()
    code, _, err = call("run", "--data", "s3://league/nowhere")
    assert code == 1
    assert err.startswith("pitchlore: s3://league/nowhere: the bucket cannot be used (it does not answer).")
    assert err.count("\n") == 1


@pytest.mark.parametrize("url", ["s3://key:secret@league/x", "s3://league/x?secret=1", "s3:///", "https://league/x",
                                 "s3://league/../x", "gs://league//x#y"])
def test_bad_url(call, url):
    """A URL with credentials or options, or none of a bucket, is refused, and not repeated."""
    code, _, err = call("kb", "list", "--data", url)
    assert code == 1
    assert err.startswith("pitchlore: --data: this URL is not that of a bucket's folder. Name ")
    assert "secret" not in err


@pytest.mark.parametrize("words", [
    ("import", "s3://league/derby.csv"), ("import", "https://host/derby.csv"),
    ("import", "derby.csv", "--map", "s3://league/map.toml"), ("run", "--settings", "gs://league/club.toml"),
    ("season", "--settings", "s3://league/short.toml"), ("record", "--settings", "s3://league/match.toml"),
    ("situations", "--plot", "s3://key:secret@league/terms.png"), ("notebooks", "s3://league/notebooks", "--no-open"),
    ("notebooks", "file:///tmp/notebooks", "--no-open"),
], ids=" ".join)
def test_url_of_a_file(call, tmp_path, monkeypatch, words):
    """Options that name files take no URLs: no folder named ``s3:`` appears, and no secret is repeated."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "derby.csv").write_text("t\n")
    code, _, err = call(*words, "--data", tmp_path / "league")
    assert code == 1
    assert "a URL is no path of this machine. Name a path; of buckets only the data folder and its inbox are read" in err
    assert "secret" not in err
    assert [path.name for path in tmp_path.iterdir() if path.name not in ("derby.csv", "league")] == []


def test_not_installed(call, monkeypatch):
    """Without the extra, one line says which."""
    buckets._opened.cache_clear()
    monkeypatch.setitem(sys.modules, "obstore.store", None)
    code, _, err = call("kb", "list", "--data", "s3://league/x")
    assert (code, err) == (
        1, "pitchlore: s3://league/x: buckets need the extra bucket. pip install 'pitchlore[bucket]'.\n")


@pytest.mark.parametrize("key", ["goals/../../../out.receipt.json", "goals//x.receipt.json"])
def test_key_that_is_no_path(server, machine, key, tmp_path):
    """An object that leads out of the folder, or nowhere, is named; nothing of it is written here."""
    url = server.new()
    machine(url).commit(work(), made("one"))
    server.put(url, key, b"{}")
    with pytest.raises(StorageFailed, match=r"it has an object .*receipt\.json, whose name is no path"):
        machine(url, "two").catch_up()
    assert not list(tmp_path.rglob("*x.receipt.json"))
    assert not list(tmp_path.rglob("*out.receipt.json"))


def test_keys_of_others(server, machine):
    """Objects of any other name, and what consoles put in for a folder, are in nobody's way."""
    url = server.new()
    receipt = machine(url).commit(work(), made("one"))
    for key in ("inbox/", "goals/", "goals", f"goals/{'n' * 300}.receipt.json", "goals/\u00fc ?#%.receipt.json",
                ".bucket.json", ".bucket.sqlite", "goals/.lock", "catalog.duckdb", "a/" * 200 + "x.receipt.json"):
        server.put(url, key, b"{}")
    store = machine(url, "two")
    store.catch_up()
    assert list(store.receipts("goals")) == [receipt]
    assert store.unreadable("goals") == {}
    assert store.read(receipt, "note") == b"one"
    assert inbox(store) == []


@pytest.mark.parametrize("full", ["os.replace", "pitchlore.pipeline.store.atomic.sync"])
def test_full_disk_of_the_copy(server, machine, monkeypatch, full):
    """If the copy's disk is full, one line says so, at any write; the bucket has the old or the new, whole."""
    url = server.new()
    store, really = machine(url), locate(full)
    store.commit(work(), made("before"))
    for after in range(2):
        left = [after]

        def refuse(*_: object, left=left, **__: object) -> None:
            left[0] -= 1
            if left[0] < 0:
                raise OSError(errno.ENOSPC, "No space left on device")
            really(*_, **__)

        with monkeypatch.context() as patch:
            patch.setattr(full, refuse)
            with pytest.raises(StorageFailed, match="No space left on device"):
                store.commit(work(version=2 + after), made(f"after {after}"))
        other = machine(url, f"other-{after}")
        other.catch_up()
        receipt = other.receipt("goals", "m-1")
        assert other.read(receipt, "note") in (b"before", b"after 0", b"after 1")
        store.catch_up()
        store.commit(work(version=2 + after), made(f"after {after}"))
        other.catch_up()
        assert other.read(other.receipt("goals", "m-1"), "note") == f"after {after}".encode()


# --- two machines -----------------------------------------------------------------------------------


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


def between(monkeypatch, mirror, method: str, happens: Callable[[], object]) -> None:
    """Let something happen before a mirror's next call of a method."""
    before = getattr(mirror, method)

    def call(*arguments, **named):
        monkeypatch.setattr(mirror, method, before)
        happens()
        return before(*arguments, **named)

    monkeypatch.setattr(mirror, method, call)


@pytest.mark.parametrize("moment", ["put_all", "swap"])
def test_same_work(two, monkeypatch, moment):
    """The loser of two that commit the same finds the work done."""
    one, other = two
    between(monkeypatch, one.mirror, moment, lambda: other.commit(work(), made("same")))
    assert one.commit(work(), made("same")) == other.receipt("goals", "m-1")
    assert one.receipt("goals", "m-1") == other.receipt("goals", "m-1")


@pytest.mark.parametrize("before", [False, True])
@pytest.mark.parametrize("moment", ["put_all", "swap"])
def test_other_work(two, monkeypatch, moment, before, server):
    """The loser of two that commit something else says so; what the winner wrote is whole, for both."""
    one, other = two
    if before:
        other.commit(work(), made("before"))
        one.catch_up()
    between(monkeypatch, one.mirror, moment, lambda: other.commit(work(version=3), made("theirs")))
    with pytest.raises(Overtaken, match=r"goals/m-1.receipt.json: has been written or removed by another machine"):
        one.commit(work(version=2), made("ours"))
    for store in (one, other):
        assert store.read(store.receipt("goals", "m-1"), "note") == b"theirs"
    assert one.commit(work(version=2), made("ours")).key == work(version=2).key
    assert server.asked > 0


def test_forgotten_meanwhile(two, monkeypatch):
    """An output is not made from what another machine has removed."""
    one, other = two
    source = other.commit(work("matches"), made("log"))
    one.catch_up()
    other.forget("matches", "m-1")
    with pytest.raises(NotFound, match="matches m-1 has been removed meanwhile"):
        one.commit(work(), made("of it"), [source])
    one.catch_up()
    assert one.receipt("matches", "m-1") is None


def test_few_requests(two, server):
    """A stage made from many outputs asks for all of them at once; `prune` lists each folder once."""
    one, other = two
    sources = [other.commit(work("matches", f"m-{number}"), made("log")) for number in range(9)]
    one.catch_up()
    server.asked = 0
    one.commit(work("behaviours", "all"), made("of all"), sources)
    assert server.asked == 3
    other.forget("matches", "m-5")
    with pytest.raises(NotFound, match="matches m-5 has been removed meanwhile"):
        one.commit(work("behaviours", "all", 2), made("of all"), sources)
    one.prune("matches")
    server.asked = 0
    assert [one.prune(noun) for noun in ("matches", "behaviours", "goals")] == [[], [], []]
    assert server.asked == 3


def test_removed_blob(two):
    """A file that another machine's `forget` took is written again with the next receipt."""
    one, other = two
    one.commit(work(), made("same"))
    other.catch_up()
    other.forget("goals", "m-1")
    one.catch_up()
    receipt = one.commit(work(), made("same"))
    other.catch_up()
    assert other.read(receipt, "note") == b"same"


class Note(Frozen):
    """Settings of a stage whose versions hold a text."""

    text: str


def noted(before: Callable[[str], object] = lambda _: None) -> Stage:
    """A stage whose versions hold the text of their settings and their number; something happens before each."""
    def plan(store: Store, _: Scope, settings: Note, __: Stage) -> Plan:
        versions = store.manifests("knowledge")
        standing = next((each for each in versions if each.details["text"] == settings.text), None)
        return Plan({}, {}, versions[-1].version if versions else None, standing)

    def compute(inputs: Inputs, settings: Note) -> Made:
        before(settings.text)
        text = settings.text
        return Made(blobs={"note": ("txt", f"{text} {inputs.version}".encode())}, details={"text": text})

    return Stage("knowledge", Per.VERSION, plan=plan, compute=compute)


def emit_at_once(stores: list[Store], stage: Stage) -> list[tuple[Manifest, bool]]:
    """Versions of emitters at once, each of its own text; an emitter whose bucket fails runs again."""
    def run(number: int) -> tuple[Manifest, bool]:
        for _ in range(20):
            with suppress(StorageFailed):
                return emit(stores[number], stage, Note(text=f"note-{number}"), EVERYTHING)
        raise AssertionError

    with ThreadPoolExecutor(len(stores)) as pool:
        return list(pool.map(run, range(len(stores))))


def all_landed(stores: list[Store]) -> None:
    """Check that each emitter's text is in one version, whole, and that each version follows the one before."""
    for store in stores:
        store.catch_up()
        manifests = store.manifests("knowledge")
        assert [each.version for each in manifests] == list(range(1, len(stores) + 1))
        assert [each.parent for each in manifests] == [None, *range(1, len(stores))]
        assert sorted(each.details["text"] for each in manifests) == [f"note-{n}" for n in range(len(stores))]
        for each in manifests:
            assert store.read(each, "note") == f"{each.details['text']} {each.version}".encode()
        assert verify_all(store).problems == []


def test_versions_at_once(two):
    """Two machines that make the same number both land: who is second makes the next one, from the first."""
    both = threading.Barrier(2)
    first = {"note-0", "note-1"}

    def meet(text: str) -> None:
        if text in first:
            first.discard(text)
            both.wait(30)

    made_by = emit_at_once(two, noted(meet))
    assert sorted((manifest.version, new) for manifest, new in made_by) == [(1, True), (2, True)]
    all_landed(two)


@pytest.mark.parametrize("fault", FAULTS)
def test_versions_in_faults(server, machine, fault, monkeypatch):
    """Four machines at once, and a network that fails now and then: all land, none is lost or mixed."""
    monkeypatch.setattr(buckets, "REQUEST_S", 1.0)
    for step in range(ROUNDS):
        server.mend()
        url = server.new()
        stores = [machine(url, f"{step}-{number}") for number in range(4)]
        buckets._opened.cache_clear()
        server.fault = lambda number, step=step: fault if (number + step) % 7 == 0 else None
        landed = emit_at_once(stores, noted())
        assert sorted(manifest.version for manifest, _ in landed) == [1, 2, 3, 4]
        server.mend()
        all_landed(stores)


def test_same_version(two):
    """Two machines that make the same version at once have one version."""
    both = threading.Barrier(2)
    stage = noted(lambda _: both.wait(30))
    with ThreadPoolExecutor(2) as pool:
        numbers = [manifest.version for manifest, _ in pool.map(
            lambda store: emit(store, stage, Note(text="same"), EVERYTHING), two)]
    assert numbers == [1, 1]
    two[0].catch_up()
    assert [manifest.version for manifest in two[0].manifests("knowledge")] == [1]


@pytest.mark.parametrize("fault", ["cut before", "cut after"])
def test_lost_answer(two, server, monkeypatch, fault):
    """A maker whose manifest gets no answer says so, whether it landed or not; made again, it stands once."""
    one, other = two
    monkeypatch.setattr(buckets, "AGAIN_S", 0.2)
    buckets._opened.cache_clear()
    one.mirror.bucket = buckets.Bucket(one.mirror.url)

    def fail() -> None:
        server.fault = lambda _: fault

    between(monkeypatch, one.mirror, "create", fail)
    with pytest.raises(StorageFailed, match="it does not answer"):
        emit(one, noted(), Note(text="ours"), EVERYTHING)
    server.mend()
    landed = fault == "cut after"
    assert emit(other, noted(), Note(text="theirs"), EVERYTHING)[0].version == 1 + landed
    again, new = emit(one, noted(), Note(text="ours"), EVERYTHING)
    assert (again.version, new) == ((1, False) if landed else (2, True))
    assert [manifest.details["text"] for manifest in one.manifests("knowledge")] == (
        ["ours", "theirs"] if landed else ["theirs", "ours"])
    assert verify_all(one).problems == []


def test_no_version_is_taken(two, monkeypatch):
    """A bucket that neither has a version nor takes it is an error, and no endless loop."""
    tried = []
    monkeypatch.setattr(two[0].mirror, "create", lambda *_, **__: False)
    with pytest.raises(Overtaken, match="has been made by another machine meanwhile"):
        emit(two[0], noted(tried.append), Note(text="ours"), EVERYTHING)
    assert tried == ["ours", "ours"]


def test_number_of_the_dead(two, server):
    """A maker that ends before its version leaves nothing that others wait for, and its number is free."""
    with pytest.raises(RuntimeError), two[0].claim("knowledge") as version:
        raise RuntimeError
    assert server.objects(two[0].mirror.url) == {}
    begun = time.monotonic()
    assert emit(two[1], noted(), Note(text="theirs"), EVERYTHING)[0].version == version == 1
    assert time.monotonic() - begun < 1


def lost_race(store: Store, text: str) -> None:
    """Leftovers of a maker whose process ends before its manifest."""
    with pytest.MonkeyPatch.context() as patch, store.claim("knowledge") as version:
        patch.setattr(store.mirror, "create", lambda *_, **__: (_ for _ in ()).throw(RuntimeError))
        with pytest.raises(RuntimeError):
            store.commit_version(work("knowledge"), made(text), version, parent=None)


def test_prune_versions(two, server):
    """`prune` removes files of makers that were overtaken, and none of a version that may still be made."""
    one, other = two
    url = one.mirror.url
    lost_race(one, "loser of version 1")
    assert one.prune_versions() == [], "somebody may be making version 1"
    with other.claim("knowledge") as version:
        other.commit_version(work("knowledge"), made("kept"), version, parent=None)
    lost_race(one, "never version 2")
    whole = server.objects(url)
    assert len(whole) == 4
    (left,) = one.prune_versions()
    assert whole.pop(left.relative_to(one.mirror.folder).as_posix()) == b"loser of version 1"
    assert server.objects(url) == whole
    assert one.prune_versions() == []
    with other.claim("knowledge") as version:
        other.commit_version(work("knowledge", version=2), made("never version 2"), version, parent=1)
    one.catch_up()
    assert one.prune_versions() == [], "its maker's files are those of the version"
    for store in two:
        assert verify_all(store).problems == []
        assert store.read(store.manifest("knowledge", 1), "note") == b"kept"


def test_prune_unreadable_manifest(two, server):
    """Files of a version whose manifest cannot be read, or is lost, stay: what cannot be read is not absent."""
    one, other = two
    url = one.mirror.url
    for version in (1, 2):
        with one.claim("knowledge") as number:
            one.commit_version(work("knowledge", version=version), made(f"{version}"), number, parent=None)
    server.put(url, "knowledge/v0001/manifest.json", b"{}")
    one.mirror.bucket.delete("knowledge/v0002/manifest.json")
    other.catch_up()
    before = server.objects(url)
    assert other.prune_versions() == []
    assert server.objects(url) == before


def test_google(machine, tmp_path, monkeypatch):
    """Google's conditions are on generations: of two machines that write the same object, one does."""
    with google() as address:
        account = {"gcs_base_url": address, "disable_oauth": True, "client_email": "", "private_key": "",
                   "private_key_id": ""}
        (tmp_path / "account.json").write_text(json.dumps(account))
        monkeypatch.setenv("GOOGLE_SERVICE_ACCOUNT", str(tmp_path / "account.json"))
        one, other = (machine("gs://league/google", name) for name in ("one", "two"))
        other.commit(work(), made("first"))
        with pytest.raises(Overtaken):
            one.commit(work(version=2), made("ours"))
        one.commit(work(version=2), made("ours"))
        with pytest.raises(Overtaken):
            other.commit(work(version=3), made("theirs"))
        for store in (one, other):
            assert store.read(store.receipt("goals", "m-1"), "note") == b"ours"
        with one.claim("knowledge") as version:
            one.commit_version(work("knowledge"), made("known"), version, parent=None)
        with other.claim("knowledge") as version:
            assert version == 2
        other.catch_up()
        assert other.read(other.manifest("knowledge", 1), "note") == b"known"


def test_slow_maker(two):
    """A maker that is overtaken finds out when it commits; the version of the other is whole."""
    one, other = two
    with one.claim("knowledge") as version:
        with other.claim("knowledge") as same:
            assert same == version == 1
            other.commit_version(work("knowledge"), made("theirs"), same, parent=None)
        with pytest.raises(Overtaken, match="has been made by another machine meanwhile"):
            one.commit_version(work("knowledge", version=2), made("ours"), version, parent=None)
    for store in two:
        store.catch_up()
        assert store.read(store.manifest("knowledge", 1), "note") == b"theirs"
        assert verify_all(store).problems == []


@contextmanager
def processes(server: Served, tmp_path: Path, names: tuple[str, ...]) -> Iterator[list[subprocess.Popen[str]]]:
    """Processes that do what they are told, each with a home of its own."""
    started = []
    for name in names:
        home = tmp_path / name
        home.mkdir(exist_ok=True)
        here = {**os.environ, **server.environment, "HOME": str(home), "XDG_CACHE_HOME": str(home / "cache"),
                "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests"), *sys.path])}
        started.append(subprocess.Popen([sys.executable, "-m", "support.at_once"], env=here, text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE))
    try:
        yield started
    finally:
        for process in started:
            process.kill()
            process.communicate()


def tell(process: subprocess.Popen[str], action: str, url: str) -> None:
    process.stdin.write(f"0 {action} {url}\n")
    process.stdin.flush()


def test_two_processes(server, machine, recordings, local, tmp_path):
    """Two machines that run at once end in the bytes of one; one that is killed leaves nothing half done."""
    names = ("ada", "bea")
    with processes(server, tmp_path, names) as both:
        assert [process.stdout.readline() for process in both] == ["ready\n"] * 2
        for _ in range(ROUNDS):
            url = server.new()
            import_recording(machine(url, "importer"), Recording(file=recordings / "derby.csv"))
            for process in both:
                tell(process, "run", url)
            said = [process.stdout.readline().strip() for process in both]
            assert "True True" in said
            assert all(line in ("True True", "False False", "True False", "False True") or "Run again" in line
                       for line in said), said
            store = machine(url, "after")
            store.catch_up()
            at_once.run(store)
            assert plain(server.objects(url)) == local
        url = server.new()
        import_recording(machine(url, "importer"), Recording(file=recordings / "derby.csv"))
        tell(both[0], "run", url)
        eventually(lambda: any(key.startswith("situations") for key in server.objects(url)))
        both[0].send_signal(signal.SIGKILL)
        both[0].wait()
    witness = machine(url, "witness")
    assert verify_all(witness).problems == []
    at_once.run(witness)
    assert plain(server.objects(url)) == local


# --- commands ---------------------------------------------------------------------------------------


@pytest.mark.usefixtures("prefect_server")
def test_commands(server, machine, call, monkeypatch, caplog, tmp_path):
    """The commands work on a bucket as on a folder; no credentials are anywhere, and nothing else in it."""
    url = server.new()
    store = machine(url)
    caplog.set_level(logging.DEBUG)
    buffer = io.StringIO()
    clip(60.0, 75.0).write_csv(buffer)
    server.put(url, "inbox/derby.csv", buffer.getvalue().encode())
    server.put(url, "inbox/notes.txt", b"dear diary")
    said = [call("run", "--data", url)]
    assert said[0][0] == 1, "there is a stranger in the inbox"
    assert call("quarantine", "--clear", "--data", url)[0] == 0
    said += [
        call("record", "--home", "static", "--away", "random", "--minutes", "0.1", "--data", url),
        call("run", "--on", "processes:2", "--data", url, "--no-train"),
        call("sql", "select count(*) n from matches", "--csv", "--data", url),
        call("kb", "list", "--data", url), call("replay", "derby", "--data", url),
        call("commentary", "derby", "--data", url), call("forget", "derby", "--data", url),
        call("sql", "select count(*) n from matches", "--csv", "--data", url),
        call("prune", "--data", url), call("verify", "--data", url), call("runs", "--data", url),
    ]
    codes = [code for code, _, _ in said]
    assert said[3][1] == "n\n2\n"
    assert re.search(rf"{url}: as of \d{{4}}-\d\d-\d\d \d\d:\d\d:\d\d", said[3][2])
    assert said[8][1] == "n\n1\n"
    assert codes[:2] == [1, 0], said
    assert f"knowledge version 1 (new): {url}/knowledge/v0001" in said[0][1]
    objects = server.objects(url)
    assert any(key.startswith("replays/") for key in objects)
    assert {key.partition("/")[0] for key in objects} <= {
        *STAGES, "matches", "inbox", "replays", "quarantine", "runs"}, "neither locks nor the catalogue"

    def down(_: int) -> str:
        return "cut before"

    monkeypatch.setattr(buckets, "AGAIN_S", 0.2)
    buckets._opened.cache_clear()
    mirrors._mirror.cache_clear()
    server.fault = down
    code, out, err = call("sql", "select count(*) n from matches", "--csv", "--data", url)
    assert (code, out) == (0, "n\n1\n"), err
    assert "the bucket cannot be used (it does not answer)" in err
    assert "What follows is of the copy here." in err

    everything = [repr(store), repr(store.mirror), repr(store.mirror.bucket), caplog.text, err,
                  *(text for _, *texts in said for text in texts)]
    everything += [data.decode(errors="replace") for data in objects.values()]
    everything += [path.read_bytes().decode(errors="replace") for path in store.root.rglob("*") if path.is_file()]
    for secret in CREDENTIALS.values():
        assert [text[:200] for text in everything if secret in text] == []


def test_refused(server, machine, monkeypatch):
    """A bucket that refuses says so, without what it or the environment says of the credentials."""
    store = machine(server.new())
    from obstore.exceptions import PermissionDeniedError

    monkeypatch.setattr("obstore.put", lambda *_, **__: (_ for _ in ()).throw(
        PermissionDeniedError(f"status code: 403 {CREDENTIALS}")))
    with pytest.raises(StorageFailed) as refused:
        store.commit(work(), made("one"))
    assert "it refuses these credentials" in str(refused.value)
    assert refused.value.__cause__ is None
    assert refused.value.__context__ is None
