"""A match in memory has the tables of a data folder that holds it alone."""

import json
from collections import Counter

import pytest
from conftest import clip

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.making import make
from pitchlore.pipeline.engine.matches import read_match, take_in
from pitchlore.pipeline.engine.memory import MemoryInputs
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stage import Per, Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.importers.readers import open_source
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.tables import to_parquet
from pitchlore.schemas import Choices

pytestmark = pytest.mark.slow

SETTINGS = Settings()


def test_equal_to_a_league_of_one_match(tmp_path):
    """Every table, blob, setting and detail of every noun is equal, bit for bit, whatever is asked for first."""
    file, store, rows = tmp_path / "derby.parquet", Store(tmp_path / "data"), 0
    clip(0.0, 120.0).write_parquet(file)
    name = take_in(store, Recording(file=file))[0].name
    STAGES.make(store, SETTINGS, Scope(matches=(name,)))
    log, _ = read_match(open_source(file.read_bytes(), file.name), TrackingMap())
    match = MemoryInputs(log, SETTINGS, TrackingMap().settings())
    for noun in reversed(STAGES.of_matches):
        stage = STAGES[noun]
        receipt = store.receipt(noun, name if stage.per is Per.MATCH else "all")
        (held,) = match[noun]
        assert held.name == receipt.name
        assert json.loads(json.dumps(held.details)) == receipt.details, noun
        assert dict(held.settings) == receipt.settings, noun
        assert set(held.files) | {"log"} == set(receipt.files) | {"log"}, noun
        for schema in stage.schemas:
            if schema.NAME not in receipt.files:
                continue
            table = match.table(noun, schema)
            assert digest(to_parquet(table, schema, where=noun)) == receipt.files[schema.NAME].sha256, schema.NAME
            rows += table.height
        for role in set(receipt.files) - {schema.NAME for schema in stage.schemas} - {"log"}:
            assert match.blob(noun, role) == store.read(receipt, role), (noun, role)
    assert rows > 20_000


def test_what_is_no_noun_of_a_match(tmp_path):
    """Versions, and tables that a noun does not have, are not there."""
    file = tmp_path / "derby.parquet"
    clip(0.0, 10.0).write_parquet(file)
    match = MemoryInputs(read_match(open_source(file.read_bytes(), file.name), TrackingMap())[0])
    assert match["knowledge"] == ()
    assert match["sprints"] == ()
    assert match["trajectories"][0].name.startswith("derby-")
    assert match.blob("trajectories", "log") is None
    with pytest.raises(NotFound, match="has no choices"):
        match.table("sequences", Choices)
    assert next(match.batches("sequences", Choices)).equals(Choices.empty())


@pytest.fixture
def derby(tmp_path):
    clip(0.0, 30.0).write_csv(tmp_path / "derby.csv")
    return Recording(file=tmp_path / "derby.csv")


def test_taken_from_memory(derby, tmp_path, monkeypatch):
    """Tables that a stage has made are read by no later stage of the match, and the bytes are the same."""
    one, other = Store(tmp_path / "one"), Store(tmp_path / "other")
    name = take_in(one, derby)[0].name
    take_in(other, derby)
    scope = Scope(matches=(name,))
    STAGES.make(one, SETTINGS, scope)
    read = Counter()
    read_table = Store.read_table
    monkeypatch.setattr(Store, "read_table", lambda store, receipt, role, schema: (
        read.update([role]), read_table(store, receipt, role, schema))[1])
    for stage_group in STAGES.stage_groups():
        for output in stage_group[0].outputs(scope):
            outcome = make(other.root, [stage.noun for stage in stage_group], output, SETTINGS, scope, frozenset())
            assert not outcome.failed
        if stage_group[0].noun == "sides":
            assert read == {"matches": 1, "referee": 1}
    files = {stage.noun: [store.receipt(stage.noun, output.name).files for store in (one, other)]
             for stage in STAGES.computed() for output in stage.outputs(scope)}
    assert {noun for noun, (first, second) in files.items() if first != second} == set()
    assert "trajectories" in files
