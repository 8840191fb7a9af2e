"""Scenes for players: made by hand, of any kind, and legal ones in which a situation may begin, with what follows."""

import math

import numpy as np
import polars as pl
from hypothesis import strategies as st
from support.scenes import rows_of

from pitchlore.pipeline.arena.physics.arena import Arena
from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.executors.actions import ACTION, LIMIT_S, VERB
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.game.tactics.splitmix import seeded
from pitchlore.pipeline.stages.situations import conditions, signals
from pitchlore.pipeline.stages.situations.rulebook import compiled
from pitchlore.pipeline.stages.situations.rules import RULES, Target
from pitchlore.schemas import ROLES

VSSS = PITCHES[Kind.VSSS]
FRAME_S = 1 / 60
M = Measures.of(VSSS, top=1.2, axle=0.071, acceleration=6.0, frame_s=FRAME_S)
ROBOTS = 3
# Codes whose initial condition is to have the ball; the one whose wheels are drawn anew with every action.
HAVING = (1, 11, 21, 22, 23, 33)
BY_CHANCE = 194
#: The codes that can be executed.
CODES = tuple(np.flatnonzero(VERB >= 0).tolist())


def view_of(*robots, ball=(0.0, 0.0, 0.0, 0.0), count=ROBOTS):
    """A view: own robots as (x, y, theta), the rest at the left wall, the ball as (x, y, vx, vy)."""
    view = np.zeros((1 + 2 * count, 6))
    view[BALL, [X, Y, VX, VY]] = ball
    for row in range(1, 1 + 2 * count):
        view[row, :3] = (0.1 * row - 0.1, 0.60, 0.0)
    for row, pose in robots[0].items() if robots and isinstance(robots[0], dict) else enumerate(robots, start=1):
        view[row, :3] = pose
    return view


def mirrored(view):
    """The same, seen in a mirror along the pitch."""
    other = view.copy()
    other[:, [Y, THETA, VY, OMEGA]] *= -1
    return other


def splitmix(seed=0):
    return seeded(np.random.default_rng(seed))


@st.composite
def views(draw, count=None, ties=True):
    """Any view, also an illegal one: bodies may overlap, leave the pitch or be in the same place."""
    robots = draw(st.integers(1, 4)) if count is None else count
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    view = np.empty((1 + 2 * robots, 6))
    size = draw(st.sampled_from([0.05, 0.9]))
    view[:, :2] = rng.uniform(-size, size, (len(view), 2))
    view[:, THETA] = rng.uniform(-math.pi, math.pi, len(view))
    view[:, VX:] = rng.normal(0, 1, (len(view), 3)) * (rng.random((len(view), 1)) < 0.7)
    if ties and draw(st.booleans()):
        view[:, :2] = np.round(view[:, :2], 1)
    return view


def scenes(rng, count):
    """Up to ``count`` scenes [K, 7, 6] without overlaps; the ball is mostly near the robot of row 1, often before it."""
    b = np.zeros((count, 1 + 2 * ROBOTS, 6))
    b[:, 1:, X] = rng.uniform(-0.7, 0.7, (count, 2 * ROBOTS))
    b[:, 1:, Y] = rng.uniform(-0.6, 0.6, (count, 2 * ROBOTS))
    b[:, 1:, THETA] = rng.uniform(-math.pi, math.pi, (count, 2 * ROBOTS))
    speed = rng.uniform(-0.8, 0.8, (count, 2 * ROBOTS)) * (rng.random((count, 2 * ROBOTS)) < 0.8)
    b[:, 1:, VX], b[:, 1:, VY] = speed * np.cos(b[:, 1:, THETA]), speed * np.sin(b[:, 1:, THETA])
    distance = np.where(rng.random(count) < 0.3, rng.uniform(0.062, 0.085, count), rng.uniform(0.06, 1.0, count))
    before = rng.random(count) < 0.5
    bearing = np.where(before, b[:, 1, THETA] + rng.normal(0, 0.2, count), rng.uniform(-math.pi, math.pi, count))
    b[:, 0, X], b[:, 0, Y] = b[:, 1, X] + distance * np.cos(bearing), b[:, 1, Y] + distance * np.sin(bearing)
    speed, course = rng.uniform(0, 1.2, count) * (rng.random(count) < 0.7), rng.uniform(-math.pi, math.pi, count)
    b[:, 0, VX], b[:, 0, VY] = speed * np.cos(course), speed * np.sin(course)
    together = rng.random(count) < 0.2
    b[together, 0, VX : VY + 1] = b[together, 1, VX : VY + 1]
    legal = (np.abs(b[:, 0, X]) < 0.72) & (np.abs(b[:, 0, Y]) < 0.62)
    for i in range(1, 1 + 2 * ROBOTS):
        legal &= np.hypot(b[:, i, X] - b[:, 0, X], b[:, i, Y] - b[:, 0, Y]) > (0.06 if i == 1 else 0.075)
        for j in range(i + 1, 1 + 2 * ROBOTS):
            legal &= np.hypot(b[:, i, X] - b[:, j, X], b[:, i, Y] - b[:, j, Y]) > 0.078
    return b[legal]


