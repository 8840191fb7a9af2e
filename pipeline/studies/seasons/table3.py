"""The paper's Table 3: decisions of its two apprentices in 35 games each.

Source: Barrios-Aranibar, Gonçalves and Alsina, *Learning by Experience and by Imitation in Multi-Robot
Systems* (2008), Table 3; the numbers in ``table3.csv`` are as printed. Of Yamamoto's game 10 it prints
5,230 actions of which 5,239 are random: one of the two is a slip. The others are 0 and 0.00 %, so the
game is read as one without other actions, of 5,230.
"""

from __future__ import annotations

import io
from functools import cache
from importlib import resources

import polars as pl

#: Column names begin with; our opponent that stands for it.
COLUMNS = {"humans": "human-like", "static": "static"}

#: The game from which on the paper's static column starts with the apprentice well ahead.
CHANGE = 11

#: Games that the paper's apprentices played.
GAMES = 35


@cache
def printed() -> pl.DataFrame:
    """Table 3 as printed, the slip included.

    Returns:
        Columns game, and total, random, other and pct for ``humans_`` and ``static_``, 35 rows.
    """
    return pl.read_csv(io.BytesIO(resources.files(__package__).joinpath("table3.csv").read_bytes()))


@cache
def games(opponent: str) -> pl.DataFrame:
    """One of the paper's columns with the names of schema Games.

    Args:
        opponent: ``human-like`` for the column of games against humans, or ``static``.

    Returns:
        Columns game, actions, random_actions, other_actions, 35 rows by game; random and other add up.

    Raises:
        KeyError: of another opponent the paper has no column.
    """
    column = {kind: name for name, kind in COLUMNS.items()}[opponent]
    return printed().select(
        pl.col("game").cast(pl.Int16),
        actions=pl.col(f"{column}_total"),
        random_actions=pl.col(f"{column}_total") - pl.col(f"{column}_other"),
        other_actions=pl.col(f"{column}_other"),
    )
