"""From degrees of conditions to one sequence of situations for each robot.

There are two stages, as in the paper (section 3.2.1). In :func:`advance` a rule's initial condition
marks its situation as possible, and its final condition, met within the time limit, completes it. In
:func:`resolve` priorities decide which occurrence gets which samples; the paper says only that 1 is
the highest priority.

Samples are those of one robot in play, counted k = 0, 1, …; an occurrence covers [k0, k1). Times are
int64 nanoseconds. A *piece* is a stretch of samples without interruption; nothing reaches across.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.pipeline.numbers.kernels import njit

Rows = npt.NDArray[np.void]

#: Tolerance of comparisons between times, because clocks are rounded.
CLOCK_NS = 1_000

#: Kinds of start, in the order of rules.Start.
ONSET, LATEST, WHILE = range(3)

#: A rule's state between blocks: the sample at which its initial condition last held, the sample at
#: which it set in (-1 for none), and the degree of the mark.
MARK = np.dtype([("held", np.int64), ("set_in", np.int64), ("degree", np.float64)])

#: One occurrence of a rule on samples [k0, k1); ``other`` is the other robot, -1 for none.
OCCURRENCE = np.dtype([
    ("rule", np.int64), ("other", np.int64), ("k0", np.int64), ("k1", np.int64), ("strength", np.float64),
])

#: One situation on samples [k0, k1); ``target`` is -1 for none; ``strength`` is NaN for a filled gap.
SITUATION = np.dtype([
    ("code", np.int64), ("target", np.int64), ("k0", np.int64), ("k1", np.int64), ("strength", np.float64),
])


#: One rule as the kernels read it: registers of its initial and final condition (the latter not used
#: for WHILE); ONSET, LATEST or WHILE; how long a mark holds (for WHILE, the longest situation); how long
#: the condition of WHILE must hold; how long a condition may fail within one stretch; whether only the
#: first ``limit_ns`` of a WHILE stretch count; and the rising edge of WHILE's term of playing time, whose
#: membership is ``rise * seconds + up``, in [0, 1].
RULE = np.dtype([
    ("initial", np.int64), ("final", np.int64), ("start", np.int64), ("limit_ns", np.int64),
    ("hold_ns", np.int64), ("lull_ns", np.int64), ("once", np.bool_),
    ("rise", np.float64), ("up", np.float64),
])


def nanoseconds(seconds: float) -> int:
    """Whole nanoseconds."""
    return round(seconds * 1e9)


class RobotSamples(NamedTuple):
    """The samples of one robot in play, k = 0, 1, … N - 1.

    Attributes:
        place: int64 [N], their places among the match's samples.
        t_ns: int64 [N], time of each.
        until_ns: int64 [N], end of each one's own interval.
        piece: int64 [N], number of the piece it belongs to.
        fresh: bool [N], whether a piece begins there.
    """

    place: I64
    t_ns: I64
    until_ns: I64
    piece: I64
    fresh: Bools

    @classmethod
    def of(cls, place: I64, t_ns: I64, fresh: Bools, times: I64, median_ns: I64) -> RobotSamples:
        """The samples of a robot, with their ends.

        A sample lasts until the next one of its piece. The last of a piece lasts for the median interval, at
        most until the match's next sample.

        Args:
            place: int64 [N], as above.
            t_ns: int64 [N], as above.
            fresh: bool [N], as above.
            times: int64 [T], times of the match's samples.
            median_ns: int64 [T], median interval where each of them is.
        """
        follows = np.append(times, np.iinfo(np.int64).max)[place + 1]
        until_ns = np.minimum(t_ns + median_ns[place], follows)
        goes_on = ~fresh[1:]
        until_ns[:-1][goes_on] = t_ns[1:][goes_on]
        return cls(place, t_ns, until_ns, np.cumsum(fresh), fresh)


def comes_back(place: I64, t_ns: I64, flicker_s: float) -> Bools:
    """Mask of samples 1 to N - 1: the robot was away for longer than ``flicker_s`` before, bool [N - 1]."""
    return (np.diff(place) > 1) & (np.diff(t_ns) > nanoseconds(flicker_s) + CLOCK_NS)


class Gaps(NamedTuple):
    """Settings of :func:`resolve`: acceptance of occurrences and filling of gaps.

    Attributes:
        least_share: least share of an occurrence that must be free.
        code: code of a filled gap.
        least_ns: shorter gaps stay empty.
        longest_ns: longer gaps are cut.
    """

    least_share: float
    code: int
    least_ns: int
    longest_ns: int


class Meanings(NamedTuple):
    """Codes, targets and longest durations of M occurrences.

    Attributes:
        code: int64 [M], of Table 1.
        target: int64 [M], equal for equal targets.
        longest_ns: int64 [M], how long situations of the code may last when merged.
        least_ns: int64 [M], for WHILE, the least duration of a part of it that counts; for others 0.
    """

    code: I64
    target: I64
    longest_ns: I64
    least_ns: I64


@njit(cache=True, nogil=True)
def _write(row: Any, rule: int, other: int, k0: int, k1: int, strength: float) -> None:
    """Fill one row of OCCURRENCE."""
    row.rule = rule
    row.other = other
    row.k0 = k0
    row.k1 = k1
    row.strength = strength


@njit(cache=True, nogil=True)
def _lasting(rule: Any, ns: int) -> float:
    """Membership of a playing time in the rule's term, or a longer one."""
    return float(max(0.0, min(1.0, rule.rise * ns * 1e-9 + rule.up)))


