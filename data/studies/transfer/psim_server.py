"""The simulator pSim (0.2.4, Box2D), a sixtieth of a second at a time, for a program that asks for it.

It needs a Python with pSim. It answers as ``rsim_server`` does. pSim drives robots by speed and turning rate,
of which it has at most 0.75 m/s and 20 rad/s; a command of more than both together is scaled down, by pSim. A
robot's radius of wheels and the distance between them are pSim's.
"""

import contextlib
import json
import math
import sys

import numpy as np

with contextlib.redirect_stdout(sys.stderr):
    from pSim.modules.simulator import Simulator

robots = int(sys.argv[1])
simulator = Simulator()


def state() -> list[float]:
    """Ball and robots, in rSim's order and units."""
    ball = simulator.ball_body
    found = [ball.position.x, ball.position.y, 0.0, ball.linearVelocity.x, ball.linearVelocity.y]
    for robot in (*simulator.robots_agent, *simulator.robots_adversary):
        found += [robot.position.x, robot.position.y, math.degrees(robot.angle), robot.linearVelocity.x,
                  robot.linearVelocity.y, math.degrees(robot.angularVelocity)]
    return found


def place(ball: list[float], blue: list[list[float]], yellow: list[list[float]]) -> None:
    """Put all bodies somewhere; robots stand."""
    poses = [[(x, y, math.radians(theta)) for x, y, theta in team] for team in (blue, yellow)]
    simulator.world.ClearForces()
    simulator.reset_simulator(poses[0], tuple(ball[:2]), poses[1])
    simulator.ball_body.linearVelocity = tuple(ball[2:])


def step(wheels: list[list[float]]) -> None:
    """A sixtieth of a second, as ``pSim.vsss_base_env`` does it."""
    for row, (left, right) in enumerate(wheels):
        speed, turning = (left + right) / 2 * simulator.r, (right - left) * simulator.r / simulator.b
        action = np.array([speed / simulator.max_v, turning / simulator.max_w])
        drive = simulator.agent_step if row < robots else simulator.adversary_step
        drive(row % robots, action)
    simulator.world.Step(timeStep=1 / 60, velocityIterations=6, positionIterations=2)
    simulator.apply_force()


spread = [[-0.2 * i, 0.0, 0.0] for i in range(1, robots + 1)]
place([0.0] * 4, spread, [[-x, y, theta] for x, y, theta in spread])
print(
    json.dumps({"field_length": simulator.field_size[0], "field_width": simulator.field_size[1]}), flush=True)
for line in sys.stdin:
    asked = json.loads(line)
    if "place" in asked:
        place(*asked["place"])
    else:
        step(asked["wheels"])
    print(json.dumps(state()), flush=True)
