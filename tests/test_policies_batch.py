"""Decisions that a policy is trained on: those that its knowledge was made from, through its parents."""

import polars as pl
import pytest

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.knowledge import label_of
from pitchlore.pipeline.engine.policies import batch
from pitchlore.pipeline.engine.stage import Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.decisions import decision_digests
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import Behaviours, Decisions, Occasions, Policies, Sides

KICK = "striker-021"


def play(store, match, reward=1.0, *, chosen=True, team="home"):
    """One decision, for a goal after a second."""
    row = {
        "match_id": match, "team": team, "robot": 1, "role": "striker", "t_ns": 0, "end_ns": 1_000_000_000,
        "state": 5, "behaviour_id": KICK, "chosen": chosen, "random": False, "reward": reward, "episode": 0,
        "ends": "terminal", "value": 0.0,
    }
    table = pl.DataFrame([row], schema=Decisions.dtypes())
    sides = pl.DataFrame([(match, side, of, "vsss", of, 0, 0) for side, of in (("home", "us"), ("away", "them"))],
                         schema=Sides.dtypes(), orient="row")
    store.commit(Work("sides", match, {}, version=1),
                 Made([(sides, Sides)], details={"kind": "vsss", "counts_as": ["us", "them"]}))
    reported = {"sha256": decision_digests(table)[match], "choosing": [team] if chosen else []}
    return store.commit(Work("decisions", f"group-{match}", {"reward": reward, "chosen": chosen, "team": team}, version=1),
                        Made([(table, Decisions)], details={"matches": {match: reported}}))


def know(store, *receipts, accumulate, imitates="us"):
    """The next version of a knowledge of one pair."""
    row = {"version": 1, "role": "striker", "key": "full36", "state": 5, "behaviour_id": KICK, "count": 1,
           "value": 0.0, "initial": 0.0, "team": "us", "kind": "vsss"}
    parent = store.latest("knowledge")
    with store.claim("knowledge") as version:
        made = Made([(Behaviours.empty(), Behaviours), (pl.DataFrame([row], schema=Occasions.dtypes()), Occasions)],
                    details={"imitates": {"team": imitates, "kind": "vsss"}})
        inputs = {label_of(receipt, match): reported["sha256"]
                  for receipt in receipts for match, reported in receipt.details["matches"].items()}
        of = Work("knowledge", "knowledge", {"accumulate": accumulate}, version=1, inputs=inputs)
        return store.commit_version(of, made, version, parent=parent.version if parent else None)


def learn(store, settings):
    """The policy that stands after training, and whether it is new."""
    return emit(store, STAGES["policies"], settings, Scope(matches=()))


def names(store, knowledge, last_matches=None):
    return [known.match for known in batch(store, knowledge, last_matches)]


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path)


@pytest.fixture
def season(store):
    """Three versions that accumulate: two matches, one, one."""
    know(store, play(store, "b"), play(store, "a"), accumulate=True)
    know(store, play(store, "z"), accumulate=True)
    return know(store, play(store, "c"), accumulate=True)


def test_accumulated_matches(store, season):
    """A version that accumulates is of its parents' matches too."""
    assert names(store, season) == ["a", "b", "z", "c"]
    assert names(store, store.manifest("knowledge", 2)) == ["a", "b", "z"]
    assert [names(store, season, last) for last in (1, 2, 3, 9)] == [["c"], ["z", "c"], ["b", "z", "c"], ["a", "b", "z", "c"]]


def test_own_matches(store):
    """A version that does not accumulate is of its own matches alone."""
    know(store, play(store, "a"), accumulate=False)
    assert names(store, know(store, play(store, "b"), play(store, "c"), accumulate=False)) == ["b", "c"]
    # what begins to accumulate adds to all that its parent is made of, and no more
    assert names(store, know(store, play(store, "d"), accumulate=True)) == ["b", "c", "d"]


def test_newer_decisions(store, season):
    """Decisions made anew put the knowledge out of date."""
    play(store, "b", reward=-1.0)
    with pytest.raises(NotFound, match="decisions of b are newer than knowledge 1"):
        batch(store, season)
    assert names(store, season, 2) == ["z", "c"]  # those hold


def matches(policy):
    """The matches whose decisions a policy, or one of its line, was trained on."""
    return {label.split("/")[2] for label in policy.inputs if label.startswith("decisions/")}


def visits(store, policy):
    return store.read_table(policy, "policies", Policies)["visits"].to_list()


SETTINGS = PolicySettings(step_size=1.0, discount=1.0, sweeps=1, last_matches=2)


def test_last_matches(store, season):
    """Training is on the last matches, and once."""
    first, new = learn(store, SETTINGS)
    assert (new, first.details["matches"], first.details["decisions"], first.parent) == (True, 2, 2, None)
    assert matches(first) == {"c", "z"}
    assert learn(store, SETTINGS) == (first, False)


def test_going_on(store, season):
    """A policy goes on from its parent with the matches that this has not learned from."""
    first, _ = learn(store, SETTINGS)
    second, new = learn(store, SETTINGS.model_copy(update={"last_matches": None}))
    assert (new, second.details["matches"], second.parent) == (True, 2, 1)
    assert matches(second) == {"a", "b", "c", "z"}
    know(store, play(store, "d"), accumulate=True)
    third, new = learn(store, SETTINGS.model_copy(update={"last_matches": None}))
    assert (new, third.details["matches"], third.parent) == (True, 1, 2)
    assert [visits(store, policy) for policy in (first, second, third)] == [[2], [4], [5]]
    assert learn(store, SETTINGS.model_copy(update={"last_matches": None})) == (third, False)


def test_nothing_left(store, season):
    """Training begins anew where the parent has learned from all matches."""
    learn(store, SETTINGS)
    anew, new = learn(store, SETTINGS.model_copy(update={"step_size": 0.5}))
    assert (new, anew.details["matches"], anew.parent, visits(store, anew)) == (True, 2, None, [2])


def test_match_made_anew(store):
    """Training begins anew where a match was made anew."""
    know(store, play(store, "a"), accumulate=False)
    learn(store, SETTINGS)
    know(store, play(store, "a", reward=-1.0), play(store, "b"), accumulate=False)
    anew, new = learn(store, SETTINGS)
    assert (new, anew.details["matches"], anew.parent, visits(store, anew)) == (True, 2, None, [2])


def test_another_team(store):
    """A policy that imitates another team is no parent; seen decisions are those of the team, chosen ones all."""
    know(store, play(store, "a"), accumulate=False)
    learn(store, SETTINGS)
    know(store, play(store, "a"), play(store, "b", chosen=False), play(store, "c", chosen=False, team="away"),
         accumulate=False, imitates="us")
    second, _ = learn(store, SETTINGS.model_copy(update={"last_matches": None}))
    assert (second.parent, second.details["matches"], second.details["decisions"]) == (1, 2, 1)
    know(store, play(store, "a"), play(store, "c", chosen=False, team="away"), accumulate=False, imitates="them")
    third, new = learn(store, SETTINGS)
    assert (new, third.details["imitates"]["team"], third.parent, third.details["decisions"]) == (True, "them", None, 2)


def test_no_parent(store, season):
    """Training without a parent begins anew."""
    learn(store, SETTINGS)
    anew, new = learn(store, SETTINGS.model_copy(update={"parent": False, "step_size": 0.5}))
    assert (new, anew.parent, visits(store, anew)) == (True, None, [2])
