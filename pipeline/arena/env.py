"""The arena for learners: a PettingZoo parallel environment and a Gymnasium one (extra ``rl``).

:func:`parallel_env` has an agent for each robot of both teams. :func:`env` has one agent, which drives a
whole team against an opponent. Both play :class:`pipeline.arena.match.match.Match`: the frames, laws and
camera of a match that ``pitchlore record`` plays.

- An episode is a match. It is truncated at the final whistle. With ``goal_ends`` a goal terminates it.
- A step is ``step_s`` seconds, rounded to whole frames, at least one. The frames of a pause of play count,
  too; actions change nothing then.
- The reward is +1 for a goal for and -1 for a goal against in the step.
- Observations are vectors of :mod:`pipeline.arena.match.observation`, float32, cut at -2 and 2. An agent of
  ``parallel_env`` gets its robot's; the agent of ``env`` gets that of robot 1.
- An action of a robot turns its wheels (``wheels``: shares of the top speed of the left and the right one, in
  [-1, 1]) or names a behaviour (``behaviours``: an index in :data:`BEHAVIOURS`), which the robot carries out
  until another is chosen, see :mod:`pipeline.arena.teams.chosen`.
- ``reset(seed=S)`` begins the match of seed S; the seeds of the matches after it follow from S.
- Infos have ``score``: goals of the agent's team and of the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, cast

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv
from pydantic import Field

from pipeline.arena.match.controllers import PolicyTables, controller_of
from pipeline.arena.match.driven import BehaviourController, Driven, WheelController
from pipeline.arena.match.match import Match
from pipeline.arena.match.observation import LIMIT, length
from pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings
from pipeline.arena.match.stepped import SteppedMatch
from pipeline.arena.teams.constant import BEST, constant
from pipeline.arena.teams.executors.actions import CODES
from pipeline.arena.teams.table import SCRIPTED
from pipeline.arena.window import window_class
from pipeline.arena.window.painting import Picture, WindowPainter
from pipeline.arrays import F32
from pipeline.errors import BadSettings
from pipeline.matches.frame import AWAY, HOME
from pipeline.toml import Frozen, fitted
from schemas import SIDES

if TYPE_CHECKING:
    from pipeline.arena.window.screen import Window

__all__ = ["BEHAVIOURS", "ID", "EnvSettings", "ParallelMatch", "TeamEnv", "env", "parallel_env"]

#: The behaviours that an action can name, by its index: codes of Table 1.
BEHAVIOURS = CODES

#: Name of :func:`env` for ``gymnasium.make``, once this module is imported.
ID = "pitchlore/Match-v0"

Actions = Literal["wheels", "behaviours"]
Side = Literal["home", "away"]
RenderMode = Literal["human", "rgb_array"]

#: Default length of a step by the kind of actions, seconds; None is one frame.
_STEP_S: dict[Actions, float | None] = {"wheels": None, "behaviours": 0.4}
_MODES = ("human", "rgb_array")
#: Width and height of pictures, pixels.
_SIZE = (640, 560)


class EnvSettings(Frozen):
    """Settings of an environment.

    Attributes:
        actions: ``wheels`` or ``behaviours``.
        step_s: seconds that a step lasts, rounded to whole frames, at least one. None: a frame for wheels,
            0.4 s for behaviours.
        goal_ends: whether a goal ends the episode.
        render_mode: ``rgb_array``: ``render`` returns a picture; ``human``: a window shows each frame in real
            time (extra ``play``); closing it interrupts, as Ctrl-C does. None: neither.
        matches: how matches are played: robots a side, pitch, physics, laws with the duration, camera.
    """

    actions: Actions = "wheels"
    step_s: float | None = Field(default=None, gt=0)
    goal_ends: bool = False
    render_mode: RenderMode | None = None
    matches: MatchSettings = MatchSettings()

    @property
    def frames(self) -> int:
        """Frames of a step."""
        seconds = _STEP_S[self.actions] if self.step_s is None else self.step_s
        return 1 if seconds is None else max(1, round(seconds * self.matches.physics.hz))

    @property
    def metadata(self) -> dict[str, Any]:
        """What both libraries ask for."""
        return {"name": "pitchlore", "render_modes": list(_MODES), "is_parallelizable": True,
                "render_fps": max(1, round(self.matches.physics.hz / self.frames))}


def parallel_env(
    *, actions: Actions = "wheels", step_s: float | None = None, robots: int | None = None,
    minutes: float | None = None, goal_ends: bool = False, render_mode: RenderMode | None = None,
    settings: MatchSettings | None = None,
) -> ParallelMatch:
    """The arena as a PettingZoo parallel environment; agents are ``home_1`` to ``away_N``.

    Args:
        actions: see :class:`EnvSettings`, as the next, ``goal_ends`` and ``render_mode``.
        step_s: seconds that a step lasts.
        robots: robots of each team; None: the settings'.
        minutes: length of a match; None: the settings'.
        goal_ends: whether a goal ends the episode.
        render_mode: what ``render`` does.
        settings: of matches; None: those of a VSSS match of 8 minutes.

    Raises:
        BadSettings: if a value does not fit.
    """
    return ParallelMatch(_settings(
        robots, minutes, settings, actions=actions, step_s=step_s, goal_ends=goal_ends,
        render_mode=render_mode,
    ))  # fmt: skip


def env(
    opponent: str | PolicyTables = "static", *, side: Side = "home", actions: Actions = "wheels",
    step_s: float | None = None, robots: int | None = None, minutes: float | None = None,
    goal_ends: bool = False, render_mode: RenderMode | None = None, settings: MatchSettings | None = None,
) -> TeamEnv:
    """The arena as a Gymnasium environment: one agent drives a team against an opponent.

    Args:
        opponent: name of a team that plays by fixed rules (static, human-like, pressing and so on);
            constant:044, constant:44/21/21 or best-constant for a constant team; or a policy.
        side: of the agent's team. Home kicks off first.
        actions: see :class:`EnvSettings`, as the next, ``goal_ends`` and ``render_mode``.
        step_s: seconds that a step lasts.
        robots: robots of each team; None: the settings'.
        minutes: length of a match; None: the settings'.
        goal_ends: whether a goal ends the episode.
        render_mode: what ``render`` does.
        settings: of matches; None: those of a VSSS match of 8 minutes.

    Raises:
        BadSettings: if a value does not fit, or if the opponent is none of these.
    """
    own = _settings(
        robots, minutes, settings, actions=actions, step_s=step_s, goal_ends=goal_ends,
        render_mode=render_mode,
    )  # fmt: skip
    return TeamEnv(own, opponent, side)


gymnasium.register(ID, entry_point=f"{__name__}:env")


class ParallelMatch(ParallelEnv[str, F32, Any]):
    """A match whose robots are agents, see :func:`parallel_env`.

    Args:
        settings: of the environment.
    """

    def __init__(self, settings: EnvSettings) -> None:
        self.settings = settings
        self.render_mode = settings.render_mode
        self.metadata = settings.metadata
        robots = settings.matches.robots
        self._names = [[f"{side}_{number}" for number in range(1, robots + 1)] for side in SIDES]
        self.possible_agents = [name for names in self._names for name in names]
        self.agents: list[str] = []
        self.observation_spaces = {name: _observed(robots) for name in self.possible_agents}
        self.action_spaces = {name: _of_one(settings.actions) for name in self.possible_agents}
        self._screen = _Screen(settings, ("home", "away"))
        self._random: np.random.Generator | None = None

    @property
    def match(self) -> Match:
        """The match that is played; there is none before the first reset."""
        return self._played.match

    def observation_space(self, agent: str) -> spaces.Space[F32]:
        """The agent's observations: float32 [14 N + 7]; always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The agent's actions: float32 [2], or an index in :data:`BEHAVIOURS`; always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, F32], dict[str, dict[str, Any]]]:
        """Begin a match; it stands at its kick-off.

        Args:
            seed: of the match; None: it follows from the last one that was given, or from chance.
            options: not used.

        Returns:
            Observations and infos by agent.
        """
        if self._random is None or seed is not None:
            self._random = seeding.np_random(seed)[0]
        recipe = _recipe(self.settings, _DRIVEN, _DRIVEN, _seed(self._random, seed))
        home, away = (_driver(self.settings, recipe, team) for team in (HOME, AWAY))
        self._played = SteppedMatch(recipe, (home, away))
        self.agents = list(self.possible_agents)
        self._screen.begin(self.match)
        return self._observations(), self._infos()

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[
        dict[str, F32], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]
    ]:
        """Play a step.

        Args:
            actions: of each agent, by name.

        Returns:
            Observations, rewards, terminations, truncations and infos by agent. When the episode is over,
            there are no ``agents`` left.

        Raises:
            BadSettings: if an action is missing or does not fit, or if there is no match or it is over.
        """
        if not self.agents:
            raise _not_begun()
        try:
            of_teams = [[actions[name] for name in names] for names in self._names]
        except KeyError as error:
            raise BadSettings(f"there is no action of {error.args[0]}", where="step",
                              next_step=f"Give one of each of {', '.join(self.agents)}") from error
        settings = self.settings
        rewards = self._played.step(of_teams, settings.frames, settings.goal_ends, self._screen.each)
        goal = settings.goal_ends and rewards[HOME] != 0.0
        names, over = self.possible_agents, self._played.match.over
        if goal or over:
            self.agents = []
        of_home, of_away = self._names
        return (
            self._observations(),
            dict.fromkeys(of_home, rewards[HOME]) | dict.fromkeys(of_away, rewards[AWAY]),
            dict.fromkeys(names, goal), dict.fromkeys(names, over), self._infos(),
        )  # fmt: skip

    def render(self) -> npt.NDArray[np.uint8] | None:
        """A picture, uint8 [560, 640, 3], in the mode ``rgb_array``; None in others."""
        return self._screen.picture()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._screen.close()

    def _observations(self) -> dict[str, F32]:
        seen = self._played.observe(self.settings.matches.robots)
        return dict(zip(self.possible_agents, seen, strict=True))

    def _infos(self) -> dict[str, dict[str, Any]]:
        home, away = self._played.match.score
        of_home, of_away = self._names
        infos: dict[str, dict[str, Any]] = {name: {"score": (home, away)} for name in of_home}
        for name in of_away:
            infos[name] = {"score": (away, home)}
        return infos


