"""A pitch simple enough to be checked by eye: square unicycle robots, a ball that is pushed out of them.

It stands in for the arena where a player only needs something that answers to its wheels.
"""

# isort: off
from pitchlore import pipeline  # noqa: F401 - before numba: it says where numba keeps its cache
# isort: on

import math

import numpy as np
from numba import njit

from pitchlore.pipeline.game.bodies import OMEGA, THETA, VX, VY, X, Y

FRAME_S = 1 / 60
SUBSTEPS = 4
HALF = 0.0375
BALL_RADIUS = 0.02135
AXLE = 0.071
ACCELERATION = 6.0
ROLLING = 0.3  # m/s² that a rolling ball loses
WALL_BOUNCE, ROBOT_BOUNCE = 0.6, 0.4


@njit(cache=True)
def step(bodies, wheels, speeds, goal_x, half_width, half_goal):
    """Advance by a frame; wheels [2 N, 2] are wanted, speeds [2 N, 2] are had. Returns +1, -1 for a goal at ±x."""
    dt = FRAME_S / SUBSTEPS
    robots = bodies.shape[0] - 1
    for substep in range(SUBSTEPS):
        for k in range(robots):
            i = k if substep % 2 == 0 else robots - 1 - k  # nobody's side is always first
            row = bodies[i + 1]
            for w in range(2):
                change = wheels[i, w] - speeds[i, w]
                speeds[i, w] += min(max(change, -ACCELERATION * dt), ACCELERATION * dt)
            v, omega = (speeds[i, 0] + speeds[i, 1]) / 2, (speeds[i, 1] - speeds[i, 0]) / AXLE
            row[THETA] = (row[THETA] + omega * dt + math.pi) % (2 * math.pi) - math.pi
            old_x, old_y = row[X], row[Y]
            row[X] += v * math.cos(row[THETA]) * dt
            row[Y] += v * math.sin(row[THETA]) * dt
            row[OMEGA] = omega
            for j in range(robots):
                dx, dy = row[X] - bodies[j + 1, X], row[Y] - bodies[j + 1, Y]
                d = math.sqrt(dx * dx + dy * dy)
                if j != i and 0 < d < 2 * HALF:
                    push = (2 * HALF - d) / d / 2
                    row[X] += dx * push
                    row[Y] += dy * push
                    bodies[j + 1, X] -= dx * push
                    bodies[j + 1, Y] -= dy * push
            row[X] = min(max(row[X], -goal_x + HALF), goal_x - HALF)
            row[Y] = min(max(row[Y], -half_width + HALF), half_width - HALF)
            row[VX], row[VY] = (row[X] - old_x) / dt, (row[Y] - old_y) / dt
        ball = bodies[0]
        speed = math.hypot(ball[VX], ball[VY])
        if speed > 0:
            kept = max(speed - ROLLING * dt, 0.0) / speed
            ball[VX] *= kept
            ball[VY] *= kept
        ball[X] += ball[VX] * dt
        ball[Y] += ball[VY] * dt
        for k in range(robots):
            i = k if substep % 2 == 0 else robots - 1 - k
            row = bodies[i + 1]
            cos, sin = math.cos(row[THETA]), math.sin(row[THETA])
            dx, dy = ball[X] - row[X], ball[Y] - row[Y]
            ahead, aside = cos * dx + sin * dy, cos * dy - sin * dx
            near_a, near_b = min(max(ahead, -HALF), HALF), min(max(aside, -HALF), HALF)
            na, nb = ahead - near_a, aside - near_b
            d = math.hypot(na, nb)
            if d >= BALL_RADIUS:
                continue
            if d == 0.0:
                na, nb, d = (math.copysign(1.0, ahead), 0.0, 1.0) if abs(ahead) > abs(aside) else (0.0, math.copysign(1.0, aside), 1.0)
                depth = BALL_RADIUS + HALF - max(abs(ahead), abs(aside))
            else:
                depth = BALL_RADIUS - d
            na, nb = na / d, nb / d
            nx, ny = cos * na - sin * nb, sin * na + cos * nb
            ball[X] += nx * depth
            ball[Y] += ny * depth
            px, py = cos * near_a - sin * near_b, sin * near_a + cos * near_b
            gap = (ball[VX] - row[VX] + row[OMEGA] * py) * nx + (ball[VY] - row[VY] - row[OMEGA] * px) * ny
            if gap < 0:
                bounce = 1 + (ROBOT_BOUNCE if gap < -0.2 else 0.0)
                ball[VX] -= bounce * gap * nx
                ball[VY] -= bounce * gap * ny
        if abs(ball[Y]) > half_width - BALL_RADIUS:
            ball[Y] = math.copysign(half_width - BALL_RADIUS, ball[Y])
            ball[VY] = -WALL_BOUNCE * ball[VY]
        if abs(ball[X]) > goal_x - BALL_RADIUS:
            if abs(ball[Y]) < half_goal:
                if abs(ball[X]) > goal_x:
                    return 1 if ball[X] > 0 else -1
            else:
                ball[X] = math.copysign(goal_x - BALL_RADIUS, ball[X])
                ball[VX] = -WALL_BOUNCE * ball[VX]
    return 0


def kick_off(robots, rng):
    """Bodies [1 + 2 N, 6] with the ball near the centre and each team in its half."""
    bodies = np.zeros((1 + 2 * robots, 6))
    bodies[0, :2] = rng.normal(0, 0.01, 2)
    for side in (0, 1):
        x = [-0.68, -0.35, -0.2][:robots]
        y = [0.0, 0.2, -0.05][:robots]
        rows = slice(1 + side * robots, 1 + (side + 1) * robots)
        sign = 1 - 2 * side
        bodies[rows, X] = sign * (np.array(x) + rng.normal(0, 0.01, robots))
        bodies[rows, Y] = sign * (np.array(y) + rng.normal(0, 0.01, robots))
        bodies[rows, THETA] = 0.0 if side == 0 else math.pi
    return bodies
