"""Matches in which a robot does a drawn behaviour in random seconds, where that behaviour is seen.

Play is cut into seconds from each restart on. At the start of each a draw decides for each robot of the team
whether it goes on as its team does, or does one of the behaviours that are offered to its role in the cell
that it is in (:func:`looking.decisions.cells`), all with the same chance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from from_recordings.network import NetworkController
from from_recordings.study import FOLDER
from looking.decisions import cells
from peers.network import load

from pitchlore.pipeline.arena.match.controllers import Controller, controllers_of, measures_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.table import SCRIPTED
from pitchlore.pipeline.game.bodies import BALL, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.executors.actions import ACTION
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.game.tactics.splitmix import seeded
from pitchlore.pipeline.numbers.arrays import F32, F64, I64, Bools
from pitchlore.pipeline.stages.values.models import logits_of, probability, shipped
from pitchlore.pipeline.stages.values.moments import BallStates, RobotStates, features
from pitchlore.pipeline.state.observation import see_from
from pitchlore.schemas import ROLES
from pitchlore.schemas.options import OPTIONS
from pitchlore.schemas.sights import SIGHT

#: Cells of :func:`looking.decisions.cells`.
CELLS = 36
#: A robot that goes on as its team does.
USUAL = -1


class Seconds(NamedTuple):
    """Seconds of robots.

    Attributes:
        match: int64 [n], seed of the match.
        role: int64 [n], index in ROLES, at the start.
        cell: int64 [n], at the start.
        sight: float32 [n, 30], at the start.
        option: int64 [n], what was drawn, index in OPTIONS; USUAL.
        change: float32 [n, 2], V one second and three seconds later less V at the start, for the robot's
            team; V is 1 or -1 from a goal on, and 0 from another end of play on.
    """

    match: I64
    role: I64
    cell: I64
    sight: F32
    option: I64
    change: F32

    @classmethod
    def together(cls, parts: Sequence[Seconds]) -> Seconds:
        """Seconds of several matches as one."""
        fields = ([getattr(part, name) for part in parts] for name in cls._fields)
        return cls(*map(np.concatenate, fields))


class Drawing(Controller):
    """Plays a team whose robots do drawn behaviours in random seconds.

    Args:
        team: the team.
        recipe: recipe of the match.
        offered: bool [roles, 36, options], behaviours that are offered in a role and cell.
        share: chance that a robot to which something is offered does not go on as its team does.
        side: 0 home, 1 away.
    """

    def __init__(self, team: Controller, recipe: Recipe, offered: Bools, share: float, side: int) -> None:
        self._team, self._offered, self._share = team, offered, share
        self._rng = np.random.default_rng([recipe.seed, 77, side])
        self._measures = measures_of(recipe).packed()
        self._splitmix, self._second = seeded(self._rng), round(recipe.physics.hz)
        self._own = np.zeros(recipe.robots, dtype=ACTION)
        self._roles = np.empty(2 * recipe.robots, dtype=np.int64)
        self._drawn = np.full(recipe.robots, USUAL)
        self._goal_x, self._start = recipe.pitch.goal_x, 0
        self._views: list[F64] = []
        self._rows: list[tuple[int, int, int, F32, int]] = []
        self._ends: list[tuple[int, float]] = []

    def restarted(self, frame: int, lead: int) -> None:  # noqa: D102
        self._team.restarted(frame, lead)
        self._start = frame
        self._drawn[:] = USUAL

    def stopped(self, frame: int, reward: float) -> None:  # noqa: D102
        self._team.stopped(frame, reward)
        self._ends.append((len(self._views), reward))

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        self._team.think(frame, view, wheels)
        m = self._measures[0]
        if (frame - self._start) % self._second == 0:
            assign(view, m, self._roles)
            sight = np.empty((len(self._own), len(SIGHT)), np.float32)
            for robot in range(1, len(self._own) + 1):
                see_from(view, robot, self._goal_x, sight[robot - 1])
            for place, cell in enumerate(cells(sight).tolist()):
                role = int(self._roles[place])
                there = np.flatnonzero(self._offered[role, cell])
                does = len(there) > 0 and self._rng.random() < self._share
                self._drawn[place] = self._rng.choice(there) if does else USUAL
                self._own[place]["code"] = 0
                self._rows.append((len(self._views), role, cell, sight[place], int(self._drawn[place])))
            self._views.append(view.copy())
        for place in np.flatnonzero(self._drawn != USUAL).tolist():
            own, code = self._own[place], OPTIONS[self._drawn[place]]
            if own["code"] != code:
                assign(view, m, self._roles)
                executors.start(code, place + 1, view, self._roles, m, self._splitmix, own)
            if executors.act(place + 1, view, m, own, wheels):
                own["code"] = 0

    def seconds(self, seed: int) -> Seconds:
        """The seconds of a match that is over."""
        value = value_of(np.array(self._views))
        change = np.empty((len(value), 2), np.float32)
        first = 0
        for end, goal in self._ends:
            path = np.concatenate([value[first:end], np.full(3, goal)])
            for place, ahead in enumerate((1, 3)):
                change[first:end, place] = path[ahead:ahead + end - first] - value[first:end]
            first = end
        at, role, cell, sight, option = zip(*self._rows, strict=True)
        return Seconds(np.full(len(at), seed), np.array(role), np.array(cell), np.array(sight),
                       np.array(option), change[np.array(at)])


def value_of(views: F64) -> F64:
    """V by the model that the package ships, for the team that sees these views, float64 [T]."""
    models, robots = shipped(), views.shape[1] // 2
    pitch = PITCHES[Kind.VSSS]
    ball = BallStates(*(views[:, BALL, part] for part in (X, Y, VX, VY)))
    own, their = (RobotStates(*(views[:, first:first + robots, part].T for part in (X, Y, THETA, VX, VY)))
                  for first in (1, 1 + robots))
    mine, its = (RobotStates(-each.x, -each.y, each.theta + np.pi, -each.vx, -each.vy)
                 for each in (own, their))
    turned = BallStates(*(-part for part in ball))
    scales = models.calibration
    chances = [probability(scales[0] * logits_of(models.fits[0], each) + scales[1])
               for each in (features(ball, own, their, pitch), features(turned, its, mine, pitch))]
    found: F64 = chances[0] - chances[1]
    return found


class Game(NamedTuple):
    """A match of a team against itself: its word, seed, and seconds."""

    team: str
    seed: int
    seconds: float

    def recipe(self) -> Recipe:
        """The match."""
        kind = self.team if self.team in SCRIPTED else "remote"
        own = TeamSettings.model_validate({"kind": kind})
        return Recipe(home=own, away=own, seed=self.seed, referee=RefereeSettings(duration_s=self.seconds))

    def controllers(self, recipe: Recipe) -> tuple[Controller, Controller]:
        """The teams of home and away."""
        if self.team in SCRIPTED:
            return controllers_of(recipe, {})
        network = load(FOLDER / f"{self.team}.npz")
        return NetworkController(network, recipe, 0), NetworkController(network, recipe, 1)


class Played(NamedTuple):
    """A match: what its draws found, and goals of home and of away."""

    seconds: Seconds
    goals: tuple[int, int]


def played(game: Game, offered: Bools, share: float, sides: Sequence[int] = (0, 1)) -> Played:
    """Play a match of a team against itself, in which the given sides draw, 0 home and 1 away."""
    recipe = game.recipe()
    usual = game.controllers(recipe)
    drawing = {side: Drawing(usual[side], recipe, offered, share, side) for side in sides}
    home, away = (drawing.get(side, usual[side]) for side in (0, 1))
    match = MatchInPlay(recipe, (home, away), logged=False)
    while match.advance(4096):
        pass
    return Played(Seconds.together([each.seconds(game.seed) for each in drawing.values()]), match.score)


def offered_of(pairs: Mapping[tuple[str, int], Iterable[int]]) -> Bools:
    """Offers, bool [roles, 36, options], from the cells of pairs of role and code."""
    found = np.zeros((len(ROLES), CELLS, len(OPTIONS)), dtype=bool)
    for (role, code), own in pairs.items():
        found[ROLES.index(role), list(own), OPTIONS.index(code)] = True
    return found


def drawn(data: Path, games: Sequence[Game], offered: Bools, share: float) -> Seconds:
    """Seconds of matches in which both sides draw; what lies in the data folder is not played again."""
    parts = []
    for game in games:
        path = data / "trials" / game.team / f"{game.seed}.npz"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            aside = path.with_suffix(".part.npz")
            np.savez_compressed(aside, **played(game, offered, share).seconds._asdict())
            aside.rename(path)
        with np.load(path) as arrays:
            parts.append(Seconds(*(arrays[field] for field in Seconds._fields)))
    return Seconds.together(parts)