def roles_of(b):
    """Roles [K, 6] in scenes [K, 7, 6]."""
    roles = np.zeros((len(b), 2 * ROBOTS), dtype=np.int64)
    for scene, row in zip(b, roles, strict=True):
        assign(scene, M, row)
    return roles


def may_begin(b, roles):
    """For each code, the scenes [K] in which an initial condition of the recogniser holds for the robot of row 1."""
    k, rules = len(b), compiled(Kind.VSSS)
    robot, ball = b[:, 1], b[:, 0]
    cos, sin = np.cos(robot[:, THETA]), np.sin(robot[:, THETA])
    end = np.where(robot[:, VX] * cos + robot[:, VY] * sin < -0.05, -1.0, 1.0)
    speed = np.hypot(robot[:, VX], robot[:, VY])
    mine = np.stack([robot[:, X], robot[:, Y], cos, sin, speed, end * cos, end * sin])
    rolls = np.hypot(ball[:, VX], ball[:, VY])
    course = np.where(rolls < 0.05, np.nan, np.arctan2(ball[:, VY], ball[:, VX]))
    still = np.zeros(k)  # it rolls as it did: no jolt, no gain; and it does not fly
    its = np.stack([ball[:, X], ball[:, Y], rolls, np.cos(course), np.sin(course), still, still, still])
    away = np.hypot(b[:, 1:, X] - ball[:, None, X], b[:, 1:, Y] - ball[:, None, Y])
    opponent, teammate = away[:, ROBOTS:].min(axis=1), away[:, 1:ROBOTS].min(axis=1)
    begins = {code: np.zeros(k, dtype=bool) for code in CODES}

    def look(name, fill, codes_of):
        registers = np.empty((rules[name].program.registers, k))
        fill(registers)
        conditions.execute(rules[name].program.steps, rules[name].program.lines, registers, k)
        for place, initial in zip(rules[name].places, rules[name].records["initial"], strict=True):
            for code, where in codes_of(RULES[place]):
                if code:
                    begins[code] |= where & (registers[initial] >= 0.5)

    look(
        "own", lambda out: signals.fill_own(mine, its, opponent, teammate, 0, k, -0.75, 2, out),
        lambda rule: [(rule.code, np.ones(k, dtype=bool))],
    )
    for row in range(2, 1 + 2 * ROBOTS):
        mate = row <= ROBOTS
        turn = (roles[:, row - 1] - roles[:, 0]) % 3 if mate else roles[:, row - 1]
        x, y = b[:, row, X].copy(), b[:, row, Y].copy()
        look(
            Target.TEAMMATE if mate else Target.OPPONENT,
            lambda out, x=x, y=y: signals.fill_other(mine, x, y, 0, k, out),
            lambda rule, turn=turn: [(code, turn == i) for i, code in enumerate(rule.code)],
        )
    return begins


