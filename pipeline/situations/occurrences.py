"""From degrees of conditions to one sequence of situations a robot.

Two stages, as in the paper (section 3.2.1): a rule's initial condition marks it as possible, its final
condition, met within the time limit, completes it (:func:`advance`); then priorities decide which
occurrence has which samples (:func:`resolve`; the paper says only that 1 is the highest priority).

Samples are those of one robot in play, counted k = 0, 1, …; an occurrence covers [k0, k1). Times are
int64 nanoseconds. A *piece* is a stretch of samples that nothing interrupts; nothing reaches across.
"""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
I32 = npt.NDArray[np.int32]
I16 = npt.NDArray[np.int16]
Flags = npt.NDArray[np.bool_]

#: Clocks are rounded: a microsecond more or less does not count.
CLOCK_NS = 1_000

#: Kinds of start, as in rules.Start.
ONSET, LATEST, WHILE = range(3)

#: Columns of a mark: sample at which the initial condition last held, where it set in; -1 is none.
HELD, SET_IN = range(2)

#: Columns of an occurrence: rule, other robot (-1 none), k0, k1.
RULE, OTHER, K0, K1 = range(4)


@numba.njit(cache=True, nogil=True)
def advance(
    registers: F64, initial: I32, final: I32, start: I64, limit_ns: I64, hold_ns: I64, lull_ns: I64,
    longest_ns: int, fire_at: float, t_ns: I64, fresh: Flags, at: int, n: int, other: int,
    marks: I64, degrees: F64, found: I64, strengths: F64,
) -> int:
    """Take marks and limits of V rules over one block of samples.

    At each sample, first the final condition is checked for marks of earlier samples, then the initial
    condition may mark. A mark holds for ``limit_ns`` after its latest sample, but always for the next
    one; completing deletes it. Stretches of a condition bridge lulls of up to ``lull_ns``.

    An occurrence of a WHILE rule ends at the last sample at which the condition held, which then belongs
    to what follows (the kick after guiding the ball); at the end of a piece, where nothing follows, after it.

    The strength of an occurrence is the lesser of the initial condition's degree where it last held and
    the final condition's where it was met; of WHILE, the least degree at which the condition held.

    Args:
        registers: float64 [R, at least n], degrees for the samples at … at + n - 1.
        initial: int32 [V], registers of the initial conditions.
        final: int32 [V], registers of the final conditions; not used for WHILE.
        start: int64 [V], ONSET, LATEST or WHILE.
        limit_ns: int64 [V], how long a mark holds.
        hold_ns: int64 [V], how long WHILE must hold.
        lull_ns: int64 [V], how long a condition may fail within one stretch.
        longest_ns: no ONSET occurrence lasts longer, its start gives way.
        fire_at: a condition holds from this degree on.
        t_ns: int64 [N], time of each sample.
        fresh: bool [N], whether a piece begins there.
        at: first sample of the block.
        n: samples in the block.
        other: index of the other robot the rules are about, -1 if none.
        marks: int64 [V, 2], the state between blocks; updated.
        degrees: float64 [V], the degree of each mark; updated.
        found: int64 [at least V * (n + 1), 4], filled with occurrences (rule, other, k0, k1).
        strengths: float64, as long as ``found``.

    Returns:
        How many occurrences were filled in.
    """
    count = 0
    for v in range(len(initial)):
        ic = registers[initial[v], :n]
        held, set_in, degree = marks[v, HELD], marks[v, SET_IN], degrees[v]
        if held < 0:
            any_holds = 0
            for j in range(n):
                any_holds |= ic[j] >= fire_at
            if any_holds == 0:
                continue
        if start[v] == WHILE:
            for j in range(n):
                k = at + j
                holds = ic[j] >= fire_at
                ends = holds and held < k - 1 and t_ns[k] - t_ns[held] > lull_ns[v] + CLOCK_NS
                if held >= 0 and (fresh[k] or ends):
                    if t_ns[held] - t_ns[set_in] >= hold_ns[v] - CLOCK_NS:
                        found[count] = v, other, set_in, held + 1 if held == k - 1 else held
                        strengths[count] = degree
                        count += 1
                    held = -1
                if holds:
                    if held < 0:
                        set_in, degree = k, ic[j]
                    held, degree = k, min(degree, ic[j])
        else:
            fc = registers[final[v], :n]
            for j in range(n):
                k = at + j
                if fresh[k]:
                    held = -1
                if held >= 0 and fc[j] >= fire_at:
                    if held == k - 1 or t_ns[k] - t_ns[held] <= limit_ns[v] + CLOCK_NS:
                        k0 = held
                        if start[v] == ONSET:
                            k0 = set_in
                            while k0 < held and t_ns[k] - t_ns[k0] > longest_ns + CLOCK_NS:
                                k0 += 1
                        found[count] = v, other, k0, k
                        strengths[count] = min(degree, fc[j])
                        count += 1
                    held = -1
                if ic[j] >= fire_at:
                    if held < 0 or (held < k - 1 and t_ns[k] - t_ns[held] > lull_ns[v] + CLOCK_NS):
                        set_in = k
                    held, degree = k, ic[j]
        marks[v, HELD], marks[v, SET_IN], degrees[v] = held, set_in, degree
    return count


