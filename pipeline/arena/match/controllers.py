"""The controllers of teams: each turns a team's view into wheel speeds, once a frame."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np
import polars as pl

from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.teams import appraising, learned
from pitchlore.pipeline.arena.teams.clock import PAPER, Clock
from pitchlore.pipeline.arena.teams.constant import clock_of, constant
from pitchlore.pipeline.arena.teams.policy_table import policy_table_of
from pitchlore.pipeline.arena.teams.predicting import Predictor, predict
from pitchlore.pipeline.arena.teams.table import TEAMS, Script
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import COLUMNS
from pitchlore.pipeline.game.tactics.ball import NOBODY
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.splitmix import seeded
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.state import BinEdges, radix
from pitchlore.schemas import AWAY, HOME, Policies


class Controller(Protocol):
    """Plays a team. The team's view is turned so that its own goal is at -x.

    A subclass needs only ``think``: by default a controller ignores the state of play and logs no decisions.
    """

    def restarted(self, frame: int, lead: int) -> None:
        """Play is on from this frame; ``lead`` is own goals minus the other's."""
        return

    def think(self, frame: int, view: F64, wheels: F64) -> None:
        """A frame of play.

        Args:
            frame: its number.
            view: float64 [1 + 2 N, 6], see :func:`pipeline.game.bodies.see`.
            wheels: float64 [N, 2], written: left and right wheel, m/s. Before, they are those of the last
                frame, or 0 after a restart.
        """

    def stopped(self, frame: int, reward: float) -> None:
        """Play has stopped at this frame: by a goal for (+1) or against (-1), or for another reason (0)."""
        return

    def decided(self) -> list[Decided]:
        """Decisions of the episodes that have ended since the last call, in order."""
        return []


class Decided(NamedTuple):
    """A decision of a robot in an episode that is over.

    Attributes:
        frame: at which it was made.
        robot: number.
        role: index in ROLES, when it decided.
        state: by all elements.
        behaviour_id: chosen; None for moves randomly.
        random: whether it was chosen at random.
        episode: stretch of play, counted from 0.
        end: frame of the robot's next decision in the episode, or at which the episode ended.
        last: whether the episode ended then.
        reward: +1 or -1 if it is the last and a goal ended the episode, else 0.
    """

    frame: int
    robot: int
    role: int
    state: int
    behaviour_id: str | None
    random: bool
    episode: int
    end: int
    last: bool
    reward: float


class ScriptedController(Controller):
    """Plays a team of fixed rules.

    Args:
        settings: settings of the team, which has a script.
        recipe: recipe of the match.
        rng: decides what is left to chance.
        script: instead of the team's own; studies leave out a rule.
    """

    def __init__(
        self, settings: TeamSettings, recipe: Recipe, rng: np.random.Generator, script: Script | None = None
    ) -> None:
        script = script or TEAMS[settings.kind].script
        assert script is not None, settings.kind
        measures = measures_of(recipe)
        self._play = script.play
        self._measures = measures.packed()
        self._memory = script.new_memory(recipe.robots, measures, rng, settings.people)
        self._splitmix = seeded(rng)

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        self._play(view, self._measures, self._splitmix, wheels, *self._memory)


class PolicyTables(NamedTuple):
    """A version of a policy, as teams play it.

    Attributes:
        values: rows of schema Policies; none if it knows nothing.
        appraisals: rows of schema Appraisals; None if teams look behaviours up in states.
    """

    values: pl.DataFrame
    appraisals: pl.DataFrame | None = None


class LearnedTeam(NamedTuple):
    """A learned team; ``pipeline.engine.teams.learned_team`` takes one from a data folder.

    Attributes:
        settings: how it plays.
        tables: its policy.
    """

    settings: TeamSettings
    tables: PolicyTables


def constant_team(word: str) -> LearnedTeam | None:
    """The constant team that a word names, with its clock; None if the word names none.

    Args:
        word: see :func:`pipeline.arena.teams.constant.constant`.

    Raises:
        BadSettings: if it has not one or three codes, or if robots have no action for a code.
    """
    found = constant(word)
    if found is None:
        return None
    settings = TeamSettings(kind="learned", policy=found.word, clock=clock_of(word))
    return LearnedTeam(settings, PolicyTables(found.policy()))


