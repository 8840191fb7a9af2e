"""A data folder in a bucket: the bytes of a local one, and the same commands."""

from __future__ import annotations

import io
import logging
import os
import re
import shutil
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from conftest import clip
from support import at_once
from support.buckets import CREDENTIALS, NAME, Served, files
from support.notebooks import NOTEBOOKS, read

pytest.importorskip("obstore", reason="the extra bucket is not installed")

from support.bucket_stores import brought, made, plain, work
from test_unreadable import DAMAGED

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine.catalog import check_files, distrust, refresh
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.store import Store, buckets, mirrors
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.store.sealed import read_anew

pytest_plugins = ["support.bucket_fixtures"]

pytestmark = pytest.mark.slow


# --- one machine ------------------------------------------------------------------------------------


def copied(server: Served, objects: dict[str, bytes]) -> str:
    """The URL of a bucket's folder with these objects."""
    url = server.new()
    for key, data in objects.items():
        server.put(url, key, data)
    return url


@pytest.fixture(scope="module")
def raw(server, recordings, local, tmp_path_factory) -> dict[str, bytes]:
    """The objects of a bucket after a run."""
    with pytest.MonkeyPatch.context() as patch:
        home = tmp_path_factory.mktemp("raw")
        for name, value in {**server.environment, "XDG_CACHE_HOME": str(home)}.items():
            patch.setenv(name, value)
        store = Store(Path(url := server.new()))
        brought(store, recordings)
    assert files(store.root) == local, "its copy, too"
    return server.objects(url)


def test_same_bytes(server, machine, raw, local):
    """A bucket holds the bytes of a local folder; so does its copy; another machine finds it all done."""
    assert plain(raw) == local
    url = copied(server, raw)
    two = machine(url, "two")
    two.catch_up()
    server.asked = 0
    assert at_once.run(two) == "False False"
    assert server.asked <= len(local), "what is done is known without reading it"
    assert plain(server.objects(url)) == local
    found = verify_all(two)
    assert (found.problems, found.files) == ([], len(local))
    assert files(two.root) == local


def test_another_library(server, machine, local):
    """A copy by another program into a bucket, file by file, is a data folder; and back."""
    url = server.new()
    for key, data in local.items():
        server.client.put_object(Bucket=NAME, Key=f"{url.removeprefix(f's3://{NAME}/')}/{key}", Body=data)
    store = machine(url)
    store.catch_up()
    assert at_once.run(store) == "False False"
    assert verify_all(store).problems == []


def test_sql(server, machine, raw):
    """Questions are answered from the files that a copy fetches, and without the bucket from those it has."""
    reader = machine(copied(server, raw), "reader")
    reader.catch_up()
    path, _ = refresh(reader)
    question = "select count(*) n, count(distinct match_id) from situations"
    answer = ask(path, question).rows()
    assert answer[0][0] > 100
    server.fault = lambda _: "cut before"
    path, left_out = refresh(reader)
    assert (ask(path, question).rows(), left_out) == (answer, [])


def test_lost_copy(server, machine, raw, local):
    """The copy is a cache: damaged or removed, it is brought again."""
    url = copied(server, raw)
    store = machine(url)
    store.catch_up()
    assert verify_all(store).problems == []
    for path in store.root.rglob("*.parquet"):
        path.write_bytes(b"x" * path.stat().st_size)
    (receipt,) = store.receipts("situations")
    assert store.read(receipt, "situations") == local[receipt.files["situations"].path]
    shutil.rmtree(store.root)
    again = machine(url, "again")
    again.catch_up()
    assert at_once.run(again) == "False False"
    assert verify_all(again).problems == []


def test_damaged_object(server, machine, raw, local):
    """`verify` names an object that is not what was written, and the next run makes it anew."""
    url = copied(server, raw)
    store = machine(url)
    store.catch_up()
    (receipt,) = store.receipts("situations")
    path = receipt.files["situations"].path
    server.put(url, path, b"x" * receipt.files["situations"].size)
    (problem,) = verify_all(store).problems
    assert problem.startswith(f"{url}/{path}: is lost or damaged in the bucket. ")
    distrust(store)  # as the command does
    store.catch_up()
    check_files(store)
    at_once.run(store)
    assert plain(server.objects(url)) == local
    assert verify_all(store).problems == []


def test_damaged_copy(server, machine):
    """A receipt that is damaged in the copy, and not in the bucket, is brought anew: nothing is made without its match."""
    store = machine(server.new())
    receipts = [store.commit(work(name=name), made(name)) for name in ("m-1", "m-2")]
    DAMAGED["flipped"](store.root / "goals" / "m-1.receipt.json")
    read_anew()
    assert list(store.receipts("goals")) == receipts


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


def test_notebook(server, machine, local, monkeypatch, caplog):
    """A notebook opens a bucket by its URL: it builds the catalogue, and says once of when it is."""
    url = copied(server, local)
    machine(url, "reader")
    path = next(path for path in NOTEBOOKS if path.stem == "1-a-match")
    monkeypatch.setenv("PITCHLORE_DATA", url)
    names: dict[str, Any] = {}
    with pl.Config():
        for cell in read(path).cells:
            if cell.cell_type == "code":
                exec(cell.source, names)
    assert len(re.findall(rf"{url}: as of \d{{4}}-\d\d-\d\d", caplog.text)) == 1
    assert "derby" in str(names["league"].matches.frame)


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


# --- commands ---------------------------------------------------------------------------------------


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
