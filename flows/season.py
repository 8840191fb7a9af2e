"""The loop of the paper's Figure 2: play, watch the adversary, recognise, know, learn, play again.

A season is a store of its own in ``seasons/<id>/``; its two tables, a row for each game that is done,
are outputs of the noun seasons in the store that it belongs to. A game is done when its rows are there:
whatever was killed goes on with the first game that is not.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import polars as pl
from prefect.artifacts import create_markdown_artifact
from prefect.futures import as_completed

from flows import behaviours, decisions, goals, grams, knowledge, policies, situations, trajectories
from flows.catalog import forget_match, refresh
from flows.record import record
from flows.stage import Scope, Stage, StageReport, data_folder, listener, need, our_flow, stage_task
from flows.teams import labelled
from pipeline.errors import BadSettings, in_one_line
from pipeline.receipts import Receipt, key_of
from pipeline.seasons.settings import Season
from pipeline.seasons.tables import Game, game_row, growth_rows
from pipeline.state import project
from pipeline.store import Store
from schemas import Behaviours, Decisions, Games, Goals, Growth, Matches, Occasions
from schemas.table import Key

NOUN = "seasons"
#: What is kept of the games of a season that is to leave little behind.
_KEPT = ("decisions",)


def store_of(data: Path, season: Season) -> Store:
    """Where a season's matches, knowledge and policies are."""
    return Store(data / NOUN / season.id)


def done(store: Store, season: Season) -> pl.DataFrame:
    """The rows of schema Games of the games that are done.

    Raises:
        BadSettings: if they were played with other settings, or by other code.
    """
    receipt = store.receipt(NOUN, season.id)
    if receipt is None:
        return Games.empty()
    if receipt.key != _key(season):
        raise BadSettings(
            "was begun with other settings or by another version of pitchlore", where=season.id,
            next_step=f"Take another seed, or remove {store.root / NOUN}/{season.id}* to play it anew",
        )
    games: pl.DataFrame = store.read_table(receipt, "games", Games)
    return games


def play(data: Path, season: Season, game: int) -> list[str]:
    """Play the matches of a game; their ids, the counted one first."""
    own = store_of(data, season)
    own.sweep()
    policy = _played_by(own, done(Store(data), season), game)
    label, rows = (None, None) if policy is None else labelled(own, own.manifest("policies", policy))
    recipes = season.recipes(game, label)
    for recipe in recipes:
        record(own, recipe, {} if label is None or rows is None else {label: rows})
    return [recipe.match_id for recipe in recipes]


def learn(data: Path, season: Season, game: int, matches: list[str], discard: bool) -> None:
    """Take a game's matches through all stages, train on them, and commit the game's rows."""
    store, own = Store(data), store_of(data, season)
    settings = season.settings.pipeline
    lengths = tuple(r.n for r in settings.behaviours.rounds)
    scope = Scope(matches=tuple(sorted(matches)), lengths=lengths, group=f"game-{game:03d}")
    for match in scope.matches:
        _make(trajectories.STAGE, own, match, settings.trajectories, scope)
        _make(situations.STAGE, own, match, settings.situations, scope)
        _make(goals.STAGE, own, match, settings.goals, scope)
    for n in lengths:
        for match in scope.matches:
            _make(grams.STAGE, own, grams.output(match, n), settings.grams, scope)
        _make(behaviours.STAGE, own, scope.round(n), settings.behaviours, scope)
    for match in scope.matches:
        _make(decisions.STAGE, own, match, settings.decisions, scope)
    known, _ = knowledge.emit(own, settings.knowledge, scope)
    policies.learn(own, settings.policies)
    before = done(store, season)
    _commit(store, own, season, before, _rows(own, season, before, game, matches[0], known.version))
    if discard:
        for match in scope.matches:
            forget_match(own, match, keep=_KEPT)


def _make(stage: Stage[Any], store: Store, name: str, settings: Any, scope: Scope) -> None:
    if not stage.done(store, name, settings, scope):
        stage.perform(store, name, settings, scope)


def _played_by(own: Store, before: pl.DataFrame, game: int) -> int | None:
    """The version of the policy that a game is played with: the one trained after the game before."""
    if game == 1:
        return None
    known = before.filter(pl.col("game") == game - 1)["knowledge_version"].item()
    return max(m.version for m in own.manifests("policies") if m.counts["knowledge_version"] == known)


