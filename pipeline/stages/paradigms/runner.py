"""Independent runs of a team of equal learners in a game, on all cores.

Run i draws from the i-th stream split off the seeds, so its result does not depend on its batch.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.stages.paradigms.games.game import Game
from pitchlore.pipeline.stages.paradigms.rules.jaq import joint_index
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import (
    LearnerSettings,
    Memory,
    Params,
    Transition,
    memory_of,
)
from pitchlore.pipeline.stages.paradigms.rules.rules import adapt, error, rule_number, values
from pitchlore.pipeline.stages.paradigms.rules.selection import ActionSelection, sample, selection_weights
from pitchlore.pipeline.stages.paradigms.settling import PARTS, Settling, greedy_joint_action

#: A run with an error of at least this has diverged, in the unit of the rewards, which are below 1,000.
DIVERGED = 1e9

#: Batches for each core; more batches share the work more evenly, fewer cost less.
BATCHES_A_CORE = 4


@dataclass(frozen=True, slots=True)
class Training:
    """Length and exploration of a team's training.

    Attributes:
        temperatures: float64 [T], temperature (or probability of exploring) at each of T ticks.
        selection: rule that makes probabilities of action values.
        tick: the temperature changes with every step, or with every episode.
        episode_steps: an episode is broken off after so many steps.
        settling: how training goes on at the last temperature; None: it does not.
    """

    temperatures: F64
    selection: ActionSelection = ActionSelection.BOLTZMANN
    tick: Literal["step", "episode"] = "step"
    episode_steps: int = 1_000_000
    settling: Settling | None = None


@dataclass(frozen=True, slots=True)
class Testing:
    """Tests of a trained team; it does not learn in them.

    Attributes:
        tests: number of episodes.
        steps: an episode without success after so many steps has failed.
        temperature: temperature of the choice; 0 is greedy, ties at random.
    """

    tests: int = 1
    steps: int = 1
    temperature: float = 0.0


class Runs(NamedTuple):
    """Results of R runs.

    Attributes:
        success: float64 [R], share of tests that succeeded; 0 if the run diverged.
        length: float64 [R], mean steps of the tests that succeeded; NaN if none did.
        last: int64 [R], joint action of the last test's last step; -1 if the run diverged.
        diverged: bool [R].
        settled: bool [R], whether the team settled; False if training does not go on until it does.
        settle_steps: int64 [R], steps of the whole training; 0 likewise.
    """

    success: F64
    length: F64
    last: I64
    diverged: Bools
    settled: Bools
    settle_steps: I64


class _Dynamics(NamedTuple):
    """A game in the form that compiled code reads."""

    following: I64
    rewards: F64
    ends: Bools
    success: Bools
    observed: I64
    start: int
    actions: int


class _Learner(NamedTuple):
    """A rule in the form that compiled code reads."""

    rule: int
    params: Params
    tosses: bool
    joint: bool
    in_turn: bool


@kernel
def _choose(
    rng: np.random.Generator, learner: _Learner, memory: Memory, selection: int, temperature: float,
    s_t: I64, worth: F64, chance: F64, a_t: I64,
) -> None:
    """Choose every agent's action, into ``a_t``; one draw for each agent."""
    for agent in range(a_t.shape[0]):
        values(learner.rule, memory, learner.params, agent, s_t, worth)
        selection_weights(selection, worth, temperature, chance)
        a_t[agent] = sample(chance, rng.random())


@kernel
def _learn(
    rng: np.random.Generator, learner: _Learner, memory: Memory,
    s_tm1: I64, a_tm1: I64, joint: int, r_t: F64, continues_t: float, s_t: I64, errors: F64,
) -> bool:
    """Update every agent by one step; False if an error is out of bounds."""
    rule, params = learner.rule, learner.params
    step = Transition(s_tm1, a_tm1, r_t, continues_t, s_t)
    agents = a_tm1.shape[0]
    for agent in range(agents):
        u_t = rng.random() if learner.tosses else 0.0
        errors[agent] = error(rule, memory, params, agent, step, u_t)
        if not abs(errors[agent]) < DIVERGED:  # NaN has diverged, too
            return False
        if learner.in_turn:
            done = joint if learner.joint else a_tm1[agent]
            memory.q[agent, s_tm1[agent], done] += params.step_size * errors[agent]
    if not learner.in_turn:
        for agent in range(agents):
            done = joint if learner.joint else a_tm1[agent]
            memory.q[agent, s_tm1[agent], done] += params.step_size * errors[agent]
    for agent in range(agents):
        adapt(rule, memory, params, agent, step)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _train(
    rng: np.random.Generator, dynamics: _Dynamics, learner: _Learner, memory: Memory,
    selection: int, temperatures: F64, by_episode: bool, episode_steps: int,
) -> bool:
    """Train one run; False if it diverged."""
    agents = dynamics.observed.shape[0]
    outcomes = dynamics.rewards.shape[2]
    s_tm1, s_t = np.empty(agents, np.int64), np.empty(agents, np.int64)
    a_tm1, r_t, errors = np.empty(agents, np.int64), np.empty(agents), np.empty(agents)
    worth, chance = np.empty(dynamics.actions), np.empty(dynamics.actions)
    state = dynamics.start
    tick = 0
    step = 0
    while tick < temperatures.shape[0]:
        for agent in range(agents):
            s_tm1[agent] = dynamics.observed[agent, state]
        _choose(rng, learner, memory, selection, temperatures[tick], s_tm1, worth, chance, a_tm1)
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
    selection: int, temperature: float, tests: int, steps: int,
) -> tuple[int, int, int]:
    """Number of tests that succeeded, their steps added up, and the last joint action."""
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
            _choose(rng, learner, memory, selection, temperature, s_t, worth, chance, a_t)
            joint = joint_index(a_t, dynamics.actions)
            if dynamics.success[state, joint]:
                succeeded += 1
                length += step + 1
                break
            if dynamics.ends[state, joint]:
                break
            state = dynamics.following[state, joint]
    return succeeded, length, joint


