"""The command season: play, watch the opponent, learn, repeat."""

from __future__ import annotations

import re
import sys
from functools import partial
from typing import Annotated

import polars as pl
from cyclopts import Parameter
from cyclopts.types import PositiveInt

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json, On
from pitchlore.flows.commands.performing import perform
from pitchlore.flows.commands.playing import Seed
from pitchlore.flows.commands.printing import console, print_failed, print_frame, print_json, print_stand_in
from pitchlore.pipeline.arena.teams.table import SCRIPTED
from pitchlore.pipeline.arena.window import window_class
from pitchlore.pipeline.base.errors import BadSettings, CorruptFile
from pitchlore.pipeline.engine.catalog import refresh_into
from pitchlore.pipeline.engine.games import next_of
from pitchlore.pipeline.engine.imitations import name_of_words
from pitchlore.pipeline.engine.placement.places import place_of
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.season import play_seasons
from pitchlore.pipeline.engine.starts import start_of
from pitchlore.pipeline.engine.teams import rivals
from pitchlore.pipeline.sessions.human import check_person_can_play, sit
from pitchlore.pipeline.stages.seasons.settings import (
    ITSELF,
    Season,
    SeasonSettings,
    named_settings,
    names,
    parse_season,
)
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.paths import named_path
from pitchlore.schemas import Games, note_on
from pitchlore.schemas.seasons import PERSON
from pitchlore.schemas.table import SLUG

#: Option: the opponents.
WhoIsPlayed = Annotated[tuple[str, ...], Parameter(negative=(), show_default=False, help=(
    f"Opponent: a script ({', '.join(SCRIPTED)}), {PERSON} (you, in a window), {ITSELF}, or any team that "
    "evaluate takes; may be repeated (default: those in the settings, which are static for best, and static "
    "and human-like for paper)."
))]  # fmt: skip


