"""Acts that are said to go surely with winning, or with losing: how many do so in other matches.

``make surely`` calls it after ``study.py``, on the same matches: the view `answers` over the matches to learn
from, and over the others. *Holds*: the mean worth in the other matches has the side of 0 that was said; rows
with fewer than five acts there are left out. Control: what followed each act is dealt anew among the acts of
its team and match, less its mean, so that no act goes with anything.

Aims, written down before: of what is *sure* and seen again 90 % holds on each side, of what is *likely*
75 %.
"""

from __future__ import annotations

import sys
from pathlib import Path

import duckdb
import numpy as np
import polars as pl
from surely.study import NOUNS, SUPPORT

from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.numbers.statistics import wilson
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Acts, Answers, Sides

KEY = ("team", "kind", "role", "act", "place")


def tables_of(store: Store) -> tuple[pl.DataFrame, pl.DataFrame]:
    """The acts and the sides of all matches of a data folder; what is missing is made."""
    STAGES.make(store, Settings(), scope_of(store), NOUNS | {"acts"})
    acts, sides = (
        pl.concat([store.read_table(receipt, schema.NAME, schema) for receipt in store.receipts(noun)])
        for noun, schema in (("acts", Acts), ("sides", Sides)))
    return acts, sides


def dealt(acts: pl.DataFrame, seed: int) -> pl.DataFrame:
    """Acts whose worths are dealt anew among those of their team and match, less their mean."""
    rng, parts = np.random.default_rng(seed), []
    known = acts.drop_nulls(["before", "after", "usual"])
    for _, part in known.group_by("match_id", "team", maintain_order=True):
        worth = part["after"] - part["before"] - part["usual"]
        anew = pl.Series(rng.permutation((worth - worth.mean()).to_numpy()))
        parts.append(part.with_columns(before=pl.lit(0.0), usual=pl.lit(0.0), after=anew))
    return pl.concat(parts)


def answers_of(acts: pl.DataFrame, sides: pl.DataFrame) -> pl.DataFrame:
    """The view `answers` over these acts."""
    with duckdb.connect() as connection:
        connection.register("acts", acts.cast({pl.Enum: pl.String}).to_arrow())
        connection.register("sides", sides.cast({pl.Enum: pl.String}).to_arrow())
        return pl.DataFrame(connection.sql(Answers.VIEW).to_arrow_table())


def main(out: Path, data: Path, seed: int = 1) -> None:
    """Write the table."""
    stores, rows = [tables_of(Store(data / name)) for name in ("learned", "others")], []
    for outcomes in ("as they were", "dealt anew"):
        first, other = (answers_of(acts if outcomes == "as they were" else dealt(acts, seed), sides)
                        for acts, sides in stores)
        both = first.join(other.filter(pl.col("n") >= SUPPORT), on=KEY, how="left", suffix="_again")
        for says in ("sure", "likely"):
            for side, name in ((1, "winning"), (-1, "losing")):
                own = both.filter(pl.col("says") == says, side * pl.col("value") > 0)
                again = own.drop_nulls("value_again")
                holds = int((side * again["value_again"] > 0).sum())
                low, high = wilson(holds, again.height) if again.height else (float("nan"), float("nan"))
                rows.append({
                    "outcomes": outcomes, "says": says, "with": name, "rows": both.height, "said": own.height,
                    "seen_again": again.height, "holds": holds, "low": round(low, 3),
                    "high": round(high, 3)})
    pl.DataFrame(rows).write_csv(out / "acts.csv")


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1]))
