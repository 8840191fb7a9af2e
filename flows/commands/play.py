"""The command play: a person plays a match."""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, Json
from pitchlore.flows.commands.playing import AS_USUAL, Playing, Seed, WhoPlays
from pitchlore.flows.commands.printing import console, print_json, print_stand_in
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.window import window_class
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine.catalog import renew
from pitchlore.pipeline.engine.record import is_played, match_log, unplayed
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.sessions.person import PersonMatch
from pitchlore.pipeline.store import Store
from pitchlore.schemas import AWAY, HOME, SIDES, note_on

# A person's match is short, unless they ask for more.
_MINUTES = 2.0


def play(
    *,
    against: WhoPlays = "static",
    seed: Seed | None = None,
    side: Annotated[Literal["home", "away"], Parameter(name="--as")] = "home",
    playing: Playing = AS_USUAL,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Play a match yourself, with the keyboard or a gamepad. It is logged like any other match.

    You drive the robot with the ring. The other robots of your team follow the rules of `static`. If you
    leave before the final whistle, the match so far is kept.

    Args:
        against: Your opponent.
        seed: Seed of the match (default: the first seed that has not been played with these settings).
        side: Your team. Home kicks off and attacks to the right in the first half.
        playing: How the match is played.
        json: Print JSON.
        common: Options of every command.
    """
    store = common.store
    how = playing.matches(store, _MINUTES).of_match()
    open_window = window_class("play")
    policies: dict[str, PolicyTables] = {}
    team = SIDES.index(side)
    teams = [entrant(store, against, policies).settings] * 2
    teams[team] = TeamSettings(kind="human")
    recipe = _unplayed(store, Recipe(**how, home=teams[HOME], away=teams[AWAY], seed=0), seed)
    yours = PersonMatch(recipe, policies)
    match = yours.match
    names = ("you", against) if team == HOME else (against, "you")
    with open_window(recipe.pitch, names, recipe.physics.hz) as window, match_log(store, match) as log_it:
        yours.play(window, log_it)
    home, away = match.score
    if json:
        print_json({"match_id": recipe.match_id, "as": side, "score_home": home, "score_away": away,
                    "complete": match.info.complete, "note": note_on(against)})
    else:
        why = match.info.incomplete_reason
        console().print(f"{names[HOME]} {home} : {away} {names[AWAY]}{f', {why}' if why else ''}. "
                        f"Kept as {recipe.match_id}; watch it with `pitchlore replay {recipe.match_id}`.",
                        soft_wrap=True)
        print_stand_in(against)
    renew(store)


def _unplayed(store: Store, recipe: Recipe, seed: int | None) -> Recipe:
    """The recipe with the seed that was asked for, else with one that was not played yet.

    Raises:
        BadSettings: if it has been played with the seed that was asked for.
    """
    fresh = recipe.model_copy(update={"seed": 1 if seed is None else seed})
    if seed is not None and is_played(store, fresh):
        raise BadSettings(f"this match has been played with seed {seed}", where=fresh.match_id,
                          next_step="Give another --seed, or none")
    return unplayed(store, fresh)
