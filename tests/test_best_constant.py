"""The best constant team: how it is searched for, and that its file is what its name plays."""

from __future__ import annotations

import json
from importlib import resources

import numpy as np
import pytest
from studies.best_constant import BUDGET_MINUTES, FIRST_SEED, difference, search

from flows.teams import entrant
from pipeline.arena.teams.constant import BEST_FILE, Constant, best_constant
from pipeline.arena.teams.executors.actions import CODES
from pipeline.arena.teams.panel import PANEL
from pipeline.store import Store
from schemas import ROLES


def file():
    """The file of the best constant team."""
    return json.loads(resources.files("pipeline.arena.teams").joinpath(BEST_FILE).read_text(encoding="utf-8"))


def worth(team):
    """Goals a minute of a toy team: each role has a best code, and the nearer its code the better."""
    best = {"goalkeeper": 21, "midfield": 47, "striker": 44}
    return -sum(abs(CODES.index(code) - CODES.index(best[role])) for role, code in team._asdict().items())


def test_finds_the_best():
    """With so much play that luck does not matter, the search ends at the best code of each role."""
    rng = np.random.default_rng(0)
    rounds = list(search(CODES, 4000, 5, lambda jobs: [worth(team) + rng.normal(0, 1) for team, _ in jobs]))
    assert {each.stage: next(iter(each.values)) for each in rounds[5:]} == {
        "striker": 44, "midfield": 47, "goalkeeper": 21}
    assert [len(each.values) for each in rounds] == [32, 16, 8, 4, 2] * 4


@pytest.mark.parametrize("codes", [CODES, CODES[:7]])
def test_fair(codes):
    """In a round codes play the same seeds, which no other round has, and differ in what is chosen; time is kept."""
    played = []

    def play(jobs):
        played.append(list(jobs))
        return [worth(team) for team, _ in played[-1]]

    rounds = list(search(codes, BUDGET_MINUTES, 100, play))
    assert sum(each.minutes for each in rounds) == 2 * sum(map(len, played)) <= BUDGET_MINUTES
    left, stage, seeds = list(codes), "all", []
    for each, jobs in zip(rounds, played, strict=True):
        left = list(codes) if each.stage != stage else left
        stage = each.stage
        own = sorted({seed for _, seed in jobs})
        seeds += own
        for seed in own:
            teams = [team for team, other in jobs if other == seed]
            vary = [role for role in ROLES if len({getattr(team, role) for team in teams}) > 1]
            assert vary == (list(ROLES) if stage == "all" else [stage])
            assert sorted(getattr(team, vary[0]) for team in teams) == sorted(left)
        left = list(each.values)[: (len(left) + 1) // 2]
    assert seeds == list(range(100, 100 + len(seeds)))


def test_file():
    """The file is of a whole search: each of its codes came first in its stage, in the time that an apprentice has."""
    said = file()
    last = {each["stage"]: int(next(iter(each["values"]))) for each in said["rounds"]}
    assert said["codes"] == {role: last[role] for role in ROLES}
    assert said["minutes"] == sum(each["minutes"] for each in said["rounds"]) <= BUDGET_MINUTES
    assert (said["seed"], said["opponent"]) == (FIRST_SEED, "static")


def test_plays_its_file(tmp_path):
    """The name plays the codes of the file, and its policy has the name of the codes."""
    policies = {}
    team = entrant(Store(tmp_path), "best-constant", policies)
    codes = file()["codes"]
    assert best_constant() == Constant(**codes)
    assert (team.name, team.settings.policy) == ("best-constant", Constant(**codes).word)
    rows = policies[team.settings.policy].values
    assert dict(rows.select("role", "behaviour_id").rows()) == {
        role: f"{role}-{code:03d}" for role, code in codes.items()}


def test_panel(tmp_path):
    """The panel's words are teams, each once."""
    names = [entrant(Store(tmp_path), word, {}).name for word in PANEL]
    assert names == list(PANEL)
    assert len(set(names)) == 7


@pytest.mark.slow
def test_difference():
    """A team that stands loses to static; the same job gives the same number."""
    standing = Constant(184, 184, 184)
    assert difference((standing, 3)) == difference((standing, 3)) < 0
