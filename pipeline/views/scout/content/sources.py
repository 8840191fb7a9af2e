"""Tables of matches that have run, and the newest knowledge, of which pages are made."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.base.digests import canonical, digest
from pitchlore.pipeline.base.errors import CorruptFile, NotFound
from pitchlore.pipeline.engine.catalog import check_files
from pitchlore.pipeline.engine.inputs import StoreInputs, by_day
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.tables import MatchTables, TableOf
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.schemas import SIDES, Behaviours

#: The nouns whose tables the pages of a match show.
_NOUNS = ("matches", "sides", "trajectories", "situations", "goals", "events", "chances", "values")
#: A noun that they show where there is one: matches that ran before it was a stage have none.
_EXTRA = "analysis"


class TeamName(NamedTuple):
    """A team as pages name it.

    Attributes:
        name: the team's.
        kind: its league; teams of two leagues are never put together.
        slug: name of its files.
    """

    name: str
    kind: str
    slug: str


def team_name(name: str, kind: str) -> TeamName:
    """A team's name, and that of its files: teams of other names or leagues have others."""
    return TeamName(name, kind, f"{readable(name) or 'team'}-{kind}-{digest(canonical([name, kind]))[:6]}")


def readable(text: str) -> str:
    """A text as part of a file's name: at most 40 small letters, digits and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")[:40]


class LeagueMatch(MatchTables):
    """A match of a data folder that has run.

    Args:
        inputs: its nouns.
        home, away: its teams.
    """

    inputs: StoreInputs

    def __init__(self, inputs: StoreInputs, home: TeamName, away: TeamName) -> None:
        super().__init__(inputs)
        self.home, self.away = home, away

    def at(self, store: Store, *, keep: bool = False) -> LeagueMatch:
        """The match read through another store of the same data; ``keep`` keeps the tables in memory."""
        return LeagueMatch(self.inputs.at(store, seen={} if keep else None), self.home, self.away)

    @property
    def goals_at_least(self) -> int:
        """Number of goals that expected goals need, by the settings that its chances were made with."""
        return int(self.inputs.details("chances")["goals_at_least"])

    @property
    def sequences_digests(self) -> dict[str, str]:
        """SHA-256 of the files of its sequences."""
        return self.inputs["sequences"][0].digests()

    def key(self, *besides: object) -> str:
        """Digest of the tables that its pages show, and of what else a page is made from."""
        files = [receipt.digests() for noun in (*_NOUNS, _EXTRA) for receipt in self.inputs[noun]]
        return digest(canonical([files, *besides]))


def played(store: Store) -> Iterator[LeagueMatch]:
    """The matches that have run up to their events and sequences, by :func:`by_day`; others are left out.

    Raises:
        CorruptFile: if a receipt or a table is damaged, unless the store may leave its match out.
    """
    nouns = (*_NOUNS, "sequences")
    damaged = {file.receipt.name: file.error for file in check_files(store)
               if file.receipt.noun in nouns and file.record.table is not None}
    for log in sorted(store.receipts("matches"), key=by_day):
        try:
            if log.name in damaged:
                raise damaged[log.name]
            made = {noun: store.receipt(noun, log.name) for noun in nouns[1:]}
        except CorruptFile as error:
            store.go_on_without(error)
            continue
        there = {noun: (receipt,) for noun, receipt in made.items() if receipt is not None}
        extra = store.receipt(_EXTRA, log.name)
        if len(there) == len(made):
            there |= {_EXTRA: (extra,)} if extra else {}
            kind = log.details["pitch"]["kind"]
            teams = (team_name(log.details[side], kind) for side in SIDES)
            yield LeagueMatch(StoreInputs(store, {"matches": (log,), **there}), *teams)


def chosen_matches(league: Sequence[LeagueMatch], names: Sequence[str]) -> list[LeagueMatch]:
    """The matches of some teams, and those whose ids are named or begin so; all without names.

    Raises:
        NotFound: if a name is that of no team, and no match begins with it.
    """
    if not names:
        return list(league)
    kept = set[str]()
    for name in names:
        found = ([match for match in league if name in (match.home.name, match.away.name)]
                 or [match for match in league if match.name == name]
                 or [match for match in league if name and match.name.startswith(name)])
        if not found:
            there = sorted({team.name for match in league for team in (match.home, match.away)})
            raise NotFound(f"no team has this name and no match begins so (teams: {', '.join(there[:8])})",
                           where=name, next_step="Name one of them, or the id of a match that has run")
        kept.update(match.name for match in found)
    return [match for match in league if match.name in kept]


def sides_played(team: TeamName, match: LeagueMatch) -> list[str]:
    """The sides that a team plays in a match; both, if it plays itself."""
    return [side for side, own in zip(SIDES, (match.home, match.away), strict=True) if own == team]


def side_of(team: TeamName, matches: Sequence[LeagueMatch]) -> dict[str, str]:
    """By match that a team plays in, its side; home, if it plays itself."""
    return {match.name: sides[0] for match in matches if (sides := sides_played(team, match))}


def matches_in_words(matches: int, itself: int) -> str:
    """A number of matches in words, and how many of them a team plays against itself."""
    says = f"{matches} {'match' if matches == 1 else 'matches'}"
    if not itself:
        return says
    which = "it" if matches == 1 else f"{itself} of them"
    return f"{says}, {which} against itself, which {'counts' if itself == 1 else 'count'} from both sides"


def against_itself(team: TeamName, matches: Sequence[LeagueMatch]) -> int:
    """How many of some matches a team plays against itself."""
    return sum(match.home == match.away == team for match in matches)


class Known(NamedTuple):
    """The newest knowledge.

    Attributes:
        manifest: manifest of the version.
        behaviours: rows of schema Behaviours.
        before: rows of the version before it; none without one.
    """

    manifest: Manifest
    behaviours: pl.DataFrame
    before: pl.DataFrame

    def of(self, team: TeamName) -> pl.DataFrame:
        """The behaviours of a team alone, never those of a pool or of another league.

        Rows of schema Behaviours with a column new: whether the version before had them not.
        """
        own = self.behaviours.filter(pl.col("team") == team.name, pl.col("kind") == team.kind)
        known = self.before.filter(pl.col("team") == team.name, pl.col("kind") == team.kind)["behaviour_id"]
        new = ~pl.col("behaviour_id").is_in(known.to_list()) & (not self.before.is_empty())
        return own.with_columns(new=new)


def newest(store: Store) -> Known | None:
    """The newest knowledge, None if there is none; a damaged version as for :func:`played`."""
    versions = store.manifests("knowledge")
    if not versions:
        return None
    manifest = versions[-1]
    before = Behaviours.empty()
    for parent in versions:  # without it, where it is damaged
        if parent.version == manifest.parent:
            before = table_of(store, parent, Behaviours)
    return Known(manifest, table_of(store, manifest, Behaviours), before)


def over_sides(
    played: Sequence[tuple[LeagueMatch, str]], table: TableOf, *, own: bool = True
) -> pl.DataFrame:
    """A table over a team's sides in matches: its own rows, or those of its adversaries."""
    return pl.concat([table.schema.empty(), *(
        table.of(match).filter((pl.col("team") == side) == own) for match, side in played)])


def sequence(match: LeagueMatch, side: str) -> pl.DataFrame:
    """The sequences of one side of a match."""
    return match.sequences.filter(pl.col("team") == side)
