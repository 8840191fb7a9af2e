"""One game of a season after the other: play, take the matches through all stages, learn.

Where a person plays, :mod:`pipeline.sessions.human` plays the match of a game and comes here for the rest.

A season is a store of its own in ``seasons/<id>/``; its tables, a row for each game that is done, are an
output of the noun seasons in the store that it belongs to. A game is done when its rows are there:
whatever was killed goes on with the first game that is not.

Nothing here loads Prefect: a process that plays games starts a second sooner.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal, NamedTuple

import polars as pl

from pitchlore.pipeline import arena
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.system import give_back
from pitchlore.pipeline.engine.catalog import forget_outputs
from pitchlore.pipeline.engine.chain import Chain
from pitchlore.pipeline.engine.knowledge import of_imitated
from pitchlore.pipeline.engine.outputs import match_names, need, table_of
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.engine.stage import Per, Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.starts import OF_POLICIES, begin_season
from pitchlore.pipeline.engine.teams import labelled, load_rival
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.stages.seasons.settings import Season
from pitchlore.pipeline.stages.seasons.tables import game_row, growth_rows, states_played
from pitchlore.pipeline.state import project
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import (
    Behaviours,
    Decisions,
    Games,
    Goals,
    Growth,
    Matches,
    Occasions,
    StatesPlayed,
    Table,
)
from pitchlore.schemas.seasons import PERSON
from pitchlore.schemas.table import Key

NOUN = "seasons"
#: Folder, in a season's own store, of the logs of games that a person left before their end.
LEFT = "left"
#: Plays a match for a store, unless that has it (:func:`pipeline.engine.record.record`).
MatchRecorder = Callable[[Store, Recipe, Mapping[str, PolicyTables]], object]


def store_of(data: Path, season: Season) -> Store:
    """The store of a season's matches, knowledge and policies."""
    return Store(data / NOUN / season.id)


def done(store: Store, season: Season) -> Receipt | None:
    """The receipt of the games that are done, None if none is; ``details["games"]`` is their number.

    Raises:
        BadSettings: if they were played with other settings, or by another version of the stages.
    """
    receipt = store.receipt(NOUN, season.id)
    if receipt is None or receipt.key == _work(season).key:
        return receipt
    why = "was begun with other settings or by another version of pitchlore"
    begun = receipt.settings.get("settings", {}).get("games")
    if not season.grows and begun not in (None, season.settings.games):
        why += (f"; it was begun with {begun} games and cannot have {season.settings.games},"
                " because its exploration depends on their number (explore is not explore_last)")
    raise BadSettings(
        why, where=season.id,
        next_step=f"Take another seed, or remove {store.where}/{NOUN}/{season.id}* to play it anew",
    )


def group_of(game: int) -> str:
    """The id of the group of a game's matches."""
    return f"game-{game:03d}"


def play_game(data: Path, season: Season, game: int, recorder: MatchRecorder = record) -> list[str]:
    """Play the missing matches of a game. Returns the ids of all its matches, the counted one first.

    Args:
        data: the data folder.
        season: season of the game.
        game: number of the game.
        recorder: plays a match for a store, unless that has it.
    """
    own, before = store_of(data, season), done(Store(data), season)
    own.sweep()
    if season.start is not None:
        begin_season(Store(data), own, season.start)
    label, known = None, {}
    policy = _played_with(season, before, "policy")
    if policy is not None:
        label, tables = labelled(own, own.manifest("policies", policy))
        known[label] = tables
    recipes = season.recipes(game, label)
    load_rival(Store(data), season.rival(game), known)
    for recipe in recipes:
        recorder(own, recipe, known)
    return [recipe.match_id for recipe in recipes]


def _played_with(season: Season, before: Receipt | None, noun: Literal["policy", "knowledge"]) -> int | None:
    """The version that the next game is played with, by the games before; None if there is none."""
    if before is None:
        return None if season.start is None else season.start.model_dump()[noun]
    version: int = before.details[noun]
    return version


def learn_from_game(
    data: Path, season: Season, game: int, matches: list[str], discard: bool, stages: Chain = STAGES
) -> None:
    """Take a game's matches through all stages, train on them, and commit the game's rows."""
    own, settings, group = store_of(data, season), season.settings.pipeline, group_of(game)
    scope = Scope(matches=tuple(sorted(matches)), group=group)
    stages.make(own, settings, scope, stages.learned)
    known, policy = (
        emit(own, stage, stage.settings(settings), scope)[0]
        for stage in (stages[noun] for noun in stages.versioned)
    )
    _commit(data, season, game, matches[0], known, policy)
    if discard:
        # with what an earlier game has left, if its process was killed at this point
        for name in match_names(own):
            forget_outputs(own, name, [noun for noun in STAGES.nouns(Per.MATCH) if noun not in OF_POLICIES])
        forget_outputs(own, group, [noun for noun in STAGES.nouns(Per.GROUP) if noun not in OF_POLICIES])