class TeamEnv(gymnasium.Env[F32, Any]):
    """A match in which one agent drives a team, see :func:`env`.

    Args:
        settings: of the environment.
        opponent: word, or a policy.
        side: of the agent's team.
    """

    metadata = EnvSettings().metadata

    def __init__(self, settings: EnvSettings, opponent: str | PolicyTables, side: Side) -> None:
        if side not in SIDES:
            raise BadSettings(f"there is no side {side!r}", where="side",
                              next_step=f"Name one of {', '.join(SIDES)}")
        self.settings = settings
        self.render_mode = settings.render_mode
        self.metadata = settings.metadata
        robots = settings.matches.robots
        self.observation_space = _observed(robots)
        self.action_space = _of_all(settings.actions, robots)
        self._team = SIDES.index(side)
        self._against, self._policy = _opponent(opponent)
        them = opponent if isinstance(opponent, str) else self._against.kind
        self._screen = _Screen(settings, ("you", them) if self._team == HOME else (them, "you"))
        self._begun = False

    @property
    def match(self) -> Match:
        """The match that is played; there is none before the first reset."""
        return self._played.match

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[F32, dict[str, Any]]:
        """Begin a match; it stands at its kick-off.

        Args:
            seed: of the match; None: it follows from the last one that was given, or from chance.
            options: not used.

        Returns:
            Observation and info.
        """
        super().reset(seed=seed)
        teams = (_DRIVEN, self._against) if self._team == HOME else (self._against, _DRIVEN)
        recipe = _recipe(self.settings, *teams, _seed(self.np_random, seed))
        home, away = (
            _driver(self.settings, recipe, team) if team == self._team
            else controller_of(self._against, recipe, team, self._policy)
            for team in (HOME, AWAY)
        )
        self._played = SteppedMatch(recipe, (home, away))
        self._begun = True
        self._screen.begin(self.match)
        return self._observation(), self._info()

    def step(self, action: Any) -> tuple[F32, float, bool, bool, dict[str, Any]]:
        """Play a step.

        Args:
            action: float32 [2 N], left and right wheel of robot 1, of robot 2 and so on; or int [N], indices
                in :data:`BEHAVIOURS`.

        Returns:
            Observation, reward, terminated, truncated and info.

        Raises:
            BadSettings: if the action does not fit, or if there is no match or it is over.
        """
        if not self._begun:
            raise _not_begun()
        given = np.asarray(action)
        if given.shape != self.action_space.shape:
            raise BadSettings(f"an action of shape {given.shape} is no action of the team", where="step",
                              next_step=f"Give numbers of shape {self.action_space.shape}")
        settings = self.settings
        of_robots = given if settings.actions == "behaviours" else given.reshape(-1, 2)
        (reward,) = self._played.step([of_robots], settings.frames, settings.goal_ends, self._screen.each)
        goal = settings.goal_ends and reward != 0.0
        over = self._played.match.over
        self._begun = not (goal or over)
        return self._observation(), reward, goal, over, self._info()

    def render(self) -> npt.NDArray[np.uint8] | None:
        """A picture, uint8 [560, 640, 3], in the mode ``rgb_array``; None in others."""
        return self._screen.picture()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._screen.close()

    def _observation(self) -> F32:
        (seen,) = self._played.observe(1)
        return cast("F32", seen)

    def _info(self) -> dict[str, Any]:
        home, away = self._played.match.score
        return {"score": (home, away) if self._team == HOME else (away, home)}


