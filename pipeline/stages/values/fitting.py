"""Models fitted to the moments of matches, by scikit-learn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import log_loss, roc_auc_score

from pitchlore.pipeline.numbers.arrays import F32, F64, Bools
from pitchlore.pipeline.numbers.threads import one_thread
from pitchlore.pipeline.numbers.trees import Trees, arrays_of
from pitchlore.pipeline.settings import ModelSettings
from pitchlore.pipeline.stages.values.models import (
    Logistic,
    Models,
    features_of,
    folds_of,
    logits_of,
    named_of,
    probability,
)
from pitchlore.schemas.values import NAMED

#: Features of the plainer models that the report compares with: the ball's alone.
CONTROLS = {"ball_x": (0,), "ball": tuple(range(8))}
#: Iterations that scikit-learn's solver may take.
_ITERATIONS = 1000
#: Standard deviation, before a match was seen, of a league's offset from the models that are ready.
_LEAGUES_APART = 1.0


def fit(
    moments: pl.DataFrame, settings: ModelSettings, ready: Models | None = None
) -> tuple[Models | None, dict[str, Any]]:
    """Fit the models of a group of matches, and choose the best kind.

    Each kind is fitted once a fold, without that fold's matches, and calibrated on the moments left out. The
    kind with the least log-loss there is kept, the plainest of equals; its figures and those of plainer
    models are reported.

    Args:
        moments: rows of schema Moments of all matches.
        settings: settings of the stage.
        ready: models that know none of these matches; they are one more kind ("shipped"), which is only
            calibrated. With fewer than ``goals_at_least`` goals, or with all of them in one fold, it has the
            level of these matches (:func:`levelled`).

    Returns:
        The models, None with so few goals and nothing ready, and a report: matches, moments, goals, kind, and
        for each model log_loss and auc of the moments left out (rate: of the mean); with so few goals kind is
        None, and level says how the ready model was moved. Last bits depend on the processor, but not on how
        many threads it has.
    """
    # its threads also wait for each other longer than they work on a few thousand moments
    with one_thread():
        return _fit(moments, settings, ready)


def _fit(
    moments: pl.DataFrame, settings: ModelSettings, ready: Models | None
) -> tuple[Models | None, dict[str, Any]]:
    known = moments.filter(pl.col("scores").is_not_null())
    apart = round(settings.moments_apart_s * 1e9)
    block = pl.col("t_ns") // apart
    known = known.filter((block != block.shift()).over("match_id", "team").fill_null(value=True))
    goals = _goals(known)
    report: dict[str, Any] = {
        "matches": known["match_id"].n_unique(), "moments": known.height, "goals": goals, "kind": None,
    }
    features, scores = features_of(known), known["scores"].to_numpy()
    matches = tuple(known["match_id"].unique().sort().to_list())
    block_ns = 0 if len(matches) >= settings.folds else round(settings.block_s * 1e9)
    fold = folds_of(known, matches, settings.folds, block_ns)
    parts = [(features[fold != f], scores[fold != f]) for f in range(settings.folds)]
    if goals < settings.goals_at_least or not all(left.any() and not left.all() for _, left in parts):
        if ready is None:
            return None, report
        moved, level = levelled(ready, features, scores, settings.evidence)
        return moved, report | {"level": level}
    kinds: dict[str, tuple[Logistic | Trees, ...]] = {}
    if ready is not None:
        kinds["shipped"] = ready.fits * settings.folds
    kinds["logistic"] = tuple(logistic(*part, range(NAMED), settings) for part in parts)
    if goals >= settings.boosting_goals:
        kinds["boosting"] = tuple(grow(*part, settings) for part in parts)
    best, least = None, np.inf
    for name, fits in kinds.items():
        left_out = np.array([logits_of(each, features) for each in fits])[fold, np.arange(len(fold))]
        calibration = _platt(left_out, scores)
        chances = probability(calibration[0] * left_out + calibration[1])
        report[name] = _figures(scores, chances)
        if report[name]["log_loss"] < least:
            least, best = report[name]["log_loss"], Models(fits, calibration, matches, block_ns)
            report["kind"] = name
    for name, places in CONTROLS.items():
        left_out = np.empty(len(scores))
        for f, part in enumerate(parts):
            left_out[fold == f] = logistic(*part, places, settings).logits(features[fold == f])
        report[name] = _figures(scores, probability(left_out))
    report["rate"] = _figures(scores, np.full(len(scores), scores.mean()))
    return best, report


def levelled(ready: Models, features: F32, scores: Bools, evidence: float) -> tuple[Models, dict[str, float]]:
    """Models with the one offset of their logits that makes them say goals as often as there are.

    Before a match was seen the offset is 0, with a standard deviation of ``_LEAGUES_APART`` (its e-th power
    is a ratio of chances); each moment weighs ``evidence``. Newton's steps find the most probable offset.

    Returns:
        The models, and offset and error: its standard error by the normal approximation.
    """
    slope, base = ready.calibration
    logits = slope * np.mean([logits_of(each, features) for each in ready.fits], axis=0) + base
    offset, information = 0.0, 1.0
    for _ in range(50):
        chance = probability(logits + offset)
        information = evidence * float((chance * (1 - chance)).sum()) + _LEAGUES_APART**-2
        step = evidence * float((scores - chance).sum()) - offset * _LEAGUES_APART**-2
        offset += float(np.clip(step / information, -1.0, 1.0))
    level = {"offset": round(offset, 6), "error": round(information**-0.5, 6)}
    calibration = np.array([slope, base + level["offset"]])
    return Models(ready.fits, calibration, ready.matches, ready.block_ns), level


def logistic(features: F32, scores: Bools, places: Sequence[int], settings: ModelSettings) -> Logistic:
    """A logistic model fitted to features float32 [T, F] and scores bool [T], both of which must occur."""
    chosen = np.array(places, dtype=np.int64)
    table = named_of(features)[:, chosen]
    mean, spread = table.mean(axis=0), np.maximum(table.std(axis=0), 1e-6)
    inverse = settings.evidence * settings.penalty**2
    model = LogisticRegression(C=inverse, max_iter=_ITERATIONS)  # type: ignore[no-untyped-call]
    model.fit((table - mean) / spread, scores)
    weight, intercept = (part.astype(np.float64) for part in (model.coef_[0], model.intercept_))
    return Logistic(chosen, mean, spread, weight, intercept)


def grow(features: F32, scores: Bools, settings: ModelSettings) -> Trees:
    """Boosted trees for the probability to score (Friedman 2001; scikit-learn's histogram boosting).

    Args:
        features: float32 [T, F], NaN where unknown.
        scores: bool [T]; both values must occur.
        settings: evidence of a moment, number, size and regularisation of the trees, and the seed of the
            bins.
    """
    # weights that are all the same only divide the penalty, and with weights the bins take four times as long
    penalty = settings.tree_penalty / settings.evidence
    builder = HistGradientBoostingClassifier(  # type: ignore[no-untyped-call]
        max_iter=settings.trees, learning_rate=settings.learning_rate, max_leaf_nodes=settings.leaves,
        min_samples_leaf=settings.leaf_samples, l2_regularization=penalty,
        early_stopping=False, random_state=settings.seed,
    )
    with one_thread():
        model = builder.fit(features, scores)
    return arrays_of(model)


def _goals(moments: pl.DataFrame) -> int:
    """Goals among the moments: segments that end with one for either team."""
    scored = moments.filter(pl.col("scores"))
    return scored.select("match_id", "segment", "team").unique().height


def _platt(logits: F64, scores: Bools) -> F64:
    """Slope, at least 0, and offset that make the probabilities of left-out moments true.

    Where nothing can be learned, models are wrong about what they leave out, because the fewer goals there
    are in one part, the more there are in the others. A negative slope would take that for knowledge.
    """
    model = LogisticRegression(C=np.inf, max_iter=_ITERATIONS)  # type: ignore[no-untyped-call]
    model.fit(logits[:, None], scores)
    if model.coef_[0, 0] < 0:
        return np.array([0.0, np.log(scores.mean() / (1 - scores.mean()))])
    return np.array([model.coef_[0, 0], model.intercept_[0]])


def _figures(scores: Bools, chances: F64) -> dict[str, float]:
    return {
        "log_loss": round(float(log_loss(scores, chances)), 5),
        "auc": round(float(roc_auc_score(scores, chances)), 4),
    }
