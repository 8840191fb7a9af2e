"""Cost of an edit of the code: only what it changes is made again."""

import dataclasses
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import clip
from support import trees

from pitchlore.pipeline.engine import games as loop
from pitchlore.pipeline.engine.chain import Chain
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.settings import BehaviourSettings, GramSettings, Settings
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store

pytestmark = pytest.mark.slow

#: Half a minute has too few goals for intervals above 0.
SETTINGS = Settings(
    grams=GramSettings(outcome="paper"), behaviours=BehaviourSettings(select_by="value", shrink=False))

#: Runs over the recordings in the inboxes of data folders.
RUN = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from pitchlore.pipeline.engine.run import run
from pitchlore.pipeline.settings import BehaviourSettings, GramSettings, HistorySettings, Settings
settings = Settings(grams=GramSettings(outcome="paper"), behaviours=BehaviourSettings(select_by="value", shrink=False))
for folder in sys.argv[2:]:
    report = run(Path(folder), settings=settings, on="threads:1", history=HistorySettings(runs=0))
    assert not report.failures
    print("made" if report.made else "nothing new")
"""


def bring(store: Store, chain: Chain = STAGES) -> None:
    """Bring a store up to date, without Prefect."""
    scope = scope_of(store)
    chain.make(store, SETTINGS, scope)
    for noun in chain.versioned:
        emit(store, chain[noun], chain[noun].settings(SETTINGS), scope)


def files(data: Path) -> dict[str, bytes]:
    """Everything in a data folder but locks and caches, receipts without what wrote them."""
    found = {}
    for path in sorted(data.rglob("*")):
        if path.is_file() and path.name not in (".lock", ".done.json", ".idle.json", ".looked.json", ".recordings.json", "catalog.duckdb"):
            content = path.read_bytes()
            if path.suffix == ".json":
                content = json.dumps(json.loads(content) | {"software": None, "checksum": None}).encode()
            found[str(path.relative_to(data))] = content
    return found


@pytest.fixture(scope="module")
def brought(tmp_path_factory) -> Path:
    """A data folder after all stages over half a minute, and its recording."""
    data = tmp_path_factory.mktemp("brought")
    (data / "inbox").mkdir()
    clip(100.0, 130.0).write_parquet(data / "inbox" / "clip.parquet")
    take_in(Store(data), Recording(file=data / "inbox" / "clip.parquet"))
    bring(Store(data))
    return data


@pytest.fixture
def store(brought, tmp_path) -> Store:
    return Store(shutil.copytree(brought, tmp_path / "data"))


def raised(noun: str, **other: object) -> Chain:
    """The stages after one of them was changed and its version raised."""
    later = dataclasses.replace(STAGES[noun], version=STAGES[noun].version + 1, **other)
    return Chain(*(later if stage.noun == noun else stage for stage in STAGES.values()))


def sums(store: Store) -> dict[str, dict[str, str]]:
    """The SHA-256 of all files by noun."""
    found: dict[str, dict[str, str]] = {}
    for noun in STAGES:
        for receipt in (*store.receipts(noun), *store.manifests(noun)):
            found.setdefault(noun, {}).update(receipt.digests())
    return found


def test_a_comment_changes_nothing(brought, tmp_path):
    """Data made by the code before a comment and after it are the same, and a run finds nothing to do."""
    tree = tmp_path / "tree"
    environment = trees.copied(tree, "pitchlore", "pipeline", "flows", "schemas")
    for edited in ("pipeline/views/replay/__init__.py", "pipeline/stages/situations/recognise.py", "pipeline/engine/stage.py"):
        with (tree / edited).open("a") as module:
            module.write("\n# a remark\n")
    data = tmp_path / "data"
    shutil.copytree(brought / "inbox", data / "inbox")
    done = subprocess.run([sys.executable, "-c", RUN, str(tree), str(data), str(brought)], cwd=tmp_path, check=True,
                          text=True, capture_output=True, env=environment)
    assert done.stdout.splitlines() == ["made", "nothing new"]
    assert files(data) == files(brought)
    receipt, ours = (next(Store(folder).receipts("goals")) for folder in (data, brought))
    assert receipt.software != ours.software, "the code was another one"


def test_season_after_edit(tmp_path, monkeypatch):
    """A season goes on after an edit of the code, but not under another version of a stage."""
    said = 'base = "paper"\ngames = 2\nlead_from = 2\n[referee]\nduration_s = 5'
    own = Season(name="short", opponent="static", seed=1, settings=parse_season(said, where="here"))
    loop.learn_from_game(tmp_path, own, 1, loop.play_game(tmp_path, own, 1), discard=False)
    for module in ("outputs", "versions"):
        monkeypatch.setattr(f"pitchlore.pipeline.store.{module}.software", lambda: "pitchlore 9.9+00000000")
    assert loop.done(Store(tmp_path), own).details["games"] == 1
    loop.learn_from_game(tmp_path, own, 2, loop.play_game(tmp_path, own, 2), discard=False)
    assert loop.done(Store(tmp_path), own).details["games"] == 2
    monkeypatch.setattr(loop, "STAGES", raised("situations"))
    with pytest.raises(Exception, match="was begun with other settings or by another version"):
        loop.done(Store(tmp_path), own)


def test_same_bytes(store):
    """A raised version makes its own outputs again; with the same bytes nothing follows, no version is minted."""
    before, goals = sums(store), {r.name: r.key for r in store.receipts("goals")}
    later, remade = raised("situations"), []
    perform = Chain.perform

    class Watched(Chain):
        def perform(self, store, stage, output, settings, scope):
            remade.append((stage.noun, perform(self, store, stage, output, settings, scope)))
            return remade[-1][1]

    bring(store, Watched(*later.values()))
    assert remade == [("situations", False)]
    assert sums(store) == before
    assert {r.name: r.key for r in store.receipts("goals")} == goals
    assert (store.versions("knowledge"), store.versions("policies")) == ([1], [1])


def test_other_bytes(store):
    """A changed stage runs again, and so does what is made from changed bytes; nothing else does."""
    before = sums(store)
    compute = STAGES["sequences"].compute

    def sequences(inputs, settings):
        made = compute(inputs, settings)
        return dataclasses.replace(made, tables=[
            (table.with_columns(value=table["value"] * 0.5), schema) for table, schema in made.tables])

    bring(store, raised("sequences", compute=sequences))
    after = sums(store)
    for noun in ("matches", "trajectories", "situations", "goals"):
        assert after[noun] == before[noun]
    assert after["sequences"] != before["sequences"]
    assert store.versions("knowledge") == [1, 2]


@pytest.mark.parametrize("noun", ["knowledge", "policies"])
def test_equal_version(store, noun):
    """A version that would be the same is not minted, and what was found is remembered."""
    later, computed = raised(noun), []

    def compute(inputs, settings):
        computed.append(inputs.version)
        return STAGES[noun].compute(inputs, settings)

    stage = dataclasses.replace(later[noun], compute=compute)
    for _ in range(2):
        manifest, new = emit(store, stage, stage.settings(SETTINGS), scope_of(store))
        assert (manifest.version, new) == (1, False)
    assert computed == [2], "what was found is remembered"
    assert store.versions(noun) == [1]
