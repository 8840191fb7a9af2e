"""Models of a league's shots, fitted by scikit-learn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import polars as pl
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import log_loss

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.pipeline.numbers.threads import one_thread
from pitchlore.pipeline.stages.values.chances import FEATURES, ShotModels, shot_features, shot_logits
from pitchlore.pipeline.stages.values.models import probability

#: Features of the plainer models that the report compares with; without any it is the league's rate.
CONTROLS: dict[str, tuple[int, ...]] = {"distance": (0,), "rate": ()}
#: Iterations that scikit-learn's solver may take.
_ITERATIONS = 1000
#: Greatest slope of the loss at which the solver stops, and decimals of a coefficient that are kept.
_TOLERANCE, _DIGITS = 1e-10, 8


def fit_shots(
    league: Mapping[str, tuple[pl.DataFrame, Pitch]], penalty: float
) -> tuple[ShotModels, dict[str, Any]]:
    """Fit a model of the shots of a league without each match, and one with all.

    Args:
        league: rows of schema Shots of each match, and its pitch.
        penalty: standard deviation of the coefficients before any shot was seen, for features of standard
            deviation 1.

    Returns:
        The models, and a report: matches, shots, goals, and, if each match can be left out, for the model and
        for plainer ones expected (the sum of the expected goals), log_loss and brier of the shots left out.
    """
    names = tuple(sorted(league))
    features = np.concatenate(
        [np.empty((0, len(FEATURES))), *(shot_features(*league[name]) for name in names)])
    scored = np.concatenate([np.empty(0, dtype=np.bool_), *(
        (league[name][0]["outcome"] == "goal").to_numpy() for name in names)])
    match = np.repeat(np.arange(len(names)), [league[name][0].height for name in names])
    rows = [match != place for place in range(len(names))] + [np.ones(len(match), dtype=np.bool_)]
    with one_thread():
        weights = np.array([_weights(features[row], scored[row], penalty) for row in rows])
        found = ShotModels(
            names, weights, np.array([int(scored[row].sum()) for row in rows], dtype=np.int64),
            np.array([int(row.sum()) for row in rows], dtype=np.int64))
        report: dict[str, Any] = {"matches": len(names), "shots": len(scored), "goals": int(scored.sum())}
        if len(scored) and np.isfinite(weights).all():
            kinds = {"xg": tuple(range(len(FEATURES))), **CONTROLS}
            report |= {name: figures(scored, left_out(features, scored, match, places, penalty))
                       for name, places in kinds.items()}
    return found, report


def left_out(features: F64, scored: Bools, match: I64, places: Sequence[int], penalty: float) -> F64:
    """Probability of each shot to be a goal by a model without its match, float64 [n].

    Args:
        features: float64 [n, features].
        scored: whether each shot was a goal, bool [n]; without each match both must occur.
        match: the match of each shot, [n].
        places: the features that the model has; none gives the rate of the other matches.
        penalty: as for :func:`fit_shots`.
    """
    found = np.empty(len(scored))
    for each in np.unique(match):
        out = match == each
        if not len(places):
            found[out] = scored[~out].mean()
            continue
        weights = _weights(features[~out][:, places], scored[~out], penalty)
        found[out] = probability(shot_logits(weights, features[out][:, places]))
    return found


def figures(scored: Bools, chances: F64) -> dict[str, float]:
    """Sum of the probabilities, log-loss and Brier score (mean squared error) of shots that were left out."""
    return {
        "expected": round(float(chances.sum()), 2),
        "log_loss": round(float(log_loss(scored, chances, labels=[False, True])), 5),
        "brier": round(float(np.mean((chances - scored) ** 2)), 5),
    }


def _weights(features: F64, scored: Bools, penalty: float) -> F64:
    """Intercept and coefficients of a logistic model, float64 [1 + features]; NaN if all scored or none."""
    if not scored.any() or scored.all():
        return np.full(1 + features.shape[1], np.nan)
    mean, spread = features.mean(axis=0), np.maximum(features.std(axis=0), 1e-6)
    model = LogisticRegression(  # type: ignore[no-untyped-call]
        C=penalty**2, solver="newton-cholesky", tol=_TOLERANCE, max_iter=_ITERATIONS)
    model.fit((features - mean) / spread, scored)
    slopes = model.coef_[0].astype(np.float64) / spread
    # summed one by one, for the reason given in logits_of
    offset = float(model.intercept_[0]) - sum(float(part) for part in slopes * mean)
    # where arrays lie in memory decides the last bits of BLAS, and Newton's steps leave no others to chance
    return np.array([offset, *slopes]).round(_DIGITS)
