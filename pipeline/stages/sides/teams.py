"""Teams: whose knowledge the rows of a match make."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.schemas import SIDES


class Team(NamedTuple):
    """The unit of knowledge: one team, or one pool of teams, in one league.

    Attributes:
        team: its name.
        kind: the league.
    """

    team: str
    kind: str


class TeamRecord(NamedTuple):
    """Counts by which a team is chosen to be imitated.

    Attributes:
        matches: number of its matches.
        watched: number of its matches in which it logged no decisions of its own, so that it can be imitated.
        difference: goals minus goals against in these, as far as they are known.
    """

    matches: int
    watched: int
    difference: int


def teams(
    sides: pl.DataFrame, choosing: Mapping[str, Collection[str]] = MappingProxyType({})
) -> dict[Team, TeamRecord]:
    """The teams that count, by name.

    Args:
        sides: rows of schema Sides of some matches.
        choosing: the sides that logged decisions, by match.
    """
    mine = pl.Series("own", [side in choosing.get(match, ()) for match, side in sides.select(
        "match_id", pl.col("side").cast(pl.String)).iter_rows()], dtype=pl.Boolean)
    difference = (pl.col("goals") - pl.col("against")).fill_null(0).cast(pl.Int64)
    rows = sides.hstack([mine]).drop_nulls("counts_as").group_by("counts_as", "kind").agg(
        pl.col("match_id").n_unique(), pl.col("match_id").filter(~pl.col("own")).n_unique().alias("watched"),
        difference.filter(~pl.col("own")).sum().alias("difference"),
    ).sort("counts_as", "kind")
    return {Team(name, kind): TeamRecord(*rest) for name, kind, *rest in rows.iter_rows()}


def imitated(records: Mapping[Team, TeamRecord], name: str | None, before: Team | None = None) -> Team | None:
    """The team whose behaviours policies choose from.

    It is that of most matches in which it logged no decisions: a learner does not imitate itself. Of several,
    it is the one of the best goal difference, else the first by name.

    Args:
        records: from :func:`teams`.
        name: only teams of this name; None: any.
        before: the team that is imitated already; it stays, unless its name is not ``name``.

    Returns:
        None if no team counts and none is asked for.

    Raises:
        NotFound: if there is no team of that name.
    """
    there = {team: record for team, record in records.items() if name in (None, team.team)}
    if name is not None and not there:
        known = ", ".join(dict.fromkeys(team.team for team in records)) or "none"
        raise NotFound(f"no team {name!r} counts (those that do: {known})", where="knowledge.imitate",
                       next_step="Name one of these, or leave it out")
    if before in there:
        return before
    return min(there, default=None, key=lambda team: (-there[team].watched, -there[team].difference, team))


def sides_of(team: Team | None, own: pl.DataFrame) -> pl.DataFrame:
    """The sides that count for a team by rows of schema Sides: match_id, team (a side), and own, true."""
    counting = own.clear() if team is None else own.filter(counts_as=team.team, kind=team.kind)
    return counting.select("match_id", pl.col("side").cast(pl.Enum(SIDES)).alias("team"), own=True)


def as_of(table: pl.DataFrame, team: Team) -> pl.DataFrame:
    """The rows as those of a team: with its name and league in columns team and kind."""
    return table.with_columns(
        pl.lit(value, dtype=pl.String).alias(name) for name, value in team._asdict().items())


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
