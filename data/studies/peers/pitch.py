"""Matches against a named team as an environment of stable-baselines3: a row is a robot.

All robots share one policy; each acts on what it sees itself, and on its role. All get the team's reward.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from peers.playing import pitch_of
from peers.worth import Worth
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from pitchlore.pipeline.arena.env import ParallelMatch
from pitchlore.schemas import SIDES


class Pitches(VecEnv):  # type: ignore[misc]  # not in this environment
    """Matches side by side, of which every other one is played as home.

    Args:
        matches: how many are played at once.
        seeds: seeds of the matches, in the order in which they begin.
        opponent: word of the other team.
        worth: adds the change of V to the reward; None: goals alone.

    Attributes:
        differences: goals for less goals against of the matches that are over.
    """

    def __init__(self, matches: int, seeds: Iterator[int], opponent: str, worth: Worth | None) -> None:
        self._pitches = [pitch_of(opponent, SIDES[number % 2]) for number in range(matches)]
        self._coming, self._worth = seeds, worth
        first = self._pitches[0]
        agent = first.possible_agents[0]
        self._robots = len(first.possible_agents)
        self.differences: list[int] = []
        super().__init__(matches * self._robots, first.observation_space(agent), first.action_space(agent))

    def resume(self, differences: list[int]) -> None:
        """Go on after matches that ended so; call it before :meth:`reset`."""
        self.differences = differences
        for _ in differences:
            next(self._coming)

    def reset(self) -> VecEnvObs:
        """Begin all matches anew."""
        seen = [self._begin(pitch) for pitch in self._pitches]
        if self._worth is not None:
            self._before = self._worth.of(self._pitches)
        return np.concatenate(seen)

    def step_async(self, actions: npt.NDArray[np.int64]) -> None:
        """Take the robots' actions."""
        self._actions = actions.reshape(-1, self._robots)

    def step_wait(self) -> VecEnvStepReturn:
        """Play a step of each match."""
        seen, rewards, over = [], np.empty(len(self._pitches), dtype=np.float32), []
        for place, (pitch, actions) in enumerate(zip(self._pitches, self._actions, strict=True)):
            observed, earned, _, truncated, reported = pitch.step(
                dict(zip(pitch.agents, actions, strict=True)))
            first = pitch.possible_agents[0]
            seen.append(np.stack(list(observed.values())))
            rewards[place] = earned[first]
            over.append(truncated[first])
            if truncated[first]:
                ours, theirs = reported[first]["score"]
                self.differences.append(ours - theirs)
        if self._worth is not None:
            after = self._worth.of(self._pitches)
            rewards += self._worth.discount * after - self._before
            self._before = after
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for place in np.flatnonzero(over).tolist():
            for robot, last in enumerate(seen[place]):
                infos[place * self._robots + robot] = {
                    "terminal_observation": last, "TimeLimit.truncated": True}
            seen[place] = self._begin(self._pitches[place])
            if self._worth is not None:
                self._before[place] = self._worth.of([self._pitches[place]])[0]
        return (np.concatenate(seen), np.repeat(rewards, self._robots),
                np.repeat(np.array(over), self._robots), infos)

    def _begin(self, pitch: ParallelMatch) -> npt.NDArray[np.float32]:
        """Begin a pitch's next match; what its robots see, float32 [N, 33]."""
        observed, _ = pitch.reset(seed=next(self._coming))
        return np.stack(list(observed.values()))

    def close(self) -> None:
        """Close all matches."""
        for pitch in self._pitches:
            pitch.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of each row's match."""
        return [getattr(self._pitches[row // self._robots], attr_name) for row in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of each row's match."""
        for row in self._get_indices(indices):
            setattr(self._pitches[row // self._robots], attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of each row's match."""
        return [getattr(self._pitches[row // self._robots], method_name)(*method_args, **method_kwargs)
                for row in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No row is wrapped."""
        return [False for _ in self._get_indices(indices)]
