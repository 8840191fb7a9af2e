"""Teams: whose knowledge the rows of a match make."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import polars as pl

from pipeline.errors import NotFound


class Team(NamedTuple):
    """The unit of knowledge: one team, or one pool of teams, in one league.

    Attributes:
        team: its name.
        kind: the league.
    """

    team: str
    kind: str


def teams(tables: Iterable[pl.DataFrame]) -> dict[Team, int]:
    """The teams that count, and in how many matches each played, by name.

    Args:
        tables: rows of schema Sides.
    """
    counts: dict[Team, int] = {}
    for table in tables:
        seen = table.drop_nulls("counts_as").select("match_id", "counts_as", "kind").unique()
        for _, name, kind in seen.iter_rows():
            counts[Team(name, kind)] = counts.get(Team(name, kind), 0) + 1
    return dict(sorted(counts.items()))


def imitated(counts: dict[Team, int], name: str | None) -> Team | None:
    """The team whose behaviours policies choose from: that of most matches, the first of several.

    Args:
        counts: from :func:`teams`.
        name: only teams of this name; None: any.

    Returns:
        None if no team counts and none is asked for.

    Raises:
        NotFound: if there is no team of that name.
    """
    there = {team: count for team, count in counts.items() if name in (None, team.team)}
    if name is not None and not there:
        known = ", ".join(dict.fromkeys(team.team for team in counts)) or "none"
        raise NotFound(f"no team {name!r} counts (those that do: {known})", where="knowledge.imitate",
                       next_step="Name one of these, or leave it out")
    return max(there, key=there.__getitem__, default=None)


def sides_of(team: Team | None, own: pl.DataFrame) -> list[str]:
    """The sides that count for a team in the matches of rows of schema Sides."""
    if team is None:
        return []
    return own.filter(counts_as=team.team, kind=team.kind)["side"].cast(pl.String).unique().to_list()


def of_teams(table: pl.DataFrame, own: pl.DataFrame) -> pl.DataFrame:
    """Rows of sides as rows of teams.

    Args:
        table: has columns match_id and team, a side.
        own: rows of schema Sides of these matches.

    Returns:
        The rows of sides that count, in order, with column team that they count for, and column kind.
    """
    who = own.drop_nulls("counts_as").select("match_id", pl.col("side").cast(pl.String), "kind", "counts_as")
    return table.with_columns(pl.col("team").cast(pl.String)).join(
        who, left_on=("match_id", "team"), right_on=("match_id", "side"), maintain_order="left",
    ).with_columns(team="counts_as").drop("counts_as")


def of_sides(table: pl.DataFrame, own: pl.DataFrame) -> pl.DataFrame:
    """Rows of teams as rows of the sides of one match.

    Args:
        table: has columns team and kind.
        own: rows of schema Sides of one match.

    Returns:
        The rows of the teams that play, once for each side that counts for them, with column side.
    """
    who = own.drop_nulls("counts_as").select("side", "kind", team="counts_as")
    return table.join(who, on=("team", "kind"), maintain_order="left_right")
