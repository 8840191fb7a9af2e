"""Several machines that write outputs to one bucket."""

from __future__ import annotations

import json
import signal
import time

import pytest
from support import at_once
from support.google import google
from support.processes import answering, eventually, line, tell

pytest.importorskip("obstore", reason="the extra bucket is not installed")

from support.bucket_stores import ROUNDS, between, made, plain, work

from pitchlore.pipeline.base.errors import NotFound, Overtaken
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.verify import verify_all

pytest_plugins = ["support.bucket_fixtures"]

pytestmark = pytest.mark.slow


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


def test_few_requests(two, server):
    """A stage made from many outputs asks for all of them at once; `prune` lists each folder once."""
    one, other = two
    sources = [other.commit(work("matches", f"m-{number}"), made("log")) for number in range(9)]
    one.catch_up()
    server.asked = 0
    one.commit(work("behaviours", "all"), made("of all"), sources)
    assert server.asked == 4, "a listing and its end, and two objects"
    other.forget("matches", "m-5")
    with pytest.raises(NotFound, match="matches m-5 has been removed meanwhile"):
        one.commit(work("behaviours", "all", 2), made("of all"), sources)
    assert one.receipt("behaviours", "all").key == work("behaviours", "all").key
    one.prune("matches")
    server.asked = 0
    assert [one.prune(noun) for noun in ("matches", "behaviours", "goals")] == [[], [], []]
    assert server.asked == 6, "each listing and its end"


def test_clock_set_back(two, monkeypatch):
    """A machine whose clock was set back by a week sees what another one changed and removed; it had not, for that week."""
    one, other = two
    for name in ("m-1", "m-2"):
        one.commit(work(name=name), made("before"))
    other.catch_up()
    monkeypatch.setattr("time.time", lambda clock=time.time: clock() - 7 * 86_400)
    one.commit(work(name="m-1", version=2), made("after"))
    one.forget("goals", "m-2")
    other.catch_up()
    assert [(receipt.name, other.read(receipt, "note")) for receipt in other.receipts("goals")] == [("m-1", b"after")]


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


def test_two_processes(server, machine, recordings, local, tmp_path):
    """Two machines that run at once end in the bytes of one; one that is killed leaves nothing half done."""
    with answering("support.at_once", **server.environment, HOME=str(tmp_path / "ada"),
                   XDG_CACHE_HOME=str(tmp_path / "ada" / "cache")) as ada:
        assert line(ada) == "ready"
        for _ in range(ROUNDS):
            url = server.new()
            take_in(machine(url, "importer"), Recording(file=recordings / "derby.csv"))
            tell(ada, 0, "run", url)
            said = [at_once.answer("run", machine(url, "bea")), line(ada)]
            assert "True True" in said
            assert all(each in ("True True", "False False", "True False", "False True") or "Run again" in each
                       for each in said), said
            store = machine(url, "after")
            store.catch_up()
            at_once.run(store)
            assert plain(server.objects(url)) == local
        url = server.new()
        take_in(machine(url, "importer"), Recording(file=recordings / "derby.csv"))
        tell(ada, 0, "run", url)
        eventually(lambda: any(key.startswith("situations") for key in server.objects(url)))
        ada.send_signal(signal.SIGKILL)
        ada.wait()
    witness = machine(url, "witness")
    assert verify_all(witness).problems == []
    at_once.run(witness)
    assert plain(server.objects(url)) == local
