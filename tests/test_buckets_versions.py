"""Several machines that make versions in one bucket: each lands, numbered, none lost or mixed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import pytest
from support.buckets import FAULTS

pytest.importorskip("obstore", reason="the extra bucket is not installed")

from support.bucket_stores import ROUNDS, between, made, work

from pitchlore.pipeline.base.errors import Overtaken, StorageFailed
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine.stage import Inputs, Per, Plan, Scope, Stage
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.store import Store, buckets, mirrors
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.pipeline.store.thinning import remove_versions
from pitchlore.pipeline.store.work import Made

pytest_plugins = ["support.bucket_fixtures"]

pytestmark = pytest.mark.slow

EVERYTHING = Scope(matches=())


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
    for step in range(ROUNDS):
        server.mend()
        url, names = server.new(), [f"{step}-{number}" for number in range(4)]
        with monkeypatch.context() as impatient:  # what follows may take its time
            impatient.setattr(buckets, "REQUEST_S", 0.5)
            stores = [machine(url, name) for name in names]
            server.fault = lambda number, step=step: fault if (number + step) % 7 == 0 else None
            landed = emit_at_once(stores, noted())
        server.mend()
        assert sorted(manifest.version for manifest, _ in landed) == [1, 2, 3, 4]
        mirrors._mirror.cache_clear()
        all_landed([machine(url, name) for name in names])


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


def test_thinned(two, server):
    """Versions that one machine removes on purpose are gone for the other, which knows that they are not lost."""
    one, other = two
    for version in (1, 2, 3):
        with one.claim("knowledge") as number:
            one.commit_version(work("knowledge", version=version), made(f"{version}"), number, parent=version - 1 or None)
    other.catch_up()
    assert other.read(other.manifest("knowledge", 1), "note") == b"1"
    with one.locked("knowledge"), one.removing():
        remove_versions(one, "knowledge", [1, 2])
    other.catch_up()
    for store in two:
        assert store.versions("knowledge") == [3]
        assert verify_all(store).problems == []
    assert sorted(server.objects(one.mirror.url))[:1] == ["knowledge/thinned.json"]
    assert len(server.objects(one.mirror.url)) == 3


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
