"""The arena's physics against closed forms and conservation laws, its borders, and that it repeats itself."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.by_attribute import body_by_body
from world.borders import BALL_MOST, ROBOT_MOST, ball_overlaps, robot_overlaps
from world.thousand import look

from pitchlore.pipeline.arena.physics.arena import Arena
from pitchlore.pipeline.arena.physics.drive import publish
from pitchlore.pipeline.arena.physics.settings import GRAVITY, PhysicsSettings
from pitchlore.pipeline.arena.physics.walls import walls
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.pipeline.matches.frame import BALL_DTYPE, ROBOT_DTYPE, Frames

VSSS = PITCHES[Kind.VSSS]
BALL_RADIUS = SCALES[Kind.VSSS].ball_radius
HALF = SCALES[Kind.VSSS].robot_radius
STEP_S = 1 / 120
#: A floor of ice: nothing but collisions changes how bodies move.
ICE = {"rolling": 0.0, "forward_grip": 1e-9, "sideways_grip": 1e-9}


def alone(ball=(-0.6, 0.55), robot=(0.5, -0.5), other=(-0.65, -0.5), **physics):
    """An arena of one a side with the ball and the robots placed (leading columns)."""
    arena = Arena(VSSS, 1, PhysicsSettings(**physics))
    bodies = np.zeros_like(arena.bodies)
    for row, place in zip(bodies, (ball, robot, other), strict=True):
        row[: len(place)] = place
    arena.place(bodies)
    return arena


def played(arena, frames, wheels=(0.0, 0.0)):
    """Bodies after each of so many frames, [frames, 1 + 2 N, 6]; the first robot has the wheels."""
    commanded = np.zeros((2 * arena.robots, 2))
    commanded[0] = wheels
    return np.array([arena.frame(commanded).copy() for _ in range(frames)])


def random_bodies(rng, robots, pitch=VSSS, speed=1.0, spin=10.0):
    """Bodies in a grid of cells wide enough for each, all on the move."""
    columns = 1 + 2 * robots
    bodies = np.zeros((columns, 6))
    bodies[:, X] = (np.arange(columns) + 0.5) / columns * pitch.length * 0.8 - 0.4 * pitch.length
    bodies[:, Y] = rng.uniform(-0.35, 0.35, columns) * pitch.width
    bodies[:, THETA] = rng.uniform(-math.pi, math.pi, columns)
    bodies[:, VX:] = rng.uniform(-1, 1, (columns, 3)) * (speed, speed, spin)
    bodies[BALL, [THETA, OMEGA]] = 0
    return bodies


def crowded(seed, chosen=None, **moves):
    """An arena of three a side whose bodies are all on the move."""
    arena = Arena(VSSS, 3, chosen)
    arena.place(random_bodies(np.random.default_rng(seed), 3, **moves))
    return arena


def random_wheels(rng, frames, robots, top=1.2):
    """Commands that change every 0.4 s, [frames, 2 N, 2]."""
    chosen = rng.uniform(-top, top, (-(-frames // 24), 2 * robots, 2))
    return np.repeat(chosen, 24, axis=0)[:frames]


def energy(bodies, physics):
    """Kinetic energy, joules, over the last two axes of bodies."""
    moment = physics.robot_mass * (2 * HALF) ** 2 / 6
    squares = (bodies[..., VX : VY + 1] ** 2).sum(-1)
    turning = moment * (bodies[..., 1:, OMEGA] ** 2).sum(-1)
    return 0.5 * (physics.ball_mass * squares[..., 0] + physics.robot_mass * squares[..., 1:].sum(-1) + turning)


def outside(points, pitch=VSSS):
    """How deep the deepest of points [..., 2] is in something solid, metres; negative if none is."""
    deepest = -np.inf
    for corners in map(np.array, walls(pitch)):
        edges = np.roll(corners, -1, axis=0) - corners
        normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.hypot(*edges.T)[:, None]
        within = -((points[..., None, :] - corners) * normals).sum(-1)
        deepest = max(deepest, float(within.min(-1).max()))
    return deepest


class TestBall:
    def test_rolling(self):
        """A ball loses speed at a constant rate and stops after v²/2a."""
        track = played(alone(ball=(-0.7, 0.3, 0, 0.8, 0)), 180)[:, BALL]
        seconds = np.arange(1, 181) / 60
        np.testing.assert_allclose(track[:, VX], np.maximum(0.8 - 0.34 * seconds, 0), rtol=0, atol=1e-12)
        # 0.8² / (2 · 0.34) = 0.9412 m, and at most half a step too far
        assert 0 <= track[-1, X] + 0.7 - 0.9412 < 0.8 * STEP_S / 2 + 1e-4
        assert np.hypot(*track[-1, VX : VY + 1]) < 1e-12

    @given(st.floats(0.5, 6.0), st.floats(-1.0, 1.0), st.floats(0.0, 1.0))
    @settings(max_examples=25)
    def test_wall(self, speed, angle, bounce):
        """A ball leaves a wall with the restitution of its speed across it and keeps that along it."""
        vx, vy = speed * math.sin(angle), speed * math.cos(angle)
        arena = alone(ball=(0, 0.615, 0, vx, vy), wall_restitution=bounce, **ICE)
        track = played(arena, 6)[:, BALL]
        assert track[-1, VY] == pytest.approx(-bounce * vy, abs=1e-9)
        assert track[-1, VX] == pytest.approx(vx, abs=1e-9)
        assert track[-1, OMEGA] == 0

    def test_head_on(self):
        """A ball struck head on takes the momentum that the robot loses."""
        physics = PhysicsSettings(**ICE)
        arena = alone(ball=(0.1, 0.0), robot=(0, 0, 0, 1.0, 0, 0), **ICE)
        after = played(arena, 20)[-1]
        # 1.3 · 0.18 / 0.226 = 1.0354: about as fast as the robot drove
        assert after[BALL, VX] == pytest.approx(1.0354, abs=1e-4)
        assert after[BALL, VX] - after[1, VX] == pytest.approx(0.3 * 1.0, abs=1e-7)
        total = physics.ball_mass * after[BALL, VX] + physics.robot_mass * after[1, VX]
        assert total == pytest.approx(physics.robot_mass * 1.0, abs=1e-7)

    def test_fast(self):
        """A fast ball does not pass through a robot."""
        for speed in (1.0, 3.0, 6.0):
            arena = alone(ball=(-0.6, 0.01, 0, speed, 0), robot=(0, 0, 0.2, 0, 0, 0))
            track = played(arena, 60)
            ahead = (track[:, BALL, X] > track[:, 1, X]) & (np.abs(track[:, BALL, Y] - track[:, 1, Y]) < HALF)
            assert not ahead.any(), speed

    def test_in_the_goal(self):
        """A ball in the goal is stopped by its back and stays between its sides."""
        track = played(alone(ball=(0.4, 0.1, 0, 3.0, 0.5)), 240)[:, BALL]
        assert track[:, X].max() > 0.75 + BALL_RADIUS
        assert track[:, X].max() <= 0.85
        past = track[track[:, X] > 0.75]
        assert np.abs(past[:, Y]).max() <= 0.2


class TestRobot:
    def test_circle(self):
        """A robot drives a circle of radius v over omega."""
        # v = (0.258 + 0.542) / 2 = 0.4, omega = 0.284 / 0.071 = 4: radius 0.1, a turn in pi / 2 s
        robot = (0, 0, 0, 0.4, 0, 4.0)
        track = played(alone(robot=robot), round(60 * math.pi / 2), wheels=(0.258, 0.542))[:, 1]
        for axis in (X, Y):
            assert np.ptp(track[:, axis]) / 2 == pytest.approx(0.1, rel=5e-3)
        np.testing.assert_allclose(track[:, OMEGA], 4, atol=1e-9)
        course = np.arctan2(track[:, VY], track[:, VX])
        assert np.abs(np.angle(np.exp(1j * (course - track[:, THETA])))).max() < 1e-9

    @pytest.mark.parametrize(
        ("physics", "rate"),
        [({}, 6.0), ({"wheel_acceleration": 100.0}, 0.8 * GRAVITY), ({"wheel_acceleration": 2.5}, 2.5)],
    )
    def test_braking(self, physics, rate):
        """A robot stops within v²/2a, by its motors or by the floor, whichever is weaker."""
        track = played(alone(robot=(-0.5, 0, 0, 1.0, 0, 0), **physics), 60)[:, 1]
        assert 0 <= track[-1, X] + 0.5 - 1 / (2 * rate) < 1.0 * STEP_S / 2 + 1e-4
        assert np.hypot(*track[-1, VX : VY + 1]) < 1e-12

    def test_top_speed(self):
        """A robot reaches its top speed and no more."""
        track = played(alone(robot=(-0.6, 0, 0, 0, 0, 0)), 30, wheels=(9.0, 9.0))[:, 1]
        assert track[5, VX] == pytest.approx(6.0 * 6 / 60, abs=1e-9)
        assert track[-1, VX] == pytest.approx(1.2, abs=1e-9)

    def test_sideways_push(self):
        """A robot pushed sideways slides only as far as its grip lets it."""
        track = played(alone(robot=(0, 0, 0, 0, 1.0, 0)), 30)[:, 1]
        np.testing.assert_allclose(track[:5, VY], 1 - GRAVITY * np.arange(1, 6) / 60, atol=1e-9)
        assert 0 <= track[-1, Y] - 1 / (2 * GRAVITY) < 1.0 * STEP_S / 2 + 1e-4
        np.testing.assert_allclose(track[:, THETA], 0, atol=1e-12)

    def test_push(self):
        """A robot pushed by another yields no more than traction explains."""
        arena = alone(ball=(-0.6, 0.5), robot=(-0.3, 0.0, 0, 0.8), other=(-0.1, 0.0, math.pi / 2))  # across, wheels still
        track = played(arena, 60, wheels=(0.8, 0.8))
        assert track[-1, 2, X] > -0.05
        # The pusher's wheels give 0.8 g, the other's hold with up to 1.0 g; what is pushed is held once it
        # moves, so it creeps by what the push gives it in one step.
        assert 0 < track[-1, 2, VX] <= 0.8 * GRAVITY * STEP_S + 1e-6
        assert track[:, 2, VX].max() > 0.3

    def test_hard_turn(self):
        """A robot turned too hard slides out of its circle."""
        # v = 0.8, omega = 8 asks for 6.4 m/s² where the floor gives 0.3 g = 2.94
        physics = {"sideways_grip": 0.3}
        track = played(alone(robot=(0, -0.2, 0, 0.8, 0, 8.0), **physics), 24, wheels=(0.516, 1.084))[:, 1]
        change = np.hypot(*np.diff(track[:, VX : VY + 1], axis=0).T) * 60
        course = np.unwrap(np.arctan2(track[:, VY], track[:, VX]))
        assert np.ptp(course) < 0.75 * np.ptp(np.unwrap(track[:, THETA]))
        assert change.max() < 9.0  # within the ellipse of 0.8 g along and 0.3 g across

    def test_standoff(self):
        """Two robots that push against each other stand."""
        arena = alone(robot=(-0.2, 0), other=(0.2, 0, math.pi))
        for _ in range(120):
            arena.frame(np.full((2, 2), 1.0))
        assert np.abs(arena.bodies[1:, VX]).max() < 0.02
        assert arena.bodies[2, X] - arena.bodies[1, X] == pytest.approx(2 * HALF, abs=2e-3)


class TestEnergy:
    @pytest.mark.parametrize("physics", [ICE, {"wheel_acceleration": 1e6}], ids=["on ice", "wheels locked"])
    def test_never_grows_by_itself(self, physics):
        chosen = PhysicsSettings(**physics)
        for seed in range(12):
            arena = crowded(seed, chosen, speed=2.0)
            joules = energy(np.concatenate([arena.bodies[None].copy(), played(arena, 120)]), chosen)
            assert np.diff(joules).max() < 1e-9 * joules[0]
            assert joules[-1] < 0.9 * joules[0]

    def test_motors_alone(self):
        """Whatever wheels do, bodies that touch have no more than they were given by the floor.

        The solver starts from the impulses of the last step; where a contact has turned since, they are off, by
        less than a millionth of a joule in one step of ten thousand. A match has some tenths of a joule.
        """
        chosen = PhysicsSettings(hz=120, substeps=1)  # a frame is one of the usual steps
        gains = []
        for seed in range(60):
            rng = np.random.default_rng(seed)
            arena = Arena(VSSS, 3, chosen)
            arena.place(random_bodies(rng, 3, speed=2.0))
            inertia = np.array([[chosen.ball_mass] * 3, *[[chosen.robot_mass] * 2 + [arena._moment]] * 6])
            for wheels in np.repeat(random_wheels(rng, 160, 3), 2, axis=0):
                given = arena.bodies.copy()
                after = arena.frame(wheels)
                given[:, VX:] += arena._exchange.forces[:7] / inertia * STEP_S
                gains.append(energy(after, chosen) - energy(given, chosen))
        gains = np.array(gains)
        assert gains.max() < 1e-5
        assert (gains > 1e-9).mean() < 1e-3
        assert (gains < -1e-3).mean() > 0.03  # they do touch

class TestMirror:
    """The world commutes with mirroring, while few bodies touch."""

    def test_half_turn(self):
        """A match turned by half a turn with the teams exchanged goes the same way."""
        one = alone(ball=(0.0, 0), robot=(-0.3, 0.02, 0.1), other=(0.6, 0.4, 2.0))
        other = alone(ball=(0.0, 0), robot=(-0.6, -0.4, 2.0 + math.pi), other=(0.3, -0.02, 0.1 + math.pi))
        wheels = np.array([(1.0, 1.0), (0.3, -0.1)])
        for _ in range(90):
            one.frame(wheels)
            other.frame(wheels[::-1].copy())
        back = other.bodies[[0, 2, 1]] * (-1, -1, 1, -1, -1, 1)
        keep = [X, Y, VX, VY, OMEGA]
        np.testing.assert_allclose(one.bodies[:, keep], back[:, keep], rtol=0, atol=1e-6)
        assert one.bodies[BALL, X] > 0.2


class TestBorders:
    @pytest.mark.parametrize("speed", [1.0, 2.0, 4.0, 8.0])
    def test_any_speed(self, speed):
        """Nothing leaves the pitch at any speed."""
        rng = np.random.default_rng(int(speed))
        for _ in range(10):
            arena = Arena(VSSS, 3)
            bodies = random_bodies(rng, 3, speed=speed, spin=40.0)
            arena.place(bodies)
            track = np.array([arena.frame(w).copy() for w in random_wheels(rng, 90, 3)])
            # walls are noticed after a step into them, and no centre gets further than that
            step = np.hypot(bodies[:, VX], bodies[:, VY]).max() * STEP_S
            assert outside(track[..., :2]) < max(0, step - BALL_RADIUS)
            assert outside(track[30:, :, :2]) < 0

    def test_squeezed_ball(self):
        """A ball squeezed by all six robots stays in."""
        corners = [(0.68, 0.6), (-0.68, -0.6), (0.0, 0.62), (0.83, 0.18)]
        for corner in corners:
            arena = Arena(VSSS, 3)
            bodies = arena.bodies.copy()
            bodies[BALL, :2] = corner
            arena.place(bodies)
            wheels = np.zeros((6, 2))
            for _ in range(240):
                away = arena.bodies[BALL, :2] - arena.bodies[1:, :2]
                turn = np.arctan2(away[:, 1], away[:, 0]) - arena.bodies[1:, THETA]
                wheels[:, 0] = 1.2 * np.cos(turn) - np.sin(turn)
                wheels[:, 1] = 1.2 * np.cos(turn) + np.sin(turn)
                arena.frame(wheels)
                assert outside(arena.bodies[BALL, :2]) < -BALL_RADIUS / 3
                assert outside(arena.bodies[:, :2]) < 0

    @pytest.mark.slow
    @pytest.mark.parametrize(("kind", "matches"), [("random", 25), ("static", 10)])
    def test_real_matches(self, kind, matches):
        """No body is deep in a border in any frame of matches with referee, goals and restarts.

        `make world` has a thousand, and two hundred of static teams.
        """
        calls = Counter()
        for seed in range(1, matches + 1):
            seen = look(kind, 20.0, seed)
            assert (seen.frames, seen.finite) == (1201, True)
            assert seen.ball <= BALL_MOST
            assert seen.robot <= ROBOT_MOST
            calls += seen.calls
        assert calls["half"] == calls["end"] == matches
        assert calls["goal"] > 2
        assert calls["fault"] > 10 or kind == "static"

    def test_overlaps(self):
        """The look at a frame finds how deep a body is in a border."""
        ball, robots = np.zeros(4, dtype=BALL_DTYPE), np.zeros(4, dtype=ROBOT_DTYPE)
        # off all; in a goal; 5 mm in the side; its middle on the face of a cut corner
        ball["x"], ball["y"] = (0, 0.76, 0.3, 0.715), (0, 0, 0.655, 0.615)
        # off all; a corner in the side; a goal's post 1 cm in its face; in the back of a goal
        post = (HALF - 0.01) / math.sqrt(2)
        robots["x"], robots["y"] = (0, 0, 0.75 - post, 0.9), (0, 0.61, 0.2 - post, 0)
        robots["theta"] = (0, math.pi / 4, math.pi / 4, 0)
        frames = Frames(np.arange(4, dtype=np.uint32), np.arange(4), ball, np.arange(5), robots)
        off = np.array([0.65, 0.09, -0.005, 0])
        np.testing.assert_allclose(ball_overlaps(frames, VSSS), BALL_RADIUS - off, atol=1e-6)
        deep = (HALF - 0.65, 0.61 + HALF * math.sqrt(2) - 0.65, 0.01, 0.05 + HALF)
        np.testing.assert_allclose(robot_overlaps(frames, VSSS)[:, 0], deep, atol=1e-6)

    @pytest.mark.parametrize(("kind", "robots"), [(Kind.SSL, 6), (Kind.SIM2D, 11), (Kind.VSSS, 5), (Kind.VSSS, 1)])
    def test_other_pitches_and_numbers(self, kind, robots):
        """Nothing leaves other pitches, whatever the number of robots."""
        rng = np.random.default_rng(robots)
        arena = Arena(PITCHES[kind], robots)
        arena.place(random_bodies(rng, robots, PITCHES[kind], speed=3.0))
        track = np.array([arena.frame(w).copy() for w in random_wheels(rng, 180, robots)])
        assert track.shape == (180, 1 + 2 * robots, 6)
        assert outside(track[..., :2], PITCHES[kind]) < 0


class TestSameAgain:
    def test_placing(self):
        """The state before placing does not matter."""
        rng = np.random.default_rng(3)
        used, new = Arena(VSSS, 3), Arena(VSSS, 3)
        for wheels in random_wheels(rng, 240, 3):
            used.frame(wheels)
        bodies = random_bodies(rng, 3)
        used.place(bodies)
        new.place(bodies)
        for wheels in random_wheels(rng, 240, 3):
            assert used.frame(wheels).tobytes() == new.frame(wheels).tobytes()

    @pytest.mark.parametrize("robots", [1, 3, 5])
    def test_batch(self, robots):
        """Bodies that move in one call move as they do body by body."""
        rng = np.random.default_rng(robots)
        one, other = Arena(VSSS, robots), body_by_body(VSSS, robots)
        for _ in range(3):
            bodies = random_bodies(rng, robots, speed=2.0)
            one.place(bodies)
            other.place(bodies)
            assert one.bodies.tobytes() == other.bodies.tobytes()
            for wheels in random_wheels(rng, 120, robots):
                assert one.frame(wheels).tobytes() == other.frame(wheels).tobytes()


class TestContract:
    def test_ball_angle(self):
        """The ball does not turn."""
        arena = Arena(VSSS, 3)
        bodies = arena.bodies.copy()
        bodies[BALL] = (0, 0, 1.0, 0.5, 0, 3.0)
        arena.place(bodies)
        assert arena.bodies[BALL].tolist() == [0, 0, 0, 0.5, 0, 0]
        for wheels in random_wheels(np.random.default_rng(5), 120, 3):
            assert not arena.frame(wheels)[BALL, [THETA, OMEGA]].any()

    def test_one_array(self):
        """Bodies are always the same array, and begin as placed."""
        arena = Arena(VSSS, 3)
        assert arena.frame(np.zeros((6, 2))) is arena.bodies
        bodies = random_bodies(np.random.default_rng(0), 3)
        held = arena.bodies
        arena.place(bodies)
        assert arena.bodies is held
        np.testing.assert_array_equal(held, bodies)

    @given(st.floats(-1e4, 1e4))
    @example(-math.pi)
    def test_wrapped_angles(self, theta):
        """Angles are wrapped into half a turn either way."""
        state, bodies = np.zeros((3, 6)), np.zeros((3, 6))
        state[1, THETA] = theta
        publish(state, bodies)
        assert -math.pi < bodies[1, THETA] <= math.pi
        assert math.sin(bodies[1, THETA] - theta) == pytest.approx(0, abs=1e-9)
        assert math.cos(bodies[1, THETA] - theta) == pytest.approx(1)

    def test_bad_places(self):
        """Placing refuses another shape and what is no number; without a robot a side there is no arena."""
        with pytest.raises(BadSettings, match="robot a side"):
            Arena(VSSS, 0)
        arena = Arena(VSSS, 3)
        with pytest.raises(BadSettings, match=r"\(7, 6\), these have \(5, 6\)"):
            arena.place(np.zeros((5, 6)))
        bodies = arena.bodies.copy()
        bodies[3, Y] = np.nan
        with pytest.raises(BadSettings, match="finite"):
            arena.place(bodies)

    @pytest.mark.parametrize("bad", [math.nan, math.inf])
    def test_bad_command(self, bad):
        """A frame refuses a command that is no number, and moves nothing."""
        arena = Arena(VSSS, 3)
        before = arena.frame(np.full((6, 2), 0.5)).copy()
        wheels = np.full((6, 2), 0.5)
        wheels[5, 1] = bad
        with pytest.raises(BadSettings, match="finite"):
            arena.frame(wheels)
        np.testing.assert_array_equal(arena.bodies, before)

    @pytest.mark.parametrize("shape", [(3, 2), (6, 1), (7, 2)])
    def test_command_shape(self, shape):
        """A frame refuses commands for more or fewer robots than it has."""
        with pytest.raises(BadSettings, match=r"shape \(6, 2\)"):
            Arena(VSSS, 3).frame(np.zeros(shape))

    def test_walls(self):
        """The walls leave the pitch and its goals free."""
        free = np.array([(0, 0), (0.74, 0.57), (0.84, 0.19), (-0.84, -0.19), (0.67, 0.64)])
        solid = np.array([(0.76, 0.21), (0, 0.66), (0.86, 0), (0.72, 0.63), (-0.72, -0.63), (-0.72, 0.63)])
        assert all(outside(point) < 0 for point in free)
        assert all(outside(point) > 0 for point in solid)
