"""Outputs of the chain for known matches, to the last digit; `make golden` makes them anew."""

import dataclasses
import difflib

import pytest
from golden.cases import CASES, HERE, Golden, complaint

from pitchlore.pipeline.engine.stages import STAGES

#: Goldens of what takes seconds to play.
PLAYED = ("paradigms/", "seasons/", "evaluations/", "report/", "executors/")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name.startswith(PLAYED) else ()) for name in CASES])
def test_golden(name):
    """The chain makes of a known match what the golden says, to the last digit."""
    before, now = (HERE / name).read_text(encoding="utf-8"), CASES[name]()
    said = complaint(name, before, now) or "`make golden`, and review the diff"
    changes = list(difflib.unified_diff(
        before.splitlines(), str(now).splitlines(), "golden", "now", lineterm="", n=0))
    assert not changes, "\n".join([said, *changes[:40]])


def test_no_golden_is_orphaned():
    assert {str(p.relative_to(HERE)) for p in HERE.glob("*/*.txt")} == set(CASES)


@pytest.mark.slow
def test_stage_goldens():
    """Every stage has a golden that names its version."""
    named = {noun for make in CASES.values() for noun in make().versions}
    assert named == {*STAGES, "arena"}


MADE = Golden("1,2", {"grams": 3}, {"alpha": 0.5}, inputs="ab")


@pytest.mark.parametrize(("other", "complained"), [
    ({"text": "1,3"}, True),
    ({"content": "cd"}, True),
    ({"text": "1,3", "versions": {"grams": 4}}, False),
    ({"text": "1,3", "inputs": "cd"}, False),
    ({"text": "1,3", "settings": {"alpha": 0.6}}, False),
    ({}, False),
])
def test_version_to_raise(other, complained):
    """Output that changes under equal versions, inputs and settings says which version to raise."""
    said = complaint("grams/x.txt", str(MADE), dataclasses.replace(MADE, **other))
    wanted = "Raise the version of grams from 3 to 4 in pipeline/engine/stages.py, then `make golden`"
    assert (said or "").endswith(wanted) == complained
    assert (said is None) != complained
