"""Steps of learning by hand: what a team of a rule knows after transitions that a test chooses."""

import numpy as np
from hypothesis import strategies as st

from pitchlore.pipeline.stages.paradigms.rules import jaq, rules
from pitchlore.pipeline.stages.paradigms.rules.memory import Transition, memory_of
from pitchlore.pipeline.stages.paradigms.rules.rules import rule_number

AGENTS, ACTIONS, OBSERVATIONS = 3, 3, 2


def ints(*numbers):
    return np.array(numbers, np.int64)


def floats(*numbers):
    return np.array(numbers, np.float64)


def learn(settings, steps, *, agents=2, actions=2, observations=1):
    """The memory after steps (seen, done, rewards, continues, seen next), of every agent each.

    A sixth part of a step is the agents' coins, which are 0.5 without it.
    """
    rule, params = rule_number(settings), settings.params(agents)
    memory = memory_of(settings, agents, observations, actions)

    def move(agent, error, s, a):
        done = jaq.joint_index(a, actions) if settings.JOINT else a[agent]
        memory.q[agent, s[agent], done] += params.step_size * error

    for *parts, coins in (step if len(step) == 6 else (*step, [0.5] * agents) for step in steps):
        step, errors = Transition(*parts), []
        for i in range(agents):
            errors.append(rules.error(rule, memory, params, i, step, float(coins[i])))
            if settings.order == "in turn":
                move(i, errors[i], step.s_tm1, step.a_tm1)
        if settings.order == "simultaneous":
            for i in range(agents):
                move(i, errors[i], step.s_tm1, step.a_tm1)
        for i in range(agents):
            rules.adapt(rule, memory, params, i, step)
    return memory


def values(settings, memory, agent, seen=None):
    """Worth of an agent's actions to it where agents see these observations; without, the first."""
    agents, _, actions = memory.occurrence.shape
    out = np.empty(actions)
    rules.values(rule_number(settings), memory, settings.params(agents), agent, ints(*(seen or [0] * agents)), out)
    return out.tolist()


def vectors(elements, dtype, size=AGENTS):
    return st.lists(elements, min_size=size, max_size=size).map(lambda row: np.array(row, dtype))


def plays(agents=AGENTS):
    """Steps in any order of observations, of every agent its own."""
    seen = vectors(st.integers(0, OBSERVATIONS - 1), np.int64, agents)
    done = vectors(st.integers(0, ACTIONS - 1), np.int64, agents)
    rewards = vectors(st.floats(-30, 30), np.float64, agents)
    return st.lists(st.tuples(seen, done, rewards, st.sampled_from([0.0, 1.0]), seen), max_size=20)


def learned(settings, play, agents=AGENTS):
    return learn(settings, play, agents=agents, actions=ACTIONS, observations=OBSERVATIONS)
