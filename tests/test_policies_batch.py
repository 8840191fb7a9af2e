"""Which decisions a policy is trained on: those that its knowledge was made from, through its parents."""

import polars as pl
import pytest

from flows.policies import batch, learn
from pipeline.errors import NotFound
from pipeline.settings import PolicySettings
from pipeline.store import Store
from schemas import Behaviours, Decisions, Occasions

KICK = "striker-021"


def play(store, match, reward=1.0):
    """One decision, for a goal after a second."""
    row = {
        "match_id": match, "team": "home", "robot": 1, "role": "striker", "t_ns": 0, "end_ns": 1_000_000_000,
        "state": 5, "behaviour_id": KICK, "chosen": True, "random": False, "reward": reward, "episode": 0,
        "ends": "terminal", "value": 0.0,
    }
    table = pl.DataFrame([row], schema=Decisions.dtypes())
    return store.commit(
        "decisions", match, f"{match}{reward}", inputs={}, settings={}, tables={"decisions": (table, Decisions)})


def know(store, *receipts, accumulate):
    """The next version of a knowledge of one pair."""
    row = {"version": 1, "role": "striker", "key": "full36", "state": 5, "behaviour_id": KICK, "count": 1,
           "value": 0.0, "initial": 0.0}
    parent = store.latest("knowledge")
    with store.claim("knowledge") as version:
        return store.commit_version(
            "knowledge", version, parent=parent.version if parent else None, key=str(version),
            inputs={label: sha for receipt in receipts for label, sha in receipt.digests().items()},
            settings={"accumulate": accumulate},
            tables={"behaviours": (Behaviours.empty(), Behaviours),
                    "occasions": (pl.DataFrame([row], schema=Occasions.dtypes()), Occasions)},
        )


def names(store, knowledge, last_matches=None):
    return [receipt.name for receipt in batch(store, knowledge, last_matches)]


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path)


@pytest.fixture
def season(store):
    """Three versions that accumulate: two matches, one, one."""
    know(store, play(store, "b"), play(store, "a"), accumulate=True)
    know(store, play(store, "z"), accumulate=True)
    return know(store, play(store, "c"), accumulate=True)


def test_a_version_that_accumulates_is_of_its_parents_matches_too(store, season):
    assert names(store, season) == ["a", "b", "z", "c"]
    assert names(store, store.manifest("knowledge", 2)) == ["a", "b", "z"]
    assert [names(store, season, last) for last in (1, 2, 3, 9)] == [["c"], ["z", "c"], ["b", "z", "c"], ["a", "b", "z", "c"]]


def test_a_version_of_its_own_matches_alone_says_nothing_of_others(store):
    know(store, play(store, "a"), accumulate=False)
    assert names(store, know(store, play(store, "b"), play(store, "c"), accumulate=False)) == ["b", "c"]
    # what begins to accumulate adds to all that its parent is made of, and no more
    assert names(store, know(store, play(store, "d"), accumulate=True)) == ["b", "c", "d"]


def test_decisions_made_anew_put_the_knowledge_out_of_date(store, season):
    play(store, "b", reward=-1.0)
    with pytest.raises(NotFound, match="decisions of b are newer than knowledge 1"):
        batch(store, season)
    assert names(store, season, 2) == ["z", "c"]  # those hold


def test_training_is_on_the_last_matches_and_goes_on_from_the_parent(store, season):
    settings = PolicySettings(step_size=1.0, discount=1.0, sweeps=1, last_matches=2)
    first, new = learn(store, settings)
    assert (new, first.counts["matches"], first.counts["decisions"], first.parent) == (True, 2, 2, None)
    assert {label for label in first.inputs if label.startswith("decisions/")} == {
        "decisions/c/decisions", "decisions/z/decisions"}
    assert learn(store, settings) == (first, False)
    second, new = learn(store, settings.model_copy(update={"last_matches": None}))
    assert (new, second.counts["matches"], second.parent, "parent" in second.inputs) == (True, 4, 1, True)
    anew, new = learn(store, settings.model_copy(update={"parent": False}))
    assert (new, anew.parent, "parent" in anew.inputs) == (True, None, False)
    visits = [store.read_version(version, "policies") for version in (first, second, anew)]
    assert [pl.read_parquet(data)["visits"].to_list() for data in visits] == [[2], [6], [2]]