def openings(seed, each):
    """For each code, scenes in which it may begin and can be done: ``each`` times (scene, roles, seed)."""
    pool = scenes(np.random.default_rng(seed), 120_000)
    roles = roles_of(pool)
    begins = may_begin(pool, roles)
    ball, robot = pool[:, 0], pool[:, 1]
    # A ball that is leaving a robot cannot be held, one that nobody is in line with not be passed; and a robot
    # is only level with a ball that is not close beside it.
    slowly = np.hypot(ball[:, VX] - robot[:, VX], ball[:, VY] - robot[:, VY]) < 0.3
    for code in HAVING:
        begins[code] &= slowly
    line = ball[:, :2] - robot[:, :2]
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    off = pool[:, 2:, :2] - ball[:, None, :2]
    distance = np.linalg.norm(off, axis=2)
    lined_up = (np.einsum("krc,kc->kr", off, line) > math.cos(0.3) * distance) & (distance < 0.4)
    begins[22] &= lined_up[:, 2:].any(axis=1)
    begins[23] &= lined_up[:, :2].any(axis=1)
    aside = np.abs(ball[:, :2] - robot[:, :2])
    # who is ahead of the ball goes round it before it shoots
    shot = [M.goal_x, 0.0] - ball[:, :2]
    begins[21] &= (shot * line).sum(axis=1) > 0.0
    begins[67] &= aside[:, Y] > 0.22
    begins[68] &= aside[:, X] > 0.22
    begins[BY_CHANCE][:each] = True
    found = {code: np.flatnonzero(where)[:each] for code, where in begins.items()}
    return {code: [(pool[i], roles[i], int(i)) for i in places] for code, places in found.items()}


def driven(bodies, frames, drive):
    """The goal (+1, -1 at ±x, or 0) of each of so many frames in the arena, for whose wheels [6, 2] ``drive`` is called.

    The bodies are changed; whoever changes them, too, puts them there.
    """
    arena, wheels = Arena(VSSS, ROBOTS), np.zeros((2 * ROBOTS, 2))
    for _ in range(frames):
        if not np.array_equal(bodies, arena.bodies):
            arena.place(bodies)
        drive(wheels)
        bodies[:] = arena.frame(wheels)
        x, y = bodies[BALL, [X, Y]]
        yield int(np.sign(x)) if abs(x) > M.goal_x and abs(y) < M.half_goal else 0


def perform(scene, roles, code, seed=0):
    """The robot of row 1 does something while the others brake.

    Returns:
        The bodies at each frame, [F, 7, 6], and whether the action was over, not the play by a goal.
    """
    bodies, track, over, memory = scene.copy(), [], False, np.zeros(1, dtype=ACTION)[0]
    executors.start(code, 1, bodies, roles, M, splitmix(seed), memory)

    def drive(wheels):
        nonlocal over
        over = executors.act(1, bodies, M, memory, wheels[:ROBOTS])
        assert np.abs(wheels).max() <= M.top + 1e-12
        track.append(bodies.copy())

    for goal in driven(bodies, round(LIMIT_S[code] / FRAME_S) + 1, drive):
        if over or goal:
            break
    return np.array(track), over


def filmed(tracks):
    """Rows of schema Trajectories: one segment a track, [F, 7, 6]."""
    b = np.concatenate(tracks)
    roles = roles_of(b)
    segment = np.repeat(np.arange(len(tracks)), [len(track) for track in tracks])
    rows = []
    for row in range(1 + 2 * ROBOTS):
        body = f"{'home' if row <= ROBOTS else 'away'}-{row}" if row else "ball"
        role = np.array(ROLES)[roles[:, row - 1]] if row else None
        rows.append(rows_of(body, np.round(np.arange(len(b)) * FRAME_S * 1e9), *b[:, row, [X, Y, THETA, VX, VY]].T,
                            role=role, segment=segment))
    return pl.concat(rows).sort("team", "robot", "t_ns")
