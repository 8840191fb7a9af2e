"""The sensitivity table: curves for every reading of the details that the paper leaves open."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import polars as pl

from pitchlore.pipeline.stages.paradigms.curves import Curve
from pitchlore.pipeline.stages.paradigms.measures import PRINTED
from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.ivq import IVQ
from pitchlore.pipeline.stages.paradigms.rules.jaq import JAQ

#: Learning rates and discounts. The paper gives "lambda = 0.1" for matrix games and "alpha = 1, lambda = 0.1"
#: for the grid world. It does not say which is which.
RATES = (0.1, 1.0)
DISCOUNTS = (0.0, 0.1, 0.5, 0.8, 0.9, 0.92, 0.95)


def matrix_readings(influence: float, **common: Any) -> Iterator[Curve]:
    """Curves of a matrix game for every combination of open settings, and for other ends of training.

    A reading's name lists what is not as printed. ``influence`` is beta of equation 4; ``common`` are the
    other fields of every curve.
    """
    for rate, discount in product(RATES, DISCOUNTS):
        shared = {"step_size": rate, "discount": discount}
        words = (rate != RATES[0] and f"learning rate {rate:g}", discount > 0 and f"discount {discount:g}")
        yield Curve(learner="IQ", reading=_named(*words), rule=IQ.model_validate(shared), **common)
        for recency in (0.0, 0.01, 0.1):
            yield Curve(
                learner="JAQ", reading=_named(*words, recency > 0 and f"beliefs by recency {recency:g}"),
                rule=JAQ.model_validate(shared | {"recency": recency}), **common)
        for changes, settings in _influences(rate):
            rule = IVQ.model_validate(shared | settings | {"influence": influence})
            yield Curve(learner="IVQ", reading=_named(*words, *changes), rule=rule, **common)
    for floor in (1.0, 0.1, 0.001):
        for learner, own in (("IQ", IQ()), ("JAQ", JAQ()), ("IVQ", IVQ(influence=influence))):
            yield Curve(learner=learner, reading=f"trained until T < {floor:g}", rule=own, floor=floor,
                        **common)


def _influences(rate: float) -> Iterator[tuple[tuple[str | bool, ...], dict[str, Any]]]:
    """All readings of equations 4 to 7: changes from the print in words, and the settings."""
    brackets = ("inside", "outside") if rate < 1 else ("inside",)  # at rate 1 they are the same
    for bracket, opinion, present, recency, order in product(
        brackets, (1.0, None), (True, False), (0.0, 0.1), ("simultaneous", "in turn")
    ):
        changes = (
            bracket == "outside" and "influence outside", opinion is None and "opinions discounted",
            not present and "present visit not counted",
            recency > 0 and f"occurrence by recency {recency:g}", order == "in turn" and "in turn",
        )
        yield changes, {"bracket": bracket, "opinion_discount": opinion, "present": present,
                        "recency": recency, "order": order}


def _named(*changes: str | bool) -> str:
    return ", ".join(change for change in changes if isinstance(change, str)) or PRINTED


def informative(points: pl.DataFrame, best: int = 3) -> pl.DataFrame:
    """Points of the readings that a picture has room for: one change from the print, and the best.

    Args:
        points: schema Paradigms; those of the study ``sensitivity`` are looked at.
        best: number of best readings for each learner, figure and decay.
    """
    tried = points.filter(pl.col("study") == "sensitivity")
    ranked = pl.col("p_optimal").rank("ordinal", descending=True).over("figure", "learner", "decay")
    return tried.filter(~pl.col("reading").str.contains(", ", literal=True) | (ranked <= best))


def grid_readings(**common: Any) -> Iterator[Curve]:
    """Curves of the grid world with one reading changed at a time; ``common`` are their other fields."""
    learners: tuple[tuple[str, type[IQ | JAQ | IVQ], dict[str, Any]], ...] = (
        ("IL-A", IQ, {"observes": "own"}), ("IL-B", IQ, {}), ("JAQ", JAQ, {}), ("IVQ", IVQ, {})
    )
    for learner, kind, own in learners:
        for reading, settings, fields in _grid_changes(kind):
            rule = kind.model_validate({"discount": 1.0} | own | settings)
            yield Curve.model_validate(
                common | {"learner": learner, "reading": reading, "rule": rule} | fields)


def _grid_changes(kind: type) -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    """Readings: words, settings of the rule, fields of the curve."""
    yield PRINTED, {}, {}
    yield "learning rate 1; discount 0.1", {"step_size": 1.0, "discount": 0.1}, {}
    yield "learning rate 1; discount 0.9", {"step_size": 1.0, "discount": 0.9}, {}
    yield "discount 0.9", {"discount": 0.9}, {}
    yield "only who is alone is punished", {}, {"punished": "alone"}
    yield "agents may stay", {}, {"stay": True}
    yield "tested at the last temperature", {}, {"test_by": "last temperature"}
    yield "temperature by episodes", {}, {"tick": "episode", "decays": (0.99,)}
    if kind is JAQ:
        yield "beliefs by recency 0.1", {"recency": 0.1}, {}
    if kind is IVQ:
        yield "influence outside", {"bracket": "outside"}, {}
        yield "present visit not counted", {"present": False}, {}
        yield "occurrence by recency 0.1", {"recency": 0.1}, {}
        yield "in turn", {"order": "in turn"}, {}
        yield "own position only", {"observes": "own"}, {}
