"""Swings of a match: V over each stretch of play as it is drawn, its largest changes, and who led when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.views.commentary.words import enumerated, percent, time_elapsed
from pitchlore.schemas import SIDES

#: Seconds within which a change of V is a swing; swings that are named; a hole in V that ends a stretch.
SWING_S, SWINGS, HOLE_S = 3.0, 6, 1.0
#: Parts of a match in the line that is drawn.
_PARTS = 240
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
        before, after: V of home at these moments, points of the line.
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


def drawn_lines(played: Sequence[BalanceLine], seconds: float) -> list[BalanceLine]:
    """The lines that are drawn: their ends, and the least and the greatest V in each of :data:`_PARTS` parts.

    Nothing is smoothed: each point is a value of V. ``seconds`` is the duration of the match.
    """
    found = []
    for t_ns, v in played:
        part = np.floor(t_ns / 1e9 / max(seconds, 1e-9) * _PARTS)
        by_value = np.lexsort((v, part))
        first = np.flatnonzero(np.diff(part[by_value], prepend=-1.0))
        last = np.append(first[1:], len(v)) - 1
        kept = np.unique(np.concatenate([by_value[first], by_value[last], [0, len(v) - 1]]))
        found.append(BalanceLine(t_ns[kept], v[kept]))
    return found


def swings(drawn: Sequence[BalanceLine]) -> list[Swing]:
    """The largest changes between points of lines that are drawn, within :data:`SWING_S`, none overlapping.

    The largest comes first.
    """
    each = []
    for t_ns, v in drawn:
        for apart in range(1, len(v)):
            near = np.flatnonzero(t_ns[apart:] - t_ns[:-apart] <= SWING_S * 1e9)
            if not len(near):
                break
            end = near + apart
            each += list(zip(v[end] - v[near], t_ns[near], t_ns[end], v[near], v[end], strict=True))
    chosen: list[Swing] = []
    for change, start, end, before, after in sorted(each, key=lambda it: (-abs(it[0]), it[1], it[2])):
        if len(chosen) == SWINGS or not change:
            break
        if all(end < one.start_ns or one.end_ns < start for one in chosen):
            chosen.append(Swing(
                int(start), int(end), SIDES[0] if change > 0 else SIDES[1], float(before), float(after)))
    return chosen


def on_top_words(played: Sequence[BalanceLine], names: Mapping[str, str]) -> str:
    """The share of the moments in play in which each side was nearer to a goal; empty without any."""
    v = np.concatenate([np.zeros(0), *(it.v for it in played)])
    if not len(v):
        return ""
    home, away = (float((sign * v > 0).mean()) for sign in (1, -1))
    first, share = (SIDES[0], home) if home >= away else (SIDES[1], away)
    return f"{names[first]} had the better chance for {percent(share)} of the time in play."


def deciding(goals: pl.DataFrame) -> tuple[int, float, str] | None:
    """The goal from which on the winner led: its place from 1, time in s, and team; None if nobody won."""
    turn = pl.when(pl.col("team") == SIDES[0]).then(1).when(pl.col("team") == SIDES[1]).then(-1).otherwise(0)
    made = goals.sort("t_ns", maintain_order=True)
    lead = np.sign(made.select(lead=turn.cum_sum())["lead"].to_numpy())
    if not len(lead) or not lead[-1]:
        return None
    place = int(np.flatnonzero(np.append(0, lead[:-1]) != lead)[-1])
    return place + 1, made["t_ns"][place] / 1e9, str(made["team"][place])


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