class _Screen:
    """What ``render`` shows of one match after another.

    Args:
        settings: of the environment.
        names: of home and away.

    Attributes:
        each: to be called after each frame; None if nobody looks at it.
    """

    def __init__(self, settings: EnvSettings, names: tuple[str, str]) -> None:
        self._settings, self._names = settings, names
        self._window: Window | None = None
        self.each = self._show if settings.render_mode == "human" else None

    def begin(self, match: Match) -> None:
        """Show this match from now on."""
        self._match = match
        if self._settings.render_mode == "rgb_array":
            self._painter = WindowPainter(self._settings.matches.pitch, self._names, _SIZE)
        if self.each is not None:
            self.each()

    def picture(self) -> npt.NDArray[np.uint8] | None:
        """The moment, uint8 [560, 640, 3], in the mode ``rgb_array``; None in others."""
        if self._settings.render_mode != "rgb_array":
            return None
        return np.array(self._painter.paint(self._scene()), dtype=np.uint8)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.__exit__()
        self._window = None

    def _show(self) -> None:
        """The frame in the window, in real time; a window that is left interrupts."""
        matches = self._settings.matches
        if self._window is None:
            self._window = window_class("render_mode human")(
                matches.pitch, self._names, matches.physics.hz).__enter__()
        if self._window.listen().leave:
            raise KeyboardInterrupt
        self._window.due()
        self._window.show(self._scene())

    def _scene(self) -> Picture:
        match, matches = self._match, self._settings.matches
        return Picture(
            match.bodies, int(match.attacks), match.score, match.frame / matches.physics.hz,
            matches.referee.duration_s,
        )  # fmt: skip


