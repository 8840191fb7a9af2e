"""Plays learners in games: many independent runs side by side, on all cores.

Run i draws from the i-th stream split off the seeds, so it is the same in whatever batch it is played.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from pipeline.studies.paradigms.games.game import Bool, Game
from pipeline.studies.paradigms.rules.jaq import joint_index
from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import F64, I64, Knobs, LearnerSettings, Memory, memory_of
from pipeline.studies.paradigms.rules.rules import RULES, adapt, error, values
from pipeline.studies.paradigms.rules.selection import Selection, sample, select

#: A run whose error grows beyond this has diverged; rewards are below 1,000.
DIVERGED = 1e9

#: Batches that a core works through; more share the work more evenly, fewer cost less.
BATCHES_A_CORE = 4


@dataclass(frozen=True, slots=True)
class Training:
    """How long a team trains and how it explores meanwhile.

    Attributes:
        heats: float64 [T], temperature (or probability of exploring) of every tick; training is T ticks.
        selection: what makes probabilities of action values.
        tick: whether heat falls with every step or with every episode.
        episode_steps: an episode that has not ended after so many steps is broken off.
    """

    heats: F64
    selection: Selection = Selection.BOLTZMANN
    tick: Literal["step", "episode"] = "step"
    episode_steps: int = 1_000_000


@dataclass(frozen=True, slots=True)
class Testing:
    """How what was learned is tested; nothing is learned meanwhile.

    Attributes:
        tests: episodes.
        steps: an episode that has not succeeded after so many has failed.
        heat: of the choice; 0 is greedy, ties at random.
    """

    tests: int = 1
    steps: int = 1
    heat: float = 0.0


class Runs(NamedTuple):
    """What became of R runs.

    Attributes:
        success: float64 [R], share of tests that succeeded; 0 where the run diverged.
        length: float64 [R], mean steps of the tests that succeeded, NaN where none did.
        last: int64 [R], joint action of the last test's last step, -1 where the run diverged.
        diverged: bool [R].
    """

    success: F64
    length: F64
    last: I64
    diverged: Bool


class _Dynamics(NamedTuple):
    """A game as compiled code reads it."""

    following: I64
    rewards: F64
    ends: Bool
    success: Bool
    observed: I64
    start: int
    actions: int


class _Learner(NamedTuple):
    """A rule as compiled code reads it."""

    rule: int
    knobs: Knobs
    tosses: bool
    joint: bool
    in_turn: bool


@kernel
def _choose(
    rng: np.random.Generator, learner: _Learner, memory: Memory, selection: int, heat: float,
    s_t: I64, worth: F64, chance: F64, a_t: I64,
) -> None:
    """Every agent's choice, into ``a_t``; one draw an agent."""
    for agent in range(a_t.shape[0]):
        values(learner.rule, memory, learner.knobs, agent, s_t, worth)
        select(selection, worth, heat, chance)
        a_t[agent] = sample(chance, rng.random())


