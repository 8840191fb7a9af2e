"""A bucket whose network, names or disk fail: one line, and nothing half done."""

from __future__ import annotations

import errno
import re
import sys
import time
from contextlib import nullcontext, suppress
from pathlib import Path
from pydoc import locate

import pytest
from support.buckets import CREDENTIALS, FAULTS

pytest.importorskip("obstore", reason="the extra bucket is not installed")

from support.bucket_stores import ROUNDS, brought, made, plain, work
from test_faults import room
from test_unreadable import DAMAGED, REFUSED

from pitchlore.pipeline.base.errors import BucketFailed, PitchloreError, StorageFailed
from pitchlore.pipeline.engine.recordings import inbox
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.store import Store, buckets, mirrors
from pitchlore.pipeline.store.mirrors import INDEX, MARKER

pytest_plugins = ["support.bucket_fixtures"]

pytestmark = pytest.mark.slow


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
    monkeypatch.setattr(buckets, "REQUEST_S", 0.5)
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


@pytest.mark.parametrize("fault", ["412", "200"])
def test_another_answers(server, machine, fault):
    """An answer in the bucket's place, as a proxy's page, is said without its words; a copy loses nothing by it."""
    url = server.new()
    stores = [machine(url, name) for name in ("one", "two")]
    receipt = stores[0].commit(work(), made("one"))
    stores[0].catch_up()
    server.mend()
    server.fault = lambda number: fault if fault == "200" or number > 1 else None  # the second machine gets a listing
    with pytest.raises(BucketFailed, match=f"{url}.*(its listing lacks|it answers 412)"):
        stores[fault == "412"].catch_up()
    server.mend()
    for store in stores:
        store.catch_up()
        assert list(store.receipts("goals")) == [receipt]


def test_nobody_answers(machine, monkeypatch, call):
    """A bucket that nobody serves is one line within seconds; so is an unknown one, and one whose plain http is forbidden."""
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
    monkeypatch.setenv("AWS_ALLOW_HTTP", "false")
    assert "its address is plain http, which AWS_ALLOW_HTTP forbids" in call("run", "--data", "s3://league/other")[2]


@pytest.mark.parametrize("address", ["http://me:secret@[bad", "me:secret", "http://me:secret@h:99999", "https://me:secret @h", "ftp://secret"])
def test_bad_address(machine, monkeypatch, call, address):
    """An address in the environment that is none is one line, which does not repeat it; the library panics at it."""
    machine("s3://league/somewhere")
    monkeypatch.setenv("AWS_ENDPOINT_URL", address)
    buckets._opened.cache_clear()
    code, out, err = call("runs", "--data", "s3://league/address")
    assert (code, out, err) == (1, "", "pitchlore: AWS_ENDPOINT_URL: is no address. Set it to https://HOST or https://HOST:PORT.\n")


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
        1, "pitchlore: s3://league/x: buckets need the extra bucket. Install the extra pitchlore[bucket].\n")


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
    assert store.unreadable_receipts("goals") == {}
    assert store.read(receipt, "note") == b"one"
    assert inbox(store) == []


@pytest.mark.parametrize(("name", "kind"), [
    *((MARKER, kind) for kind in REFUSED), *((name, kind) for name in (MARKER, INDEX) for kind in ("flipped", "folder", "pipe"))])
def test_unreadable_marker(server, machine, kind, name):
    """A copy whose marker cannot be read is no plain folder: what is written into it would never reach the bucket. Nor is the index new."""
    root = machine(server.new()).root
    (root / INDEX).write_bytes(b"no index")
    spoilt = REFUSED[kind][0](root / name) if kind in REFUSED else nullcontext(DAMAGED[kind](root / name))
    with spoilt, pytest.raises(PitchloreError, match=r"it is a cache|Let this user read it|Mend the disk|a cache, then"):
        Store(root).commit(work(), made("one"))
    assert not list(root.rglob("*receipt*"))


@pytest.mark.parametrize("full", ["os.replace", "pitchlore.pipeline.store.atomic.sync_file"])
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


@pytest.mark.parametrize("always", [False, True])
@pytest.mark.parametrize("page", [1, 2, 3])
def test_a_page_of_a_listing_that_is_none(machine, server, monkeypatch, page, always):
    """A gateway's page in a listing of several hides no object, and `prune` removes nothing that a receipt names.

    If each further page is a gateway's, the listing goes on from its last key, or is refused.
    """
    url = server.new()
    one, other, third = machine(url), machine(url), machine(url)
    names = [f"m-{number}" for number in range(9)]
    for name in names:
        one.commit(work(name=name), made(name))
    asked, pages = server.ask, []

    def ask(method, path, body, headers):
        if "list-type=2" not in path:
            return asked(method, path, body, headers)
        pages.append(path)
        answer, data = asked(method, f"{path}&max-keys=5", body, headers)
        wrong = len(pages) == page or (always and page > 1 and "continuation-token" in path)
        return answer, b"<html>Log in first</html>" if wrong else data

    with monkeypatch.context() as patch:
        patch.setattr(server, "ask", ask)
        patch.setattr(mirrors.Mirror, "now", lambda _: time.time() + 3 * 86_400)
        for read in (lambda: sorted(other.catch_up() or other.names("goals")) == names, lambda: not third.prune("goals")):
            pages.clear()
            with suppress(BucketFailed) if always else nullcontext():
                assert read()
    other.catch_up()
    assert [other.read(other.receipt("goals", name), "note") for name in names] == [name.encode() for name in names]


def test_full_disk_of_the_index(machine, server):
    """If the disk is full for the index of the copy, one line says so, and a run again goes on."""
    store = machine(server.new())
    assert store.mirror is not None
    index = store.mirror._index._database
    (pages,) = index.execute("pragma page_count").fetchone()
    index.execute(f"pragma max_page_count = {pages}")

    def fill() -> None:
        for number in range(200):
            store.commit(work(name=f"m-{number}"), made("one"))

    with pytest.raises(StorageFailed, match=r"index\S*: cannot be written \(database or disk is full\)\. Free space"):
        fill()
    index.execute("pragma max_page_count = 100000")
    index.execute("pragma wal_checkpoint(truncate)")
    with room(0), pytest.raises(StorageFailed, match=r"index\S*: cannot be written \(.*\)\. Free space"):
        store.mirror.sync()  # its first word to the index is one whose rows end it
    store.commit(work(), made("two"))
    assert store.read(store.receipt("goals", "m-1"), "note") == b"two"


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
