"""What the situations of a recording add up to: shares of time, durations, and passes beside hand-overs."""

from __future__ import annotations

from itertools import pairwise

import polars as pl

from pipeline.pitch import Pitch
from pipeline.views.commentary import CommentarySettings
from pipeline.views.commentary.touches import Touch, spells, touches

#: Situations that last no longer are brief.
BRIEF_S = 0.16
#: A pass or a reception that begins or ends so near to the hand-over belongs to it.
BESIDE_NS = 200_000_000
STANDS, RANDOM, YIELDS, RECEIVES = 184, 194, 23, 45


def summary(situations: pl.DataFrame) -> dict[str, float]:
    """Measures of a table of situations.

    Returns:
        situations, how many; median_s, their median duration; brief, the share that lasts at most ``BRIEF_S``;
        random, the share of 194 in the time of all; random_moving, the same in the time without 184; and how
        many are 023 and 045.
    """
    lasts = situations.select("code", s=(pl.col("end_ns") - pl.col("start_ns")) / 1e9)
    total, of = lasts["s"].sum(), dict(lasts.group_by("code").agg(pl.col("s").sum()).iter_rows())
    moving = total - of.get(STANDS, 0.0)
    return {
        "situations": lasts.height, "median_s": lasts["s"].median(), "brief": (lasts["s"] <= BRIEF_S + 1e-6).mean(),
        "random": of.get(RANDOM, 0.0) / total, "random_moving": of.get(RANDOM, 0.0) / moving,
        "n_023": (lasts["code"] == YIELDS).sum(), "n_045": (lasts["code"] == RECEIVES).sum(),
    }


def handed_over(touched: list[Touch]) -> list[tuple[Touch, Touch]]:
    """Touches that follow each other in a segment, by two robots of one team."""
    return [(one, next_) for one, next_ in pairwise(touched)
            if one.segment == next_.segment and one.team == next_.team and one.robot != next_.robot]


def possession(table: pl.DataFrame, pitch: Pitch, situations: pl.DataFrame, settings: CommentarySettings) -> dict[str, float]:
    """Hand-overs and changes of possession, counted from touches.

    Returns:
        handovers, how many; given and received, the shares of them beside a 023 of the one and a 045 of the
        other; spells_per_s, changes of possession a second of play with a touch.
    """
    touched = touches(table, pitch, settings)
    pairs = handed_over(touched)
    found: dict[tuple[str, int, int], list[tuple[int, int]]] = {}
    for team, robot, code, start, end in situations.filter(pl.col("code").is_in((YIELDS, RECEIVES))).select(
            "team", "robot", "code", "start_ns", "end_ns").iter_rows():
        found.setdefault((team, robot, code), []).append((start, end))

    def beside(touch: Touch, code: int, first_ns: int, last_ns: int) -> bool:
        times = found.get((touch.team, touch.robot, code), [])
        return any(start <= last_ns + BESIDE_NS and end >= first_ns - BESIDE_NS for start, end in times)

    of_teams = spells(touched, table)
    return {
        "handovers": len(pairs),
        "given": _share([beside(one, YIELDS, one.end_ns, next_.start_ns) for one, next_ in pairs]),
        "received": _share([beside(next_, RECEIVES, next_.start_ns, next_.start_ns) for _, next_ in pairs]),
        "spells_per_s": _share([len(of_teams)], sum(spell.seconds for spell in of_teams)),
    }


def _share(counted: list[bool] | list[int], of: float | None = None) -> float | None:
    of = len(counted) if of is None else of
    return sum(counted) / of if of else None