class _Deciding(Controller):
    """Logs the decisions of a team.

    Args:
        recipe: recipe of the match.
        rng: decides what is left to chance.
        names: behaviour ids by the number that a decision holds, None for moves randomly.
    """

    def __init__(self, recipe: Recipe, rng: np.random.Generator, names: list[str | None]) -> None:
        self._names = names
        self._edges = BinEdges.of(recipe.pitch)
        self._measures = measures_of(recipe).packed()
        self._robots = np.zeros(recipe.robots, dtype=learned.ROBOT)
        self._splitmix = seeded(rng)
        self._made = np.zeros(recipe.robots, dtype=learned.DECISION)
        self._direction = math.nan
        self._lead = self._episode = 0
        self._rows: list[tuple[int, ...]] = []
        self._over: list[Decided] = []

    def restarted(self, frame: int, lead: int) -> None:
        self._lead, self._direction = lead, math.nan

    def _look(self, view: F64) -> None:
        """Follow the ball's direction."""
        self._direction = learned.ball_direction(view, self._direction, self._edges.moving)

    def _note(self, frame: int, made: int) -> None:
        """Remember the first ``made`` decisions of a frame."""
        self._rows += [(frame, *row) for row in self._made[:made].tolist()]

    def stopped(self, frame: int, reward: float) -> None:
        following: dict[int, int] = {}
        closed = []
        for at, robot, role, state, chosen, random in reversed(self._rows):
            last = robot not in following
            closed.append(Decided(
                at, robot, role, state, self._names[chosen], bool(random), self._episode,
                following.get(robot, frame), last, reward if last else 0.0,
            ))
            following[robot] = at
        self._over += reversed(closed)
        self._rows.clear()
        self._episode += 1

    def decided(self) -> list[Decided]:
        over, self._over = self._over, []
        return over


class LearnedController(_Deciding):
    """Plays a policy whose behaviours are looked up in states.

    Args:
        policy: rows of schema Policies, of one version; none if it knows nothing.
        settings: how it explores, and when it decides.
        recipe: recipe of the match.
        rng: decides what is left to chance.
    """

    def __init__(
        self, policy: pl.DataFrame, settings: TeamSettings, recipe: Recipe, rng: np.random.Generator
    ) -> None:
        self._known, names = policy_table_of(policy, settings.min_visits)
        super().__init__(recipe, rng, names)
        self._settings = settings
        sampled = self._known._replace(values=self._known.values.copy())
        self._policy = learned.BehaviourPolicy(sampled, radix("full36"), self._edges, settings.explore,
                                      Clock.of(settings.clock, recipe.physics.hz))
        self._due = True
        self._has = NOBODY

    def restarted(self, frame: int, lead: int) -> None:  # noqa: D102
        super().restarted(frame, lead)
        learned.forget_choices(self._robots)
        own = self._settings
        learned.sample_values(
            self._known, own.posterior_std, own.lcb_weight, self._splitmix, self._policy.table.values
        )
        self._due = True
        self._has = NOBODY

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        self._look(view)
        if self._policy.clock.interrupts:
            self._has, interrupted = learned.interrupt(view, self._robots, self._has, self._measures)
            self._due = self._due or interrupted
        if self._due:
            self._note(frame, learned.decide(
                view, self._direction, self._lead, self._robots, self._policy, self._measures,
                self._splitmix, self._made,
            ))  # fmt: skip
        self._due = learned.carry_on(
            view, self._robots, self._policy.table.codes, self._policy.clock, self._measures, self._splitmix,
            wheels,
        )  # fmt: skip


