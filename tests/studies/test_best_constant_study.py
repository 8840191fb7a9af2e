"""The study of the best constant team: how it is searched for, and that the file has the team that won."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from best_constant.search import search
from best_constant.study import BUDGET_MINUTES, CLOCKS, FINAL_SEEDS, SEARCHES, difference
from conftest import ROOT

from pitchlore.pipeline.arena.teams.constant import Constant, best_constant, clock_of
from pitchlore.pipeline.game.tactics.executors.actions import CODES
from pitchlore.schemas import ROLES

RESULTS = ROOT / "data/studies/best_constant"


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
    """The file has the team that won the final. All that searches found, and constant:044, were in it.

    Each search had the time of play of an apprentice, and its own clock throughout.
    """
    final, searches = (pl.read_csv(RESULTS / name) for name in ("final.csv", "searches.csv"))
    entered = set(final.select("team", "clock").rows())
    assert ("constant:044", "paper") in entered
    for seed, clock in SEARCHES.items():
        own = searches.filter(seed=seed)
        assert own["clock"].unique().to_list() == [clock]
        rounds = own.unique(["stage", "minutes", "pairs"], maintain_order=True)
        assert rounds["minutes"].sum() <= BUDGET_MINUTES
        last = {stage: own.filter(stage=stage)["code"][-2] for stage in ROLES}  # the last round has two, the better first
        assert (Constant(**last).word, clock) in entered
    best = final.row(final["difference"].arg_max(), named=True)
    assert set(final["matches"]) == {2 * len(FINAL_SEEDS)}
    assert (best_constant().word, clock_of("best-constant")) == (best["team"], CLOCKS[best["clock"]])


@pytest.mark.slow
def test_difference():
    """A team that stands loses to static; the same job gives the same number."""
    standing = Constant(184, 184, 184)
    assert difference((standing, 3, "paper", 60.0)) == difference((standing, 3, "paper", 60.0)) < 0
