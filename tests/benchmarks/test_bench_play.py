"""Play a match: ours, the same match in plain Python, a plain loop that does less, and what a part costs.

PERFORMANCE's rows of "play a match". The same match in plain Python is ours with compilation switched
off, in a process of its own: the same rules, physics and log, and the same bodies but for rounding. The plain
loop is what one would write first: pymunk's attributes, players of six lines, a message a frame.
"""

import io
import json
import math
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from mcap.writer import Writer
from support.by_attribute import ByAttribute, pymunk_alone
from support.played import starting

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena import physics
from pitchlore.pipeline.arena.match.controllers import controller_of
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.arena import Arena
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.store import Store

VSSS = PITCHES[Kind.VSSS]
HZ, MINUTE = 60, 3_600
LOGGED, UNLOGGED = "play a match and log it", "play a match without a log"
STATIC = TeamSettings(kind="static")


def recipe(frames, seed=1):
    referee = RefereeSettings(duration_s=frames / HZ)
    return Recipe(home=STATIC, away=STATIC, seed=seed, referee=referee)


def unlogged(frames):
    """The bodies at the end."""
    played = starting(recipe(frames), logged=False)
    played.advance(frames + 1)
    return played.bodies.tolist()


def recorded(folder, frames, seed):
    """As `pitchlore record` does it: the log is written, synced, read again, checked and committed."""
    receipt, new = record(Store(folder), recipe(frames, seed))
    assert new
    return receipt


def as_plain_python():
    """Measures and an arena as Python has them: what is packed for compiled code has no attributes in Python."""
    assert os.environ["NUMBA_DISABLE_JIT"] == "1"
    Measures.packed = lambda self: [self]
    physics.arena.Exchange = ByAttribute


@pytest.fixture(scope="module")
def interpreted(tmp_path_factory):
    """A process in which nothing is compiled."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_DISABLE_JIT", "1")
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(1, mp_context=context, initializer=as_plain_python) as pool:
            pool.submit(recorded, tmp_path_factory.mktemp("warm"), 10, 0).result()
            yield lambda work, *arguments: pool.submit(work, *arguments).result()


# --- the plain loop ------------------------------------------------------------------------------------


def plain_player(robot, ball, goal, behind):
    """Forward speed and turn rate: to behind the ball as seen from a goal, then at it."""
    (x, y), (bx, by) = robot.position, ball.position
    away = math.hypot(goal - bx, by) or 1.0
    near = math.hypot(bx - x, by - y) < behind + 0.05 and (bx - x) * goal > 0
    tx, ty = (bx, by) if near else (bx - behind * (goal - bx) / away, by + behind * by / away)
    off = (math.atan2(ty - y, tx - x) - robot.angle + math.pi) % math.tau - math.pi
    return 1.2 * math.cos(off), 8.0 * off


def plain_loop(frames, stream=None):
    """Two teams of plain players in the arena's space, moved by attributes; a JSON message a frame."""
    arena = Arena(VSSS, 3)
    space, substeps, step_s = arena._space, arena.settings.substeps, arena._step_s
    ball, *robots = space.bodies
    start = [(tuple(body.position), body.angle) for body in space.bodies]
    score, writer = [0, 0], None
    if stream is not None:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("frame", "jsonschema", b"{}")
        channel = writer.register_channel("/frame", "json", schema)
    for frame in range(frames):
        for row, robot in enumerate(robots):
            forward, turn = plain_player(robot, ball, 0.75 if row < 3 else -0.75, 0.1 * (1 + row % 3))
            robot.velocity = forward * math.cos(robot.angle), forward * math.sin(robot.angle)
            robot.angular_velocity = turn
        ball.velocity = ball.velocity * 0.995
        for _ in range(substeps):
            space.step(step_s)
        if abs(ball.position.x) > 0.77:
            score[ball.position.x < 0] += 1
            for body, (position, angle) in zip(space.bodies, start, strict=True):
                body.position, body.angle, body.velocity, body.angular_velocity = position, angle, (0, 0), 0
        if writer is not None:
            message = {"frame": frame, "score": score, "bodies": [
                [*body.position, body.angle, *body.velocity, body.angular_velocity] for body in space.bodies]}
            t_ns = round(frame * 1e9 / HZ)
            writer.add_message(channel, t_ns, json.dumps(message).encode(), t_ns)
    if writer is not None:
        writer.finish()
    return score


