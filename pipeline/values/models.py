"""Models of the probability to score soon: logistic and boosting, cross-fitted by match and calibrated."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import log_loss, roc_auc_score

from pipeline.arrays import F32, F64, I64, Bools
from pipeline.settings import ModelSettings
from pipeline.values import trees
from pipeline.values.trees import Trees
from schemas.values import FEATURES, NAMED

#: Features of the plainer models that the report compares with: the ball's alone.
CONTROLS = {"ball_x": (0,), "ball": tuple(range(8))}
#: Iterations that scikit-learn's solver may take.
_ITERATIONS = 1000
#: Places of a feature's value where a robot is missing that a logistic model reads: far off, and across.
_MISSING = np.array([0.0] * 8 + [5.0, 5.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True)
class Logistic:
    """A logistic model of some features: logit = intercept + sum of weight * (feature - mean) / spread.

    Attributes:
        places: int64 [P], the features.
        mean, spread: float64 [P].
        weight: float64 [P].
        intercept: float64 [1].
    """

    places: I64
    mean: F64
    spread: F64
    weight: F64
    intercept: F64

    @classmethod
    def fit(cls, features: F32, scores: Bools, places: Sequence[int], settings: ModelSettings) -> Logistic:
        """Fit it to features float32 [T, F] and scores bool [T], both of which must occur."""
        chosen = np.array(places, dtype=np.int64)
        table = _known(features)[:, chosen]
        mean, spread = table.mean(axis=0), np.maximum(table.std(axis=0), 1e-6)
        inverse = settings.evidence * settings.penalty**2
        model = LogisticRegression(C=inverse, max_iter=_ITERATIONS)  # type: ignore[no-untyped-call]
        model.fit((table - mean) / spread, scores)
        weight, intercept = (part.astype(np.float64) for part in (model.coef_[0], model.intercept_))
        return cls(chosen, mean, spread, weight, intercept)

    def logits(self, features: F32) -> F64:
        """Logit of each moment, float64 [T]."""
        table = (_known(features)[:, self.places] - self.mean) / self.spread
        found: F64 = table @ self.weight + self.intercept[0]
        return found


@dataclass(frozen=True, slots=True)
class Models:
    """The models of one group of matches.

    Attributes:
        fits: one model a fold, fitted without that fold's part; Logistic or Trees.
        calibration: float64 [2], a and b of the probability ``1 / (1 + exp(-(a logit + b)))`` (Platt 1999).
        matches: matches that they were fitted to, sorted.
        block_ns: with fewer matches than folds, the length of the stretches that are left out in turn;
            0 if whole matches are.
    """

    fits: tuple[Logistic | Trees, ...]
    calibration: F64
    matches: tuple[str, ...]
    block_ns: int

    def chances(self, moments: pl.DataFrame) -> F64:
        """Probability that the team scores soon, float64 [T], for rows of schema Moments.

        A moment that models were fitted to gets the one without it, any other the mean of their logits.
        """
        features = _features(moments)
        logits = np.array([_logits(fit, features) for fit in self.fits])
        fold = _folds(moments, self.matches, len(self.fits), self.block_ns)
        there = np.where(fold >= 0, logits[np.maximum(fold, 0), np.arange(len(fold))], logits.mean(axis=0))
        return _probability(self.calibration[0] * there + self.calibration[1])


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
            calibrated.

    Returns:
        The models, None with fewer than ``goals_at_least`` goals or with all of them in one fold, and a
        report: matches, moments, goals, kind, and for each model log_loss and auc of the moments left out
        (rate: of the mean).
    """
    known = moments.filter(pl.col("scores").is_not_null())
    apart = round(settings.moments_apart_s * 1e9)
    block = pl.col("t_ns") // apart
    known = known.filter((block != block.shift()).over("match_id", "team").fill_null(value=True))
    goals = _goals(known)
    report: dict[str, Any] = {
        "matches": known["match_id"].n_unique(), "moments": known.height, "goals": goals, "kind": None,
    }
    if goals < settings.goals_at_least:
        return None, report
    matches = tuple(known["match_id"].unique().sort().to_list())
    block_ns = 0 if len(matches) >= settings.folds else round(settings.block_s * 1e9)
    fold = _folds(known, matches, settings.folds, block_ns)
    features, scores = _features(known), known["scores"].to_numpy()
    parts = [(features[fold != f], scores[fold != f]) for f in range(settings.folds)]
    if not all(_both(left) for _, left in parts):
        return None, report
    kinds: dict[str, tuple[Logistic | Trees, ...]] = {}
    if ready is not None:
        kinds["shipped"] = ready.fits * settings.folds
    kinds["logistic"] = tuple(Logistic.fit(*part, range(NAMED), settings) for part in parts)
    if goals >= settings.boosting_goals:
        kinds["boosting"] = tuple(trees.grow(*part, settings) for part in parts)
    best, least = None, np.inf
    for name, fits in kinds.items():
        left_out = np.array([_logits(each, features) for each in fits])[fold, np.arange(len(fold))]
        calibration = _platt(left_out, scores)
        chances = _probability(calibration[0] * left_out + calibration[1])
        report[name] = _figures(scores, chances)
        if report[name]["log_loss"] < least:
            least, best = report[name]["log_loss"], Models(fits, calibration, matches, block_ns)
            report["kind"] = name
    for name, places in CONTROLS.items():
        left_out = np.empty(len(scores))
        for f, part in enumerate(parts):
            left_out[fold == f] = Logistic.fit(*part, places, settings).logits(features[fold == f])
        report[name] = _figures(scores, _probability(left_out))
    report["rate"] = _figures(scores, np.full(len(scores), scores.mean()))
    return best, report


