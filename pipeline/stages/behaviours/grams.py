"""Grams: distinct runs of consecutive situations, counted and valued (paper section 3.2.2)."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import Bools
from pitchlore.pipeline.numbers.sums import added_up, exact
from pitchlore.pipeline.stages.sequences.windows import codes_of, instances, mark, owner_of, role_of, windows
from pitchlore.schemas import ROLES

#: Quantum of sums that may be larger than those of values; exact below 2**37.
_COARSE = 2.0**-16


def cover(sequence: pl.DataFrame, patterns: pl.DataFrame) -> Bools:
    """Mask of the situations that are part of a behaviour already, bool [S].

    The patterns are applied in the order of the rounds: four situations first, then three in the
    rest, and so on. Overlapping instances of one length all count.

    Args:
        sequence: columns role, code and follows, perhaps who [S].
        patterns: columns role and codes (schema Patterns), perhaps who, of all earlier rounds together.
    """
    taken = np.zeros(sequence.height, dtype=np.bool_)
    for found in instances(sequence, patterns):
        mark(found.first, found.n, taken)
    return taken


def grams(sequence: pl.DataFrame, n: int, taken: Bools | None = None) -> pl.DataFrame:
    """Count and value the distinct runs of ``n`` consecutive situations.

    Args:
        sequence: rows of schema Sequences of some matches, each whole; with a column who, grams of these
            owners are distinguished [S].
        n: 1 to 4.
        taken: bool [S], situations that are used up (:func:`cover`); None for none.

    Returns:
        One row a distinct (owner, role at the start, codes), sorted by ``key``: that of
        :func:`pipeline.stages.sequences.windows.keys_of`, and the counts and sums of schema Grams. Tables of
        other matches are added up by :func:`merge`.
    """
    runs = windows(sequence, n, taken)
    rows = runs.first[:, None] + np.arange(n)
    paper = exact(sequence["value"].to_numpy()[rows].mean(axis=1))
    by_change = sequence["change"].null_count() == 0
    instance = exact(sequence["change"].to_numpy()[rows].sum(axis=1)) if by_change else paper
    x, y = (exact(sequence[name].cast(pl.Float64).to_numpy()[runs.first], _COARSE) for name in ("x", "y"))
    known = ~np.isnan(x)
    each = pl.DataFrame({
        "match": sequence["match_id"].to_physical()[runs.first],
        "key": runs.key,
        "value_sum": instance,
        "value_square_sum": exact(instance**2),
        "paper_sum": paper,
        "placed": known.astype(np.int64),
        "x_sum": np.where(known, x, 0.0),
        "y_sum": np.where(known, y, 0.0),
    })
    of_match = each.lazy().group_by("match", "key").agg(
        pl.len().cast(pl.Int64).alias("count"), pl.exclude("match", "key").sum()).collect()
    total, count = (of_match[name].to_numpy() for name in ("value_sum", "count"))
    return added_up([of_match.select(
        "key", "count", "value_sum", "value_square_sum",
        pl.Series("match_square_sum", exact(total**2, _COARSE)),
        pl.Series("match_product_sum", exact(total * count, _COARSE)),
        pl.Series("match_count_square_sum", count**2),
        "paper_sum", "placed", "x_sum", "y_sum",
    )], "key")


def merge(tables: Iterable[pl.DataFrame]) -> pl.DataFrame:
    """Add up grams over matches; see :func:`pipeline.numbers.sums.added_up`.

    Args:
        tables: at least one, of :func:`grams` or of this function, of any lengths.

    Returns:
        One row a distinct key, sorted by key: by owner, role and codes.
    """
    return added_up(tables, "key")


def spelt(merged: pl.DataFrame, n: int) -> pl.DataFrame:
    """Merged grams of one length with the columns of their keys: who (int64), role, codes and n."""
    key = merged["key"].to_numpy()
    codes = pl.Series("codes", codes_of(key, n), dtype=pl.Array(pl.Int16, n)).cast(pl.List(pl.Int16))
    return merged.select(
        pl.Series("who", owner_of(key)),
        pl.Series("role", np.array(ROLES)[role_of(key)], dtype=pl.Enum(ROLES)),
        codes,
        pl.lit(n, dtype=pl.Int8).alias("n"),
        pl.exclude("key"),
    )
