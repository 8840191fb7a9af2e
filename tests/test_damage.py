"""Damage is seen, and mended: what stages make by `run`, the rest from a backup."""

from __future__ import annotations

import json
import os
import random
import shutil
from pathlib import Path

import pytest
from conftest import run
from support.idle import nothing_new
from support.receipts import put_receipt, receipt_at

from pitchlore.pipeline.base.errors import CorruptFile
from pitchlore.pipeline.engine.catalog import forget_match, refresh
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.sealed import read_model
from pitchlore.pipeline.store.verification import verify


@pytest.fixture
def data(tmp_path, finished) -> Path:
    """A finished data folder of one's own, without its inbox."""
    folder = shutil.copytree(finished, tmp_path / "data")
    shutil.rmtree(folder / "inbox")
    refresh(Store(folder))
    return folder


def outputs(folder: Path) -> dict[str, bytes]:
    """The bytes of all outputs, receipts and versions."""
    nouns = [*STAGES.of_matches, *STAGES.versioned]
    return {str(path.relative_to(folder)): path.read_bytes() for noun in nouns
            for path in (folder / noun).rglob("*") if path.is_file() and not path.name.startswith(".")}


def flip(path: Path, rng: random.Random) -> None:
    """Flip one bit. The file is as long as before; its time is later, as on a real disk."""
    data, before = bytearray(path.read_bytes()), path.stat().st_mtime_ns
    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    path.write_bytes(data)
    os.utime(path, ns=(before + 10**9, before + 10**9))


def test_every_output_is_mended(data):
    """A flipped bit in every file of every stage: the next run makes all of them again, with the same bytes."""
    store, rng, whole = Store(data), random.Random(1), outputs(data)
    for noun in STAGES.nouns():
        if noun in STAGES.of_matches and noun != "matches":
            for receipt in store.receipts(noun):
                for record in receipt.files.values():
                    flip(data / record.path, rng)
    assert nothing_new(store, Settings()) is None
    assert run(data).failures == {}
    assert outputs(data) == whole
    assert nothing_new(store, Settings()) is not None


def test_sql_and_run(data, call):
    """`sql` says what to do about damaged files of stages, and it helps: `run` mends them in its next run."""
    store, rng, receipts = Store(data), random.Random(2), []
    for noun in ("situations", "behaviours", "decisions"):
        receipts.append(next(iter(store.receipts(noun))))
        path = data / next(iter(receipts[-1].files.values())).path
        flip(path, rng)
        code, _, err = call("sql", "select 1", "--data", data)
        (line,) = (line for line in err.splitlines() if str(path) in line)
        assert (code, "Run `pitchlore run` to make it anew" in line) == (3, True)
    assert call("run", "--data", data)[0] == 0
    assert call("sql", "select 1", "--data", data)[2] == ""
    assert all(map(store.intact, receipts))


def test_match_with_a_whole_log(data):
    """Damaged tables of a match are made again from its log."""
    store, whole, rng = Store(data), outputs(data), random.Random(3)
    for receipt in store.receipts("matches"):
        for role, record in receipt.files.items():
            if role != "log":
                flip(data / record.path, rng)
    assert nothing_new(store, Settings()) is not None
    assert outputs(data) == whole


def test_what_needs_a_backup(data, tmp_path, call):
    """Files that no stage can make again are named by `run`, `sql` and `verify`, and restored from a backup."""
    backup = shutil.copytree(data, tmp_path / "backup")
    store, whole = Store(data), outputs(data)
    paths = [data / next(iter(store.receipts("matches"))).files["log"].path]
    paths += [next(store.version_folder(noun, 1).glob("*.parquet")) for noun in STAGES.versioned]
    for path in paths:
        flip(path, random.Random(4))
    for words in (("run",), ("verify",)):
        code, out, _ = call(*words, "--data", data)
        for path in paths:
            (line,) = (line for line in out.splitlines() if str(path) in line)
            assert (code, "--restore-from" in line) == (1, True), words
    err = call("sql", "select 1", "--data", data)[2]
    assert all(str(path) in err for path in paths)
    assert call("verify", "--restore-from", backup, "--data", data)[0] == 0
    assert call("run", "--data", data)[0] == 0
    assert outputs(data) == whole


def test_kb_verify_restores(data, tmp_path, call):
    """`kb verify` restores versions of the knowledge, and touches nothing else."""
    backup = shutil.copytree(data, tmp_path / "backup")
    store = Store(data)
    paths = [store.version_folder("knowledge", 1) / "manifest.json", *store.version_folder("knowledge", 1).glob("*.parquet")]
    other = data / next(iter(store.receipts("sequences"))).files["sequences"].path
    for path in (*paths, other):
        flip(path, random.Random(5))
    harmed = other.read_bytes()
    assert call("kb", "verify", "--data", data)[0] == 1
    assert call("kb", "verify", "1", "--restore-from", backup, "--data", data)[0] == 0
    assert other.read_bytes() == harmed
    code, out, _ = call("verify", "--json", "--data", data)
    assert (code, len(json.loads(out)["problems"])) == (1, 1)


