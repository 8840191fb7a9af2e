"""Seasons and matches of the arms; everything that is in the data folder is not played again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import harness
import polars as pl
from looking.blind import blind
from looking.learners import ALL, STATIC, WATCHED, Arm
from looking.pairs import kept, of_pairs
from looking.permuted import Deal, actions_dealt, sights_dealt, stages

from pitchlore.pipeline import arena
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.engine.evaluations import evaluate
from pitchlore.pipeline.engine.games import next_of, take_game
from pitchlore.pipeline.engine.placement.executors import Executors
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.stages.evaluations import Evaluation, Pair, results_of_pair
from pitchlore.pipeline.stages.seasons.settings import Season
from pitchlore.pipeline.store import Store

#: Seasons whose apprentices learn from a log that was dealt out anew: their settings, and how it is dealt.
DEALT: dict[str, tuple[str, Deal]] = {
    "looking-shuffled": (WATCHED.season, actions_dealt), "looking-drawn": (ALL.season, sights_dealt)}


def seasons(arms: Sequence[Arm], data: Path) -> None:
    """Play the seasons of arms that are missing."""
    for settings, seeds in dict.fromkeys((arm.trained, arm.seasons) for arm in arms):
        if settings in DEALT:
            with harness.workers() as pool:
                list(pool.map(partial(season_dealt, data, settings), seeds))
        else:
            harness.seasons(settings, seeds, data)


def season_dealt(data: Path, name: str, seed: int) -> None:
    """Play the missing games of a season whose apprentice learns from a log that was dealt out anew."""
    settings, deal = DEALT[name]
    own = Season(name=name, opponent=STATIC, seed=seed, settings=harness.settings_of(settings))
    turn = next_of(Store(data), own)
    while turn is not None:
        take_game(data, turn, discard=True, stages=stages(deal))
        turn = turn.following()


def measured(store: Store, word: str, arm: Arm, opponent: str, executors: Executors) -> pl.DataFrame:
    """Goal differences of a team in an arm, a row a pair of matches: seed, difference."""
    policies: dict[str, PolicyTables] = {}
    team = entrant(store, word, policies, predict_s=arm.predict_s)
    other = entrant(store, opponent, policies)
    how = Evaluation(**arm.how.of_match(), team=team, opponent=other)
    if arm.blind:
        said = f"blind {arm.late_s} {how.id} {arena.VERSION}"
        return kept(store.root / "looking", said, arm.seeds, partial(played_blind, how, policies, arm.late_s))
    return of_pairs(evaluate(store, how, arm.seeds, policies, executors)[0])


def played_blind(
    how: Evaluation, policies: Mapping[str, PolicyTables], late_s: float | None, seeds: Sequence[int]
) -> pl.DataFrame:
    """Goal differences of an evaluation whose team is blind: seed, difference."""
    pairs = [Pair(evaluation=how, seed=seed) for seed in seeds]
    with harness.workers() as pool:
        return pl.concat(pool.map(partial(blind_pair, policies, late_s), pairs))


def blind_pair(policies: Mapping[str, PolicyTables], late_s: float | None, pair: Pair) -> pl.DataFrame:
    """Goal difference of a pair of matches whose measured team is blind: seed, difference."""
    label = pair.evaluation.team.settings.policy
    assert label is not None, "it has learned"
    return of_pairs(results_of_pair(pair, policies, blind(policies[label], late_s)))
