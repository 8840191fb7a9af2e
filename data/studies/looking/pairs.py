"""Goal differences of pairs of matches, kept in a data folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import polars as pl

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.stages.report.measures import DIFFERENCE

_SCHEMA = {"seed": pl.Int64, "difference": pl.Float64}


def of_pairs(rows: pl.DataFrame) -> pl.DataFrame:
    """Goal differences of an evaluation, a row a pair of matches: seed, difference.

    Args:
        rows: schema Evaluations.
    """
    return rows.group_by("seed", maintain_order=True).agg(difference=DIFFERENCE.mean())


def kept(
    folder: Path, said: str, seeds: Sequence[int], play: Callable[[Sequence[int]], pl.DataFrame] | None
) -> pl.DataFrame:
    """Goal differences of pairs, by seed; those that are missing are played.

    Args:
        folder: folder of the files.
        said: everything that the results depend on but the seeds, in words.
        seeds: seeds of the pairs.
        play: plays pairs of some seeds: a row a pair, seed and difference. None: missing pairs have no row.
    """
    path = folder / f"{digest(said.encode())}.csv"
    known = pl.read_csv(path) if path.exists() else pl.DataFrame(schema=_SCHEMA)
    missing = [seed for seed in seeds if seed not in known["seed"]]
    if missing and play is not None:
        known = pl.concat([known, play(missing)]).sort("seed")
        folder.mkdir(parents=True, exist_ok=True)
        aside = path.with_suffix(".part")
        known.write_csv(aside)
        aside.rename(path)
    return known.filter(pl.col("seed").is_in(list(seeds)))