def _commit(
    data: Path, season: Season, number: int, match: str, known: Manifest, policy: Manifest
) -> Receipt:
    """Add a game's rows to those of the games before, and record the policy for the next game.

    Args:
        data: the data folder.
        season: season of the game.
        number: number of the game.
        match: the counted match.
        known: the knowledge after the game.
        policy: the policy after the game.
    """
    store, own = Store(data), store_of(data, season)
    before = done(store, season)
    decided = _decided(own, number, match, season.settings.pipeline.knowledge.state_key)
    played = states_played(_so_far(store, before, StatesPlayed), decided)
    version = _played_with(season, before, "knowledge")
    played_with = None if version is None else own.manifest("knowledge", version)
    row = game_row(
        season, number, table_of(own, need(own, "matches", match), Matches), decided,
        table_of(own, need(own, "goals", match), Goals),
        situations=sum(need(own, "situations", match).details["situations"].values()),
        known=None if played_with is None else of_imitated(
            played_with, table_of(own, played_with, Occasions)),
        policy_version=_played_with(season, before, "policy"),
        knowledge_version=known.version,
        left=len(own.were_set_aside(LEFT, f"{match}.mcap")) if season.opponent == PERSON else None,
    )
    growth = growth_rows(
        season, number, decided, played,
        of_imitated(known, table_of(own, known, Occasions)),
        of_imitated(known, table_of(own, known, Behaviours)).filter("kept"),
    )
    return store.commit(_work(season), Made(
        tables=[(pl.concat([_so_far(store, before, Games), row]), Games),
                (pl.concat([_so_far(store, before, Growth), growth]), Growth),
                (played, StatesPlayed)],
        details={"games": number, "store": f"{NOUN}/{season.id}", "knowledge": known.version,
                 "policy": policy.version},
    ))


def _decided(own: Store, game: int, match: str, key: Key) -> pl.DataFrame:
    """The decisions of a match of a game, with their states by a key."""
    table = table_of(own, need(own, "decisions", group_of(game)), Decisions)
    made = table.filter(match_id=match)
    states = project(made["state"].to_numpy(), key, made["role"].to_physical().to_numpy())
    return made.with_columns(state=pl.Series(states, dtype=pl.Int64))


def _so_far(store: Store, before: Receipt | None, schema: type[Table]) -> pl.DataFrame:
    """A table of the games that are done."""
    return schema.empty() if before is None else table_of(store, before, schema)


def _work(season: Season) -> Work:
    """A season as a piece of work. It continues only under the versions of the stages that it began with."""
    versions = {noun: STAGES[noun].version for noun in (*STAGES.learned, *STAGES.versioned)}
    stage = STAGES[NOUN]
    return Work(
        noun=NOUN, name=season.id, settings=season.model_dump(mode="json"), version=stage.version,
        seed=season.seed, schemas=stage.schemas, through={**versions, "arena": arena.VERSION},
        deciding=season.of_each_game(),
    )


def next_of(store: Store, season: Season) -> Turn | None:
    """The next game of a season, None if it has no games left.

    Raises:
        BadSettings: as for :func:`done`.
    """
    before = done(store, season)
    last = 0 if before is None else before.details["games"]
    return Turn(season, last + 1) if last < season.settings.games else None


class Turn(NamedTuple):
    """A game to be played next.

    Attributes:
        season: season of the game.
        game: number of the game.
    """

    season: Season
    game: int

    @property
    def label(self) -> str:
        """Name of the game, for people."""
        return f"{self.season.id} game {self.game}"

    @property
    def left(self) -> int:
        """Number of games of the season that are still to be played, this one included."""
        return self.season.settings.games - self.game + 1

    def following(self) -> Turn | None:
        """The next game of the season, None if this is the last."""
        return Turn(self.season, self.game + 1) if self.game < self.season.settings.games else None


def take_game(data: Path, turn: Turn, discard: bool, stages: Chain = STAGES) -> None:
    """Play a game and learn from it; steps that are done already are not repeated.

    Args:
        data: the data folder.
        turn: the game.
        discard: delete the game's logs and tables after learning from it, except its sides and decisions.
        stages: make what is learned.
    """
    learn_from_game(data, turn.season, turn.game, play_game(data, turn.season, turn.game), discard, stages)
    give_back()
