"""Tables of matches that have run, and the newest knowledge, of which pages are made."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest, Receipt, canonical, digest
from pitchlore.pipeline.views.scout.facts import Tables
from pitchlore.schemas import (
    SIDES,
    Behaviours,
    Chances,
    Goals,
    Matches,
    Passes,
    Possession,
    Pressure,
    Quality,
    Referee,
    Restarts,
    Sequences,
    Shots,
    Sides,
    Situations,
    Table,
    Trajectories,
)

#: Tables of a match by the noun that makes them.
_TABLES = {
    "matches": (Matches, Quality, Referee), "sides": (Sides,), "trajectories": (Trajectories,),
    "situations": (Situations,), "goals": (Goals,), "events": (Possession, Passes, Shots, Pressure, Restarts),
    "chances": (Chances,),
}


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


class Match(NamedTuple):
    """A match that has run.

    Attributes:
        log: receipt of its log.
        made: receipts of what was made from it, by noun.
        home, away: its teams.
    """

    log: Receipt
    made: dict[str, Receipt]
    home: TeamName
    away: TeamName

    @property
    def name(self) -> str:
        """Its id."""
        return self.log.name

    @property
    def pitch(self) -> Pitch:
        """Its pitch."""
        return Pitch.model_validate(self.log.details["pitch"])

    @property
    def goals_at_least(self) -> int:
        """Number of goals that expected goals need, by the settings that its chances were made with."""
        return int(self.made["chances"].details["goals_at_least"])

    def key(self, *besides: object) -> str:
        """Digest of its tables, and of what else a page is made from."""
        receipts = (self.log, *(self.made[noun] for noun in _TABLES if noun in self.made))
        files = [receipt.digests() for receipt in receipts]
        return digest(canonical([files, *besides]))

    def tables(self, store: Store) -> Tables:
        """Its tables."""
        found = {}
        for noun, schemas in _TABLES.items():
            receipt = self.log if noun == "matches" else self.made[noun]
            for schema in schemas:
                found[schema.NAME] = store.read_table(receipt, schema.NAME, schema)
        return Tables(**found)


def played(store: Store) -> Iterator[Match]:
    """The matches that have run up to their events and sequences, sorted by id; others are left out."""
    wanted = [noun for noun in _TABLES if noun != "matches"]
    for log in store.receipts("matches"):
        made = {noun: receipt for noun in (*wanted, "sequences")
                if (receipt := store.receipt(noun, log.name)) is not None}
        if len(made) == len(wanted) + 1:
            kind = log.details["pitch"]["kind"]
            yield Match(log, made, *(team_name(log.details[side], kind) for side in SIDES))


def chosen(league: Sequence[Match], names: Sequence[str]) -> list[Match]:
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


def sides_of(team: TeamName, match: Match) -> list[str]:
    """The sides that a team plays in a match; both, if it plays itself."""
    return [side for side, own in zip(SIDES, (match.home, match.away), strict=True) if own == team]


def counted(matches: int, itself: int) -> str:
    """A number of matches in words, and how many of them a team plays against itself."""
    says = f"{matches} {'match' if matches == 1 else 'matches'}"
    if not itself:
        return says
    which = "it" if matches == 1 else f"{itself} of them"
    return f"{says}, {which} against itself, which {'counts' if itself == 1 else 'count'} from both sides"


def against_itself(team: TeamName, matches: Sequence[Match]) -> int:
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
    """The newest knowledge, None if there is none."""
    manifest = store.latest("knowledge")
    if manifest is None:
        return None
    before = Behaviours.empty()
    if manifest.parent is not None:
        before = store.read_table(store.manifest("knowledge", manifest.parent), "behaviours", Behaviours)
    return Known(manifest, store.read_table(manifest, "behaviours", Behaviours), before)


def events_of(
    store: Store, played: Sequence[tuple[Match, str]], schema: type[Table], *, own: bool = True
) -> pl.DataFrame:
    """A table of events over a team's sides in matches: its own rows, or those of its adversaries."""
    return pl.concat([schema.empty(), *(
        store.read_table(match.made["events"], schema.NAME, schema).filter((pl.col("team") == side) == own)
        for match, side in played)])


def sequence(store: Store, match: Match, side: str) -> pl.DataFrame:
    """The sequences of one side of a match."""
    return store.read_table(match.made["sequences"], "sequences", Sequences).filter(pl.col("team") == side)
