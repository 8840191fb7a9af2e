"""Hand-made points of schema Paradigms for tests."""

import polars as pl

from pitchlore.pipeline.numbers.statistics import wilson
from pitchlore.schemas.paradigms import Paradigms

GAMES = {4: "penalty", 5: "climbing", 6: "grid"}


def point(figure, learner, p, *, decay=0.9997, k=None, reading="printed", runs=2000, study="figure", path=None,
          half=0.05, equilibrium=None, game=None, tests=1, seed=0):
    """One row; ``path`` is the mean path length, ``half`` half the width of its interval."""
    low, high = wilson(p * runs, runs)
    return {
        "study": study, "figure": figure, "game": game or GAMES[figure], "learner": learner, "reading": reading,
        "k": k, "decay": decay, "steps": 1000, "runs": runs, "tests": tests, "seed": seed,
        "p_optimal": p, "p_low": low, "p_high": high, "p_equilibrium": equilibrium,
        "path_length": path, "path_low": None if path is None or half is None else path - half,
        "path_high": None if path is None or half is None else path + half, "diverged": 0,
    }


def curve(figure, learner, values, **rest):
    """Points over k from {k: p}."""
    return [point(figure, learner, p, k=float(k), **rest) for k, p in values.items()]


def over_decays(learner, values, **rest):
    """Points of the climbing game from {decay: p}."""
    return [point(5, learner, p, decay=decay, **rest) for decay, p in values.items()]


def table(*rows):
    """The points, sorted as the schema says."""
    order = ["study", "figure", "game", "learner", "reading", "decay", "k", "runs", "seed"]
    flat = [row for part in rows for row in (part if isinstance(part, list) else [part])]
    return Paradigms.validate(pl.DataFrame(flat, schema=Paradigms.dtypes()).sort(order), cast=True)
