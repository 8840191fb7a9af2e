"""Evaluations: missing pairs of matches are played, in several processes."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

import polars as pl

from flows.progress import listener
from flows.stages import STAGES
from flows.workers import Workers
from pipeline import arena
from pipeline.store import Store
from pipeline.store.work import Made, Work
from pipeline.studies.evaluations import Evaluation, Pair, play
from schemas import Evaluations

NOUN = "evaluations"


def evaluate(
    store: Store, evaluation: Evaluation, seeds: Sequence[int], policies: Mapping[str, pl.DataFrame],
    jobs: int = 1,
) -> tuple[pl.DataFrame, int]:
    """Results of all pairs of an evaluation; missing pairs are played, and each is stored when it ends.

    The results do not depend on ``jobs``.

    Args:
        store: store of the results.
        evaluation: settings of the evaluation.
        seeds: seeds of the pairs, each once.
        policies: rows of schema Policies, by the label in the teams' settings.
        jobs: number of processes; with 1 everything runs in this process.

    Returns:
        Rows of schema Evaluations of all pairs, and the number of pairs played now.

    Raises:
        WorkerLost: if a process was killed; pairs that had ended are stored.
    """
    pairs = {seed: Pair(evaluation=evaluation, seed=seed) for seed in sorted(seeds)}
    there = {seed: rows for seed, pair in pairs.items() if (rows := _there(store, pair)) is not None}
    todo = [pair for seed, pair in pairs.items() if seed not in there]
    listener.get().begin(NOUN, len(todo))
    for pair, rows in _played(todo, policies, max(1, min(jobs, len(todo)))):
        store.commit(_work(pair), Made([(rows, Evaluations)]))
        there[pair.seed] = rows
        listener.get().advance(NOUN, pair.name)
    return pl.concat([there[seed] for seed in pairs]), len(todo)


def _there(store: Store, pair: Pair) -> pl.DataFrame | None:
    """Stored result of a pair; None if it has not been played."""
    receipt = store.holding(_work(pair))
    return None if receipt is None else store.read_table(receipt, "evaluations", Evaluations)


def _work(pair: Pair) -> Work:
    """A pair as a piece of work: it depends on the version of the arena, too."""
    return STAGES[NOUN].work(pair.name, pair, {}, seed=pair.seed, through={"arena": arena.VERSION})


def _played(
    pairs: Sequence[Pair], policies: Mapping[str, pl.DataFrame], jobs: int
) -> Iterator[tuple[Pair, pl.DataFrame]]:
    """Each pair with its rows, as soon as it ends."""
    with Workers(jobs) as workers, ThreadPoolExecutor(jobs) as threads:
        futures = {threads.submit(workers.run, play, pair, policies): pair for pair in pairs}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            threads.shutdown(wait=False, cancel_futures=True)
