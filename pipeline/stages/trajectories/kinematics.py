"""Numba kernels over the rows of bodies: implausible jumps, velocities, roles.

Rows are *body-contiguous* where a docstring says so: all rows of a body together, in order of time.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.numbers.arrays import F32, F64, I8, I32, I64, U8, Bools
from pitchlore.pipeline.numbers.kernels import njit

GOALKEEPER, MIDFIELD, STRIKER = range(3)
#: In place of a role, for a robot that the frame already has.
REPEATED = -1

# Recorded times are rounded to nanoseconds, often from float seconds. The tolerance keeps a sample on
# the window's edge inside.
_EDGE_NS = 1_000


@njit(cache=True, nogil=True)
def find_jumps(
    body: I32, part: I64, t_ns: I64, x: F32, y: F32,
    max_speed: float, slack: float, accept_ns: int,
) -> tuple[Bools, Bools]:
    """Masks of rows that the body cannot have reached, and of rows where it was put.

    A row is plausible if it is at most ``max_speed * dt + slack`` from the last plausible row of its
    part. Any other row is suspect, and the rows after it are compared with the old and the new place;
    rows nearer to the new place keep to it. Once the body has kept to the new place for ``accept_ns``, it
    was put there, and its rows since the jump are plausible. If it had been at its old place for less
    than that, those first rows were wrong and become suspect instead. A part starts afresh: its first
    row is plausible anywhere. The body's time at its place continues over the parts if it could have
    got there and was seen at most ``accept_ns`` before.

    Args:
        body: int32 [n], which body; body-contiguous.
        part: int64 [n], a stretch of a body; only rows of equal part are compared.
        t_ns: int64 [n], increasing within a body.
        x: float32 [n], metres.
        y: float32 [n], metres.
        max_speed: m/s.
        slack: error of vision and its clock, metres.
        accept_ns: time at a new place after which the body counts as put there.

    Returns:
        suspect: bool [n].
        moved: bool [n], true at the first row of a place where the body was put.
    """
    n = len(part)
    suspect, moved = np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
    suspect[:] = moved[:] = False
    begin = first = last = 0  # first row of the part, first row at the accepted place, last plausible row
    there = tip = -1  # first and last row at the new place
    for i in range(n):
        if i == 0 or body[i] != body[i - 1]:
            begin = first = last = i
            there = -1
            continue
        left = np.hypot(np.float64(x[i]) - x[last], np.float64(y[i]) - y[last])
        plausible = left <= max_speed * (t_ns[i] - t_ns[last]) * 1e-9 + slack
        if part[i] != part[i - 1]:
            if not plausible or t_ns[i] - t_ns[last] > accept_ns:
                first = i
            begin = last = i
            there = -1
            continue
        if there >= 0:
            along = np.hypot(np.float64(x[i]) - x[tip], np.float64(y[i]) - y[tip])
            keeps = along <= max_speed * (t_ns[i] - t_ns[tip]) * 1e-9 + slack
            if keeps and not (plausible and left < along):
                tip = i
                suspect[i] = True
                if t_ns[i] - t_ns[there] >= accept_ns:
                    if t_ns[last] - t_ns[first] >= accept_ns:
                        moved[there] = True
                    else:
                        suspect[begin:there] = True
                    suspect[there : i + 1] = False
                    first, last, there = there, i, -1
                continue
        if plausible:
            last = i
            there = -1
        else:
            suspect[i] = True
            there = tip = i
    return suspect, moved


@njit(cache=True, nogil=True)
def slopes(part: I64, t_ns: I64, values: F64, half_ns: int, least: int) -> F32:
    """Slope of the least-squares line through the samples around each sample, per second.

    The window of sample i is [t_i - half, t_i + half], both ends included, and has at least
    ``least // 2`` samples on either side. It ends where the part ends; if it would hold fewer than
    ``least`` samples there, it is extended on its other side. This is Savitzky-Golay smoothing of
    degree 1, for irregular times (Savitzky & Golay 1964, doi:10.1021/ac60214a047).

    Args:
        part: int64 [n], body-contiguous; the window stays within rows of equal part.
        t_ns: int64 [n], strictly increasing within a part.
        values: float64 [k, n], finite.
        half_ns: half the width of the window.
        least: least samples in a window; a shorter part is used whole.

    Returns:
        float32 [k, n]; NaN where the part has one sample only.
    """
    k, n = values.shape
    out = np.empty((k, n), dtype=np.float32)
    half = half_ns + _EDGE_NS
    start = 0
    while start < n:
        end = start + 1
        while end < n and part[end] == part[start]:
            end += 1
        low = high = start  # the window is rows low <= j < high
        for i in range(start, end):
            while t_ns[i] - t_ns[low] > half:
                low += 1
            while high < end and t_ns[high] - t_ns[i] <= half:
                high += 1
            a = max(start, min(low, i - least // 2))
            b = min(end, max(high, i + least // 2 + 1))
            if b - a < least:
                a, b = max(start, min(a, b - least)), min(end, max(b, a + least))
            if b - a < 2:
                for v in range(k):
                    out[v, i] = np.nan
                continue
            mean = 0.0
            for j in range(a, b):
                mean += (t_ns[j] - t_ns[i]) * 1e-9
            mean /= b - a
            spread = 0.0
            for j in range(a, b):
                spread += ((t_ns[j] - t_ns[i]) * 1e-9 - mean) ** 2
            for v in range(k):
                moment = 0.0
                for j in range(a, b):
                    moment += ((t_ns[j] - t_ns[i]) * 1e-9 - mean) * (values[v, j] - values[v, i])
                out[v, i] = moment / spread
        start = end
    return out


@njit(cache=True, nogil=True)
def assign_roles(
    frame: I64, team: U8, robot: npt.NDArray[np.uint16], x: F32, y: F32, goal_x: float
) -> I8:
    """Role of each robot in its team and frame, by distance to its own goal's centre.

    The nearest robot is the goalkeeper (paper, section 4), the nearer ``(n - 1) // 2`` of the others are
    midfield, the rest strikers; the lower number wins ties. Home's own goal is at -x.

    Args:
        frame: int64 [n], non-decreasing.
        team: uint8 [n], HOME or AWAY.
        robot: uint16 [n].
        x: float32 [n], metres, home attacks +x.
        y: float32 [n], metres.
        goal_x: distance of the goal lines from the centre, metres.

    Returns:
        int8 [n]: GOALKEEPER, MIDFIELD or STRIKER; REPEATED for a robot that the frame already has.
    """
    n = len(frame)
    role = np.empty(n, dtype=np.int8)
    distance = np.empty(n, dtype=np.float64)
    start = 0
    while start < n:
        end = start + 1
        while end < n and frame[end] == frame[start]:
            end += 1
        for i in range(start, end):
            own = -goal_x if team[i] == 0 else goal_x
            distance[i] = (x[i] - own) ** 2 + np.float64(y[i]) ** 2
            role[i] = GOALKEEPER
            for j in range(start, i):
                if team[j] == team[i] and robot[j] == robot[i]:
                    role[i] = REPEATED
        for i in range(start, end):
            if role[i] == REPEATED:
                continue
            rank = 0
            mates = 0
            for j in range(start, end):
                if team[j] != team[i] or role[j] == REPEATED or j == i:
                    continue
                mates += 1
                nearer = distance[j] < distance[i] or (distance[j] == distance[i] and robot[j] < robot[i])
                rank += int(nearer)
            if rank > 0:
                role[i] = MIDFIELD if rank <= mates // 2 else STRIKER
        start = end
    return role
