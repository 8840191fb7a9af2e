"""Options of omnidirectional robots, learned from motion alone; no executor is written by hand.

An option is a way to drive: the velocity to be had 0.2 s later is a weighted sum of vectors that the robot
sees (``seeing.VECTORS``), and each option has its own weights. Options follow one another as a hidden Markov
chain. Expectation maximisation finds weights, spreads and the chain together (switching regression: Hamilton
1990, "Analysis of time series subject to changes in regime", Journal of Econometrics 45). Habits, boosted
trees, say which option is taken at what is seen, after the options before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from omnidirectional.recording import HZ, STEPS, Stretch, view_of
from omnidirectional.seeing import ANGLES, NUMBERS, VECTORS, observe_omni
from sklearn.cluster import KMeans

from pitchlore.pipeline.game.bodies import BALL, THETA, VX, X
from pitchlore.pipeline.numbers.arrays import F32, F64, I64, Bools
from pitchlore.pipeline.numbers.threads import one_thread
from pitchlore.pipeline.numbers.trees import Trees
from pitchlore.pipeline.settings import HabitSettings
from pitchlore.pipeline.stages.options.of_team import fit_habits, probabilities

#: Samples of a window, 0.2 s; samples that a robot looks back for its change of velocity; how far ahead
#: motion is foretold; and velocities.
WINDOW, BACK, AHEAD, LATER = 12, 6, (6, 15, 30, 60), 30
#: Length of the blocks of time that intervals are over, s; no fewer windows than this are a block.
BLOCK_S, _LEAST = 3.0, 20
#: Trees of habits: few and small, for there are a thousand windows.
HABITS = HabitSettings(trees=60, learning_rate=0.05, leaves=8, leaf_samples=20, tree_penalty=1.0)
#: Pull of an option's weights to those of all windows, as so many windows; rounds of EM; windows for which an
#: option is taken to last before any was seen; least spread of a window's way, metres; change of the mean
#: logarithm of the likelihood at which EM ends.
_PULL, _ROUNDS, _STICKS, _SPREAD, _ENOUGH, _SMALL = 3.0, 60, 5.0, 0.003, 1e-3, 1e-6


class Windows(NamedTuple):
    """Windows of a team's robots, in order of stretch, robot and time.

    Attributes:
        chain: int64 [W], the same for windows that follow one another.
        block: int64 [W], block of time.
        robot: int64 [W], row in the team's view.
        stretch: int64 [W], index of the stretch, and
        sample: int64 [W], first sample in it.
        vectors: float64 [W, VECTORS, 2], angles: float64 [W, ANGLES], numbers: float32 [W, NUMBERS], as
            :func:`seeing.observe_omni` has them.
        ahead: float64 [W, AHEAD, 2], the way of the robot so much later, metres; NaN after the stretch.
        moved: float64 [W, 2], its way in the window, metres.
        told: float64 [W, 2], velocity at the window's end, m/s.
        later: float64 [W, 2], velocity ``LATER`` samples later; NaN after the stretch.
        turned: float64 [W], turn in the window, radians.
    """

    chain: I64
    block: I64
    robot: I64
    stretch: I64
    sample: I64
    vectors: F64
    angles: F64
    numbers: F32
    ahead: F64
    moved: F64
    told: F64
    later: F64
    turned: F64

    def some(self, rows: Bools) -> Windows:
        """Some of the windows."""
        return Windows(*(getattr(self, name)[rows] for name in self._fields))


def windows(parts: Sequence[Stretch], team: int, goal_x: float) -> Windows:
    """All windows of a team's robots in some stretches."""
    columns: list[list[object]] = [[] for _ in Windows._fields]
    chain = block = -1
    since, count = 0.0, _LEAST
    for place, part in enumerate(parts):
        view, blocks = view_of(part, team), list[int]()
        starts = range(STEPS + BACK, len(view) - WINDOW, WINDOW)
        for sample in starts:
            if count >= _LEAST and (sample == starts[0] or sample / HZ - since >= BLOCK_S):
                block, since, count = block + 1, sample / HZ, 0
            blocks.append(block)
            count += int(np.isfinite(view[sample, 1:(len(view[0]) + 1) // 2, X]).sum())
        for robot in range(1, (view.shape[1] - 1) // 2 + 1):
            if np.isnan(view[0, robot, X]) or np.isnan(view[0, BALL, X]):
                continue
            chain += 1
            for own, sample in zip(blocks, starts, strict=True):
                seen = np.zeros((len(VECTORS), 2)), np.zeros(len(ANGLES)), np.zeros(NUMBERS)
                observe_omni(view[sample], robot, view[sample - BACK, robot, VX:VX + 2], goal_x, *seen)
                here, end = view[sample, robot], view[sample + WINDOW, robot]
                ahead = [view[sample + later, robot, :2] - here[:2] if sample + later < len(view)
                         else np.full(2, np.nan) for later in AHEAD]
                later = (view[sample + LATER, robot, VX:VX + 2] if sample + LATER < len(view)
                         else np.full(2, np.nan))
                turned = (end[THETA] - here[THETA] + np.pi) % (2 * np.pi) - np.pi
                row = (chain, own, robot, place, sample, *seen, np.array(ahead), end[:2] - here[:2],
                       end[VX:VX + 2], later, turned)
                for column, value in zip(columns, row, strict=True):
                    column.append(value)
    whole = ("chain", "block", "robot", "stretch", "sample")
    kinds = {"numbers": np.float32, **dict.fromkeys(whole, np.int64)}
    return Windows(*(np.array(column, dtype=kinds.get(name, np.float64))
                     for name, column in zip(Windows._fields, columns, strict=True)))


def regressed(vectors: F64, out: F64, shares: F64) -> F64:
    """Weights float64 [K, L] of vectors [W, L, 2] whose sum is near to ``out`` [W, 2]: ridge regression.

    Each option's are pulled to those of all windows, and those to nothing; windows with NaN do not count.

    Args:
        vectors: terms of the sum.
        out: aim of the sum.
        shares: float64 [W, K], how much windows count for each option.
    """
    known = np.isfinite(out).all(axis=1)
    x, y, shares = vectors[known], out[known], shares[known]
    width = x.shape[1]
    squares = np.einsum("wlc,wmc->wlm", x, x).reshape(len(x), width * width)
    products = np.einsum("wlc,wc->wl", x, y)
    pull = np.diag(_PULL * (np.diag(squares.mean(axis=0).reshape(width, width)) + _SMALL))
    mean = np.linalg.solve(squares.sum(axis=0).reshape(width, width) + pull, products.sum(axis=0))
    if shares.shape[1] == 1:
        return mean[None]
    left = (shares.T @ squares).reshape(-1, width, width) + pull
    right = shares.T @ products + pull @ mean
    found: F64 = np.linalg.solve(left, right[:, :, None])[:, :, 0]
    return found


def summed(vectors: F64, weights: F64) -> F64:
    """Sums of vectors [W, L, 2] by the weights [K, L] of each option: float64 [W, K, 2]."""
    found: F64 = np.einsum("wlc,kl->wkc", vectors, weights)
    return found


class Chain(NamedTuple):
    """Options of a team.

    Attributes:
        weights: float64 [K, VECTORS], of the way in a window.
        spread: float64 [K], standard deviation of each coordinate of the way, metres.
        next: float64 [K, K], probability of the option after another.
        first: float64 [K], probability of a chain's first option.
    """

    weights: F64
    spread: F64
    next: F64
    first: F64

    def evidence(self, known: Windows) -> F64:
        """Logarithm of the density of each window's way with each option, float64 [W, K]."""
        off = np.sum((known.moved[:, None] - summed(known.vectors, self.weights)) ** 2, axis=2)
        found: F64 = -off / (2 * self.spread**2) - 2 * np.log(self.spread)
        return found

    def told(self, known: Windows) -> tuple[F64, F64, F64, float]:
        """Options of windows by their motion.

        Returns:
            Probabilities float64 [W, K] of the option before each window, by motion until then alone (of a
            first window: ``first``); of its own option, by all motion; expected steps from option to
            option [K, K]; the logarithm of the likelihood.
        """
        evidence = self.evidence(known)
        before, after = np.empty_like(evidence), np.empty_like(evidence)
        steps = np.zeros_like(self.next)
        total = _forward_backward(evidence, known.chain, self.next, self.first, before, after, steps)
        return before, after, steps, float(total)


@njit(cache=True, nogil=True, error_model="numpy")
def _forward_backward(
    evidence: F64, chain: I64, following: F64, first: F64, before: F64, after: F64, steps: F64
) -> float:
    """Logarithm of the likelihood; ``before``, ``after`` and ``steps`` are written (:meth:`Chain.told`)."""
    count, total, begin = len(first), 0.0, 0
    while begin < len(chain):
        end = begin
        while end < len(chain) and chain[end] == chain[begin]:
            end += 1
        likely, scale = np.empty((end - begin, count)), np.empty(end - begin)
        for t in range(begin, end):
            before[t] = first if t == begin else after[t - 1]  # until here the probabilities by the past
            top = evidence[t].max()
            likely[t - begin] = np.exp(evidence[t] - top)
            now = likely[t - begin] * (first if t == begin else after[t - 1] @ following)
            scale[t - begin] = now.sum()
            after[t] = now / scale[t - begin]
            total += math.log(scale[t - begin]) + top
        back = np.ones(count)
        for t in range(end - 2, begin - 1, -1):
            weighed = likely[t + 1 - begin] * back / scale[t + 1 - begin]
            for one in range(count):
                steps[one] += after[t, one] * following[one] * weighed
            back = following @ weighed
            after[t] *= back
        begin = end
    return total


def chained(known: Windows, count: int, seed: int = 0) -> Chain:
    """Find so many options by expectation maximisation, from clusters of how windows differ from the mean."""
    every = regressed(known.vectors, known.moved, np.ones((len(known.chain), 1)))
    off = known.moved - summed(known.vectors, every)[:, 0]
    if count == 1:
        return Chain(every, np.array([np.sqrt(np.mean(off**2))]), np.ones((1, 1)), np.ones(1))
    along = np.einsum("wc,wlc->wl", off, known.vectors)
    with one_thread():
        clusters = KMeans(count, n_init=3, random_state=seed)  # type: ignore[no-untyped-call]
        own = clusters.fit_predict(along / (along.std(axis=0) + 1e-9))  # type: ignore[no-untyped-call]
    shares = 0.9 * np.eye(count)[own] + 0.1 / count
    steps, last, found = np.zeros((count, count)), -np.inf, None
    first = shares.mean(axis=0)
    for _ in range(_ROUNDS):
        weights = regressed(known.vectors, known.moved, shares)
        off2 = np.sum((known.moved[:, None] - summed(known.vectors, weights)) ** 2, axis=2)
        spread = np.maximum(np.sqrt((off2 * shares).sum(axis=0) / (2 * shares.sum(axis=0) + 1e-9)), _SPREAD)
        follow = steps + 0.1 + _STICKS * np.eye(count)
        found = Chain(weights, spread, follow / follow.sum(axis=1, keepdims=True), first)
        _, shares, steps, total = found.told(known)
        first = shares[np.diff(known.chain, prepend=-1) != 0].sum(axis=0) + 1
        first /= first.sum()
        if total / len(shares) - last < _ENOUGH:
            break
        last = total / len(shares)
    assert found is not None
    return found


class Clone(NamedTuple):
    """A team as it was learned.

    Attributes:
        options: its options.
        habits: trees of the logit of each option at what is seen and the option before, by its index.
        ahead: float64 [AHEAD, K, VECTORS], weights of the way until each time ahead.
        told: float64 [K, VECTORS], weights of the velocity 0.2 s later: the commands.
        later: float64 [K, VECTORS], weights of the velocity half a second later.
        turns: float64 [K, ANGLES], weights of the turn in 0.2 s.
    """

    options: Chain
    habits: dict[int, Trees]
    ahead: F64
    told: F64
    later: F64
    turns: F64

    def usual(self, numbers: F32, before: F64) -> F64:
        """Probabilities of options, float64 [W, K], at what is seen and those of the option before [W, K]."""
        count = len(self.options.first)
        if count == 1:
            return np.ones((len(numbers), 1))
        found = probabilities(self.habits, _seen(numbers, before), count)
        shares: F64 = (1 - HABITS.doubt) * found + HABITS.doubt * (before @ self.options.next)
        return shares


def _seen(numbers: F32, before: F64) -> F32:
    """Observations of habits, float32 [W, NUMBERS + K]."""
    return np.ascontiguousarray(np.column_stack([numbers, before]), dtype=np.float32)


def cloned(known: Windows, count: int, seed: int = 0, shares: F64 | None = None) -> Clone:
    """Learn a team.

    Args:
        known: its windows.
        count: options.
        seed: decides the first clusters.
        shares: float64 [W, K], options of the windows; by default those that motion tells.
    """
    options = chained(known, count, seed)
    before, after, _, _ = options.told(known)
    after = after if shares is None else shares
    turned = np.column_stack([known.turned, np.zeros(len(after))])
    angles = np.stack([known.angles, np.zeros_like(known.angles)], axis=2)
    habits = fit_habits(_seen(known.numbers, before), after.argmax(axis=1), HABITS) if count > 1 else {}
    ahead = [regressed(known.vectors, known.ahead[:, place], after) for place in range(len(AHEAD))]
    return Clone(options, habits, np.array(ahead), regressed(known.vectors, known.told, after),
                 regressed(known.vectors, known.later, after), regressed(angles, turned, after))