class AppraisingController(_Deciding):
    """Plays a policy that appraises actions by what robots see.

    Args:
        values: rows of schema Policies, of one version.
        appraisals: rows of schema Appraisals of the same version.
        settings: how often it decides and how it explores.
        recipe: recipe of the match.
        rng: decides what is left to chance.
    """

    def __init__(
        self, values: pl.DataFrame, appraisals: pl.DataFrame, settings: TeamSettings, recipe: Recipe,
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        appraiser, names = appraising.appraiser_of(values, appraisals)
        super().__init__(recipe, rng, names)
        hz = recipe.physics.hz
        self._clock = max(1, round(settings.clock_s * hz))
        self._policy = appraising.ActionPolicy(appraiser, radix("full36"), self._edges, settings.explore,
                                         hold=max(1, round(settings.explore_s * hz / self._clock)))
        self._held = np.zeros(recipe.robots, dtype=np.int64)
        self._next = 0

    def restarted(self, frame: int, lead: int) -> None:  # noqa: D102
        super().restarted(frame, lead)
        self._held[:] = 0
        self._next = frame

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        self._look(view)
        if frame >= self._next:
            self._decide(view)
            self._note(frame, len(self._made))
            self._next = frame + self._clock
        appraising.carry_on(
            view, self._robots, self._policy.appraiser, self._measures, self._splitmix, wheels)

    def _decide(self, view: F64) -> None:
        """Decide for all robots; a subclass may show them something else."""
        appraising.decide(
            view, self._direction, self._lead, self._robots, self._policy, self._held, self._measures,
            self._splitmix, self._made,
        )  # fmt: skip


class PredictingController(Controller):
    """Shows a team the bodies as they are now, by its commands, where the camera shows them as they were.

    Args:
        player: the team.
        frames: number of frames that are predicted, at least 1.
        recipe: recipe of the match.
    """

    def __init__(self, player: Controller, frames: int, recipe: Recipe) -> None:
        self._player = player
        self._measures = measures_of(recipe).packed()
        self._acceleration = recipe.physics.wheel_acceleration
        self._predictor = Predictor.of(recipe.robots, frames)
        self._ahead = np.zeros((1 + 2 * recipe.robots, COLUMNS))

    def restarted(self, frame: int, lead: int) -> None:  # noqa: D102
        self._predictor.restart()
        self._player.restarted(frame, lead)

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        predict(frame, view, wheels, self._measures, self._acceleration, self._predictor, self._ahead)
        self._player.think(frame, self._ahead, wheels)

    def stopped(self, frame: int, reward: float) -> None:  # noqa: D102
        self._player.stopped(frame, reward)

    def decided(self) -> list[Decided]:  # noqa: D102
        return self._player.decided()


def controller_of(
    settings: TeamSettings, recipe: Recipe, team: int, policy: PolicyTables | None = None
) -> Controller:
    """The controller of a team that plays by itself.

    Args:
        settings: settings of the team.
        recipe: recipe of the match.
        team: 0 home, 1 away; its chances do not depend on the other's.
        policy: policy of a learned team; None if it knows nothing.

    Raises:
        BadSettings: if a person has to play it, or if a team that appraises what it sees has the clock of
            those that look states up.
    """
    player = _player_of(settings, recipe, team, policy)
    frames = round(settings.predict_s * recipe.physics.hz)
    return PredictingController(player, frames, recipe) if frames else player


def rng_of(recipe: Recipe, team: int) -> np.random.Generator:
    """Random numbers of a team, 0 home or 1 away, in a match."""
    return np.random.default_rng([recipe.seed, 1 + team])


def _player_of(settings: TeamSettings, recipe: Recipe, team: int, policy: PolicyTables | None) -> Controller:
    rng = rng_of(recipe, team)
    if settings.kind == "learned":
        known = policy or PolicyTables(Policies.empty())
        if known.appraisals is not None:
            if settings.clock != PAPER:
                raise BadSettings("only a team that looks behaviours up in states has this clock",
                                  where="clock", next_step="Leave it out, or give --clock-s")
            return AppraisingController(known.values, known.appraisals, settings, recipe, rng)
        return LearnedController(known.values, settings, recipe, rng)
    if settings.kind == "human":
        raise BadSettings("a person plays at the window", where="human", next_step="Use `pitchlore play`")
    if settings.kind == "remote":
        raise BadSettings("another program drives this team", where="remote",
                          next_step="Use `pitchlore record --serve vsss`")
    return ScriptedController(settings, recipe, rng)


def controllers_of(
    recipe: Recipe, policies: Mapping[str, PolicyTables],
    live: tuple[Controller | None, Controller | None] = (None, None),
) -> tuple[Controller, Controller]:
    """The controllers of both teams, home and away.

    Args:
        recipe: recipe of the match.
        policies: policies by the label that the recipe's teams name.
        live: controllers of home and away that do not play by themselves, a person's or another program's.

    Raises:
        BadSettings: if a team needs such a controller and there is none.
    """
    home, away = (
        controller_of(settings, recipe, team, policies[settings.policy] if settings.policy else None)
        if own is None else own
        for team, settings, own in ((HOME, recipe.home, live[HOME]), (AWAY, recipe.away, live[AWAY]))
    )
    return home, away


def measures_of(recipe: Recipe) -> Measures:
    """The measures of a match."""
    physics = recipe.physics
    return Measures.of(
        recipe.pitch, top=physics.wheel_speed, axle=physics.axle, acceleration=physics.wheel_acceleration,
        frame_s=1 / physics.hz,
    )
