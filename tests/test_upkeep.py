"""The commands that keep the data folder tidy."""

import json
import shutil

import pytest

from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.base.errors import BadRecording, CorruptFile
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.teams import label
from pitchlore.pipeline.engine.thinning import thin
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.settings import Settings
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


def versions(store: Store, number: int, **policies: object) -> None:
    """Make so many versions of the knowledge, and of policies that go by states."""
    for step in range(number):
        settings = Settings.model_validate({
            "knowledge": {"optimistic": step / 8, "recover": None}, "policies": {"learner": "sarsa", **policies}})
        for noun in STAGES.versioned:
            assert emit(store, STAGES[noun], STAGES[noun].settings(settings), scope_of(store))[1]


def there(store: Store) -> list[list[int]]:
    """The numbers of the knowledge, and of policies."""
    return [store.versions(noun) for noun in STAGES.versioned]


@pytest.fixture
def many(copied) -> Store:
    """A league with seven versions of the knowledge and of policies, none of which goes on from another."""
    store = Store(copied)
    versions(store, 6, parent=False)
    assert there(store) == [[*range(1, 8)]] * 2
    return store


def test_thin(many, call):
    """Old versions go, but for what is named; everything that names something finds it, and numbers go on."""
    played = Recipe(home=TeamSettings(kind="learned", policy=label(many.manifest("policies", 3))), away=TeamSettings(kind="static"), seed=1)
    many.commit(Work("matches", "m-0123456789ab", played.model_dump(mode="json"), version=1), Made())
    measured = {"evaluation": {"team": {"policy_version": 2, "knowledge_version": 2}, "opponent": {"policy_version": None}}}
    many.commit(Work("evaluations", "e-0", measured, version=1), Made())
    code, out, _ = call("prune", "--newest", 2, "--one-in", 5, "--data", many.root)
    assert (code, "knowledge: 2 versions removed, 5 kept" in out) == (0, True)
    assert there(many) == [[2, 3, 5, 6, 7]] * 2
    many.forget("matches", "m-0123456789ab")
    assert verify_all(many).problems == []
    code, out, _ = call("kb", "list", "--json", "--data", many.root)
    assert [row["version"] for row in json.loads(out)] == there(many)[0]
    code, _, err = call("kb", "show", 4, "--data", many.root)
    assert (code, "knowledge has no version 4" in err) == (1, True)
    for words in (("sql", "select distinct version from policies"), ("kb", "diff", 3, 5), ("kb", "show", 2), ("run",)):
        assert call(*words, "--data", many.root)[0] == 0
    newest = many.versions("knowledge")[-1]
    assert newest > 7, "a number is never given again"
    shutil.rmtree(many.version_folder("knowledge", newest - 1))
    (lost,) = (line for line in verify_all(many).problems if line.startswith("knowledge"))
    assert "which it follows, is gone" in lost, "what was lost is told from what was removed"


def test_thin_keeps_ancestors(copied):
    """Policies that a kept one goes on from stay, and so does all that a version adds to."""
    store = Store(copied)
    versions(store, 3, last_matches=1)
    chain = [policy.parent for policy in store.manifests("policies")]
    thin(store, 1)
    kept, following = set(), store.versions("policies")[-1]
    while following is not None:
        kept.add(following)
        following = chain[following - 1]
    assert set(store.versions("policies")) >= kept
    assert verify_all(store).problems == []


def test_thin_refuses(many, call):
    """Where something that may name versions cannot be read, nothing is removed."""
    for path in (many.version_folder("policies", 2) / "manifest.json", next(many.root.glob("matches/*.receipt.json"))):
        whole = path.read_bytes()
        path.write_bytes(whole[:-9])
        with pytest.raises(CorruptFile):
            thin(many, 1)
        path.write_bytes(whole)
    assert there(many) == [[*range(1, 8)]] * 2
    for words, said in ((("--newest", 0), "--newest: must be 1 or more"), (("--one-in", 3), "--one-in: goes with --newest")):
        code, _, err = call("prune", *words, "--data", many.root)
        assert (code, said in err) == (1, True)
    thin(many, 1)
    note = many.root / "knowledge" / "thinned.json"
    note.write_bytes(note.read_bytes()[:-9])
    assert any(str(note) in line for line in verify_all(many).problems)
