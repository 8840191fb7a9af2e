"""The two sides of an environment's matches: those who drive, or an opponent by name."""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.arena.match.controllers import LearnedTeam, PolicyTables, constant_team, controller_of
from pitchlore.pipeline.arena.match.driven import BehaviourController, Driven, WheelController
from pitchlore.pipeline.arena.match.environment import EnvSettings
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.match.stepped import SteppedMatch
from pitchlore.pipeline.arena.teams.constant import BEST
from pitchlore.pipeline.arena.teams.table import SCRIPTED
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.schemas import AWAY, HOME, SIDES, Side

#: A driven team in a recipe.
_DRIVEN = TeamSettings(kind="human")


class MatchSides:
    """The two sides of an environment's matches.

    Args:
        settings: settings of the environment.
        opponent: word, or a learned team; None: both sides are driven.
        side: the driven team's side, if there is an opponent.

    Attributes:
        driven: the driven teams, 0 home, 1 away.
        names: names of home and away, to be shown.
    """

    def __init__(
        self, settings: EnvSettings, opponent: str | LearnedTeam | None, side: Side
    ) -> None:
        if side not in SIDES:
            raise BadSettings(f"there is no side {side!r}", where="side",
                              next_step=f"Name one of {', '.join(SIDES)}")
        self._settings = settings
        self._teams = [_DRIVEN, _DRIVEN]
        self._policy: PolicyTables | None = None
        self.names = ("home", "away")
        self.driven: tuple[int, ...] = (HOME, AWAY)
        if opponent is not None:
            team = SIDES.index(side)
            against, self._policy = team_of(opponent)
            self.driven, self._teams[1 - team] = (team,), against
            them = opponent if isinstance(opponent, str) else against.kind
            self.names = ("you", them) if team == HOME else (them, "you")

    def begin(self, seed: int) -> SteppedMatch:
        """The match of a seed, at its kick-off."""
        home, away = self._teams
        recipe = Recipe(**self._settings.matches.of_match(), home=home, away=away, seed=seed)
        first, second = (
            _driver(self._settings, recipe, team) if team in self.driven
            else controller_of(self._teams[team], recipe, team, self._policy)
            for team in (HOME, AWAY)
        )
        return SteppedMatch(recipe, (first, second))


def _driver(settings: EnvSettings, recipe: Recipe, team: int) -> Driven:
    """The controller of a driven team, 0 home, 1 away."""
    if settings.actions == "wheels":
        return WheelController(recipe)
    return BehaviourController(recipe, np.random.default_rng([recipe.seed, 1 + team]))


def team_of(word: str | LearnedTeam) -> tuple[TeamSettings, PolicyTables | None]:
    """Settings of the team that a word names, or of a learned team, and its policy; None without one.

    Raises:
        BadSettings: if there is none of this name, or robots have no action for a code.
    """
    if isinstance(word, LearnedTeam):
        return word
    if word in SCRIPTED:
        return TeamSettings(kind=word), None
    always = constant_team(word)
    if always is None:
        raise BadSettings(f"{word!r} is no team", next_step=(
            f"Name one of {', '.join(SCRIPTED)}, constant:044, constant:44/21/21, {BEST}, or give a "
            "learned team (`League.policy().team()`)"))
    return always