@njit(cache=True, nogil=True)
def advance(
    registers: F64, rules: Rows, t_ns: I64, fresh: Bools, fire_at: float, longest_ns: int, at: int, n: int,
    other: int, marks: Rows, found: Rows,
) -> int:
    """Number of occurrences found in one block of samples; updates ``marks`` and fills ``found``.

    At each sample the final condition is first checked against marks of earlier samples; then the
    initial condition may mark. A mark holds for ``limit_ns`` after its latest sample, and always for the
    next sample; completion deletes it. A stretch of a condition continues over lulls.

    An occurrence of a WHILE rule ends at the last sample at which the condition held. That sample
    belongs to the following situation (the kick after guiding the ball). At the end of a piece nothing
    follows, and the occurrence includes it.

    The strength of an occurrence is the lesser of two degrees: the initial condition's where it last
    held, and the final condition's where it was met. For WHILE they are the least degree at which the
    condition held, and the membership of the playing time for which it did.

    Args:
        registers: float64 [R, at least n], degrees for the samples at … at + n - 1.
        rules: RULE [V].
        t_ns: int64 [N], as in Samples.
        fresh: bool [N], as in Samples.
        fire_at: a condition holds from this degree on.
        longest_ns: no ONSET occurrence lasts longer; its start moves later instead.
        at: first sample of the block.
        n: samples in the block.
        other: index of the other robot that the rules are about, -1 for none.
        marks: MARK [V], the state between blocks.
        found: OCCURRENCE [at least V * (n + 1)].
    """
    count = 0
    for v in range(len(rules)):
        rule = rules[v]
        ic = registers[rule.initial, :n]
        held, set_in, degree = marks[v].held, marks[v].set_in, marks[v].degree
        if held < 0:
            any_holds = 0
            for j in range(n):
                any_holds |= ic[j] >= fire_at
            if any_holds == 0:
                continue
        if rule.start == WHILE:
            for j in range(n):
                k = at + j
                holds = ic[j] >= fire_at
                ends = holds and held < k - 1 and t_ns[k] - t_ns[held] > rule.lull_ns + CLOCK_NS
                if held >= 0 and (fresh[k] or ends):
                    if t_ns[held] - t_ns[set_in] >= rule.hold_ns - CLOCK_NS:
                        lasting = _lasting(rule, t_ns[held] - t_ns[set_in])
                        end = held + 1 if held == k - 1 else held
                        _write(found[count], v, other, set_in, end, min(degree, lasting))
                        count += 1
                    held = -1
                if holds:
                    if held < 0:
                        set_in, degree = k, ic[j]
                    held, degree = k, min(degree, ic[j])
        else:
            fc = registers[rule.final, :n]
            for j in range(n):
                k = at + j
                if fresh[k]:
                    held = -1
                if held >= 0 and fc[j] >= fire_at:
                    if held == k - 1 or t_ns[k] - t_ns[held] <= rule.limit_ns + CLOCK_NS:
                        k0 = held
                        if rule.start == ONSET:
                            k0 = set_in
                            while k0 < held and t_ns[k] - t_ns[k0] > longest_ns + CLOCK_NS:
                                k0 += 1
                        _write(found[count], v, other, k0, k, min(degree, fc[j]))
                        count += 1
                    held = -1
                if ic[j] >= fire_at:
                    if held < 0 or (held < k - 1 and t_ns[k] - t_ns[held] > rule.lull_ns + CLOCK_NS):
                        set_in = k
                    held, degree = k, ic[j]
        mark = marks[v]
        mark.held, mark.set_in, mark.degree = held, set_in, degree
    return count


