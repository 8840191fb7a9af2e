"""The paper's Table 3: decisions of its two apprentices in 35 games each.

Source: Barrios-Aranibar, Gonçalves and Alsina, *Learning by Experience and by Imitation in Multi-Robot
Systems* (2008), Table 3; the numbers in ``table3.csv`` are as printed. For Yamamoto's game 10 it prints 5,230
actions, 5,239 of them random: one of the two is a slip. It also prints 0 other actions and 0.00 %, so the
game is read as 5,230 actions, all random.
"""

from __future__ import annotations

import io
from collections.abc import Container
from functools import cache
from importlib import resources

import polars as pl

from pitchlore.schemas.seasons import PERSON

#: Our opponents beside each of the paper's columns, whose names begin with the key. The first that has
#: seasons counts: until a person has played, a second script stands beside the human column.
COLUMNS: dict[str, tuple[str, ...]] = {"humans": (PERSON, "human-like"), "static": ("static",)}

#: First game of the paper's static column that starts with the apprentice far ahead.
CHANGE = 11

#: Games of each of the paper's apprentices.
GAMES = 35


@cache
def printed() -> pl.DataFrame:
    """Table 3 as printed, the slip included.

    Returns:
        Columns game, and total, random, other and pct for ``humans_`` and ``static_``, 35 rows.
    """
    return pl.read_csv(io.BytesIO(resources.files(__package__).joinpath("table3.csv").read_bytes()))


def beside(column: str, played: Container[str]) -> str:
    """Our opponent beside one of the paper's columns.

    Args:
        column: a key of :data:`COLUMNS`; the name of an opponent is that opponent.
        played: opponents that there are seasons against.
    """
    *first, last = COLUMNS.get(column, (column,))
    return next((opponent for opponent in first if opponent in played), last)


def column_of(opponent: str) -> str | None:
    """The paper's column that seasons against an opponent stand beside; None if there is none."""
    return next((name for name, opponents in COLUMNS.items() if opponent in opponents), None)


@cache
def games(column: str) -> pl.DataFrame:
    """One of the paper's columns, ``humans`` or ``static``, with the column names of schema Games.

    Returns:
        Columns game, actions and other_actions, 35 rows by game.

    Raises:
        KeyError: if the paper has no such column.
    """
    if column not in COLUMNS:
        raise KeyError(column)
    return printed().select(
        pl.col("game").cast(pl.Int16),
        actions=pl.col(f"{column}_total"),
        other_actions=pl.col(f"{column}_other"),
    )
