"""Outputs of a match made stage after stage: what one stage has made, the next ones do not read again."""

from collections import Counter

import pytest
from conftest import clip

from pitchlore.pipeline.engine.making import make
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stage import Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store

pytestmark = pytest.mark.slow

SETTINGS = Settings()


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
