"""Settings of the studies' seasons: each says what it changes, and is listed with its difference."""

from __future__ import annotations

import pytest
from conftest import ROOT
from harness import settings_of

from pitchlore.pipeline.stages.seasons.settings import named_settings, names

STUDIES = ROOT / "data" / "studies"
#: What each ablation changes, by the name of its settings; those of the paper are played against one team.
ABLATIONS = {
    "looking-all": {"pipeline.policies.appraisals.codes"},
    "looking-imitates": {"pipeline.policies.appraisals.codes", "pipeline.policies.appraisals.watched",
                         "pipeline.grams.watched_s"},
    "looking-late": {"camera.latency_s", "camera.position_noise", "predict_s"},
    "looking-all-late": {"camera.latency_s", "camera.position_noise", "predict_s", "pipeline.policies.appraisals.codes"},
    "looking-held": {"explore", "explore_last", "explore_s", "pipeline.policies.appraisals.codes"},
    "looking-held-late": {"camera.latency_s", "camera.position_noise", "predict_s", "explore", "explore_last", "explore_s",
                          "pipeline.policies.appraisals.codes"},
    "paper-full35": {"pipeline.knowledge.state_key", "opponents"},
    "paper-level": {"lead", "opponents"},
    "best-begin-all": {"clock.begin_ended"},
    "best-bold": {"lcb_weight"},
    "best-both-teams": {"pipeline.sides.watch", "pipeline.sides.pools.both"},
    "best-constant-steps": {"pipeline.policies.steps", "pipeline.policies.step_size"},
    "best-each-decision": {"pipeline.policies.traces"},
    "best-grams": {"pipeline.behaviours.rounds"},
    "best-in-games": {"practice", "explore_counted", "pipeline.policies.last_matches"},
    "best-influence": {"pipeline.policies.rule"},
    "best-no-interrupts": {"clock.interrupts"},
    "best-no-least-time": {"clock.least_s"},
    "best-one-match": {"practice", "pipeline.policies.last_matches"},
    "best-optimistic": {"pipeline.policies.new_pairs"},
    "best-paper-clock": {"clock.least_s", "clock.interrupts", "clock.begin_ended"},
    "best-random-tries": {"posterior_std", "explore", "explore_last"},
    "best-short-traces": {"pipeline.policies.trace_decay"},
    "best-states": {"pipeline.knowledge.state_key", "pipeline.knowledge.backoff", "min_visits"},
    "paper-literal": {f"pipeline.behaviours.{name}" for name in ("share_of", "support_at_least", "keep_random")},
    "paper-vary-alpha-high": {"pipeline.grams.alpha"},
    "paper-vary-alpha-low": {"pipeline.grams.alpha"},
    "paper-vary-explore-more": {"explore", "explore_last"},
    "paper-vary-explore-none": {"explore", "explore_last"},
    "paper-vary-lead-small": {"lead", "opponents"},
    "paper-vary-maps-large": {"pipeline.behaviours.rounds"},
    "paper-vary-maps-small": {"pipeline.behaviours.rounds"},
    "paper-vary-random-long": {"pipeline.situations.random_longest_s"},
    "paper-vary-random-short": {"pipeline.situations.random_longest_s"},
}


def flat(settings, path=""):
    """Settings by the path of their names."""
    for name, value in settings.items():
        if isinstance(value, dict):
            yield from flat(value, f"{path}{name}.")
        else:
            yield f"{path}{name}", value


def test_settings_names():
    """The settings that come along are those that people play; each other one is a study's, and its difference is listed."""
    assert set(names()) == {"paper", "paper-literal", "best", "best-in-games", "looking", "looking-held"}
    studies = {path.stem for path in STUDIES.glob("*/*.toml")}
    assert studies | set(names()) == {"paper", "best", "looking", *ABLATIONS}
    assert not studies & set(names())


@pytest.mark.parametrize("ablation", ABLATIONS)
def test_ablation(ablation):
    """An ablation changes the settings that are listed for it and no others."""
    base = dict(flat(named_settings(ablation.split("-")[0]).model_dump()))
    mine = dict(flat(settings_of(ablation).model_dump()))
    assert {name for name in mine | base if mine.get(name) != base.get(name)} == ABLATIONS[ablation]
