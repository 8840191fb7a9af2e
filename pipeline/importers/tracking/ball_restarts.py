"""Restarts found from the ball, where no state of the game tells them.

The ball is put elsewhere from one sample to the next, and lies still there. On a mark of the league's rules
this is a penalty, a free ball or a goal kick; elsewhere it counts only if the robots were put elsewhere, too.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from pitchlore.pipeline.game.pitch import MARKINGS, PITCHES, SCALES, Kind, Pitch
from pitchlore.pipeline.matches.frame import Frames
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools

#: Kinds of restarts that have marks, as schema Restarts names them.
Marked = Literal["penalty", "goal kick", "free ball"]

#: Distance from the centre within which the ball was put back there, as a share of the pitch's length.
CENTRE = 0.05
#: Samples are missing where two are so many times as far apart as is usual.
MISSING = 2.5
#: Time without a sample of the ball that ends what was seen of it, s.
_GAP_S = 0.5
#: A ball that was not seen to be put to the centre lies still there before a kick-off: for how long, s, and
#: how far it may move meanwhile, as a share of the pitch's length.
_STILL_S, _STILL = 0.5, 0.01
#: A ball that is at most so far from its place lies there, as a share of the pitch's length.
_THERE = 0.02
#: How long the ball lies where it was put together with the robots, and where it alone was, s.
LIES_S = (0.1, 0.5)
#: A ball that was at a place so short a time before came back to it, s.
_BACK_S = 2.0
#: Robots that are put again so soon, round a ball that lies where it was put, belong to the same restart, s.
_AGAIN_S = 3.0
#: Longest time for which it is looked how a ball leaves its place, s.
_LEAVES_S = 60.0
#: A robot that was put elsewhere moved farther from one sample to the next, as a share of the pitch's length.
_PUT = 0.05


class Ball(NamedTuple):
    """The ball where it was seen, at rising times.

    Attributes:
        t_ns: int64 [S].
        x, y: float64 [S], metres.
        stopped: bool [S], whether the states of the game say that play is stopped.
        line_ups: int64 [S], how often the robots were put elsewhere up to the sample (:func:`line_ups`).
    """

    t_ns: I64
    x: F64
    y: F64
    stopped: Bools
    line_ups: I64


class BallRestart(NamedTuple):
    """A restart found from the ball.

    Attributes:
        t_ns: time of the first sample at the place where the ball was put.
        kind: None where the place is no mark.
        end: +1 if that place is in the half at +x, else -1.
        lined_up: whether the robots were put elsewhere with the ball.
    """

    t_ns: int
    kind: Marked | None
    end: int
    lined_up: bool


def line_ups(frames: Frames, order: I64, pitch: Pitch) -> I64:
    """Count of the times at which the robots were put elsewhere, up to each frame, int64 [F].

    They were where at least half of those that are seen in two frames, and at least two, moved farther from
    one to the next than robots drive.

    Args:
        frames: samples of a match.
        order: int64 [F], the frames in order of time.
        pitch: pitch of the match.
    """
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    robots, at = frames.robots, rank[frames.robot_frames()]
    rows = np.argsort(at, kind="stable")
    # 16 bits, as they are sorted fast: ids end at 32767
    body = (robots["team"].astype(np.uint16) << 15 | robots["id"])[rows]
    by_body = np.argsort(body, kind="stable")
    rows, body = rows[by_body], body[by_body]
    at = at[rows]
    time_s = np.diff(frames.t_ns[order][at]) / 1e9
    way = np.hypot(np.diff(robots["x"][rows]), np.diff(robots["y"][rows]))
    pair = (np.diff(body) == 0) & (np.diff(at) == 1)
    far = pair & (way > np.maximum(_PUT * pitch.length, SCALES[pitch.kind].max_robot_speed * time_s))
    seen, put = (np.bincount(at[1:][mask], minlength=len(order)) for mask in (pair, far))
    return np.cumsum((put >= 2) & (2 * put >= seen)).astype(np.int64)


def ball_restarts(ball: Ball, pitch: Pitch, lies_s: tuple[float, float] = LIES_S) -> list[BallRestart]:
    """Restarts found from the ball, in order of time; kick-offs are none of them.

    The ball was put where it moved farther from one sample to the next than it can roll. If the robots were
    put, too, it lies still there; on a mark of the rules it need not have moved then. If not, it lies on a
    mark for longer. It did not come back to its place, and it leaves it as a ball rolls. A ball that is on a
    mark when the robots were put may have been there before, and may leave it when they are put again.

    Args:
        ball: where it was seen.
        pitch: pitch of the match; its middle is (0, 0).
        lies_s: least time for which it lies there if the robots were put, too, and if not, s.
    """
    if len(ball.t_ns) < 2:
        return []
    step_s = np.diff(ball.t_ns) / 1e9
    fastest = SCALES[pitch.kind].max_ball_speed
    jumped = _ways(ball) > np.maximum(2 * CENTRE * pitch.length, fastest * step_s)
    lined = np.diff(ball.line_ups) > 0
    cuts = cuts_of(ball, pitch)
    found: list[BallRestart] = []
    last = 0
    for at in (1 + np.flatnonzero(jumped | lined)).tolist():
        kind, x, y = _mark(pitch, float(ball.x[at]), float(ball.y[at]))
        lined_up = bool(lined[at - 1])
        if np.hypot(x, y) <= CENTRE * pitch.length or (kind is None and not (lined_up and jumped[at - 1])):
            continue
        since, lain, until = np.searchsorted(ball.t_ns, ball.t_ns[at] + np.round(1e9 * np.array(
            [-_BACK_S, lies_s[not lined_up], _LEAVES_S])).astype(np.int64)).tolist()
        off = np.hypot(ball.x[since:until] - x, ball.y[since:until] - y)
        away = off[at - since:] > _THERE * pitch.length
        leaves = at + int(np.argmax(away)) if away.any() else until
        if leaves <= lain or cuts[at + 1:lain + 1].any():
            continue
        sure = lined_up and kind is not None
        if not sure and (off[:at - since] <= 2 * CENTRE * pitch.length).any():
            continue
        if leaves < until and cuts[leaves] and not (sure and lined[leaves - 1]):
            continue
        restart = BallRestart(int(ball.t_ns[at]), kind, int(np.sign(x)) or 1, lined_up)
        if found and at < last and restart.t_ns - found[-1].t_ns <= round(_AGAIN_S * 1e9):
            found.pop()
        found.append(restart)
        last = leaves
    return found


def _mark(pitch: Pitch, x: float, y: float) -> tuple[Marked | None, float, float]:
    """Kind and place of the mark at a place of the ball; None and that place if there is none."""
    for kind, mark_x, mark_y in _marks(pitch):
        if np.hypot(abs(x) - mark_x, abs(y) - mark_y) <= _THERE * pitch.length:
            return kind, float(np.copysign(mark_x, x)), float(np.copysign(mark_y, y))
    return None, x, y


def _marks(pitch: Pitch) -> list[tuple[Marked, float, float]]:
    """Kinds of restarts with their marks in one quarter of the pitch; none in leagues without such marks."""
    if pitch.kind != Kind.VSSS:
        return []
    usual, lines = PITCHES[pitch.kind], MARKINGS[pitch.kind]
    (x, _), (_, y), *_ = lines.marks
    depth, width = lines.areas[0]
    along, across = pitch.length / usual.length, pitch.width / usual.width
    return [
        ("penalty", x * along, 0.0), ("free ball", x * along, y * across),
        ("goal kick", pitch.goal_x - depth * along, width / 2 * pitch.goal_width / usual.goal_width),
    ]


def _ways(ball: Ball) -> F64:
    """Distance from each sample to the next, float64 [S - 1], metres."""
    way: F64 = np.hypot(np.diff(ball.x), np.diff(ball.y))
    return way


def cuts_of(ball: Ball, pitch: Pitch) -> Bools:
    """Mask of samples to which the ball was not seen to move from the one before, bool [S].

    Where samples are missing, a tenth of the pitch is too far: they may have been taken out, with all that
    went on meanwhile.
    """
    step_s = np.diff(ball.t_ns) / 1e9
    least, fastest = 2 * CENTRE * pitch.length, SCALES[pitch.kind].max_ball_speed
    missing = step_s > MISSING * np.median(step_s)
    far = _ways(ball) > np.where(missing, least, np.maximum(least, fastest * step_s))
    return np.concatenate(([True], (step_s > _GAP_S) | far))


def put_back(ball: Ball, pitch: Pitch, cuts: Bools) -> I64:
    """Samples at which the ball is at the centre and was put there, or lies still there, int64 [K].

    Args:
        ball: where it was seen.
        pitch: pitch of the match.
        cuts: bool [S], from :func:`cuts_of`.
    """
    near = np.hypot(ball.x, ball.y) <= CENTRE * pitch.length
    later = np.searchsorted(ball.t_ns, ball.t_ns + round(_STILL_S * 1e9))
    later = np.minimum(later, len(cuts) - 1)
    stretch = np.cumsum(cuts)
    still = np.hypot(ball.x[later] - ball.x, ball.y[later] - ball.y) <= _STILL * pitch.length
    still &= (ball.t_ns[later] - ball.t_ns >= round(_STILL_S * 1e9)) & (stretch[later] == stretch)
    return np.flatnonzero(near & (cuts | still)).astype(np.int64)
