"""Models of the probability to score soon: logistic and boosting, cross-fitted by match and calibrated.

They are fitted in :mod:`pipeline.stages.values.fitting`.
"""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.numbers import trees
from pitchlore.pipeline.numbers.arrays import F32, F64, I64
from pitchlore.pipeline.numbers.trees import Trees
from pitchlore.schemas.values import FEATURES, NAMED

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

    def logits(self, features: F32) -> F64:
        """Logit of each moment, float64 [T]."""
        table = (named_of(features)[:, self.places] - self.mean) / self.spread
        # feature by feature: the last bits of a BLAS product depend on its threads and on the processor
        found = np.full(len(table), self.intercept[0])
        for column, weight in zip(table.T, self.weight, strict=True):
            found += column * weight
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
        features = features_of(moments)
        logits = np.array([logits_of(fit, features) for fit in self.fits])
        fold = folds_of(moments, self.matches, len(self.fits), self.block_ns)
        there = np.where(fold >= 0, logits[np.maximum(fold, 0), np.arange(len(fold))], logits.mean(axis=0))
        return probability(self.calibration[0] * there + self.calibration[1])


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


@lru_cache(maxsize=2)  # a process values many matches by the same
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
    text = resources.files(__package__).joinpath("shipped.json").read_text(encoding="utf-8")
    found = json.loads(text)
    arrays = {name: np.array(found[name]) for name in ("mean", "spread", "weight", "intercept")}
    places = np.array([list(FEATURES).index(name) for name in found["features"]], dtype=np.int64)
    return Models((Logistic(places, **arrays),), np.array(found["calibration"]), (), 0)


def features_of(moments: pl.DataFrame) -> F32:
    """The features as float32 [T, F], NaN where unknown."""
    return np.ascontiguousarray(moments["features"].to_numpy(), dtype=np.float32)


def named_of(features: F32) -> F64:
    """The named features, with a stand-in where a robot is missing, float64 [T, NAMED]."""
    named = features[:, :NAMED].astype(np.float64)
    return np.where(np.isnan(named), _MISSING, named)


def logits_of(model: Logistic | Trees, features: F32) -> F64:
    """Logit of each moment by either kind of model, float64 [T]; features float32 [T, F]."""
    return model.logits(features) if isinstance(model, Logistic) else trees.logits(model, features)


def folds_of(moments: pl.DataFrame, matches: tuple[str, ...], folds: int, block_ns: int) -> I64:
    """The fold of each moment, int64 [T]; -1 for a match that is not among ``matches``."""
    names = moments["match_id"].to_numpy()
    order = {name: place for place, name in enumerate(matches)}
    place = np.array([order.get(name, -1) for name in names], dtype=np.int64)
    number = place if not block_ns else moments["t_ns"].to_numpy() // block_ns + place
    return np.where(place < 0, -1, number % folds)


def probability(logits: F64) -> F64:
    """The probability of each logit, float64 [T]."""
    found: F64 = 1 / (1 + np.exp(-np.clip(logits, -30, 30)))
    return found
