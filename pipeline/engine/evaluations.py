"""Evaluations: missing pairs of matches are played, by executors."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import polars as pl
from pydantic import BaseModel

from pitchlore.pipeline import arena
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.placement.executors import Executors, Here
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.progress import listener
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.tasks import runner, spread
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.stages.evaluations import Evaluation, Pair, results_of_pair
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import Evaluations

NOUN = "evaluations"
#: One match at a time, in this process.
HERE = Here(1)


def evaluate(
    store: Store, evaluation: Evaluation, seeds: Sequence[int], policies: Mapping[str, PolicyTables],
    executors: Executors = HERE,
) -> tuple[pl.DataFrame, int]:
    """Results of all pairs of an evaluation; missing pairs are played, and each is stored when it ends.

    The results do not depend on the executors.

    Args:
        store: store of the results.
        evaluation: settings of the evaluation.
        seeds: seeds of the pairs, each once.
        policies: by the label in the teams' settings.
        executors: executors of the matches.

    Returns:
        Rows of schema Evaluations of all pairs, and the number of pairs played now.

    Raises:
        WorkerLost: if a worker was lost; pairs that had ended are stored.
    """
    pairs = {seed: Pair(evaluation=evaluation, seed=seed) for seed in sorted(seeds)}
    there = {seed: rows for seed, pair in pairs.items() if (rows := stored(store, pair)) is not None}
    todo = [pair for seed, pair in pairs.items() if seed not in there]
    listener.get().begin(NOUN, len(todo))
    data = executors.path(store.root)
    pieces = ((pair.name, {"data": data, "pair": pair, "policies": policies}) for pair in todo)
    for name, rows in spread(executors, play_pair, pieces, len(todo), task="pair"):
        there[rows["seed"][0]] = rows
        listener.get().advance(NOUN, name)
    return pl.concat([there[seed] for seed in pairs]), len(todo)


class Played(BaseModel):
    """Outcome of a measurement.

    Attributes:
        pairs: number of pairs of matches that were played now, for each evaluation; the others were there.
    """

    pairs: list[int]


def measure(
    data: Path, evaluations: list[Evaluation], teams: list[str], seed: int, pairs: int, on: str | None = None
) -> Played:
    """Play the missing pairs of some evaluations; :func:`evaluate` then finds the results.

    Args:
        data: the data folder.
        evaluations: settings of each.
        teams: words of all teams (:func:`pipeline.engine.teams.entrant`), whose policies play.
        seed: seed of the first pair.
        pairs: number of pairs of each evaluation; each later pair has the next seed.
        on: where matches are played, as for :func:`pipeline.engine.placement.places.place_of`.

    Raises:
        BadSettings, NotFound: if a word names no team.
        WorkerLost: if a worker was lost; pairs that had ended are stored.
    """
    store, policies = Store(data), dict[str, PolicyTables]()
    for word in teams:
        entrant(store, word, policies)
    seeds = range(seed, seed + pairs)
    with placed(on, store.root) as executors:
        found = [evaluate(store, evaluation, seeds, policies, executors)[1] for evaluation in evaluations]
    runner.get().show(
        lambda: "\n".join(f"- {one.team.name} against {one.opponent.name}: {new} of {pairs} pairs played now"
                          for one, new in zip(evaluations, found, strict=True)),
        key="evaluation", description="what was played")
    return Played(pairs=found)


def play_pair(data: Path, pair: Pair, policies: Mapping[str, PolicyTables]) -> pl.DataFrame:
    """Rows of schema Evaluations of a pair, which is played and stored unless it was before."""
    store = Store(data)
    rows = stored(store, pair)
    if rows is None:
        rows = results_of_pair(pair, policies)
        store.commit(_work(pair), Made([(rows, Evaluations)]))
    return rows


def stored(store: Store, pair: Pair) -> pl.DataFrame | None:
    """Stored result of a pair; None if it has not been played."""
    receipt = store.holding(_work(pair))
    return None if receipt is None else table_of(store, receipt, Evaluations)


def _work(pair: Pair) -> Work:
    """A pair as a piece of work: it depends on the version of the arena, too."""
    return STAGES[NOUN].work(pair.name, pair, {}, seed=pair.seed, through={"arena": arena.VERSION})
