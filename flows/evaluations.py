"""Evaluations: pairs of matches that are not there yet are played, by several processes."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

import polars as pl

from flows.stage import listener
from flows.workers import Workers
from pipeline.store import Store
from pipeline.store.receipts import key_of
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
        store.commit(
            NOUN, pair.name, _key(pair), inputs={}, settings=pair.model_dump(mode="json"),
            seed=pair.seed, tables={"evaluations": (rows, Evaluations)},
        )
        there[pair.seed] = rows
        listener.get().advance(NOUN, pair.name)
    return pl.concat([there[seed] for seed in pairs]), len(todo)


def _there(store: Store, pair: Pair) -> pl.DataFrame | None:
    """What a pair of matches came to, if it was played."""
    receipt = store.holding(NOUN, pair.name, _key(pair))
    return None if receipt is None else store.read_table(receipt, "evaluations", Evaluations)


def _key(pair: Pair) -> str:
    return key_of(NOUN, pair.name, inputs={}, settings=pair.model_dump(mode="json"), seed=pair.seed,
                  tables=(Evaluations,))


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