def _rows(
    own: Store, season: Season, before: pl.DataFrame, number: int, match: str, version: int
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """The rows of Games and Growth of a game."""
    game = Game(season.id, season.name, season.opponent, season.seed, number)
    key = season.settings.pipeline.knowledge.state_key
    made = [_decided(own, played, key) for played in (*before["match_id"], match)]
    known_before = None
    if number > 1:
        last = before.filter(pl.col("game") == number - 1)["knowledge_version"].item()
        known_before = own.read_version_table(own.manifest("knowledge", last), "occasions", Occasions)
    manifest = own.manifest("knowledge", version)
    return (
        game_row(
            game, own.read_table(need(own, "matches", match), "matches", Matches), made[-1],
            own.read_table(need(own, "goals", match), "goals", Goals),
            situations=sum(need(own, "situations", match).details["situations"].values()),
            lead=season.lead(number), known=known_before, key=key,
            policy_version=_played_by(own, before, number), knowledge_version=version,
        ),
        growth_rows(
            game, made, own.read_version_table(manifest, "occasions", Occasions),
            own.read_version_table(manifest, "behaviours", Behaviours), key=key,
        ),
    )


def _decided(own: Store, match: str, key: Key) -> pl.DataFrame:
    """The decisions of a match, their states by a key."""
    made = own.read_table(need(own, "decisions", match), "decisions", Decisions)
    states = project(made["state"].to_numpy(), key, made["role"].to_physical().to_numpy())
    return made.with_columns(state=pl.Series(states, dtype=pl.Int64))


def _commit(
    store: Store, own: Store, season: Season, before: pl.DataFrame, rows: tuple[pl.DataFrame, pl.DataFrame]
) -> Receipt:
    """Add a game's rows to those of the games before."""
    there = store.receipt(NOUN, season.id)
    grown = Growth.empty() if there is None else store.read_table(there, "growth", Growth)
    newest = own.latest("policies")
    return store.commit(
        NOUN, season.id, _key(season), inputs={}, seed=season.seed, settings=season.model_dump(mode="json"),
        tables={"games": (pl.concat([before, rows[0]]), Games),
                "growth": (pl.concat([grown, rows[1]]), Growth)},
        details={"games": before.height + 1, "store": f"{NOUN}/{season.id}",
                 "policy": newest.version if newest else None},
    )


def _key(season: Season) -> str:
    return key_of(NOUN, season.id, inputs={}, settings=season.model_dump(mode="json"), tables=(Games, Growth))


@contextmanager
def _workers(jobs: int) -> Iterator[Executor | None]:
    """Processes that play and learn; None, and everything is done in place, for one job."""
    if jobs == 1:
        yield None
    else:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            yield pool


def _in(pool: Executor | None, work: Callable[..., Any], *arguments: Any) -> Any:
    return work(*arguments) if pool is None else pool.submit(work, *arguments).result()


@our_flow(name="season")
def season_flow(data: Path, seasons: list[Season], jobs: int = 1, discard: bool = False) -> dict[str, Any]:
    """Play what is left of some seasons, ``jobs`` games at a time; a season's games follow each other.

    Args:
        data: the data folder.
        seasons: what to play.
        jobs: processes.
        discard: forget the logs and tables of a game once it is learned from, all but its decisions.
    """
    store = data_folder(data)
    report = StageReport(noun=NOUN)
    with _workers(jobs) as pool:

        @stage_task(name="play")
        def play_game(name: str, season: Season, game: int) -> list[str]:
            matches: list[str] = _in(pool, play, data, season, game)
            return matches

        @stage_task(name="learn")
        def learn_game(name: str, season: Season, game: int, matches: list[str]) -> None:
            _in(pool, learn, data, season, game, matches, discard)

        waiting = list(seasons)
        running: dict[Any, tuple[Season, int, bool]] = {}
        while waiting or running:
            while waiting and len(running) < jobs:
                season = waiting.pop(0)
                game = done(store, season).height + 1
                if game > season.settings.games:
                    report.kept += 1
                    continue
                listener.get().begin(season.id, season.settings.games - game + 1)
                future = play_game.submit(f"{season.id} game {game}", season, game)
                running[future] = season, game, True
            if not running:
                break
            future = next(as_completed(list(running)))
            season, game, played = running.pop(future)
            result: Any = future.result(raise_on_failure=False)
            if isinstance(result, BaseException):
                report.failed[f"{season.id} game {game}"] = in_one_line(result)
                continue
            label = f"{season.id} game {game}"
            if played:
                running[learn_game.submit(label, season, game, result)] = season, game, False
                continue
            listener.get().advance(season.id, label)
            report.made.append(label)
            if game < season.settings.games:
                label = f"{season.id} game {game + 1}"
                running[play_game.submit(label, season, game + 1)] = season, game + 1, True
    refresh(store)
    create_markdown_artifact(_markdown(report), key="season", description="what was played")
    return report.model_dump()


def _markdown(report: StageReport) -> str:
    lines = [f"{len(report.made)} games played, {report.kept} seasons were over already", ""]
    return "\n".join([*lines, *(f"- **{what}**: {why}" for what, why in report.failed.items())])