@njit(cache=True, nogil=True, error_model="numpy")
def _settle(
    rng: np.random.Generator, dynamics: _Dynamics, learner: _Learner, memory: Memory,
    selection: int, temperature: float, steps: int, still: int, most: int,
) -> tuple[bool, bool, int]:
    """Train a run on until it settles (:class:`pipeline.stages.paradigms.settling.Settling`).

    ``steps`` are those that it has trained. Returns whether it is bounded, whether it settled, and its steps.
    """
    done = steps
    before, _ = greedy_joint_action(learner.rule, memory, learner.params)
    while done < most * steps:
        more = max(still, done // PARTS)
        if not _train(rng, dynamics, learner, memory, selection, np.full(more, temperature), False, more):
            return False, False, done
        done += more
        now, stays = greedy_joint_action(learner.rule, memory, learner.params)
        if stays and (now == before).all():
            return True, True, done
        before = now
    return True, False, done


def stream(seeds: Sequence[int], run: int) -> np.random.Generator:
    """Random numbers of one run: the ``run``-th stream split off the seeds."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seeds, spawn_key=(run,))))


def play_runs(
    game: Game, settings: LearnerSettings, training: Training, testing: Testing,
    *, runs: range, seeds: Sequence[int],
) -> Runs:
    """Results of training a team of equal learners in a game, then testing it, once for each run.

    A step draws one number for each learner's choice, one for the outcome if there are several, and one for
    each learner's rule if its error is random, in this order. Other seeds make independent runs, unless they
    differ only in zeros at the end.

    Raises:
        ValueError: if the settings belong to no rule in RULES.
    """
    dynamics, learner = dynamics_of(game, settings), learner_of(settings, game.agents)
    count = len(runs)
    out = Runs(np.zeros(count), np.full(count, np.nan), np.full(count, -1), np.zeros(count, np.bool_),
               np.zeros(count, np.bool_), np.zeros(count, np.int64))

    def batch(places: I64) -> None:
        for place in places:
            rng = stream(seeds, runs[place])
            memory, bounded = trained(rng, dynamics, learner, settings, training)
            if bounded and training.settling is not None:
                bounded, out.settled[place], out.settle_steps[place] = _settle(
                    rng, dynamics, learner, memory, int(training.selection), training.temperatures[-1],
                    len(training.temperatures), training.settling.still, training.settling.most)
            out.diverged[place] = not bounded
            if not bounded:
                continue
            succeeded, length, out.last[place] = _test(
                rng, dynamics, learner, memory, int(training.selection), testing.temperature, testing.tests,
                testing.steps)
            out.success[place] = succeeded / testing.tests
            if succeeded:
                out.length[place] = length / succeeded

    threads = os.cpu_count() or 1
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(batch, np.array_split(np.arange(count), min(count, threads * BATCHES_A_CORE) or 1)))
    return out


def dynamics_of(game: Game, settings: LearnerSettings) -> _Dynamics:
    """The game as learners with these settings observe it: of one agent if one learner chooses for all."""
    game = game.as_one_agent() if settings.ONE_FOR_ALL else game
    return _Dynamics(  # copies: read-only arrays are another type to numba, compiled once more
        game.following.copy(), game.rewards.copy(), game.ends.copy(), game.success.copy(),
        game.observed(settings.observes).copy(), game.start, game.actions,
    )


def learner_of(settings: LearnerSettings, agents: int) -> _Learner:
    """The rule of these settings for a team of ``agents``."""
    return _Learner(
        rule_number(settings), settings.params(agents), tosses=settings.TOSSES, joint=settings.JOINT,
        in_turn=settings.order == "in turn",
    )


def trained(
    rng: np.random.Generator, dynamics: _Dynamics, learner: _Learner, settings: LearnerSettings,
    training: Training,
) -> tuple[Memory, bool]:
    """Memory of a new team after training; False beside it if the run diverged.

    The memory of a run that diverged is that of the moment when an error left the bounds.
    """
    agents, observations = dynamics.observed.shape[0], int(dynamics.observed.max()) + 1
    memory = memory_of(settings, agents, observations, dynamics.actions)
    temperatures = np.asarray(training.temperatures, dtype=np.float64)
    bounded = _train(
        rng, dynamics, learner, memory, int(training.selection), temperatures, training.tick == "episode",
        training.episode_steps)
    return memory, bool(bounded)