@njit(cache=True, nogil=True)
def finish(rules: Rows, t_ns: I64, other: int, marks: Rows, found: Rows) -> int:
    """Complete the WHILE stretches that the last sample left open; arguments as for :func:`advance`."""
    count = 0
    for v in range(len(rules)):
        rule, held, set_in = rules[v], marks[v].held, marks[v].set_in
        if rule.start == WHILE and held >= 0 and t_ns[held] - t_ns[set_in] >= rule.hold_ns - CLOCK_NS:
            end = held + 1 if held == len(t_ns) - 1 else held
            lasting = _lasting(rule, t_ns[held] - t_ns[set_in])
            _write(found[count], v, other, set_in, end, min(marks[v].degree, lasting))
            count += 1
    return count


@njit(cache=True, nogil=True)
def _chunk_end(samples: RobotSamples, k0: int, k1: int, longest_ns: int) -> int:
    """End of the first chunk of [k0, k1), in (k0, k1]: the fewest and most even chunks within ``longest_ns``.

    [k0, k1) lies in one piece. A chunk of one sample may last longer than ``longest_ns``.
    """
    t_ns, until_ns = samples.t_ns, samples.until_ns
    lasts = until_ns[k1 - 1] - t_ns[k0]
    if lasts <= longest_ns + CLOCK_NS:
        return k1
    share = lasts / np.ceil((lasts - CLOCK_NS) / longest_ns)
    k = k0 + 1
    while k < k1 and until_ns[k] - t_ns[k0] <= share + CLOCK_NS:
        k += 1
    return k


@njit(cache=True, nogil=True)
def cut(found: Rows, rules: Rows, samples: RobotSamples, longest_ns: int) -> Rows:
    """The occurrences, WHILE stretches cut into chunks; of a rule that counts once only the first is kept.

    Args:
        found: OCCURRENCE [M].
        rules: RULE [V]; no chunk is longer than its rule's ``limit_ns``.
        samples: the robot's.
        longest_ns: no chunk of any rule is longer.

    Returns:
        OCCURRENCE [at least M].
    """
    whole = 0
    for i in range(len(found)):
        rule = rules[found[i].rule]
        chunked = rule.start == WHILE and not rule.once
        whole += found[i].k1 - found[i].k0 if chunked else 1
    out = np.empty(whole, dtype=OCCURRENCE)
    count = 0
    for i in range(len(found)):
        v, k0, k1 = found[i].rule, found[i].k0, found[i].k1
        rule = rules[v]
        while k0 < k1:
            end = k1
            if rule.start == WHILE and rule.once:
                end = k0 + 1
                while end < k1 and samples.t_ns[end] - samples.t_ns[k0] < rule.limit_ns - CLOCK_NS:
                    end += 1
                k1 = end
            elif rule.start == WHILE:
                end = _chunk_end(samples, k0, k1, min(rule.limit_ns, longest_ns))
            _write(out[count], v, found[i].other, k0, end, found[i].strength)
            count += 1
            k0 = end
    return out[:count]


