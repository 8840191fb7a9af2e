"""Forces of the floor on bodies in one step: wheels push robots, and the ball loses speed as it rolls.

A robot stands on two wheels on the axis through its centre, each with half its weight. A wheel's rim
follows the commanded speed as fast as its motor can. If rim and floor move differently, or if the robot
moves sideways, friction pushes as hard as needed to end that, within the friction ellipse of the wheel:
``(forward / (forward_grip load))² + (sideways / (sideways_grip load))² <= 1``. Friction answers motion, so
a push moves a standing robot for one step before the floor holds it. A robot that is pushed all the time,
even by less than its grip, creeps (at most 6.5 cm/s by one robot, in steps of 1/120 s).
"""

from __future__ import annotations

import math

import numpy as np

from pitchlore.pipeline.arena.physics.settings import GRAVITY, PhysicsSettings
from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

#: Columns of the forces: newtons and newton metres, in the frame of the pitch.
FX, FY, TORQUE = range(3)

# Entries of the constants: one array costs a tenth of the time of as many numbers in a call, and half of
# that of a record; two steps a frame would feel it.
(
    _STEP_S, _WHEEL_SPEED, _WHEEL_ACCELERATION, _HALF_AXLE, _MASS, _MOMENT, _FORWARD, _SIDEWAYS,
    _BALL_MASS, _ROLLING,
) = range(10)  # fmt: skip


def constants(settings: PhysicsSettings, moment: float) -> F64:
    """Constants of ``drive`` and ``roll``, float64 [10], SI units.

    Args:
        settings: settings of the arena.
        moment: a robot's moment of inertia, kg m².
    """
    load = settings.robot_mass * GRAVITY / 2
    return np.array(
        [
            1 / (settings.hz * settings.substeps), settings.wheel_speed, settings.wheel_acceleration,
            settings.axle / 2, settings.robot_mass, moment,
            settings.forward_grip * load, settings.sideways_grip * load, settings.ball_mass, settings.rolling,
        ],
        dtype=np.float64,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def drive(bodies: F64, wheels: F64, rims: F64, of: F64, forces: F64) -> bool:
    """The forces of the floor on all bodies for the next step; rims follow their commands.

    Args:
        bodies: float64 [1 + 2 N, 6], see ``pipeline.game.bodies``.
        wheels: float64 [2 N, 2], commanded left and right rim speeds, m/s.
        rims: float64 [2 N, 2], the speeds that rims have; changed.
        of: float64 [10], see ``constants``.
        forces: float64 [1 + 2 N, 3], written.

    Returns:
        False, and nothing is changed, if a command is missing or not a finite number.
    """
    if wheels.shape[0] != rims.shape[0] or wheels.shape[1] != rims.shape[1]:
        return False
    for robot in range(rims.shape[0]):
        if not math.isfinite(wheels[robot, 0] + wheels[robot, 1]):
            return False

    step_s = of[_STEP_S]
    speed = math.hypot(bodies[BALL, VX], bodies[BALL, VY])
    brake = 0.0
    if speed > 0.0:
        brake = -of[_BALL_MASS] * min(of[_ROLLING], speed / step_s) / speed
    forces[BALL, FX] = brake * bodies[BALL, VX]
    forces[BALL, FY] = brake * bodies[BALL, VY]
    forces[BALL, TORQUE] = 0.0

    top, change = of[_WHEEL_SPEED], of[_WHEEL_ACCELERATION] * step_s
    half_axle, mass = of[_HALF_AXLE], of[_MASS]
    for robot in range(rims.shape[0]):
        row = 1 + robot
        for wheel in range(2):
            wanted = min(max(wheels[robot, wheel], -top), top)
            rims[robot, wheel] += min(max(wanted - rims[robot, wheel], -change), change)
        # The robot has moved on when the forces act, and so has the direction of its wheels.
        heading = bodies[row, THETA] + bodies[row, OMEGA] * step_s
        c, s = math.cos(heading), math.sin(heading)
        forward = bodies[row, VX] * c + bodies[row, VY] * s
        sideways = bodies[row, VY] * c - bodies[row, VX] * s
        slip_left = rims[robot, 0] - forward + bodies[row, OMEGA] * half_axle
        slip_right = rims[robot, 1] - forward - bodies[row, OMEGA] * half_axle
        push = mass * (slip_left + slip_right) / 4
        twist = of[_MOMENT] * (slip_right - slip_left) / (4 * half_axle * half_axle)
        across = -mass * sideways / (2 * step_s)
        left, across_left = _gripped((push - twist) / step_s, across, of[_FORWARD], of[_SIDEWAYS])
        right, across_right = _gripped((push + twist) / step_s, across, of[_FORWARD], of[_SIDEWAYS])
        along, across = left + right, across_left + across_right
        forces[row, FX] = along * c - across * s
        forces[row, FY] = along * s + across * c
        forces[row, TORQUE] = half_axle * (right - left)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _gripped(along: float, across: float, most_along: float, most_across: float) -> tuple[float, float]:
    """The force that a wheel needs, shortened to the limit of its friction ellipse, newtons."""
    square = (along / most_along) ** 2 + (across / most_across) ** 2
    part = 1 / math.sqrt(square) if square > 1.0 else 1.0
    return along * part, across * part


@njit(cache=True, nogil=True, error_model="numpy")
def publish(state: F64, bodies: F64) -> None:
    """Copy pymunk's state into the bodies of the arena, with THETA in (-pi, pi].

    Args:
        state: float64 [at least 1 + 2 N, 6].
        bodies: float64 [1 + 2 N, 6], written.
    """
    for row in range(bodies.shape[0]):
        for column in range(bodies.shape[1]):
            bodies[row, column] = state[row, column]
        theta = state[row, THETA]
        if not -math.pi < theta <= math.pi:
            theta -= 2 * math.pi * math.ceil((theta - math.pi) / (2 * math.pi))
            bodies[row, THETA] = math.pi if theta <= -math.pi else theta


@njit(cache=True, nogil=True, error_model="numpy")
def roll(bodies: F64, of: F64, rims: F64) -> None:
    """Give rims the speeds at which the moving robots roll without slip.

    Args:
        bodies: float64 [1 + 2 N, 6].
        of: float64 [10], see ``constants``.
        rims: float64 [2 N, 2], written.
    """
    for robot in range(rims.shape[0]):
        row = 1 + robot
        c, s = math.cos(bodies[row, THETA]), math.sin(bodies[row, THETA])
        forward = bodies[row, VX] * c + bodies[row, VY] * s
        rims[robot, 0] = forward - bodies[row, OMEGA] * of[_HALF_AXLE]
        rims[robot, 1] = forward + bodies[row, OMEGA] * of[_HALF_AXLE]
