"""Played matches: logged during play, committed at the end."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path

from pitchlore.pipeline import arena
from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import PART, MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.base.digests import fingerprint
from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.engine.matches import keep
from pitchlore.pipeline.engine.recordings import PLAYING
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.work import Work


def record(
    store: Store, recipe: Recipe, policies: Mapping[str, PolicyTables] | None = None
) -> tuple[Receipt, bool]:
    """Play a match, unless the store has it. Returns its receipt, and whether it is new.

    Args:
        store: keeps the match.
        recipe: recipe of the match.
        policies: policies by the label that the recipe's teams name.

    Raises:
        StorageFailed: if the log cannot be written, or if another process plays this match.
    """
    there = recorded(store, recipe)
    if there is not None:
        return there, False
    match = MatchInPlay(recipe, controllers_of(recipe, policies or {}))
    with match_log(store, match) as log_it:
        while match.advance(PART):
            log_it()
    there = recorded(store, recipe)
    assert there is not None
    return there, True


def recorded(store: Store, recipe: Recipe) -> Receipt | None:
    """The receipt of a match that has been played by a recipe, None if the store has none."""
    return store.holding(_work(recipe))


def record_match(
    data: Path, recipe: Recipe, policies: Mapping[str, PolicyTables]
) -> tuple[Receipt, bool]:
    """Play a match for a data folder (:func:`record`)."""
    return record(Store(data), recipe, policies)


def is_played(store: Store, recipe: Recipe) -> bool:
    """True if a match was played by a recipe, or is being played."""
    playing = store.root / PLAYING / f"{recipe.match_id}.mcap"
    return store.receipt("matches", recipe.match_id) is not None or playing.exists()


def unplayed(store: Store, recipe: Recipe) -> Recipe:
    """The recipe with the next seed that was not played with it.

    A recipe does not say what people or others' programs do, so it cannot be played again.
    """
    while is_played(store, recipe):
        recipe = recipe.model_copy(update={"seed": recipe.seed + 1})
    return recipe


@contextmanager
def match_log(store: Store, match: MatchInPlay) -> Iterator[Callable[[], None]]:
    """Log a match while it is played; when the body ends, commit the match as its log says.

    If the process is killed, the logged part stays in ``playing/``. If the body raises, all that was played
    stays there. The next run of the stages takes the log from there.

    Yields:
        A function that logs all that was played since its last call. A kill of the process loses none of it.
    """
    recipe = match.recipe
    with store.growing(PLAYING, f"{recipe.match_id}.mcap") as (path, stream):
        recorder = log.Recorder(stream, match.info)

        def log_it() -> None:
            _log(recorder, match)

        try:
            yield log_it
        except BaseException:  # a match that breaks off is logged as far as it came
            with suppress(PitchloreError):
                log_it()
            raise
        log_it()
        recorder.close(info=match.info)
        data = store.foreign(path, megabytes=log.MAX_LOG_BYTES >> 20)
        played = log.read(data, where=str(path))
        with store.locked("matches"):
            keep(store, played, data, _work(recipe))
        store.release("matches", recipe.match_id)
        path.unlink()


def in_memory(recipe: Recipe, policies: Mapping[str, PolicyTables] | None = None) -> MatchLog:
    """A match played for nobody's data folder, as its log would be read.

    Args:
        recipe: recipe of the match.
        policies: policies by the label that the recipe's teams name.
    """
    match, stream = MatchInPlay(recipe, controllers_of(recipe, policies or {})), BytesIO()
    recorder = log.Recorder(stream, match.info)
    while match.advance(PART):
        _log(recorder, match)
    _log(recorder, match)
    recorder.close(info=match.info)
    return log.read(stream.getvalue(), where=match.info.source)


def _log(recorder: log.Recorder, match: MatchInPlay) -> None:
    """Log all that was played since the last call."""
    part = match.take()
    recorder.frames(part.frames)
    recorder.referee(part.referee)
    recorder.decisions(part.decisions)
    recorder.flush()


def _work(recipe: Recipe) -> Work:
    """A match as a piece of work: its version is the arena's."""
    return Work(
        noun="matches", name=recipe.match_id, settings=recipe.model_dump(mode="json"), version=arena.VERSION,
        inputs={"source": fingerprint(recipe)}, schemas=STAGES["matches"].schemas,
    )