#: A driven team in a recipe.
_DRIVEN = TeamSettings(kind="human")


def _settings(
    robots: int | None, minutes: float | None, matches: MatchSettings | None, **said: Any
) -> EnvSettings:
    """The settings of an environment, of the arguments of its door."""
    usual = (matches or MatchSettings()).of_match()
    if robots is not None:
        usual["robots"] = robots
    if minutes is not None:
        usual["referee"] = usual["referee"].model_dump() | {"duration_s": 60 * minutes}
    return fitted(EnvSettings, {**said, "matches": usual}, "environment",
                  "See EnvSettings in pipeline/arena/env.py")


def _recipe(settings: EnvSettings, home: TeamSettings, away: TeamSettings, seed: int) -> Recipe:
    return Recipe(**settings.matches.of_match(), home=home, away=away, seed=seed)


def _driver(settings: EnvSettings, recipe: Recipe, team: int) -> Driven:
    """The controller of a driven team, 0 home, 1 away."""
    if settings.actions == "wheels":
        return WheelController(recipe)
    return BehaviourController(recipe, np.random.default_rng([recipe.seed, 1 + team]))


def _opponent(word: str | PolicyTables) -> tuple[TeamSettings, PolicyTables | None]:
    """Settings and policy of an opponent.

    Raises:
        BadSettings: if there is none of this name, or robots have no action for a code.
    """
    if isinstance(word, PolicyTables):
        return TeamSettings(kind="learned"), word
    if word in SCRIPTED:
        return TeamSettings(kind=word), None
    always = constant(word)
    if always is None:
        raise BadSettings(f"{word!r} is no opponent", where="opponent", next_step=(
            f"Name one of {', '.join(SCRIPTED)}, constant:044, constant:44/21/21, {BEST}, or give a policy"))
    return TeamSettings(kind="learned"), PolicyTables(always.policy())


def _seed(random: np.random.Generator, asked: int | None) -> int:
    """The seed of the next match."""
    return int(random.integers(1 << 62)) if asked is None else asked


def _observed(robots: int) -> spaces.Space[F32]:
    return cast("spaces.Space[F32]", spaces.Box(-LIMIT, LIMIT, (length(robots),), np.float32))


def _of_one(actions: Actions) -> spaces.Space[Any]:
    """The actions of a robot."""
    if actions == "wheels":
        return spaces.Box(-1.0, 1.0, (2,), np.float32)
    return spaces.Discrete(len(BEHAVIOURS))


def _of_all(actions: Actions, robots: int) -> spaces.Space[Any]:
    """The actions of a team."""
    if actions == "wheels":
        return spaces.Box(-1.0, 1.0, (2 * robots,), np.float32)
    return spaces.MultiDiscrete([len(BEHAVIOURS)] * robots)


def _not_begun() -> BadSettings:
    return BadSettings("there is no match to play on", where="step", next_step="Call reset first")