# --- with a log ----------------------------------------------------------------------------------------


@pytest.mark.benchmark(group=LOGGED)
def test_logged_ours(timed, tmp_path):
    recorded(tmp_path, 100, 0)
    seeds = iter(range(1, 100))
    timed(8 * MINUTE, "frames", lambda: recorded(tmp_path, 8 * MINUTE, next(seeds)), rounds=7)


@pytest.mark.benchmark(group=LOGGED)
def test_logged_plain_loop_that_does_less(timed):
    timed(MINUTE, "frames", lambda: plain_loop(MINUTE, io.BytesIO()), rounds=5)


@pytest.mark.benchmark(group=LOGGED)
def test_logged_the_same_in_plain_python(timed, interpreted, tmp_path):
    frames = MINUTE // 6
    seeds = iter(range(1, 100))
    receipt = timed(frames, "frames", lambda: interpreted(recorded, tmp_path / "plain", frames, next(seeds)), rounds=3)
    ours = recorded(tmp_path / "ours", frames, 3)
    for name in ("x", "y", "theta"):
        plain, compiled = (
            matches.read((tmp_path / folder / of.files["log"].path).read_bytes(), where=folder).frames.robots[name]
            for folder, of in (("plain", receipt), ("ours", ours))
        )
        np.testing.assert_allclose(plain, compiled, rtol=0, atol=1e-6)


# --- without ------------------------------------------------------------------------------------------


@pytest.mark.benchmark(group=UNLOGGED)
def test_unlogged_ours(timed):
    unlogged(100)
    timed(8 * MINUTE, "frames", unlogged, (8 * MINUTE,), rounds=7)


@pytest.mark.benchmark(group=UNLOGGED)
def test_unlogged_plain_loop_that_does_less(timed):
    assert sum(timed(MINUTE, "frames", plain_loop, (MINUTE,), rounds=5)) > 0


@pytest.mark.benchmark(group=UNLOGGED)
def test_unlogged_the_same_in_plain_python(timed, interpreted):
    frames = MINUTE // 6
    bodies = timed(frames, "frames", lambda: interpreted(unlogged, frames), rounds=3)
    np.testing.assert_allclose(bodies, unlogged(frames), rtol=0, atol=1e-9)


@pytest.mark.benchmark(group=UNLOGGED)
def test_unlogged_bound_pymunk_steps_alone(timed):
    """As many steps of the same space with nobody who drives: what no player or referee can be faster than."""
    timed(MINUTE, "frames", pymunk_alone(VSSS, MINUTE), rounds=5)


# --- the players alone --------------------------------------------------------------------------------


def thought(frames):
    """Wheel speeds that both teams want in so many frames of one scene; the last wheels."""
    of = recipe(MINUTE)
    controllers = [controller_of(of.home, of, team) for team in (0, 1)]
    view, wheels = Arena(VSSS, 3).bodies.copy(), np.zeros((2, 3, 2))
    for frame in range(frames):
        for team in (0, 1):
            controllers[team].think(frame, view, wheels[team])
    return wheels.tolist()


@pytest.mark.benchmark(group="two teams think")
def test_think_ours(timed):
    thought(1)
    timed(50_000, "frames", thought, (50_000,), rounds=5)


@pytest.mark.benchmark(group="two teams think")
def test_think_the_same_in_plain_python(timed, interpreted):
    assert timed(1_000, "frames", lambda: interpreted(thought, 1_000), rounds=3) == thought(1_000)
