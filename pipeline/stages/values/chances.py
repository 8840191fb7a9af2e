"""Expected goals of shots: logistic models of a league's shots, each without one match.

They are fitted in :mod:`pipeline.stages.values.shooting`.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.settings import ChanceSettings
from pitchlore.pipeline.stages.values.models import probability
from pitchlore.schemas import Chances

#: What a shot is judged by, in the order of :func:`shot_features`.
FEATURES = ("log distance", "log angle", "log cover", "in_way", "log cover * angle")
#: Greatest distance of an adversary from the ball's way that is distinguished, in half goals.
_FAR_COVER = 3.0
#: Added to distance (lengths of the pitch) and cover (half goals) before the logarithm: nearer is alike.
_NEAR, _NEAR_COVER = 0.03, 0.1
#: Least angle that is distinguished, rad: 0 from beside the goal.
_LEAST_ANGLE = 0.01


@dataclass(frozen=True, slots=True)
class ShotModels:
    """The models of the shots of one league: row m is fitted without match m, the last row with all.

    Attributes:
        matches: matches that they were fitted to, sorted, [M].
        weights: float64 [M + 1, 1 + features], intercept and coefficients of the logit; NaN where the shots
            are all goals, or none is.
        goals, shots: int64 [M + 1], what each row was fitted to.
    """

    matches: tuple[str, ...]
    weights: F64
    goals: I64
    shots: I64

    def row_of(self, match: str) -> int:
        """The row of the model that has not seen a match."""
        return self.matches.index(match) if match in self.matches else len(self.matches)


def chances_to_bytes(models: ShotModels) -> bytes:
    """The models as an .npz file; the same models give the same bytes."""
    out = io.BytesIO()
    np.savez_compressed(
        out, allow_pickle=False, matches=np.array(models.matches, dtype=np.str_), weights=models.weights,
        goals=models.goals, shots=models.shots, features=np.array(FEATURES, dtype=np.str_))
    return out.getvalue()


@lru_cache(maxsize=2)  # a process judges the shots of many matches by the same
def chances_from_bytes(data: bytes) -> ShotModels:
    """The models of an .npz file that :func:`chances_to_bytes` made."""
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        return ShotModels(
            tuple(arrays["matches"].tolist()), arrays["weights"], arrays["goals"], arrays["shots"])


def shot_features(shots: pl.DataFrame, pitch: Pitch) -> F64:
    """Features of the shots of one pitch, float64 [n, features]; lengths in those of the pitch.

    Distance is in lengths of the pitch, angle in rad, cover in half goals, at most 3. Where no adversary is
    seen, none is in the way. The product says that a free way is worth more, the wider the goal is seen.
    """
    distance, angle, cover = (pl.col(name).cast(pl.Float64) for name in ("distance", "angle", "cover"))
    cover = (cover / (pitch.goal_width / 2)).fill_null(_FAR_COVER).clip(0, _FAR_COVER)
    free = (cover + _NEAR_COVER).log()
    return shots.select(
        (distance / pitch.length + _NEAR).log().alias(FEATURES[0]),
        angle.clip(lower_bound=_LEAST_ANGLE).log().alias(FEATURES[1]),
        free.alias(FEATURES[2]),
        pl.col("in_way").cast(pl.Float64).fill_null(0.0).alias(FEATURES[3]),
        (free * angle).alias(FEATURES[4]),
    ).to_numpy()


def shot_logits(weights: F64, features: F64) -> F64:
    """Logit of each shot, float64 [n]: weights [1 + features], features [n, features]."""
    # feature by feature: the last bits of a BLAS product depend on its threads and on the processor
    found = np.full(len(features), weights[0])
    for column, weight in zip(features.T, weights[1:], strict=True):
        found += column * weight
    return found


def chances(
    match: str, shots: pl.DataFrame, pitch: Pitch, models: ShotModels | None, settings: ChanceSettings
) -> pl.DataFrame:
    """Rows of schema Chances: expected goals of the shots of one match, by a model that has not seen it.

    Args:
        match: its id.
        shots: rows of schema Shots of the match.
        pitch: pitch of the match.
        models: models of its league; None if no shot of the league is known.
        settings: settings of the stage.
    """
    row = 0 if models is None else models.row_of(match)
    goals, number = (0, 0) if models is None else (int(models.goals[row]), int(models.shots[row]))
    xg = pl.Series("xg", [None] * shots.height, dtype=pl.Float64)
    # without a shot that fails there is nothing to tell goals from
    if models is not None and goals >= settings.goals_at_least and np.isfinite(models.weights[row]).all():
        xg = pl.Series("xg", probability(shot_logits(models.weights[row], shot_features(shots, pitch))))
    return shots.select(
        "match_id", "team", "t_ns", "robot", xg, goals=pl.lit(goals), shots=pl.lit(number),
    ).cast(pl.Schema(Chances.dtypes()))
