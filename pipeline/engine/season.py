"""The loop of the paper's Figure 2: play, watch the adversary, recognise, know, learn, play again.

Seasons are played game by game (:mod:`pipeline.engine.games`), as many at once as there are workers.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pitchlore.pipeline.base.errors import PitchloreError, in_one_line
from pitchlore.pipeline.engine.catalog import refresh_into
from pitchlore.pipeline.engine.games import NOUN, Turn, next_of, take_game
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.progress import StageReport, listener
from pitchlore.pipeline.engine.run import suspecting
from pitchlore.pipeline.engine.tasks import runner
from pitchlore.pipeline.stages.seasons.settings import Season
from pitchlore.pipeline.store import Store


def play_seasons(
    data: Path, seasons: list[Season], discard: bool = False, on: str | None = None
) -> StageReport:
    """Play the remaining games of some seasons, as many at once as the executors can.

    The games of a season follow each other. The season with most games left is next, so that all workers
    have work to the end. A season that fails stops at that game; the others continue.

    Args:
        data: the data folder.
        seasons: seasons to play.
        discard: delete the logs and tables of a game after learning from it, except its sides and decisions.
        on: where games are played, as for :func:`pipeline.engine.placement.places.place_of`.

    Returns:
        The games that were played now; ``kept`` counts the seasons that were over already.

    Raises:
        BadSettings: if ``data`` is not a folder, or ``on`` names no place.
    """
    store = suspecting(data)
    report = StageReport(noun=NOUN)
    waiting = list(_begin(store, seasons, report))
    with placed(on, store.root) as executors:
        workers = executors.for_pieces(len(waiting))
        root = workers.path(store.root)
        with runner.get().pool(workers.width) as pool:
            while waiting or len(pool):
                while waiting and len(pool) < workers.width:
                    turn = max(waiting, key=lambda turn: turn.left)
                    waiting.remove(turn)
                    pool.submit(turn, "game", turn.label, workers.run, take_game, root, turn, discard)
                for turn, result in pool.ended():
                    following = _end(turn, result, report)
                    if following is not None:
                        waiting.append(following)
    refresh_into(store, report)
    runner.get().show(lambda: _markdown(report), key="season", description="what was played")
    return report


def _begin(store: Store, seasons: list[Season], report: StageReport) -> Iterator[Turn]:
    """The next game of each season that has games left."""
    for season in {season.id: season for season in seasons}.values():
        try:
            turn = next_of(store, season)
        except PitchloreError as error:
            report.failed[season.id] = str(error)
            continue
        if turn is None:
            report.kept += 1
        else:
            listener.get().begin(season.id, turn.left)
            yield turn


def _end(turn: Turn, result: object, report: StageReport) -> Turn | None:
    """Record the outcome of a game. Returns the season's next, None if the season is over or has failed."""
    if isinstance(result, PitchloreError):
        report.failed[turn.label] = str(result)
        return None
    if isinstance(result, BaseException):
        report.failed[turn.label] = (
            f"unexpected {in_one_line(result)}. Run again with --debug and report what it says.")
        return None
    listener.get().advance(turn.season.id, turn.label)
    report.made.append(turn.label)
    return turn.following()


def _markdown(report: StageReport) -> str:
    lines = [f"{len(report.made)} games played, {report.kept} seasons were over already", ""]
    return "\n".join([*lines, *(f"- **{what}**: {why}" for what, why in report.failed.items())])
