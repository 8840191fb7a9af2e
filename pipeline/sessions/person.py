"""A person's match: played in a window at its real pace, with the keyboard or a gamepad."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.human import HumanController
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.arena.window.painting import Picture
from pitchlore.pipeline.matches.frame import home_attacks
from pitchlore.schemas import AWAY, HOME

if TYPE_CHECKING:
    from pitchlore.pipeline.arena.window.screen import Window

# A killed process loses what was played since it was last logged.
_LOG_EVERY_S = 1.0
_FAREWELL_S = 3.0


class PersonMatch:
    """A match that a person plays.

    Args:
        recipe: one of its teams is of kind human.
        policies: policies by the label that the other team names.

    Attributes:
        match: the match.
        team: the person's: 0 (home) or 1 (away).
        person: the controller of their team.
    """

    def __init__(self, recipe: Recipe, policies: Mapping[str, PolicyTables]) -> None:
        self.team = HOME if recipe.home.kind == "human" else AWAY
        self.person = HumanController(recipe, np.random.default_rng([recipe.seed, 1 + self.team]))
        live = (self.person, None) if self.team == HOME else (None, self.person)
        self.match = MatchInPlay(recipe, controllers_of(recipe, policies, live))

    def wait(self, window: Window, message: str, hint: str) -> bool:
        """Show the match as it stands until the person goes on or leaves. Returns whether they go on.

        Args:
            window: open, and paused.
            message: over the pitch, in large letters.
            hint: in small letters below it: how to go on.
        """
        while not (asked := window.listen()).leave:
            if not asked.paused:
                return True
            window.due()
            window.show(self._picture(message, hint))
        return False

    def play(self, window: Window, log_it: Callable[[], None]) -> bool:
        """Play in real time, until the final whistle or until the person leaves.

        Args:
            window: open.
            log_it: called each second of play, to log what was played.

        Returns:
            Whether the final whistle has been.
        """
        match, hz, logged = self.match, self.match.laws.hz, 0
        while not match.over:
            asked = window.listen()
            if asked.leave:
                match.leave()
                return False
            self.person.command(asked.command)
            if asked.switch:
                self.person.switch(asked.switch)
            due = window.due()
            if not asked.paused:
                match.advance(due)
            window.show(self._picture(self._called(paused=asked.paused)))
            if match.frame - logged >= _LOG_EVERY_S * hz:
                logged = match.frame
                log_it()
        for _ in range(round(_FAREWELL_S * hz)):
            if window.listen().leave:
                break
            window.due()
            window.show(self._picture(self._called(paused=False)))
        return True

    def _called(self, *, paused: bool) -> str:
        """The word over the pitch; empty while play is on."""
        if self.match.over:
            return "Final whistle"
        if paused:
            return "Pause"
        if not self.person.playing and self.match.frame:
            return {1.0: "Goal!", -1.0: "They scored"}.get(self.person.reward, "Whistle")
        return ""

    def _picture(self, message: str, hint: str = "") -> Picture:
        """The picture that the window shows."""
        match = self.match
        robots, hz = match.recipe.robots, match.laws.hz
        attacks = home_attacks(match.laws.periods(), np.array([match.laws.t_ns(match.frame)]))
        return Picture(
            match.bodies, int(attacks[0]), match.score, match.frame / hz, match.recipe.referee.duration_s,
            driven=self.person.driven + (robots if self.team == AWAY else 0), message=message, hint=hint,
        )
