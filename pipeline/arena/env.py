"""The arena for learners: a PettingZoo parallel environment and a Gymnasium one (extra ``rl``).

:func:`parallel_env` has an agent for each robot, of both teams or of one against an opponent. :func:`env` has
one agent, which drives a whole team against an opponent. Both play a
:class:`pipeline.arena.match.match.MatchInPlay`: they have frames, laws and camera of a match that
``pitchlore record`` plays.

- An episode is a match. It is truncated at the final whistle. With ``goal_ends`` a goal terminates it.
- A step is ``step_s`` seconds, rounded to whole frames, at least one. The frames of a pause of play count,
  too; actions change nothing then.
- The reward is +1 for a goal for and -1 for a goal against in the step.
- Observations are float32, cut at -2 and 2: vectors of :mod:`pipeline.arena.match.observation` (``bodies``)
  or of :mod:`pipeline.arena.match.sighted` (``sights``: what teams that look decide by). An agent of
  ``parallel_env`` gets its robot's. The agent of ``env`` gets robot 1's bodies, or the sights of all robots
  one after the other.
- An action of a robot turns its wheels (``wheels``: shares of the top speed of the left and the right one, in
  [-1, 1]) or names a behaviour (``behaviours``: an index in :data:`BEHAVIOURS`), which the robot carries out
  until another is chosen, see :mod:`pipeline.arena.teams.chosen`.
- ``reset(seed=S)`` begins the match of seed S; the seeds of the matches after it follow from S.
- Infos have ``score``: goals of the agent's team and of the other.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, cast

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from pitchlore.pipeline.arena.match.controllers import LearnedTeam
from pitchlore.pipeline.arena.match.environment import Actions, EnvSettings, Observations, RenderMode
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.observation import LIMIT, length
from pitchlore.pipeline.arena.match.recipe import MatchSettings, varied
from pitchlore.pipeline.arena.match.sides import MatchSides
from pitchlore.pipeline.arena.match.sighted import NUMBERS
from pitchlore.pipeline.arena.window.rendering import Rendering
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.toml import fitted
from pitchlore.pipeline.game.tactics.executors.actions import CODES
from pitchlore.pipeline.numbers.arrays import F32
from pitchlore.schemas import SIDES, Side

__all__ = ["BEHAVIOURS", "ID", "EnvSettings", "ParallelMatch", "TeamEnv", "env", "parallel_env"]

#: The behaviours that an action can name, by its index: codes of Table 1.
BEHAVIOURS = CODES

#: Name of :func:`env` for ``gymnasium.make``, once this module is imported.
ID = "pitchlore/Match-v0"


def parallel_env(
    opponent: str | LearnedTeam | None = None, *, side: Side = "home", actions: Actions = "wheels",
    observations: Observations = "bodies", step_s: float | None = None, robots: int | None = None,
    minutes: float | None = None, goal_ends: bool = False, render_mode: RenderMode | None = None,
    settings: MatchSettings | None = None,
) -> ParallelMatch:
    """The arena as a PettingZoo parallel environment; agents are ``home_1`` to ``away_N``.

    Args:
        opponent: team of the other side, as in :func:`env`; then only the robots of ``side`` are agents.
            None: all robots are.
        side: the agents' side, if there is an opponent. Home kicks off first.
        actions: see :class:`EnvSettings`, as the next two, ``goal_ends`` and ``render_mode``.
        observations: kind of the agents' observations.
        step_s: seconds that a step lasts.
        robots: robots of each team; None: the settings'.
        minutes: length of a match; None: the settings'.
        goal_ends: whether a goal ends the episode.
        render_mode: effect of ``render``.
        settings: settings of matches; None: those of a VSSS match of 8 minutes.

    Raises:
        BadSettings: if a value does not fit, or if the opponent is nobody.
    """
    own = _settings(
        robots, minutes, settings, actions=actions, observations=observations, step_s=step_s,
        goal_ends=goal_ends, render_mode=render_mode,
    )  # fmt: skip
    return ParallelMatch(own, opponent, side)


def env(
    opponent: str | LearnedTeam = "static", *, side: Side = "home", actions: Actions = "wheels",
    observations: Observations = "bodies", step_s: float | None = None, robots: int | None = None,
    minutes: float | None = None, goal_ends: bool = False, render_mode: RenderMode | None = None,
    settings: MatchSettings | None = None,
) -> TeamEnv:
    """The arena as a Gymnasium environment: one agent drives a team against an opponent.

    Args:
        opponent: name of a team that plays by fixed rules (static, human-like, pressing and so on);
            constant:044, constant:44/21/21 or best-constant for a constant team; or a learned team, see
            :meth:`pitchlore.Policy.team`.
        side: the side of the agent's team. Home kicks off first.
        actions: see :class:`EnvSettings`, as the next two, ``goal_ends`` and ``render_mode``.
        observations: kind of the agent's observations.
        step_s: seconds that a step lasts.
        robots: robots of each team; None: the settings'.
        minutes: length of a match; None: the settings'.
        goal_ends: whether a goal ends the episode.
        render_mode: effect of ``render``.
        settings: settings of matches; None: those of a VSSS match of 8 minutes.

    Raises:
        BadSettings: if a value does not fit, or if the opponent is none of these.
    """
    own = _settings(
        robots, minutes, settings, actions=actions, observations=observations, step_s=step_s,
        goal_ends=goal_ends, render_mode=render_mode,
    )  # fmt: skip
    return TeamEnv(own, opponent, side)


gymnasium.register(ID, entry_point=f"{__name__}:env")


class ParallelMatch(ParallelEnv[str, F32, Any]):
    """A match whose robots are agents, see :func:`parallel_env`.

    Args:
        settings: settings of the environment.
        opponent: word, or a learned team; None: there is none.
        side: the agents' side, if there is an opponent.
    """

    def __init__(
        self, settings: EnvSettings, opponent: str | LearnedTeam | None = None, side: Side = "home"
    ) -> None:
        self.settings = settings
        self.render_mode = settings.render_mode
        self.metadata = settings.metadata
        robots = settings.matches.robots
        self._sides = MatchSides(settings, opponent, side)
        self._names = [[f"{SIDES[team]}_{number}" for number in range(1, robots + 1)]
                       for team in self._sides.driven]
        self.possible_agents = [name for names in self._names for name in names]
        self.agents: list[str] = []
        self.observation_spaces = {name: _observed(settings) for name in self.possible_agents}
        self.action_spaces = {name: _of_one(settings.actions) for name in self.possible_agents}
        self._screen = Rendering(settings.render_mode, settings.matches, self._sides.names)
        self._random: np.random.Generator | None = None

    @property
    def match(self) -> MatchInPlay:
        """The match that is played; there is none before the first reset."""
        return self._played.match

    @property
    def driven(self) -> tuple[int, ...]:
        """The teams whose robots are agents, 0 home, 1 away."""
        return self._sides.driven

    def observation_space(self, agent: str) -> spaces.Space[F32]:
        """The agent's observations: float32 [14 N + 7], or [33] of sights; always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The agent's actions: float32 [2], or an index in :data:`BEHAVIOURS`; always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, F32], dict[str, dict[str, Any]]]:
        """Begin a match; it stands at its kick-off.

        Args:
            seed: seed of the match; None: it follows from the last one that was given, or from chance.
            options: not used.

        Returns:
            Observations and infos by agent.
        """
        if self._random is None or seed is not None:
            self._random = seeding.np_random(seed)[0]
        self._played = self._sides.begin(_seed(self._random, seed))
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
            actions: actions of each agent, by name.

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
        goal = settings.goal_ends and rewards[0] != 0.0
        names, over = self.possible_agents, self._played.match.over
        if goal or over:
            self.agents = []
        earned = {name: reward for of_team, reward in zip(self._names, rewards, strict=True)
                  for name in of_team}
        return (
            self._observations(), earned, dict.fromkeys(names, goal), dict.fromkeys(names, over),
            self._infos(),
        )  # fmt: skip

    def begin_anew(self, agents: Collection[str]) -> None:
        """Let agents begin the behaviours of the next step anew; else one that is chosen again goes on.

        A learned team that looks does so at each decision. Wheels know no behaviours.

        Raises:
            BadSettings: if there is no match or it is over.
        """
        if not self.agents:
            raise _not_begun()
        self._played.begin_anew([[place for place, name in enumerate(names) if name in agents]
                                 for names in self._names])

    def render(self) -> npt.NDArray[np.uint8] | None:
        """A picture, uint8 [560, 640, 3], in the mode ``rgb_array``; None in others."""
        return self._screen.picture()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._screen.close()

    def _observations(self) -> dict[str, F32]:
        settings = self.settings
        seen = (self._played.sights() if settings.observations == "sights"
                else self._played.observe(settings.matches.robots))
        return dict(zip(self.possible_agents, seen, strict=True))

    def _infos(self) -> dict[str, dict[str, Any]]:
        score = self._played.match.score
        return {name: {"score": (score[team], score[1 - team])}
                for team, names in zip(self._sides.driven, self._names, strict=True) for name in names}