@kernel
def _learn(
    rng: np.random.Generator, learner: _Learner, memory: Memory,
    s_tm1: I64, a_tm1: I64, joint: int, r_t: F64, continues_t: float, s_t: I64, errors: F64,
) -> bool:
    """Every agent's update of one step; whether all errors are within bounds."""
    rule, knobs = learner.rule, learner.knobs
    agents = a_tm1.shape[0]
    for agent in range(agents):
        u_t = rng.random() if learner.tosses else 0.0
        errors[agent] = error(rule, memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
        if not abs(errors[agent]) < DIVERGED:  # so that NaN has diverged, too
            return False
        if learner.in_turn:
            done = joint if learner.joint else a_tm1[agent]
            memory.q[agent, s_tm1[agent], done] += knobs.step_size * errors[agent]
    if not learner.in_turn:
        for agent in range(agents):
            done = joint if learner.joint else a_tm1[agent]
            memory.q[agent, s_tm1[agent], done] += knobs.step_size * errors[agent]
    for agent in range(agents):
        adapt(rule, memory, knobs, agent, s_tm1, a_tm1, r_t)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _train(
    rng: np.random.Generator, dynamics: _Dynamics, learner: _Learner, memory: Memory,
    selection: int, heats: F64, by_episode: bool, episode_steps: int,
) -> bool:
    """One run's training; whether it stayed within bounds."""
    agents = dynamics.observed.shape[0]
    outcomes = dynamics.rewards.shape[2]
    s_tm1, s_t = np.empty(agents, np.int64), np.empty(agents, np.int64)
    a_tm1, r_t, errors = np.empty(agents, np.int64), np.empty(agents), np.empty(agents)
    worth, chance = np.empty(dynamics.actions), np.empty(dynamics.actions)
    state = dynamics.start
    tick = 0
    step = 0
    while tick < heats.shape[0]:
        for agent in range(agents):
            s_tm1[agent] = dynamics.observed[agent, state]
        _choose(rng, learner, memory, selection, heats[tick], s_tm1, worth, chance, a_tm1)
        joint = joint_index(a_tm1, dynamics.actions)
        outcome = int(rng.random() * outcomes) if outcomes > 1 else 0
        for agent in range(agents):  # no view: counting references to it would cost more than the copy
            r_t[agent] = dynamics.rewards[state, joint, outcome, agent]
        ended = dynamics.ends[state, joint]
        state = dynamics.following[state, joint]
        for agent in range(agents):
            s_t[agent] = dynamics.observed[agent, state]
        continues_t = 0.0 if ended else 1.0
        if not _learn(rng, learner, memory, s_tm1, a_tm1, joint, r_t, continues_t, s_t, errors):
            return False
        step += 1
        over = ended or step >= episode_steps
        if over:
            state = dynamics.start
            step = 0
        if over or not by_episode:
            tick += 1
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _test(
    rng: np.random.Generator, dynamics: _Dynamics, learner: _Learner, memory: Memory,
    selection: int, heat: float, tests: int, steps: int,
) -> tuple[int, int, int]:
    """How many tests succeed, in how many steps together, and the last joint action."""
    agents = dynamics.observed.shape[0]
    s_t, a_t = np.empty(agents, np.int64), np.empty(agents, np.int64)
    worth, chance = np.empty(dynamics.actions), np.empty(dynamics.actions)
    succeeded = 0
    length = 0
    joint = -1
    for _ in range(tests):
        state = dynamics.start
        for step in range(steps):
            for agent in range(agents):
                s_t[agent] = dynamics.observed[agent, state]
            _choose(rng, learner, memory, selection, heat, s_t, worth, chance, a_t)
            joint = joint_index(a_t, dynamics.actions)
            if dynamics.success[state, joint]:
                succeeded += 1
                length += step + 1
                break
            if dynamics.ends[state, joint]:
                break
            state = dynamics.following[state, joint]
    return succeeded, length, joint


def stream(seeds: Sequence[int], run: int) -> np.random.Generator:
    """The random numbers of one run: the ``run``-th stream split off the seeds."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seeds, spawn_key=(run,))))


def warm_up() -> None:
    """Have everything compiled, which takes some seconds the first time; nothing else comes of it."""
    one = np.zeros((1, 4, 1, 2))
    never = np.zeros((1, 4), dtype=np.bool_)
    nowhere = np.zeros((1, 4), dtype=np.int64)
    game = Game("nothing", 2, nowhere, one, never, never, np.zeros((2, 1), dtype=np.int64))
    play(game, RULES[0](), Training(np.ones(1)), Testing(), runs=range(1), seeds=(0,))


def play(
    game: Game, settings: LearnerSettings, training: Training, testing: Testing,
    *, runs: range, seeds: Sequence[int], workers: int | None = None,
) -> Runs:
    """Train a team of equal learners in a game, as often as ``runs`` is long, and test each.

    A step draws one number an agent for its choice, one for the outcome if there are several, and one
    an agent for its rule if that tosses coins, in this order.

    Args:
        game: what is played.
        settings: of every agent's rule.
        training: how long and how exploring.
        testing: how it is tested.
        runs: which runs of the seeds.
        seeds: of all runs; others make independent runs, unless they differ only in zeros at the end.
        workers: threads; by default one a core.

    Raises:
        ValueError: if the settings are of no rule in RULES.
    """
    dynamics, learner = _dynamics(game, settings), _learner(settings, game.agents)
    count = len(runs)
    out = Runs(np.zeros(count), np.full(count, np.nan), np.full(count, -1), np.zeros(count, np.bool_))

    def batch(places: npt.NDArray[np.int64]) -> None:
        for place in places:
            rng = stream(seeds, runs[place])
            memory, bounded = _trained(rng, dynamics, learner, settings, training)
            out.diverged[place] = not bounded
            if not bounded:
                continue
            succeeded, length, out.last[place] = _test(
                rng, dynamics, learner, memory, int(training.selection), testing.heat, testing.tests,
                testing.steps)
            out.success[place] = succeeded / testing.tests
            if succeeded:
                out.length[place] = length / succeeded

    threads = workers or os.cpu_count() or 1
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(batch, np.array_split(np.arange(count), min(count, threads * BATCHES_A_CORE) or 1)))
    return out


def learn(
    game: Game, settings: LearnerSettings, training: Training, *, run: int, seeds: Sequence[int]
) -> Memory:
    """What a team knows after one run's training: the very memory that :func:`play` tests.

    Where the run diverged it is as it was when an error left the bounds.

    Args:
        game: what is played.
        settings: of every agent's rule.
        training: how long and how exploring.
        run: which run of the seeds.
        seeds: of all runs.

    Raises:
        ValueError: if the settings are of no rule in RULES.
    """
    dynamics, learner = _dynamics(game, settings), _learner(settings, game.agents)
    memory, _ = _trained(stream(seeds, run), dynamics, learner, settings, training)
    return memory


def _dynamics(game: Game, settings: LearnerSettings) -> _Dynamics:
    return _Dynamics(  # copies: read-only arrays are another type to numba, compiled once more
        game.following.copy(), game.rewards.copy(), game.ends.copy(), game.success.copy(),
        game.observed(settings.observes).copy(), game.start, game.actions,
    )


def _learner(settings: LearnerSettings, agents: int) -> _Learner:
    rule = RULES.index(type(settings))
    return _Learner(
        rule, settings.knobs(agents), settings.TOSSES, settings.JOINT, settings.order == "in turn")


def _trained(
    rng: np.random.Generator, dynamics: _Dynamics, learner: _Learner, settings: LearnerSettings,
    training: Training,
) -> tuple[Memory, bool]:
    """A new team's memory after training, and whether it stayed within bounds."""
    agents, observations = dynamics.observed.shape[0], int(dynamics.observed.max()) + 1
    memory = memory_of(settings, agents, observations, dynamics.actions)
    heats = np.asarray(training.heats, dtype=np.float64)
    bounded = _train(
        rng, dynamics, learner, memory, int(training.selection), heats, training.tick == "episode",
        training.episode_steps)
    return memory, bool(bounded)
