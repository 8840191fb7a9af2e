"""Pages as pieces of work: those of some matches, and those of a team. Workers make them; none writes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.card import Card
from pitchlore.pipeline.views.commentary import commentary
from pitchlore.pipeline.views.scout.content import answers, copies, maps, opponent, replays
from pitchlore.pipeline.views.scout.content import matches as match_pages
from pitchlore.pipeline.views.scout.content import teams as team_pages
from pitchlore.pipeline.views.scout.content.learned import Learned
from pitchlore.pipeline.views.scout.content.sources import Known, LeagueMatch, TeamName, side_of
from pitchlore.pipeline.views.scout.pages import rendered


class MatchTodo(NamedTuple):
    """Pages and a line that are to be made of a match.

    Attributes:
        match: the match.
        pages: names of its pages that are asked for.
        line: whether its line in the league is asked for.
    """

    match: LeagueMatch
    pages: Collection[str]
    line: bool


class MatchPages(NamedTuple):
    """Pages and a line that were made of a match.

    Attributes:
        pages: by name.
        line: its line in the league; None where it was not asked for.
    """

    pages: dict[str, bytes]
    line: dict[str, Any] | None


def of_matches(data: Path, todo: Sequence[MatchTodo], around: Mapping[str, Any]) -> dict[str, MatchPages]:
    """The pages and the data of some matches, by their ids. No knowledge is in them.

    Args:
        data: the data folder.
        todo: pieces to be made.
        around: common part of all pages.

    Raises:
        CorruptFile: if a file of the store is damaged.
    """
    store = Store(data)
    return {each.match.name: _of_match(store, each, around) for each in todo}


def _of_match(store: Store, todo: MatchTodo, around: Mapping[str, Any]) -> MatchPages:
    match = todo.match.at(store, keep=True)
    reported = cache(partial(commentary, match))
    kept = cache(partial(answers.kept, match))
    makers: dict[str, Callable[[], bytes]] = {
        f"data/{match.name}.js": lambda: replays.data(match, reported()),
        f"matches/{match.name}.html": lambda: rendered(
            "match", up="../", of=match.name, **around, **match_pages.match_facts(match, reported(), kept())),
    }
    return MatchPages({name: makers[name]() for name in todo.pages},
                match_pages.line(match, kept()) if todo.line else None)


class TeamTodo(NamedTuple):
    """A team whose pages are to be made, and what they are made from.

    Attributes:
        team: the team.
        matches: its matches.
        lines: their lines in the league.
        known: the newest knowledge.
        league: the matches that have run.
        sides: sides of the matches behind the knowledge that the team played.
        imitated: whether a policy imitates it.
        copied: its imitation; None without one.
        keepers: shots that the league's other goalkeepers saved, and those that reached them.
        card: sentences on what went with its winning and losing; None where that is not known.
        mine: name of the team that reads; empty: none is chosen.
    """

    team: TeamName
    matches: list[LeagueMatch]
    lines: dict[str, dict[str, Any]]
    known: Known | None
    league: list[LeagueMatch]
    sides: int
    imitated: bool
    copied: copies.Copied | None
    keepers: tuple[int, int]
    card: Card | None
    mine: str = ""

    @property
    def kinds(self) -> list[str]:
        """The folders that have a page of it."""
        return ["teams", "behaviours", "maps", "against", *(["copies"] if self.copied else [])]


def pages_of_team(
    data: Path, team: TeamTodo, pages: Collection[str], around: Mapping[str, Any]
) -> dict[str, bytes]:
    """The pages of a team, by name.

    Args:
        data: the data folder.
        team: tables that they are made from.
        pages: names of those to make.
        around: common part of all pages with knowledge.

    Raises:
        CorruptFile: if a file of the store is damaged.
    """
    store, slug = Store(data), team.team.slug
    team = team._replace(matches=[match.at(store) for match in team.matches])
    behind = Learned(store, team.known, team.league)
    shown = cache(partial(_gallery, team, behind))
    makers: dict[str, tuple[str, Callable[[], dict[str, Any]]]] = {
        f"teams/{slug}.html": ("team", lambda: {
            "imitated": team.imitated, "copied": team.copied is not None,
            **team_pages.team_facts(team.team, team.matches, team.lines, team.keepers)}),
        f"behaviours/{slug}.html": ("behaviours", shown),
        f"maps/{slug}.html": ("map", lambda: maps.maps_facts(team.team, team.known, behind)),
        f"against/{slug}.html": ("opponent", lambda: opponent.opponent_facts(
            team.team, team.matches, team.lines, shown(), team.card, team.mine)),
        f"copies/{slug}.html": ("copy", lambda: {} if team.copied is None else copies.copy_facts(
            store, team.copied.at(store))),
    }
    sides = side_of(team.team, team.matches)
    return {name: rendered(makers[name][0], up="../", side_of=sides, **around, **makers[name][1]())
            for name in pages}


def _gallery(team: TeamTodo, behind: Learned) -> dict[str, Any]:
    found = None if team.known is None else team_pages.gallery(
        team.team, team.matches, team.known, behind)
    none = {"team": team.team, "version": "none", "total": 0, "shown_from": 0, "roles": [],
            "cards": [], "every": [], "phrases": []}
    return (found or none) | {"sides": team.sides}
