"""The gallery: behaviours of a team in their order for people, and occurrences of each to look at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.views.commentary.words import with_minus
from pitchlore.schemas.behaviours import SHOWN_FROM

#: No robot.
NOBODY = -1
#: Clips shown of a behaviour: the best, the worst, and the typical ones, four each.
EACH = 4
#: Of these, clips shown at first.
AT_FIRST = 4
#: Behaviours shown beside those of one situation: the first, and the first in each other order.
SHOWN, SHOWN_OF_ORDER = 50, 10
#: Seconds shown before and after an occurrence.
LEAD_S, TAIL_S = 1.0, 1.5


class Clip(NamedTuple):
    """A stretch of a match to look at.

    Attributes:
        match: id.
        team: home or away.
        robot: robot to watch, or NOBODY.
        start_s: from when, seconds.
        end_s: until when.
        says: best, worst or typical, and its value.
        at_s: when what it shows happens, seconds; the clip begins before.
    """

    match: str
    team: str
    robot: int
    start_s: float
    end_s: float
    says: str
    at_s: float

    @classmethod
    def about(
        cls, row: Mapping[str, Any], start_ns: int, end_ns: int, says: str, *, before_s: float, after_s: float
    ) -> Clip:
        """A clip of what a row of a table tells, with some seconds before it and after it.

        The row has match_id and team, and perhaps robot; without one nobody is watched.
        """
        robot = row.get("robot")
        return cls(row["match_id"], row["team"] or "home", NOBODY if robot is None else robot,
                   round(max(start_ns / 1e9 - before_s, 0.0), 2), round(end_ns / 1e9 + after_s, 2), says,
                   round(start_ns / 1e9, 2))


def leading(ranked: pl.DataFrame) -> pl.DataFrame:
    """The behaviours that a page shows: the first, the first in each other order, and all of one situation.

    Args:
        ranked: behaviours in their order, with columns codes, support, value, low, effect, new and at_least.
    """
    often = pl.when(pl.col("support") >= SHOWN_FROM)
    orders = (*map(pl.col, ("support", "new", "at_least")), often.then("value"), often.then("low"),
              -pl.col("effect"))
    first = [pl.int_range(pl.len()) < SHOWN, pl.col("codes").list.len() == 1, *(
        order.rank("ordinal", descending=True) <= SHOWN_OF_ORDER for order in orders)]
    return ranked.filter(pl.any_horizontal(first))


def clips(occurrences: pl.DataFrame) -> dict[str, list[Clip]]:
    """Up to twelve clips of each behaviour.

    Args:
        occurrences: columns behaviour_id, match_id, team, robot, t_ns, done_ns and change: one row an
            occurrence, with what it changed of V.

    Returns:
        By behaviour: the occurrences that changed most, those that changed least, and those next to the
        median; all of them if they are no more than twelve.
    """
    keys = ["match_id", "team", "robot", "t_ns"]
    ordered = occurrences.sort("change", *keys)
    return {
        str(name): [
            Clip.about(
                row, row["t_ns"], row["done_ns"], with_minus(f"{kind}, {round(row['change'], 2) + 0.0:+.2f}"),
                before_s=LEAD_S, after_s=TAIL_S)
            for kind, part in _parts(rows) for row in part.iter_rows(named=True)]
        for (name,), rows in ordered.group_by("behaviour_id", maintain_order=True)}


def at_first(found: Sequence[Clip]) -> tuple[list[Clip], list[Clip]]:
    """Clips of a behaviour that are shown at first, and those that are shown on demand.

    The first are the best, a typical and the worst one, and one more.

    Args:
        found: clips of one behaviour, in the order of :func:`clips`.
    """
    heads = {clip.says.split(",")[0]: clip for clip in reversed(found)}
    chosen = list(heads.values())
    chosen += [clip for clip in found if clip not in chosen][:AT_FIRST - len(chosen)]
    return ([clip for clip in found if clip in chosen], [clip for clip in found if clip not in chosen])


def paths(seen: pl.DataFrame) -> dict[str, pl.DataFrame]:
    """Where the occurrences of each behaviour began and ended: all whose places are known, in order of time.

    Args:
        seen: columns behaviour_id, match_id, t_ns, x, y, to_x and to_y.
    """
    known = seen.drop_nulls(["x", "y", "to_x", "to_y"]).sort("match_id", "t_ns", "robot")
    return {str(name): rows for (name,), rows in known.group_by("behaviour_id", maintain_order=True)}


def _parts(rows: pl.DataFrame) -> list[tuple[str, pl.DataFrame]]:
    """The best, the typical and the worst of occurrences that are sorted by what they changed."""
    each = min(EACH, rows.height // 3)
    middle = (rows.height - EACH) // 2 if each == EACH else each
    length = EACH if each == EACH else rows.height - 2 * each
    return [("best", rows.tail(each).reverse()), ("typical", rows.slice(middle, length)),
            ("worst", rows.head(each))]
