"""Verdicts on claims about seasons.

A claim is *contradictory* if the quantity, read in the paper's own Table 3, lies outside of what it states;
else it is judged by our seasons: *reproduced* if the 95 % interval lies wholly inside, *contradicted* if
wholly outside, else *not reproduced*; *not judged* below five seasons. What holds and could not but hold
in this system is true *by construction*, which is no evidence. Our aims are *reached* or not, by the same
rule.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import polars as pl

from pipeline.studies.seasons.claims import AIM, CLAIMS, Claim, printed
from pipeline.studies.seasons.measures import Season, pooled, seasons_of
from pipeline.studies.statistics import Estimate, weighted_sum
from schemas import Claims

#: Fewer seasons tell too little.
LEAST_SEASONS = 5


def judged(games: pl.DataFrame, growth: pl.DataFrame, evaluations: pl.DataFrame) -> pl.DataFrame:
    """Every claim beside what the seasons show.

    Args:
        games: schema Games, of any seasons.
        growth: schema Growth, of the same.
        evaluations: schema Evaluations, of their apprentices.

    Returns:
        Schema Claims, a row a claim, in their order, whether or not its seasons are there.
    """
    found = seasons_of(games, growth, evaluations)
    return Claims.validate(pl.DataFrame(list(_rows(found)), schema=Claims.dtypes()), cast=True)


def _rows(found: Mapping[tuple[str, str], Sequence[Season]]) -> Iterator[dict[str, object]]:
    for claim in CLAIMS:
        sides = [_pooled(claim, found.get(side, [])) for side in claim.sides]
        estimate = _apart([side for side, _ in sides])
        seasons = min(n for _, n in sides)
        in_table = _of_table_3(claim) if claim.in_table_3 else None
        yield {
            "item": claim.item, "claim": claim.text,
            "settings": _named(settings for settings, _ in claim.sides),
            "opponent": _named(opponent for _, opponent in claim.sides),
            "quantity": claim.quantity, "stated": claim.states.text, "table_3": in_table,
            **{name: None if math.isnan(end) else end
               for name, end in zip(("measured", "low", "high"), estimate, strict=True)},
            "seasons": seasons, "verdict": _verdict(claim, in_table, estimate, seasons),
        }


def _pooled(claim: Claim, seasons: Sequence[Season]) -> tuple[Estimate, int]:
    """The quantity over the seasons of one side, and how many have it."""
    values = [claim.measure(season) for season in seasons]
    trials = [claim.trials(season) for season, value in zip(seasons, values, strict=True)
              if not math.isnan(value)]
    return pooled(values, claim.pooling, min(trials, default=1))


def _apart(sides: Sequence[Estimate]) -> Estimate:
    """One estimate, or the first less the second."""
    if len(sides) == 1:
        return sides[0]
    one, other = sides
    if one.defined and other.defined:
        return weighted_sum([1.0, -1.0], [one, other])
    return Estimate(one.value - other.value, math.nan, math.nan)


def _of_table_3(claim: Claim) -> float:
    values = [printed(claim.measure, opponent) for _, opponent in claim.sides]
    return values[0] if len(values) == 1 else values[0] - values[1]


def _verdict(claim: Claim, in_table: float | None, estimate: Estimate, seasons: int) -> str:
    if in_table is not None and not claim.states.holds(in_table):
        return "contradictory"
    if seasons < LEAST_SEASONS:
        return "not judged"
    verdict = claim.states.verdict(estimate)
    if claim.item == AIM:
        return "reached" if verdict == "reproduced" else "not reached"
    return "by construction" if claim.by_construction and verdict == "reproduced" else verdict


def _named(names: Iterable[str]) -> str:
    """``human-like less static``, or one name."""
    return " less ".join(dict.fromkeys(names))