def to_bytes(models: Models) -> bytes:
    """The models as an .npz file; the same models give the same bytes."""
    arrays: dict[str, npt.NDArray[np.generic]] = {
        "calibration": models.calibration, "matches": np.array(models.matches, dtype=np.str_),
        "block_ns": np.array([models.block_ns]), "features": np.array(list(FEATURES), dtype=np.str_),
    }
    for k, each in enumerate(models.fits):
        fields = each._asdict() if isinstance(each, Trees) else {
            name: getattr(each, name) for name in Logistic.__slots__}
        kind = "trees" if isinstance(each, Trees) else "logistic"
        arrays |= {f"{kind}.{k}.{name}": array for name, array in fields.items()}
    out = io.BytesIO()
    np.savez_compressed(out, allow_pickle=False, **arrays)
    return out.getvalue()


def from_bytes(data: bytes) -> Models:
    """The models of an .npz file that :func:`to_bytes` made."""
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        kinds = {"trees": (Trees, Trees._fields), "logistic": (Logistic, Logistic.__slots__)}
        fits = []
        for k in range(sum(name.endswith((".base", ".intercept")) for name in arrays.files)):
            kind = "trees" if f"trees.{k}.base" in arrays.files else "logistic"
            make, names = kinds[kind]
            fits.append(make(**{name: arrays[f"{kind}.{k}.{name}"] for name in names}))
        return Models(
            tuple(fits), arrays["calibration"], tuple(arrays["matches"].tolist()), int(arrays["block_ns"][0]))


def to_json(models: Models) -> dict[str, Any]:
    """Logistic models as readable numbers, which :func:`shipped` reads: the mean of all folds' fits."""
    fits = [each for each in models.fits if isinstance(each, Logistic)]
    mean = {name: np.mean([getattr(each, name) for each in fits], axis=0) for name in Logistic.__slots__}
    return {
        "features": [list(FEATURES)[int(place)] for place in mean.pop("places")],
        **{name: values.round(6).tolist() for name, values in mean.items()},
        "calibration": models.calibration.round(6).tolist(),
    }


def shipped() -> Models:
    """The models that come with the package, of no match of the user's; for recordings with too few goals."""
    text = resources.files("pipeline.values").joinpath("shipped.json").read_text(encoding="utf-8")
    found = json.loads(text)
    arrays = {name: np.array(found[name]) for name in ("mean", "spread", "weight", "intercept")}
    places = np.array([list(FEATURES).index(name) for name in found["features"]], dtype=np.int64)
    return Models((Logistic(places, **arrays),), np.array(found["calibration"]), (), 0)


def _features(moments: pl.DataFrame) -> F32:
    """The features as float32 [T, F], NaN where unknown."""
    return np.ascontiguousarray(moments["features"].to_numpy(), dtype=np.float32)


def _known(features: F32) -> F64:
    """The named features, with a stand-in where a robot is missing, float64 [T, NAMED]."""
    named = features[:, :NAMED].astype(np.float64)
    return np.where(np.isnan(named), _MISSING, named)


def _logits(model: Logistic | Trees, features: F32) -> F64:
    return model.logits(features) if isinstance(model, Logistic) else trees.logits(model, features)


def _folds(moments: pl.DataFrame, matches: tuple[str, ...], folds: int, block_ns: int) -> I64:
    """The fold of each moment, int64 [T]; -1 for a match that is not among ``matches``."""
    names = moments["match_id"].to_numpy()
    order = {name: place for place, name in enumerate(matches)}
    place = np.array([order.get(name, -1) for name in names], dtype=np.int64)
    number = place if not block_ns else moments["t_ns"].to_numpy() // block_ns + place
    return np.where(place < 0, -1, number % folds)


def _goals(moments: pl.DataFrame) -> int:
    """Goals among the moments: segments that end with one for either team."""
    scored = moments.filter(pl.col("scores"))
    return scored.select("match_id", "segment", "team").unique().height


def _both(scores: Bools) -> bool:
    return bool(scores.any() and not scores.all())


def _probability(logits: F64) -> F64:
    found: F64 = 1 / (1 + np.exp(-np.clip(logits, -30, 30)))
    return found


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
