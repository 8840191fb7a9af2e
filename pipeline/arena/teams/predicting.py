"""Bodies as they will be: what a team with a late camera makes of its picture and of its own commands.

A picture is as old as the camera's latency. In that time a robot drives a robot's length and more. The
team knows the commands that it gave since, so it reckons its own robots ahead by them (dead reckoning).
The others and the ball go on at their last velocity.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, Records, X, Y, wrapped
from pitchlore.pipeline.game.tactics.geometry import clamp
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

#: Share of the difference between where a robot is seen and where it was reckoned to be that is believed.
_TRUST = 0.3
#: A robot that is seen so many of its radii from where it was reckoned to be was put there.
_PUT = 2.0


class Predictor(NamedTuple):
    """Memory of a team's own robots.

    Attributes:
        rims: float64 [N, 2], speeds that the wheels have by the commands, left and right, m/s.
        past: float64 [L, N, 2], those of the last L frames; the one before frame f is in row f % L.
        pose: float64 [N, 3], x, y and theta that each robot had at the moment of the picture; NaN at first.
    """

    rims: F64
    past: F64
    pose: F64

    @classmethod
    def of(cls, robots: int, frames: int) -> Predictor:
        """A predictor for so many robots that looks so many frames ahead, at least one."""
        return cls(np.zeros((robots, 2)), np.zeros((frames, robots, 2)), np.full((robots, 3), np.nan))

    def restart(self) -> None:
        """All robots stand."""
        self.rims[:] = self.past[:] = 0
        self.pose[:] = np.nan


@njit(cache=True, nogil=True, error_model="numpy")
def predict(
    frame: int, view: F64, wheels: F64, packed: Records, acceleration: float, by: Predictor, out: F64
) -> None:
    """Write the bodies as they are now, when the view is L frames old.

    Args:
        frame: its number; each call is for the next one, or follows a restart.
        view: float64 [1 + 2 N, 6], the team's.
        wheels: float64 [N, 2], the commands of the frame before, m/s.
        packed: measures, ``Measures.packed()``.
        acceleration: greatest change of a wheel's speed, m/s².
        by: memory of the predictor; written.
        out: float64 [1 + 2 N, 6], written.
    """
    m = packed[0]
    late, count = len(by.past), len(by.rims)
    slot = frame % late
    change = acceleration * m.frame_s
    ahead_s = late * m.frame_s
    for row in range(len(view)):
        for column in range(view.shape[1]):
            out[row, column] = view[row, column]
    for robot in range(count):
        row, pose = 1 + robot, by.pose[robot]
        # The picture is of the moment at which the oldest speeds of the memory began.
        _drive(pose, by.past[slot, robot], m)
        off = math.hypot(view[row, X] - pose[0], view[row, Y] - pose[1])
        if off <= _PUT * m.radius:
            pose[0] += _TRUST * (view[row, X] - pose[0])
            pose[1] += _TRUST * (view[row, Y] - pose[1])
            pose[2] += _TRUST * wrapped(view[row, THETA] - pose[2])
        else:  # put there, or seen for the first time: the distance is NaN then
            pose[0], pose[1], pose[2] = view[row, X], view[row, Y], view[row, THETA]
        for side in range(2):
            by.rims[robot, side] += clamp(wheels[robot, side] - by.rims[robot, side], change)
            by.past[slot, robot, side] = by.rims[robot, side]
        now = pose.copy()
        for back in range(late):
            _drive(now, by.past[(slot + 1 + back) % late, robot], m)
        left, right = by.rims[robot]
        speed = (left + right) / 2
        out[row, X], out[row, Y] = now[0], now[1]
        out[row, THETA] = wrapped(now[2])
        out[row, VX], out[row, VY] = speed * math.cos(now[2]), speed * math.sin(now[2])
        out[row, OMEGA] = (right - left) / m.axle
    for row in range(len(view)):
        if not 1 <= row <= count:
            out[row, X] += ahead_s * view[row, VX]
            out[row, Y] += ahead_s * view[row, VY]
            if row != BALL:
                out[row, THETA] = wrapped(view[row, THETA] + ahead_s * view[row, OMEGA])
        # Walls stop what rolls on; where the goals are open, to the depth of a robot.
        deep = m.goal_x + (2 * m.radius if abs(out[row, Y]) < m.half_goal else 0.0)
        out[row, X] = clamp(out[row, X], deep)
        out[row, Y] = clamp(out[row, Y], m.half_width)


@njit(cache=True, nogil=True, error_model="numpy")
def _drive(pose: F64, rims: F64, m: Measures) -> None:
    """Move a pose, float64 [3], by a frame at the speeds of its wheels, float64 [2]."""
    ahead, turn = (rims[0] + rims[1]) / 2 * m.frame_s, (rims[1] - rims[0]) / m.axle * m.frame_s
    pose[0] += ahead * math.cos(pose[2] + turn / 2)
    pose[1] += ahead * math.sin(pose[2] + turn / 2)
    pose[2] += turn
