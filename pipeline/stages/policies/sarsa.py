"""Sarsa(lambda) in batch over state-behaviour pairs, for decisions of unequal duration.

The rule is tabular Sarsa(lambda) with eligibility traces: Sutton and Barto, *Reinforcement
Learning*, 1st edition, sections 7.5, 7.8 and figure 7.11; 2nd edition, section 12.7. A replacing
trace sets the visited pair's trace to one and leaves the other behaviours of its state alone.
Behaviours take time, so the process is semi-Markov: discounting counts seconds, not decisions.

Suffixes carry time: ``q_tm1`` is the value of the pair decided on at t - 1, and ``r_t``,
``discount_t`` and ``q_t`` are its outcome.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.base.errors import BadSettings, SchemaMismatch
from pitchlore.pipeline.numbers.arrays import F64, I8, I64, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.settings import PolicySettings

CONTINUES, TERMINAL, TRUNCATED = 0, 1, 2

#: The pair of a decision that the knowledge does not hold.
UNKNOWN = -1

#: A trace below this is dropped: it would move a value by less than a millionth of the step that
#: the latest pair takes.
TRACE_FLOOR = 1e-6


class Transitions(NamedTuple):
    """Decisions in order of time, episode after episode, each with its outcome.

    An episode is a run of rows that ends with the first row whose ``ends`` is not CONTINUES.

    Attributes:
        pair: int64 [T], index of the state-behaviour pair decided on, or UNKNOWN.
        elapsed: float64 [T], seconds until the next decision or the episode's end.
        reward: float64 [T], received once, when ``elapsed`` is over.
        ends: int8 [T]. CONTINUES: the next row is the robot's next decision. TERMINAL: the episode
            is over, and no value follows. TRUNCATED: the rest was not recorded. The last row ends one.
    """

    pair: I64
    elapsed: F64
    reward: F64
    ends: I8


class LearnedValues(NamedTuple):
    """Action values after some sweeps over a batch, with counts and errors.

    Attributes:
        q: float64 [P], the new action values.
        seen: float64 [P], how often each pair was seen, earlier batches included. Replacing traces
            count a pair once an episode, and again if its trace has run out meanwhile; accumulating
            traces count each visit.
        first_errors: float64 [T], TD error of each decision in the first sweep, without influence
            values. NaN where the decision made no update: its pair is unknown, or its successor was
            not recorded.
        last_errors: the same in the last sweep.
    """

    q: F64
    seen: F64
    first_errors: F64
    last_errors: F64


class _LearningRule(NamedTuple):
    """The numbers of the settings that the kernel needs."""

    step_size: float
    trace_decay: float
    averaging: bool
    replacing: bool


class _TableInTraining(NamedTuple):
    """A table in training; the kernel changes its arrays in place.

    Attributes:
        q: float64 [P], action values.
        seen: float64 [P], how often each pair was seen.
        trace: float64 [P], eligibility of each pair; all zero between episodes.
        active: int64 [P], scratch: the pairs whose trace is not zero.
    """

    q: F64
    seen: F64
    trace: F64
    active: I64


@njit(cache=True, nogil=True)
def _learn(
    error: float, pair: int, decay: float, rule: _LearningRule, table: _TableInTraining, count: int
) -> int:
    """Number of active pairs after one update: moves every traced pair along the error, decays its trace.

    ``table.active[:count]`` lists the pairs whose trace is not zero, so the cost does not depend on P.
    ``table.seen`` grows by one for each trace that begins, or for each visit if traces accumulate.
    """
    q, seen, trace, active = table
    if trace[pair] == 0.0:
        active[count] = pair
        count += 1
    if trace[pair] == 0.0 or not rule.replacing:
        seen[pair] += 1.0
    trace[pair] = 1.0 if rule.replacing else trace[pair] + 1.0
    kept = 0
    for i in range(count):
        traced = active[i]
        step = max(rule.step_size, 1.0 / seen[traced]) if rule.averaging else rule.step_size
        q[traced] += step * error * trace[traced]
        decayed = trace[traced] * decay
        if decayed < TRACE_FLOOR:
            trace[traced] = 0.0
        else:
            trace[traced] = decayed
            active[kept] = traced
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def _sweep(
    batch: Transitions, discounts: F64, influence: F64, rule: _LearningRule, table: _TableInTraining,
    errors: F64,
) -> None:
    """Make one pass over the batch: change ``table`` and fill ``errors`` [T].

    An error is ``r_t + discount_t * q_t - q_tm1``, the outcome minus the expectation. ``influence`` [T]
    is added to a decision's error in its update only. ``discounts`` [T] are gamma to the power of
    ``elapsed``.
    """
    pair, _, reward, ends = batch
    q, _, trace, active = table
    count = 0
    a_tm1 = -1  # the last known pair, waiting for its outcome
    row = 0
    r_t = 0.0
    discount_t = 1.0
    for t in range(len(pair)):
        errors[t] = np.nan
        a_t = pair[t]
        if a_t >= 0:
            if a_tm1 >= 0:
                error = r_t + discount_t * q[a_t] - q[a_tm1]
                errors[row] = error
                count = _learn(
                    error + influence[row], a_tm1, discount_t * rule.trace_decay, rule, table, count
                )
            a_tm1, row, r_t, discount_t = a_t, t, 0.0, 1.0
        discount_t *= discounts[t]
        r_t += discount_t * reward[t]
        if ends[t] != CONTINUES:
            if ends[t] == TERMINAL and a_tm1 >= 0:
                error = r_t - q[a_tm1]
                errors[row] = error
                count = _learn(
                    error + influence[row], a_tm1, discount_t * rule.trace_decay, rule, table, count
                )
            for i in range(count):
                trace[active[i]] = 0.0
            count = 0
            a_tm1 = -1


def sarsa_lambda(
    q: F64,
    seen: F64,
    batch: Transitions,
    settings: PolicySettings,
    influence: Callable[[F64], F64] | None = None,
) -> LearnedValues:
    """Action values after some sweeps over a batch, in order of time, updated at every decision.

    A decision at time t that lasts ``elapsed`` seconds has the target
    ``discount ** elapsed * (reward + q_next)``. The reward is discounted because it comes at the end
    of the decision. So a goal is worth ``discount ** seconds`` to each decision before it, as in the
    paper's value of a situation (section 3.2.2). Traces decay by ``discount ** elapsed * trace_decay``
    and are cleared where an episode ends.

    A decision whose pair is UNKNOWN has no value to learn. It prolongs the known decision before it,
    which waits for its successor and collects the reward meanwhile. Before the episode's first known
    decision it is ignored. The last known decision of a TRUNCATED episode has no successor and makes
    no update; earlier updates stand.

    With "average" steps, the step is one over how often the pair was seen, but at least ``step_size``.
    In episodes of one decision a value is then the mean of all returns.

    Args:
        q: float64 [P], finite action values to start from; not changed.
        seen: float64 [P], finite and not negative: how often each pair was seen before, as
            :class:`LearnedValues` defines it. Every sweep counts from there; not changed.
        batch: the decisions; every pair is below P.
        settings: the learning rule.
        influence: called before every sweep with the TD errors by the current values, float64 [T], NaN
            where a decision makes no update. Returns what is added to each decision's TD error in its
            update, float64 [T], finite. See :class:`pipeline.stages.policies.influence.Influence`.

    Raises:
        SchemaMismatch: if an elapsed time is negative or not finite, or a reward is not finite.
        BadSettings: if the values grew beyond all bounds.
    """
    _require(np.isfinite(batch.elapsed) & (batch.elapsed >= 0), "elapsed", "is negative or not finite")
    _require(np.isfinite(batch.reward), "reward", "is not finite")

    # copies, because numba compiles the kernel once more for read-only arrays
    batch = Transitions(batch.pair.copy(), batch.elapsed.copy(), batch.reward.copy(), batch.ends.copy())
    discounts = np.power(settings.discount, batch.elapsed)
    rule = _LearningRule(
        settings.step_size, settings.trace_decay, settings.steps == "average", settings.traces == "replacing"
    )
    learned, counted = q.copy(), seen.copy()
    scratch = np.zeros_like(learned), np.empty(len(learned), dtype=np.int64)
    first = last = none = np.zeros(len(batch.pair))
    for sweep in range(settings.sweeps):
        added, counted, last = none, seen.copy(), np.empty_like(none)
        if influence is not None:
            # TD errors by the values as they are: a sweep of step zero on copies
            still = _LearningRule(0.0, 0.0, averaging=False, replacing=True)
            copies = _TableInTraining(learned.copy(), counted.copy(), *scratch)
            _sweep(batch, discounts, none, still, copies, last)
            added = influence(last)
        _sweep(batch, discounts, added, rule, _TableInTraining(learned, counted, *scratch), last)
        first = last if sweep == 0 else first
    if not np.isfinite(learned).all():
        raise BadSettings(
            "the action values grew beyond all bounds", where="sarsa",
            next_step="Lower step_size, discount or trace_decay, or use replacing traces",
        )
    return LearnedValues(learned, counted, first, last)


def _require(ok: Bools, name: str, breach: str) -> None:
    if not ok.all():
        raise SchemaMismatch(
            f"{name}[{int(np.argmin(ok))}] {breach}", where="sarsa",
            next_step="Pass arrays as Transitions documents them",
        )
