"""Direction in which the home team attacks, inferred from where the robots stand."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

import numpy as np

from pitchlore.pipeline.matches.frame import Frames, Period
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.schemas import AWAY, HOME

Sign = Literal[1, -1]

#: Least strength of a period's vote; a weaker one may be chance.
WEAK = 0.2
#: Least strength of the votes on both sides of a change of sides without a half-time event.
CLEAR = 0.5
#: Least share of the match on either side of it.
LEAST_SHARE = 0.1
#: Longest time for which a sample counts, ns; it counts until the next one.
_LONGEST_NS = 500_000_000


def infer_periods(
    frames: Frames, boundaries: Sequence[int], first: Sign | None = None, told: Sequence[Sign | None] = ()
) -> tuple[tuple[Period, ...], list[Flaw]]:
    """Periods with the direction in which home attacks, from where the robots stand.

    Each sample has three votes: which team's mean x is nearer to which goal, and which team has the
    outermost robot at either end (a goalkeeper stays at its goal, however the match goes). A period's
    vote is the mean over its time. Without half-time events a single change of sides is looked for, and
    accepted only if the votes before and after it are clear.

    Args:
        frames: the samples.
        boundaries: times of the half-time events, ns; those outside the match are ignored.
        first: direction of the first period, +1 or -1; None: it is inferred.
        told: directions of the periods as the source tells them, which a clear vote may contradict.

    Returns:
        The periods, consecutive and covering all samples, and a flaw for each inferred one, and for each told
        one that is contradicted. Where the vote is weaker than ``WEAK`` the direction is +x.
    """
    if not len(frames):
        return (), []
    order = np.argsort(frames.t_ns, kind="stable")
    t_ns = frames.t_ns[order]
    vote = votes_of(frames)[order]
    # at least a nanosecond, so that a match of one sample has a vote
    weight = np.clip(np.diff(t_ns, append=t_ns[-1]), 1, _LONGEST_NS).astype(np.float64)
    start, end = int(t_ns[0]), int(t_ns[-1]) + 1
    cuts = sorted({at for at in boundaries if start < at < end})
    if not cuts:
        change = _change(vote, weight)
        cuts = [] if change is None else [int(t_ns[change])]
    edges = [start, *cuts, end]
    periods = []
    flaws = []
    for index, (low, high) in enumerate(pairwise(edges)):
        inside = (t_ns >= low) & (t_ns < high)
        # a period between two half-times may have no sample
        strength = float(np.average(vote[inside], weights=weight[inside])) if inside.any() else 0.0
        known = first if index == 0 and first is not None else told[index] if index < len(told) else None
        guess: Sign = -1 if strength <= -WEAK else 1
        period = Period(start_ns=low, end_ns=high, home_attacks=known or guess, inferred=known is None)
        periods.append(period)
        if period.inferred:
            flaws.append(_flaw(period, strength, int(inside.sum())))
        elif index < len(told) and strength * period.home_attacks <= -CLEAR:
            note = (f"the source tells that home attacks {'+x' if period.home_attacks > 0 else '-x'}, and is "
                    f"believed, but the vote of the bodies is {strength:+.2f}")
            flaws.append(Flaw("direction inferred", note, max(int(inside.sum()), 1), low, high))
    return tuple(periods), flaws


def unsure(periods: Sequence[Period], flaws: Sequence[Flaw]) -> list[tuple[int, int]]:
    """Stretches [start, end) of the periods whose direction is not known, ns, by the flaws of the periods."""
    unknown = {flaw.start_ns for flaw in flaws if flaw.flaw == "direction unknown"}
    return [(period.start_ns, period.end_ns) for period in periods if period.start_ns in unknown]


def _flaw(period: Period, vote: float, samples: int) -> Flaw:
    """Flaw of an inferred period; ``vote`` is in [-1, 1], positive if home seems to attack +x."""
    if abs(vote) < WEAK:
        flaw, so = "direction unknown", "too weak: home is taken to attack +x"
    else:
        flaw, so = "direction inferred", f"so home attacks {'+x' if period.home_attacks > 0 else '-x'}"
    note = f"vote of the bodies {vote:+.2f}, {so}"
    return Flaw(flaw, note, max(samples, 1), period.start_ns, period.end_ns)


def votes_of(frames: Frames) -> F64:
    """Mean of each sample's three votes, float64 [F] in [-1, 1]; 0 where a team is not seen.

    It is positive where home seems to attack +x. Each vote is -1, 0 or 1.
    """
    return np.concatenate([np.empty(0), *map(_votes, frames.parts())])


def _votes(frames: Frames) -> F64:
    """The mean votes of a part of a match."""
    count = len(frames)
    frame_of = frames.robot_frames()
    x = frames.robots["x"].astype(np.float64)
    low = np.full((2, count), np.inf)
    high = np.full((2, count), -np.inf)
    mean = np.zeros((2, count))
    for team in (HOME, AWAY):
        mine = (frames.robots["team"] == team) & np.isfinite(x)
        seen = np.bincount(frame_of[mine], minlength=count)
        total = np.bincount(frame_of[mine], weights=x[mine], minlength=count)
        mean[team] = total / np.maximum(seen, 1)
        np.minimum.at(low[team], frame_of[mine], x[mine])
        np.maximum.at(high[team], frame_of[mine], x[mine])
    both = np.isfinite(low).all(axis=0)
    # outermost robot at either end: +1 if it is home's at the -x end, away's at the +x end
    west = np.sign(np.where(both, low[AWAY], 0) - np.where(both, low[HOME], 0))
    east = np.sign(np.where(both, high[AWAY], 0) - np.where(both, high[HOME], 0))
    middle = np.sign(mean[AWAY] - mean[HOME])
    result: F64 = np.where(both, (middle + west + east) / 3, 0.0)
    return result


def _change(vote: F64, weight: F64) -> int | None:
    """Index of the first sample after the change of sides, None if there is clearly none.

    It is the cut with the largest difference between the votes before and after it.
    """
    votes = np.cumsum(vote * weight)
    time = np.cumsum(weight)
    last = int(np.argmax(np.abs(2 * votes - votes[-1])))
    rest = time[-1] - time[last]
    if min(time[last], rest) < LEAST_SHARE * time[-1]:
        return None
    before = votes[last] / time[last]
    after = (votes[-1] - votes[last]) / rest
    if before * after >= 0 or min(abs(before), abs(after)) < CLEAR:
        return None
    return last + 1
