"""The commands that keep the data folder tidy."""

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made, Work


def test_quarantine(copied, call):
    """Quarantine is listed with its reasons and can be cleared."""
    code, out, _ = call("quarantine", "--data", copied)
    assert (code, "nothing is in quarantine" in out) == (0, True)
    Store(copied).quarantine("goals", "m-1", BadRecording("is odd", where="row 3", next_step="Mend it"))
    code, out, _ = call("quarantine", "--json", "--data", copied)
    assert (code, '"reason": "row 3: is odd. Mend it."' in out) == (0, True)
    assert call("quarantine", "--clear", "--data", copied)[0] == 0
    assert Store(copied).quarantined() == []


def test_forget(copied, call):
    """Forget removes a match, by its id or the beginning of it, and all outputs of it; it refuses to choose."""
    store = Store(copied)
    name, other = (receipt.name for receipt in store.receipts("matches"))
    store.commit(Work("matches", "early-2", {}, version=1), Made())
    for word, said in (("early", f"several matches begin so (there are: {name}, early-2). Name one of them."),
                       ("", "no match is named")):
        code, _, err = call("forget", word, "--data", copied)
        assert (code, said in err) == (1, True)
    code, out, _ = call("forget", name[:8], "--data", copied)
    assert (code, f"{name}: {len(STAGES.nouns(Per.MATCH))} outputs removed" in out) == (0, True)
    assert not [path for path in copied.rglob(f"*{name}*") if "inbox" not in path.parts]
    assert [receipt.name for receipt in store.receipts("matches")] == ["early-2", other]
    assert [receipt.name for receipt in store.receipts("situations")] == [other]
    assert store.versions("knowledge") == [1], "the knowledge stays"
    code, _, err = call("forget", name, "--data", copied)
    assert (code, "there is no such match" in err) == (1, True)


def test_prune(copied, call):
    """Prune removes superseded files and nothing that a receipt names."""
    before = {path: path.read_bytes() for path in copied.rglob("*") if path.is_file() and path.suffix != ".duckdb"}
    stray = copied / "goals" / "early-000000000000-0123456789ab.goals.parquet"
    stray.write_bytes(b"old")
    code, out, _ = call("prune", "--data", copied)
    assert (code, "1 superseded files removed" in out) == (0, True)
    assert not stray.exists()
    assert {path: path.read_bytes() for path in before} == before