def season(
    *,
    settings: str = "best",
    opponent: WhoIsPlayed = (),
    in_turn: Flag = False,
    start: str | None = None,
    seed: Seed = 1,
    seasons: PositiveInt = 1,
    games: PositiveInt | None = None,
    now: PositiveInt | None = None,
    on: On = None,
    discard: Flag = False,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Play seasons: play, watch the opponent, learn, repeat. Games that are done are not played again.

    With `--opponent person` you play each game yourself, in a window, with the keyboard or a gamepad. The
    window waits before each game. Leave it there, and the same command goes on tomorrow. A game that you
    leave before its end does not count and is played anew. Several people play seasons with seeds of their
    own.

    Args:
        settings: Named settings (paper, paper-literal, best, best-in-games, looking, looking-held) or a
            TOML file.
        opponent: Opponent.
        in_turn: Play all opponents in one season, a game each in turn (default: each has seasons of its own).
        start: The imitation as which the apprentice begins: imitated:TEAM. It learns on by what it tries
            (default: it begins with nothing).
        seed: Seed of the first season; each later season has the next seed.
        seasons: Number of seasons against each opponent.
        games: Number of games in a season (default: from the settings). With more games a finished season
            continues, unless its settings change exploration from game to game.
        now: Number of games that you play now, against a person (default: until you leave).
        on: Where games are played; each worker plays one at a time.
        discard: Delete a game's logs and tables after learning from it.
        json: Print JSON.
        common: Options of every command.
    """
    store = common.store
    name, chosen = _settings(settings, store)
    if games is not None:
        chosen = SeasonSettings.model_validate(chosen.model_dump() | {"games": games})
    opponents = opponent or chosen.opponents
    groups = [opponents] if in_turn else [(word,) for word in opponents]
    played = [rivals(store, group) for group in groups]
    begins = None if start is None else start_of(store, start, chosen)
    name += "" if begins is None else f"-as-{name_of_words(begins.word, 24)}"
    wanted = [
        _named(Season(name=name, opponent=against, start=begins, rivals=found, seed=number, settings=chosen))
        for number in range(seed, seed + seasons) for against, found in played
    ]
    if PERSON in opponents:
        report = _in_person(store, wanted, on, now, discard, say=not json)
    else:
        report = _against_scripts(store, wanted, on, now, discard)
    rows, damaged = _summary(store, wanted)
    report.failed |= damaged
    if json:
        print_json({"report": report.model_dump(), "seasons": rows.to_dicts(), "note": note_on(*opponents)})
    else:
        print_frame(rows, title="all games and the last ten: goals a game, learned share of time")
        print_stand_in(*opponents)
        print_failed(report.failed, "stopped")
        turn = next_of(store, wanted[0]) if PERSON in opponents else None
        if turn is not None:
            console().print(f"{turn.label} of {turn.season.settings.games} is next: the same command goes on")
        console().print("`pitchlore report` writes the page on all seasons of the data folder")
    sys.exit(1 if report.failed else 0)


def _against_scripts(
    store: Store, wanted: list[Season], on: str | None, now: int | None, discard: bool
) -> StageReport:
    """Play seasons against scripts, several at once.

    Raises:
        BadSettings: if a number of games for now is given.
    """
    if now is not None:
        raise BadSettings("only a person plays some games now and some later", where="--now",
                          next_step="Leave it out, or name --opponent person")
    place_of(on)  # so that a word that names none is refused at once
    return perform(store, "season_flow", StageReport, play_seasons)(store.root, wanted, discard, on)


def _in_person(
    store: Store, wanted: list[Season], on: str | None, now: int | None, discard: bool, *, say: bool
) -> StageReport:
    """Let a person play games of a season at the window of this process.

    Raises:
        BadSettings: if it is not one season, or it is to be played elsewhere; and as for
            :func:`pipeline.sessions.human.sit`.
    """
    if len(wanted) > 1:
        raise BadSettings("a person plays one season at a time", where="--opponent person",
                          next_step="Name no other --opponent and no --seasons; --seed tells people apart")
    if on is not None:
        raise BadSettings("a person plays at the window of this machine", where="--on",
                          next_step="Leave it out")
    check_person_can_play(wanted[0])
    window = window_class("season")
    store.sweep()
    report = sit(store, wanted[0], window, most=now, discard=discard,
                 say=partial(console().print, soft_wrap=True) if say else lambda _: None)
    refresh_into(store, report)
    return report


def _named(season: Season) -> Season:
    """The season.

    Raises:
        BadSettings: if its id is too long for a name.
    """
    if re.match(SLUG, season.id):
        return season
    raise BadSettings("is too long for the name of a season", where=season.id,
                      next_step="Name the settings file, or fewer opponents, in fewer letters")


def _settings(word: str, store: Store) -> tuple[str, SeasonSettings]:
    """The name of settings, and the settings: those in the package of this name, or a file's.

    Raises:
        NotFound: if there is neither.
        BadSettings: if a file cannot be used, or its name cannot name a season.
    """
    if not word.endswith(".toml"):
        return word, named_settings(word)
    path = named_path(word)
    if not re.match(SLUG, f"{path.stem}-human-like-9999"):
        raise BadSettings("its name cannot name a season", where=word,
                          next_step="Name the file in lower case letters, digits and hyphens, 48 at most")
    if path.stem in names():
        raise BadSettings("has the name of settings in the package", where=word,
                          next_step="Rename the file, and write base = \"...\" in it")
    return path.stem, parse_season(store.foreign(path), where=word)


def _summary(store: Store, wanted: list[Season]) -> tuple[pl.DataFrame, dict[str, str]]:
    """A row for each season that has games, and the seasons whose table cannot be read, with the reason."""
    rows, damaged = [], {}
    for own in wanted:
        try:
            receipt = store.receipt("seasons", own.id)
            if receipt is None:
                continue
            games = store.read_table(receipt, "games", Games)
        except CorruptFile as error:
            damaged[own.id] = str(error)
            continue
        rows.append(pl.DataFrame({"season": own.id, "games": games.height}).hstack(
            pl.concat([_means(games, ""), _means(games.tail(10), "last ")], how="horizontal")))
    return pl.concat(rows) if rows else pl.DataFrame(), damaged


def _means(games: pl.DataFrame, prefix: str) -> pl.DataFrame:
    return games.select(
        pl.col("goals_for").mean().alias(f"{prefix}for"),
        pl.col("goals_against").mean().alias(f"{prefix}against"),
        (pl.col("other_s").sum() / pl.col("played_s").sum()).alias(f"{prefix}learned"),
    )
