"""Sections of the report on seasons: what of Table 3 is kick-offs, and what the paper leaves open."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import polars as pl

from pitchlore.pipeline.report import kickoffs
from pitchlore.pipeline.report.claims import PAPER, WITHOUT_SCORE
from pitchlore.pipeline.report.document import interval, number, table
from pitchlore.pipeline.report.kickoffs import NOT_TOLD, conclusions, kick_offs
from pitchlore.pipeline.report.sensitivity import HEADINGS, sensitivity
from pitchlore.schemas import called


def about_kick_offs(games: pl.DataFrame) -> Iterator[str]:
    """Paragraphs on how much of Table 3 is kick-offs, from schema Games; none without the paper's seasons."""
    rows = kick_offs(games)
    if not rows.height:
        return
    yield "## Kick-offs in Table 3"
    yield (
        f"The seasons of `{PAPER}`, and of `{WITHOUT_SCORE}`, whose key has no score, from the first game on "
        "in which their column of Table 3 has learned actions. Robots decide anew at each kick-off and other "
        "restart; the first second after one is counted by itself. A state is of one role. The correlation "
        "is of the share with goals + 1, the number of kick-offs after goals and at the start.")
    yield estimates(rows, kickoffs.HEADINGS, ("settings", "opponent", "seasons", "first", "last"))
    yield "\n".join(f"- {said}" for said in conclusions(rows))
    yield NOT_TOLD


def about_sensitivity(
    games: pl.DataFrame, growth: pl.DataFrame, changes: Mapping[str, str] = MappingProxyType({})
) -> Iterator[str]:
    """Paragraphs on the paper's settings varied; none without variations.

    Args:
        games: schema Games.
        growth: schema Growth.
        changes: the change of each variation in words, by its name.
    """
    rows = sensitivity(games, growth, PAPER)
    if not rows.height:
        return
    yield "## Points that the paper leaves open"
    yield (
        f"The key numbers of Table 3 and Figures 8 to 10 with one setting of `{PAPER}` changed, over the "
        f"first {rows['games'][0]} games, means over seasons.")
    if changes:
        told = rows["settings"].unique().sort()
        yield "\n".join(f"- `{name}`: {changes[name]}" for name in told if name in changes)
    yield estimates(rows.drop("games"), HEADINGS, ("opponent", "settings", "seasons"))


def estimates(
    rows: pl.DataFrame, headings: Mapping[str, str], first: tuple[str, ...], last: tuple[str, ...] = ()
) -> str:
    """Table of the ``first`` columns, those with intervals that ``headings`` names, and the ``last``."""
    cells = [
        (*(cell(row[name]) for name in first),
         *(interval(row[name], row[f"{name}_low"], row[f"{name}_high"]) for name in headings),
         *(cell(row[name]) for name in last))
        for row in rows.iter_rows(named=True)
    ]
    numbers = (rows.schema[name].is_numeric() for name in first)
    right = (*numbers, *[True] * len(headings), *[False] * len(last))
    return table((*first, *headings.values(), *last), cells, right)


def cell(value: str | float | None) -> str:
    """A name or a number, as tables of the report show it."""
    return called(value) if isinstance(value, str) else number(value)
