"""The games of a season that a person plays now, one after the other, in a window.

The counted match of a game is played at its real pace. What follows is as in any season
(:mod:`pipeline.engine.games`). A game that is left before its end is not counted: its log is set aside, and
the game is played anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine.games import LEFT, NOUN, Turn, learn_from_game, next_of, play_game, store_of
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.record import match_log, recorded
from pitchlore.pipeline.engine.recordings import PLAYING
from pitchlore.pipeline.sessions.person import PersonMatch
from pitchlore.pipeline.stages.seasons.settings import Season
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Matches

if TYPE_CHECKING:
    from pitchlore.pipeline.arena.window.screen import Window

#: Names of the teams in the window: the apprentice is home.
NAMES = ("apprentice", "you")
_BEGIN = "P or Start begins"


class GameLeft(Exception):
    """The person has left before the final whistle."""


def check_person_can_play(season: Season) -> None:
    """Check that a season has games that a person can play.

    Raises:
        BadSettings: if it has practice matches.
    """
    if season.settings.practice:
        raise BadSettings(
            f"a person plays no practice matches, and it has {season.settings.practice} beside each game",
            where=season.id,
            next_step="Take --settings paper, best-in-games, or a TOML file with practice = 0")


def sit(
    store: Store, season: Season, window: type[Window], *, most: int | None, discard: bool,
    say: Callable[[str], None],
) -> StageReport:
    """Play games of a season until the person leaves, the season is over, or enough are played.

    Args:
        store: store that the season belongs to.
        season: season against a person.
        window: the window.
        most: number of games that are enough; None: all.
        discard: as for :func:`pipeline.engine.games.learn_from_game`.
        say: takes lines for the person.

    Returns:
        The games that were played and learned from.

    Raises:
        BadSettings: as for :func:`pipeline.engine.games.done` and :func:`check_person_can_play`.
    """
    check_person_can_play(season)
    report = StageReport(noun=NOUN)
    turn = next_of(store, season)
    report.kept += turn is None
    while turn is not None and (most is None or len(report.made) < most):
        if not _take(store, turn, window, discard, say):
            break
        report.made.append(turn.label)
        turn = turn.following()
    return report


def _take(
    store: Store, turn: Turn, window: type[Window], discard: bool, say: Callable[[str], None]
) -> bool:
    """Let the person play a game, and learn from it. Returns whether they have played it to its end."""
    season, game = turn
    own = store_of(store.root, season)
    of_all = f"Game {game} of {season.settings.games}"

    def at_the_window(own: Store, recipe: Recipe, policies: Mapping[str, PolicyTables]) -> None:
        if recorded(own, recipe) is not None:
            return  # it was played, and its process was killed while it learned
        minutes = recipe.referee.duration_s / 60
        say(f"{season.id}: {of_all.lower()}, {minutes:g} minutes. {_BEGIN} it in the window, Esc leaves.")
        yours = PersonMatch(recipe, policies)
        yours.match.advance()  # to the kick-off; the first time it is compiled, for which no window waits
        with window(recipe.pitch, NAMES, recipe.physics.hz, paused=True) as open_window:
            if not yours.wait(open_window, of_all, _BEGIN):
                raise GameLeft
            with match_log(own, yours.match) as log_it:
                if not yours.play(open_window, log_it):
                    raise GameLeft

    _set_aside(own, say)
    try:
        matches = play_game(store.root, season, game, at_the_window)
    except GameLeft:
        return False
    finally:
        _set_aside(own, say)
    say(f"{_score(own, matches[0])}. Learning from it …")
    learn_from_game(store.root, season, game, matches, discard)
    return True


def _set_aside(own: Store, say: Callable[[str], None]) -> None:
    """Set the logs of games aside that were left, or whose process was killed."""
    for path in own.abandoned(PLAYING):
        there = own.set_aside(path, LEFT)
        if there is not None:
            say(f"A game was left before its end. It does not count; its log is {there}.")


def _score(own: Store, match: str) -> str:
    """The result of a match in words."""
    receipt = own.receipt("matches", match)
    assert receipt is not None
    row = table_of(own, receipt, Matches).row(0, named=True)
    return f"{NAMES[0]} {row['score_home']} : {row['score_away']} {NAMES[1]}"