class TeamEnv(gymnasium.Env[F32, Any]):
    """A match in which one agent drives a team, see :func:`env`.

    Args:
        settings: settings of the environment.
        opponent: word, or a learned team.
        side: the side of the agent's team.
    """

    metadata = EnvSettings().metadata

    def __init__(self, settings: EnvSettings, opponent: str | LearnedTeam, side: Side) -> None:
        self.settings = settings
        self.render_mode = settings.render_mode
        self.metadata = settings.metadata
        robots = settings.matches.robots
        self._sides = MatchSides(settings, opponent, side)
        self.observation_space = _observed(settings, robots if settings.observations == "sights" else 1)
        self.action_space = _of_all(settings.actions, robots)
        (self._team,) = self._sides.driven
        self._screen = Rendering(settings.render_mode, settings.matches, self._sides.names)
        self._begun = False

    @property
    def match(self) -> MatchInPlay:
        """The match that is played; there is none before the first reset."""
        return self._played.match

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[F32, dict[str, Any]]:
        """Begin a match; it stands at its kick-off.

        Args:
            seed: seed of the match; None: it follows from the last one that was given, or from chance.
            options: not used.

        Returns:
            Observation and info.
        """
        super().reset(seed=seed)
        self._played = self._sides.begin(_seed(self.np_random, seed))
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
        if self.settings.observations == "sights":
            return self._played.sights().ravel()
        (seen,) = self._played.observe(1)
        return cast("F32", seen)

    def _info(self) -> dict[str, Any]:
        score = self._played.match.score
        return {"score": (score[self._team], score[1 - self._team])}


def _settings(
    robots: int | None, minutes: float | None, matches: MatchSettings | None, **said: Any
) -> EnvSettings:
    """The settings of an environment, of the arguments of its door."""
    return fitted(EnvSettings, {**said, "matches": varied(matches, robots, minutes)}, "environment",
                  "help(pitchlore.env) explains them")


def _seed(random: np.random.Generator, asked: int | None) -> int:
    """The seed of the next match."""
    return int(random.integers(1 << 62)) if asked is None else asked


def _observed(settings: EnvSettings, robots: int = 1) -> spaces.Space[F32]:
    """The space of what so many robots see."""
    numbers = NUMBERS if settings.observations == "sights" else length(settings.matches.robots)
    return cast("spaces.Space[F32]", spaces.Box(-LIMIT, LIMIT, (robots * numbers,), np.float32))


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