def test_nothing_comes_from_a_damaged_backup(data, tmp_path, call):
    """Damage that the backup has, too, is not restored, nor is another output's receipt; no pipe or device is read."""
    backup, store = shutil.copytree(data, tmp_path / "backup"), Store(data)
    log = next(iter(store.receipts("matches"))).files["log"].path
    for folder in (data, backup):
        flip(folder / log, random.Random(6))
    first, second = (receipt.files["goals"].path for receipt in store.receipts("goals"))
    for path in (first, second):
        flip(data / path, random.Random(8))
        (backup / path).unlink()
    os.mkfifo(backup / first)
    (backup / second).symlink_to("/dev/zero")
    one, other = (f"situations/{receipt.name}.receipt.json" for receipt in store.receipts("situations"))
    (data / one).write_text("damaged")
    (backup / one).write_bytes((data / other).read_bytes())
    code, out, _ = call("verify", "--restore-from", backup, "--data", data)
    assert (code, "0 restored, 4 problems" in out, (data / one).read_text()) == (1, True, "damaged")
    code, _, err = call("verify", "--restore-from", tmp_path / "none", "--data", data)
    assert (code, "Name a copy of the data folder" in err) == (1, True)


def test_every_flip_in_a_receipt_is_seen(data):
    """Every bit of a receipt counts: no flip goes unseen."""
    path = next((data / "sides").glob("*.receipt.json"))
    whole = path.read_bytes()
    for at in range(0, 8 * len(whole), 5):
        harmed = bytearray(whole)
        harmed[at // 8] ^= 1 << at % 8
        path.write_bytes(harmed)
        with pytest.raises(CorruptFile):
            read_model(str(path), Receipt)


def test_flips_in_receipts_are_verified(data):
    """`verify` names a receipt or manifest with a flipped bit."""
    store, rng = Store(data), random.Random(7)
    for noun in STAGES.nouns():
        versioned = noun in STAGES.versioned
        receipts = sorted((data / noun).glob("*.receipt.json"))
        paths = [store.version_folder(noun, 1) / "manifest.json"] if versioned else receipts
        for path in paths:
            whole = path.read_bytes()
            for _ in range(5):
                flip(path, rng)
                found = verify(store, *(((), [(noun, 1)]) if versioned else ([noun], ())))
                assert any(str(path) in line for line in found.problems)
                path.write_bytes(whole)


def test_silent_damage(data, call):
    """Bytes that changed under an unchanged time are `verify`'s to find; then `run` mends them."""
    store = Store(data)
    path = data / next(iter(store.receipts("situations"))).files["situations"].path
    before = path.stat()
    flip(path, random.Random(8))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert refresh(store)[1] == []
    assert call("run", "--data", data)[0] == 0  # it does not see it either
    code, out, _ = call("verify", "--data", data)
    assert (code, str(path) in out) == (1, True)
    assert call("run", "--data", data)[0] == 0
    assert call("verify", "--data", data)[0] == 0


def silently(path: Path) -> None:
    """Flip a bit where its reader would not see it: neither size nor time tell."""
    before = path.stat()
    flip(path, random.Random(8))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


@pytest.mark.parametrize(("noun", "table", "readers"), [
    ("knowledge", "behaviours", (("kb", "show"), ("kb", "diff", "1", "1"), ("kb", "verify"))),
    ("knowledge", "occasions", (("train",), ("kb", "verify"))),
    ("policies", "states", (("policy", "show"), ("verify",))),
    ("policies", "policies", (("record", "--home", "learned", "--minutes", "0.01"), ("evaluate", "--matches", "2"), ("verify",))),
])
def test_readers_of_versions(data, call, noun, table, readers):
    """Readers of knowledge and policies check each byte: a bit that flipped under an unchanged time is refused, and never played."""
    path = Store(data).version_folder(noun, 1) / f"{table}.parquet"
    (data / "policies" / "v0001" / "manifest.json").rename(data / "kept") if "train" in readers[0] else None
    silently(path)
    for words in readers:
        code, out, err = call(*words, "--data", data)
        assert (code, str(path) in out + err) == (1, True), (words, out, err)


def test_table_that_duckdb_cannot_read(data, call):
    """A table whose last bytes changed under an unchanged time stops no query: its rows are left out, and said."""
    store = Store(data)
    path = data / next(iter(store.receipts("situations"))).files["situations"].path
    before = path.stat()
    with path.open("r+b") as file:
        file.seek(-1, os.SEEK_END)
        file.write(b"X")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    for query in ("select count(*) from situations", "select count(*) from goals"):
        code, _, err = call("sql", query, "--data", data)
        assert (code, err.count("is lost or damaged")) == (3, 1)
    os.utime(data / next(iter(store.receipts("goals"))).files["goals"].path)  # so that the catalogue is built anew
    assert call("sql", "select count(*) from goals", "--data", data)[0] == 3
    assert call("run", "--data", data)[0] == 0
    assert call("sql", "select count(*) from situations", "--data", data)[2] == ""


@pytest.mark.parametrize("place", ["goals", "knowledge", "quarantine"])
def test_folder_that_cannot_be_read(data, call, place):
    """Files that cannot be seen are not gone: a folder that cannot be read is said by every command."""
    shutil.rmtree(data / place, ignore_errors=True)
    (data / place).write_text("no folder")
    for words in (["sql", "select count(*) from goals"], ["run"], ["verify"]):
        code, out, err = call(*words, "--data", data)
        if words == ["verify"] and place == "quarantine":
            continue  # it checks none
        assert (code, place in out + err, "(Not a directory)" in out + err) == (1, True, True), words


@pytest.mark.parametrize("paths", [("../victim.txt", "/etc/hostname"), ("goals/../../victim.txt", "goals/.lock")])
def test_paths_of_receipts(data, tmp_path, call, paths):
    """A receipt that names a file outside its noun's folder is damaged: nobody reads or removes that file."""
    store, victim = Store(data), tmp_path / "victim.txt"
    victim.write_text("mine")
    for receipt, path in zip(store.receipts("goals"), paths, strict=True):
        at = data / "goals" / f"{receipt.name}.receipt.json"
        content = json.loads(at.read_text())
        content["files"]["goals"]["path"] = path
        put_receipt(at, content, checksum=None)
    assert call("verify", "--data", data)[1].count("is not a readable receipt") == 2
    for receipt in store.receipts("matches"):
        assert call("forget", receipt.name, "--data", data)[0] == 0
    assert victim.read_text() == "mine"
    assert Path("/etc/hostname").exists()


def test_seasons_are_restored(data, tmp_path, call):
    """Receipts, manifests and tables of a season's own store come back from a backup."""
    season = data / "seasons" / "a-1"
    for noun in (*STAGES.of_matches, *STAGES.versioned):
        shutil.copytree(data / noun, season / noun)
    name = next(iter(Store(data).receipts("matches"))).name
    put_receipt(data / "seasons" / "a-1.receipt.json", receipt_at(data / "matches" / f"{name}.receipt.json"),
                noun="seasons", name="a-1", files={}, details={"store": "seasons/a-1"})
    backup, rng = shutil.copytree(data, tmp_path / "backup"), random.Random(7)
    harmed = [season / "matches" / f"{name}.receipt.json", season / "knowledge" / "v0001" / "manifest.json",
              next((season / "goals").glob("*.parquet"))]
    for path in harmed:
        flip(path, rng)
    code, out, _ = call("verify", "--restore-from", backup, "--data", data)
    assert (code, "3 restored, 0 problems" in out) == (0, True)
    assert all(path.read_bytes() == (backup / path.relative_to(data)).read_bytes() for path in harmed)


def test_half_a_file_of_a_version(data, call):
    """Leftovers of a kill in a version's folder are no damage."""
    (data / "knowledge" / "v0001" / ".manifest.json.4194305-00000000.tmp").write_bytes(b"half")
    assert call("verify", "--data", data)[0] == 0


def test_lineage(data, call):
    """`verify` names what was made from a match or a version that is gone."""
    store = Store(data)
    match = next(iter(store.receipts("matches"))).name
    (data / "matches" / f"{match}.receipt.json").unlink()
    shutil.rmtree(store.version_folder("knowledge", 1))
    problems = verify_all(store).problems
    assert f"sides {match}: its match is gone. Import it again, or remove what is left: `pitchlore forget {match}`." in problems
    assert any(line.startswith("policies version 1: ") and "no version 1" in line for line in problems)
    assert call("forget", match, "--data", data)[0] == 0
    assert not [line for line in verify_all(store).problems if match in line]


def test_receipts_of_an_earlier_version(data, call):
    """Receipts without a checksum are read, and counted by `verify`."""
    path = next((data / "sides").glob("*.receipt.json"))
    put_receipt(path, receipt_at(path))
    code, out, _ = call("verify", "--data", data)
    assert (code, "1 receipts of an earlier version have no checksum of themselves" in out) == (0, True)


def test_copy_of_hard_links(data, tmp_path, call):
    """It is a snapshot: whatever is done to the folder afterwards does not reach it (docs/how-to/backup.md)."""
    copy, asked = tmp_path / "copy", "select match_id, count(*) from situations group by all order by all"
    shutil.copytree(data, copy, copy_function=os.link)
    whole, rows = outputs(copy), call("sql", asked, "--json", "--data", copy)[1]
    store = Store(data)
    forget_match(store, next(iter(store.receipts("matches"))).name)
    other = Settings.model_validate({"sides": {"watch": ["home"]}})
    assert run(data, settings=other).knowledge_is_new
    for noun in STAGES.receipted:
        store.prune(noun)
    assert outputs(copy) == whole
    assert call("verify", "--data", copy)[0] == 0
    assert call("sql", asked, "--json", "--data", copy)[1] == rows
    assert nothing_new(Store(copy), Settings()) is not None
