"""Swings of a match: V over each stretch of play, its largest changes, and who led when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.views.commentary.words import enumerated, time_elapsed
from pitchlore.schemas import SIDES

#: Seconds within which a change of V is a swing; swings that are named; a hole in V that ends a stretch.
SWING_S, SWINGS, HOLE_S = 3.0, 6, 1.0
#: Stretches in which a side led that are named; of more only the last.
_SPANS = 4


class BalanceLine(NamedTuple):
    """V in a stretch of play that nothing interrupts.

    Attributes:
        t_ns: float64 [n], times, ascending.
        v: float64 [n], home's chance to score soon less that of away.
    """

    t_ns: F64
    v: F64


class Swing(NamedTuple):
    """A change of V within :data:`SWING_S`.

    Attributes:
        start_ns, end_ns: its first and its last moment.
        side: home or away, in whose favour it is.
        before, after: V of that side at these moments.
    """

    start_ns: int
    end_ns: int
    side: str
    before: float
    after: float


def stretches(values: pl.DataFrame) -> list[BalanceLine]:
    """V by stretches of play: from a restart to the next stop, and not across a hole in which V is unknown.

    Args:
        values: rows of schema Values of one match.
    """
    found = []
    for _, rows in values.sort("t_ns").group_by("segment", maintain_order=True):
        t_ns, v = rows["t_ns"].to_numpy().astype(np.float64), rows["value"].to_numpy()
        cuts = np.flatnonzero(np.diff(t_ns) > HOLE_S * 1e9) + 1
        found += [BalanceLine(*part) for part in zip(np.split(t_ns, cuts), np.split(v, cuts), strict=True)]
    return found


def swings(played: Sequence[BalanceLine]) -> list[Swing]:
    """The largest changes of V within :data:`SWING_S`, none of which overlap, the largest first."""
    each = []
    for t_ns, v in played:
        until = np.searchsorted(t_ns, t_ns + SWING_S * 1e9, side="right") - 1
        each += list(zip(v[until] - v, t_ns, t_ns[until], v, v[until], strict=True))
    chosen: list[Swing] = []
    for change, start, end, before, after in sorted(each, key=lambda it: (-abs(it[0]), it[1])):
        if len(chosen) == SWINGS or not change:
            break
        if all(end < one.start_ns or one.end_ns < start for one in chosen):
            turn = 1 if change > 0 else -1
            chosen.append(Swing(int(start), int(end), SIDES[0] if turn > 0 else SIDES[1],
                                float(turn * before), float(turn * after)))
    return chosen


def on_top_words(played: Sequence[BalanceLine], names: Mapping[str, str]) -> str:
    """The share of the moments in play in which each side was nearer to a goal; empty without any."""
    v = np.concatenate([np.zeros(0), *(it.v for it in played)])
    if not len(v):
        return ""
    home, away = (float((sign * v > 0).mean()) for sign in (1, -1))
    first, share = (SIDES[0], home) if home >= away else (SIDES[1], away)
    return f"{names[first]} had the better chance for {share:.0%} of the time in play."


def lead_words(goals: pl.DataFrame, names: Mapping[str, str]) -> str:
    """Spans in which a side led, by rows of schema Goals; empty where no goal has a team."""
    known = goals.drop_nulls("team").sort("t_ns").select(
        "t_ns", turn=pl.when(pl.col("team") == SIDES[0]).then(1).otherwise(-1))
    leads = known.select("t_ns", lead=pl.col("turn").cum_sum().sign()).rows()
    turns = [(t_ns, lead) for (t_ns, lead), before in zip(leads, [0, *(it[1] for it in leads)], strict=False)
             if lead != before]
    if not turns:
        return ""
    ends = [time_elapsed(t_ns) for t_ns, _ in turns[1:]] + ["the end"]
    spans = [f"{names[SIDES[0] if lead > 0 else SIDES[1]]} led from {time_elapsed(t_ns)} to {end}"
             for (t_ns, lead), end in zip(turns, ends, strict=True) if lead]
    if len(spans) > _SPANS:
        leaders = [lead for _, lead in turns if lead]
        hands = sum(lead != before for before, lead in pairwise(leaders))
        return f"The lead changed hands {number_of(hands, 'time')}; {spans[-1]}."
    return f"{enumerated(spans)}."