@numba.njit(cache=True, nogil=True)
def finish(
    start: I64, hold_ns: I64, t_ns: I64, other: int, marks: I64, degrees: F64, found: I64, strengths: F64
) -> int:
    """Complete the WHILE stretches that the last sample left open; arguments as for :func:`advance`."""
    count = 0
    for v in range(len(start)):
        held, set_in = marks[v, HELD], marks[v, SET_IN]
        if start[v] == WHILE and held >= 0 and t_ns[held] - t_ns[set_in] >= hold_ns[v] - CLOCK_NS:
            found[count] = v, other, set_in, held + 1 if held == len(t_ns) - 1 else held
            strengths[count] = degrees[v]
            count += 1
    return count


@numba.njit(cache=True, nogil=True)
def chunk_end(t_ns: I64, until_ns: I64, k0: int, k1: int, longest_ns: int) -> int:
    """End of the first chunk of [k0, k1): it is cut into as few and as even chunks as ``longest_ns`` allows.

    Args:
        t_ns: int64 [N], time of each sample.
        until_ns: int64 [N], where each sample's own interval ends.
        k0: start of the stretch, within one piece.
        k1: its end, exclusive.
        longest_ns: no chunk of more than one sample lasts longer.

    Returns:
        k in (k0, k1].
    """
    lasts = until_ns[k1 - 1] - t_ns[k0]
    if lasts <= longest_ns + CLOCK_NS:
        return k1
    share = lasts / np.ceil((lasts - CLOCK_NS) / longest_ns)
    k = k0 + 1
    while k < k1 and until_ns[k] - t_ns[k0] <= share + CLOCK_NS:
        k += 1
    return k


@numba.njit(cache=True, nogil=True)
def cut(
    found: I64, strengths: F64, start: I64, limit_ns: I64, hold_ns: I64, once: Flags, t_ns: I64, until_ns: I64
) -> tuple[I64, F64]:
    """Cut WHILE stretches into chunks of at most ``limit_ns``; of a rule that counts once keep the hold.

    Args:
        found: int64 [M, 4], occurrences as :func:`advance` fills them in.
        strengths: float64 [M], their strengths.
        start: int64 [V], as for :func:`advance`.
        limit_ns: int64 [V], the longest chunks.
        hold_ns: int64 [V], as for :func:`advance`.
        once: bool [V], whether only the first ``hold_ns`` of a stretch count.
        t_ns: as for :func:`chunk_end`.
        until_ns: as for :func:`chunk_end`.

    Returns:
        The occurrences and their strengths, in the same form.
    """
    whole = 0
    for i in range(len(found)):
        v = found[i, RULE]
        chunks = 1
        if start[v] == WHILE and not once[v]:
            chunks = found[i, K1] - found[i, K0]
        whole += chunks
    out, out_strengths = np.empty((whole, 4), dtype=np.int64), np.empty(whole)
    count = 0
    for i in range(len(found)):
        v, k0, k1 = found[i, RULE], found[i, K0], found[i, K1]
        while k0 < k1:
            end = k1
            if start[v] == WHILE and once[v]:
                end = k0 + 1
                while end < k1 and t_ns[end] - t_ns[k0] < hold_ns[v] - CLOCK_NS:
                    end += 1
                k1 = end
            elif start[v] == WHILE:
                end = chunk_end(t_ns, until_ns, k0, k1, limit_ns[v])
            out[count] = v, found[i, OTHER], k0, end
            out_strengths[count] = strengths[i]
            count += 1
            k0 = end
    return out[:count], out_strengths[:count]