@njit(cache=True, nogil=True)
def _fill(owner: I64, i: int, k0: int, k1: int, least_ns: int, samples: RobotSamples) -> None:
    """Give occurrence ``i`` each free run of [k0, k1) that lasts ``least_ns``, and all if all is free."""
    k = k0
    while k < k1:
        end = k
        while end < k1 and owner[end] < 0:
            end += 1
        all_free = k == k0 and end == k1
        if all_free or (end > k and samples.until_ns[end - 1] - samples.t_ns[k] >= least_ns - CLOCK_NS):
            owner[k:end] = i
        k = end + 1


@njit(cache=True, nogil=True)
def resolve(order: I64, found: Rows, meanings: Meanings, samples: RobotSamples, gaps: Gaps) -> Rows:
    """One sequence without overlaps: occurrences by priority, gaps filled, neighbours merged.

    An occurrence is accepted if its last sample is free, and enough of the samples up to it: two
    samples and ``least_share`` of its length (one sample, if it is one sample long). It then starts
    where that free run starts. One of WHILE gets every free run that lasts long enough instead, because
    its condition holds in any part of it. A gap of at least ``gaps.least_ns`` becomes ``gaps.code``; a
    shorter one stays empty. Neighbours of the same code and target are merged if together they last no
    longer than the code may; the merged strength is the lesser one.

    Args:
        order: int64 [M], occurrences from the highest priority to the lowest.
        found: OCCURRENCE [M].
        meanings: codes, targets and longest durations of ``found``.
        samples: the robot's.
        gaps: thresholds and times.

    Returns:
        SITUATION [S], in order of time.
    """
    t_ns, until_ns, piece = samples.t_ns, samples.until_ns, samples.piece
    n = len(t_ns)
    owner = np.empty(n, dtype=np.int64)
    owner[:] = -1
    for i in order:
        k0, k1 = found[i].k0, found[i].k1
        if meanings.least_ns[i] > 0:
            _fill(owner, i, k0, k1, meanings.least_ns[i], samples)
            continue
        free = k1
        while free > k0 and owner[free - 1] < 0:
            free -= 1
        if k1 - free >= min(max(2.0, gaps.least_share * (k1 - k0)), k1 - k0):
            owner[free:k1] = i
    out = np.empty(n, dtype=SITUATION)
    longest = np.empty(n, dtype=np.int64)
    count = 0
    k = 0
    while k < n:
        end = k + 1
        while end < n and owner[end] == owner[k] and piece[end] == piece[k]:
            end += 1
        i = owner[k]
        if i < 0:
            gap = until_ns[end - 1] - t_ns[k] >= gaps.least_ns - CLOCK_NS
            while gap and k < end:
                cut_at = _chunk_end(samples, k, end, gaps.longest_ns)
                row = out[count]
                row.code, row.target, row.k0, row.k1, row.strength = gaps.code, -1, k, cut_at, np.nan
                longest[count] = gaps.longest_ns
                count += 1
                k = cut_at
        else:
            code, target, longest_ns = meanings.code[i], meanings.target[i], meanings.longest_ns[i]
            last = out[count - 1]  # not looked at while count is 0
            if (
                count > 0 and last.k1 == k and last.code == code and last.target == target
                and piece[k - 1] == piece[k]
                and until_ns[end - 1] - t_ns[last.k0] <= min(longest[count - 1], longest_ns) + CLOCK_NS
            ):
                last.k1 = end
                last.strength = min(last.strength, found[i].strength)
            else:
                row = out[count]
                row.code, row.target, row.k0, row.k1, row.strength = code, target, k, end, found[i].strength
                longest[count] = longest_ns
                count += 1
        k = end
    return out[:count]
