"""The level of the shipped V in other leagues, before and after it is fitted to their goals.

``make study-values`` (two minutes of it) judges each half of a recording by the other half, and of each
pairing of our arena one match by another (seeds 7101 and 7102; no choice was made on them). It writes
``level.csv``: for each the goals of both parts, how many times as often as it happened V says that a team
scores soon (ratio), and the log-loss; *before*: as shipped, *after*: its one offset fitted to the other part,
*rate*: the other part's share of moments that score, half a moment added to either outcome.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
from harness import elsewhere, recordings
from sklearn.metrics import log_loss
from values.study import PAIRINGS, played, watch

from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.settings import ModelSettings
from pitchlore.pipeline.stages.values import models
from pitchlore.pipeline.stages.values.fitting import levelled

SEEDS = (7101, 7102)


def apart(moments: pl.DataFrame) -> pl.DataFrame:
    """Moments whose outcome is known, a second apart."""
    second = pl.col("t_ns") // 1_000_000_000
    known = moments.filter(pl.col("scores").is_not_null())
    return known.filter((second != second.shift()).over("match_id", "team").fill_null(value=True))


def goals(moments: pl.DataFrame) -> int:
    """Goals among moments."""
    return moments.filter("scores").select("match_id", "segment", "team").unique().height


def row(name: str, fitted: pl.DataFrame, judged: pl.DataFrame) -> dict[str, object]:
    """The figures of one part, by V as shipped and by its level in another part."""
    ready = models.shipped()
    after, level = levelled(
        ready, models.features_of(fitted), fitted["scores"].to_numpy(), ModelSettings().evidence)
    scores = judged["scores"].to_numpy()
    rate = np.full(len(scores), (float(fitted["scores"].to_numpy().sum()) + 0.5) / (fitted.height + 1))

    def loss(chances: F64) -> float:
        return round(float(log_loss(scores, chances, labels=[False, True])), 4)

    def ratio(chances: F64) -> float | None:
        return round(float(chances.sum() / scores.sum()), 2) if scores.any() else None

    says = {"before": ready.chances(judged), "after": after.chances(judged), "rate": rate}
    return {"game": name, "goals_fitted": goals(fitted), "goals": goals(judged), "moments": judged.height,
            **{name: round(value, 2) for name, value in level.items()},
            **{f"ratio_{when}": ratio(chances) for when, chances in says.items()},
            **{f"log_loss_{when}": loss(chances) for when, chances in says.items()}}


def main(out: Path, folder: Path) -> None:
    """Write the table."""
    rows = []
    for name, path in recordings(folder).items():
        seen = apart(watch(path.read_bytes(), name).moments)
        first = pl.col("t_ns") < seen["t_ns"].median()
        halves = seen.filter(first), seen.filter(~first)
        rows += [row(f"{name}, {half} half", halves[1 - i], halves[i])
                 for i, half in enumerate(("first", "second"))]
    for home, away in PAIRINGS:
        one, two = (apart(played((home, away, seed)).moments) for seed in SEEDS)
        rows.append(row(f"{home} - {away}", one, two))
    pl.DataFrame(rows, infer_schema_length=None).write_csv(out / "level.csv")


if __name__ == "__main__":
    main(Path(__file__).parent, elsewhere())