@numba.njit(cache=True, nogil=True)
def resolve(
    order: I64, found: I64, strengths: F64, code: I64, target: I64, longest_ns: I64, t_ns: I64,
    until_ns: I64, piece: I64, share: float, gap_code: int, gap_least_ns: int, gap_longest_ns: int,
) -> tuple[I64, F64]:
    """One sequence without overlaps: paint by priority, fill the gaps, merge what abuts.

    An occurrence is accepted if its last sample is free and so is enough of what leads up to it: two
    samples and ``share`` of its length (one, if it is one sample long); it then starts where that free
    run starts. Gaps that last ``gap_least_ns`` become ``gap_code``; shorter ones stay empty. Neighbours
    of the same code and target are merged while together they last no longer than the code may; their
    strength is the lesser one.

    Args:
        order: int64 [M], occurrences from the highest priority to the lowest.
        found: int64 [M, 4], the occurrences (rule, other, k0, k1).
        strengths: float64 [M], theirs.
        code: int64 [M], theirs.
        target: int64 [M], theirs; equal for equal targets.
        longest_ns: int64 [M], how long their codes may last when merged.
        t_ns: as for :func:`chunk_end`.
        until_ns: as for :func:`chunk_end`.
        piece: int64 [N], number of the piece of each sample.
        share: least share of an occurrence that must be free.
        gap_code: the code of a gap.
        gap_least_ns: shorter gaps are dropped.
        gap_longest_ns: longer gaps are cut.

    Returns:
        int64 [S, 4] rows (code, target or -1, k0, k1), in order of time, and their strengths float64 [S],
        NaN for gaps.
    """
    n = len(t_ns)
    owner = np.full(n, -1, dtype=np.int64)
    for i in order:
        k0, k1 = found[i, K0], found[i, K1]
        free = k1
        while free > k0 and owner[free - 1] < 0:
            free -= 1
        if k1 - free >= min(max(2.0, share * (k1 - k0)), k1 - k0):
            owner[free:k1] = i
    rows, out = np.empty((n, 4), dtype=np.int64), np.empty(n)
    longest = np.empty(n, dtype=np.int64)
    count = 0
    k = 0
    while k < n:
        end = k + 1
        while end < n and owner[end] == owner[k] and piece[end] == piece[k]:
            end += 1
        i = owner[k]
        if i < 0:
            gap = until_ns[end - 1] - t_ns[k] >= gap_least_ns - CLOCK_NS
            while gap and k < end:
                cut_at = chunk_end(t_ns, until_ns, k, end, gap_longest_ns)
                rows[count] = gap_code, -1, k, cut_at
                out[count], longest[count] = np.nan, gap_longest_ns
                count += 1
                k = cut_at
        else:
            last = count - 1
            if (
                last >= 0 and rows[last, 3] == k and rows[last, 0] == code[i] and rows[last, 1] == target[i]
                and piece[k - 1] == piece[k]
                and until_ns[end - 1] - t_ns[rows[last, 2]] <= min(longest[last], longest_ns[i]) + CLOCK_NS
            ):
                rows[last, 3] = end
                out[last] = min(out[last], strengths[i])
            else:
                rows[count] = code[i], target[i], k, end
                out[count], longest[count] = strengths[i], longest_ns[i]
                count += 1
        k = end
    return rows[:count], out[:count]
