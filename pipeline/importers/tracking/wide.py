"""Wide tables: one row a sample, and columns for each body. They become one row per body and sample."""

from __future__ import annotations

import re
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.forms.words import BALLS, WORDS, bare
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.columns import (
    REQUIRED,
    column_name,
    columns_to_read,
    first_columns,
)
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.quality import Flaw

#: Columns of a body, and those of a whole sample.
OF_A_BODY = ("x", "y", "heading", "vx", "vy", "omega", "option")
OF_A_SAMPLE = ("frame", "t", "period", "segment", "score_home", "score_away", "game_state")
#: Words of a column's name that say nothing.
_NOISE = {"pos", "position", "posicao", "robot", "robo", "player", "jogador", "agent", "agente", "the", "m",
          "frame", "robots", "players"}
#: Bodies from which on a table is wide.
_BODIES = 2
_PARTS = re.compile(r"[A-ZÀ-Þ]?[a-zß-ÿ]+|[A-ZÀ-Þ]+|\d+")

#: Of each team and player (None for the ball) the columns: our name to the file's.
_Bodies = dict[tuple[str, str | None], dict[str, str]]


class Body(NamedTuple):
    """A body and its columns.

    Attributes:
        team: its team, or the ball's name.
        player: its number or name, None for the ball.
        columns: our name to the file's.
    """

    team: str
    player: str | None
    columns: dict[str, str]


class Wide(NamedTuple):
    """The columns of a wide table: our name to the file's for those of a sample, and the bodies."""

    sample: dict[str, str]
    bodies: tuple[Body, ...]
    flaws: tuple[Flaw, ...]

    def names(self) -> list[str]:
        """The file's columns that are read, each once."""
        every = [*self.sample.values(), *(name for body in self.bodies for name in body.columns.values())]
        return list(dict.fromkeys(every))


def wide(found: list[str], mapping: TrackingMap, name: str) -> Wide | None:
    """The columns of a wide table; None if the table is none.

    A map names the columns of each body, or their own names do: one part is the quantity, the others are a
    team and a number, or a word for the ball, in any order: ``x_blue0``, ``blue_0_x``, ``ballX``.

    Args:
        found: the names of the file's columns.
        mapping: the map.
        name: the file's name, for messages.

    Raises:
        BadRecording: if the file lacks a column that the map names, or the time.
    """
    if mapping.bodies:
        parts = _by_map(found, mapping, name)
    elif {*mapping.columns.model_fields_set} & {*REQUIRED} - {"t"} or {"x", "y"} <= {*found}:
        return None
    else:
        parts = named_bodies(found, mapping.teams.ball)
    whole = [Body(*who, columns) for who, columns in parts.items() if {"x", "y"} <= columns.keys()]
    if len(whole) < _BODIES:
        _check_of_teams(found, name)
        return None
    read = {column for body in whole for column in body.columns.values()}
    left = [column for columns in parts.values() for column in columns.values() if column not in read]
    flaws = [Flaw("skipped", f"columns without x or y: {', '.join(left[:8])}", len(left))] if left else []
    sample = columns_to_read(found, mapping.columns, name, ("t",))
    return Wide({ours: sample[ours] for ours in OF_A_SAMPLE if ours in sample}, tuple(whole), tuple(flaws))


def _by_map(found: list[str], mapping: TrackingMap, name: str) -> _Bodies:
    """The columns of each body that a map names."""
    bodies: _Bodies = {}
    for body, columns in mapping.bodies.items():
        reported = columns.model_dump(exclude_none=True).items()
        named = {ours: column_name(theirs, found) for ours, theirs in reported}
        missing = [theirs for theirs in named.values() if theirs not in found]
        if missing:
            raise BadRecording(
                f"has no column {missing[0]} for the body {body!r}; it has {first_columns(found)}",
                where=name,
                next_step="Mend the map's [bodies] table",
            )
        team, _, player = body.rpartition(" ")
        bodies[(body, None) if body == mapping.teams.ball else (team, player)] = named
    return bodies


def named_bodies(found: list[str], ball: str) -> dict[tuple[str, str | None], dict[str, str]]:
    """The columns of each body by their names: of team and player (None for the ball), ours to the file's."""
    bodies: _Bodies = {}
    spelt: dict[str, str] = {}
    for column in found:
        parts = _PARTS.findall(column)
        at = [i for i, part in enumerate(parts) if WORDS.get(bare(part)) in OF_A_BODY]
        if len(at) > 1:  # l1_body is a heading, and body1_x is none
            at = [i for i in at if bare(parts[i]) != "body"]
        if len(at) > 1:  # y0.x: what stands before the number is the team
            at = [i for i in at if not parts[i + 1:] or not parts[i + 1].isdigit()]
        numbers = [part for part in parts if part.isdigit()]
        words = [part for i, part in enumerate(parts)
                 if i not in at and not part.isdigit() and bare(part) not in _NOISE]
        if len(at) != 1 or not words or len(numbers) > 1:
            continue
        team = "_".join(words)
        if bare(team) in (*BALLS, bare(ball)) and not numbers:
            who: tuple[str, str | None] = (ball, None)
        elif numbers:
            who = (spelt.setdefault(team.lower(), team), str(int(numbers[0])))
        else:
            continue
        bodies.setdefault(who, {}).setdefault(WORDS[bare(parts[at[0]])], column)
    return bodies


def _check_of_teams(found: list[str], name: str) -> None:
    """Raise if the columns are numbered for bodies, and no team is among their names: ``x1, y1, x2, y2``."""
    numbered = [column for column in found if re.fullmatch(r"[xy][ _.]?\d+", column, re.IGNORECASE)]
    if len(numbered) >= 2 * _BODIES:
        raise BadRecording(
            f"has columns for bodies of no team: {first_columns(numbered)}", where=name, next_step=(
                'Say whose they are in a map: [bodies] ball = {x = "x0", y = "y0"}, '
                '"blue 1" = {x = "x1", y = "y1"}'
            ))


def unfolded(table: pl.DataFrame, columns: Wide, source: SourceFile) -> pl.DataFrame:
    """A wide table with one row per body and sample, under our names, in the order of the file.

    Raises:
        BadRecording: if it has too many bodies, or too many rows then.
    """
    robots = len(columns.bodies) - 1
    if robots > 2 * source.limits.robots:
        raise source.too_much(f"columns for {robots} robots", "robots")
    rows = len(table) * len(columns.bodies)
    if rows > source.limits.rows:
        raise source.too_much(f"{rows} rows of bodies", "rows")
    table = table.with_row_index("row")
    sample = [pl.col(theirs).alias(ours) for ours, theirs in columns.sample.items()]
    parts = [
        table.select(
            "row", *sample, pl.lit(body.team).alias("team"),
            pl.lit(body.player, dtype=pl.String).alias("player"),
            *(pl.col(theirs).alias(ours) for ours, theirs in body.columns.items()),
        )
        for body in columns.bodies
    ]
    return pl.concat(parts, how="diagonal_relaxed").sort("row", maintain_order=True).drop("row")
