"""Evaluations: pairs of matches that are not there yet are played, by several processes."""

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
    """Play the pairs of matches of an evaluation that are not there yet; each is kept when it is over.

    What comes out does not depend on ``jobs``.

    Args:
        store: where they are kept.
        evaluation: what to play.
        seeds: of the pairs, each once.
        policies: rows of schema Policies by the label that the teams' settings name.
        jobs: processes; with one it is all done in this process.

    Returns:
        Rows of schema Evaluations of all the pairs, and how many pairs were played now.

    Raises:
        WorkerLost: if a process was killed; what was over by then is kept.
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
    """What a pair of matches came to, if it was played."""
    receipt = store.holding(_work(pair))
    return None if receipt is None else store.read_table(receipt, "evaluations", Evaluations)


def _work(pair: Pair) -> Work:
    """A pair as a piece of work: it depends on the version of the arena, too."""
    return STAGES[NOUN].work(pair.name, pair, {}, seed=pair.seed, through={"arena": arena.VERSION})


def _played(
    pairs: Sequence[Pair], policies: Mapping[str, pl.DataFrame], jobs: int
) -> Iterator[tuple[Pair, pl.DataFrame]]:
    """Each pair with its rows, as soon as it is over."""
    with Workers(jobs) as workers, ThreadPoolExecutor(jobs) as threads:
        futures = {threads.submit(workers.run, play, pair, policies): pair for pair in pairs}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            threads.shutdown(wait=False, cancel_futures=True)
