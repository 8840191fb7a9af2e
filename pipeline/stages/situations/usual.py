"""Situations that a kind of match usually shows, and whether a match shows too few of them.

``usual.json`` has, for each kind, how often each situation was recognised in recordings, in a robot's
second of play. ``make usual-codes`` measures it. A situation that is shown λ times a second is shown at
least once in T seconds with probability 1 - exp(-λ T), if it comes at random; the sum over all codes is
the number of codes that T seconds show. Situations come in clusters, so that short matches show fewer: a
match has to show half of them.
"""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from math import exp
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.game.pitch import Kind
from pitchlore.schemas.situations import MOVES_RANDOMLY

#: A match that shows a smaller share of the usual codes is poorly recognised, ...
LEAST_SHARE = 0.5
#: ... and so is one whose robots move randomly for a larger share of the time.
MOST_RANDOM = 2 / 3
#: Robots' seconds in play below which nothing is reported: pieces of sound recordings that are shorter show
#: fewer than half of the usual codes now and then (docs/decisions/importers.md, "Poor recognition is said").
LEAST_SECONDS = 100.0


class Recognition(NamedTuple):
    """Situations that a match, or a part of it, shows.

    Attributes:
        codes: number of codes besides 194.
        usual: number of codes that such a length usually shows.
        random: share of the time that is 194, in [0, 1].
        seconds: robots' seconds in play.
    """

    codes: int
    usual: float
    random: float
    seconds: float

    @property
    def poor(self) -> bool:
        """True if it shows fewer than half of the usual codes, or 194 for over two thirds of the time."""
        few = self.codes < LEAST_SHARE * self.usual
        return self.seconds >= LEAST_SECONDS and (few or self.random > MOST_RANDOM)


@cache
def rates(kind: Kind) -> dict[int, float]:
    """How often each code but 194 was recognised in recordings of a kind, per second of a robot's play."""
    reported = json.loads(resources.files(__package__).joinpath("usual.json").read_text())
    return {int(code): rate for code, rate in reported[kind.value]["rates"].items()}


def recognition(situations: pl.DataFrame, kind: Kind) -> Recognition:
    """Situations of a match beside the usual ones.

    Args:
        situations: rows of schema Situations of one match, or of a part of one.
        kind: kind of the match.
    """
    spans = situations.select("code", s=(pl.col("end_ns") - pl.col("start_ns")) / 1e9)
    seconds = float(spans["s"].sum())
    random = float(spans.filter(pl.col("code") == MOVES_RANDOMLY)["s"].sum())
    return Recognition(
        codes=spans.filter(pl.col("code") != MOVES_RANDOMLY)["code"].n_unique(),
        usual=sum(1 - exp(-rate * seconds) for rate in rates(kind).values()),
        random=random / seconds if seconds else 0.0, seconds=seconds,
    )
