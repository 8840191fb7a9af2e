"""Players: the teams that play soccer, and what they are made of; the executors have a file of their own."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from support.openings import FRAME_S, VSSS, M, driven, mirrored, splitmix, view_of, views
from support.played import starting

from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.physics.settings import PhysicsSettings
from pitchlore.pipeline.arena.teams import human_like, moving_randomly, static
from pitchlore.pipeline.arena.teams.people import People
from pitchlore.pipeline.arena.teams.table import SCRIPTED, TEAMS
from pitchlore.pipeline.game.bodies import BALL, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.game.tactics.ball import coming, has_ball, soon, spin
from pitchlore.pipeline.game.tactics.executors.actions import ACTION
from pitchlore.pipeline.game.tactics.goalkeeping import keep_line
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.game.tactics.splitmix import bits, normal, seeded, uniform
from pitchlore.pipeline.game.tactics.steering import (
    BACK,
    EITHER,
    FRONT,
    along_walls,
    around,
    drive_to,
    held,
    set_wheels,
    steer,
    to_pose,
)
from pitchlore.pipeline.stages.trajectories import kinematics

PACKED = M.packed()


def nobody(robots):
    """The memory of a static team of which no robot has a job."""
    return np.zeros(robots, dtype=static.ROBOT)


#: All rules of the static team.
ON = np.ones(1, dtype=static.RULES)


def plays(bodies, memory, rules=ON):
    """The drive of a static team that plays."""
    return lambda wheels: static.play(bodies, PACKED, splitmix(), wheels[:3], memory, rules)


def jobs(memory):
    """Rows of the goalkeeper and the attacker of a static team."""
    return [1 + memory["job"].tolist().index(job) for job in (static.KEEPER, static.ATTACKER)]


class TestMeasures:
    def test_by_hand(self):
        """The measures of a robot on the VSSS pitch are those worked out by hand."""
        m = Measures.of(VSSS, top=1.2, axle=0.071, acceleration=6.0, frame_s=1 / 60)
        assert (m.goal_x, m.half_width, m.half_goal) == (0.75, 0.65, 0.2)
        assert (m.area_depth, m.area_half_width) == pytest.approx((0.15, 0.35))
        assert m.touch == pytest.approx(0.05885)
        assert m.gain == pytest.approx(math.sqrt(2 * 6.0 / 0.071 / math.pi))
        assert m.arrival == pytest.approx(math.sqrt(6.0 / 0.1))

    def test_slow_clock(self):
        """A slow clock makes a robot patient: it limits the gains."""
        m = Measures.of(VSSS, top=1.2, axle=0.071, acceleration=1000.0, frame_s=0.1)
        assert m.gain == m.arrival == pytest.approx(2.5)

    @pytest.mark.parametrize("name", ["wheel_speed", "axle", "wheel_acceleration", "hz"])
    @pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
    def test_refuses(self, name, value):
        """A setting that measures are made from is refused by name if it is not positive and finite."""
        with pytest.raises(ValidationError, match=name):
            PhysicsSettings(**{name: value})


class TestSplitMix:
    def test_splitmix64(self):
        """The generator gives the first numbers of its authors' reference."""
        # the first numbers of the authors' reference for this seed
        one = np.array([1234567], dtype=np.uint64)
        assert [int(bits(one)) for _ in range(3)] == [
            6457827717110365317, 3203168211198807973, 9817491932198370423,
        ]

    def test_distributions(self):
        """Uniform numbers fill [0, 1), and normal ones have mean 0 and deviation 1."""
        one = splitmix()
        flat = np.array([uniform(one) for _ in range(20_000)])
        bell = np.array([normal(one) for _ in range(20_000)])
        assert flat.min() >= 0 and flat.max() < 1  # noqa: PT018
        assert flat.mean() == pytest.approx(0.5, abs=0.01)
        assert (bell.mean(), bell.std()) == pytest.approx((0.0, 1.0), abs=0.03)
        assert np.mean(np.abs(bell) < 1) == pytest.approx(0.683, abs=0.015)


class TestRoles:
    @given(views())
    def test_trajectory_roles(self, view):
        """Players assign the roles that the trajectories have."""
        view = view.astype(np.float32).astype(np.float64)  # tables hold float32
        count = len(view) // 2
        roles = np.empty(2 * count, dtype=np.int64)
        assign(view, M, roles)
        team = np.repeat(np.array([0, 1], dtype=np.uint8), count)
        expected = kinematics.assign_roles(
            np.zeros(2 * count, dtype=np.int64), team, np.tile(np.arange(count, dtype=np.uint16), 2),
            view[1:, X].astype(np.float32), view[1:, Y].astype(np.float32), M.goal_x,
        )
        assert roles.tolist() == expected.tolist()


class TestSteering:
    def test_wheels(self):
        """At the limit of the wheels the turn is kept and the speed gives way."""
        wheels = np.zeros((1, 2))
        set_wheels(0.5, 2.0, 1, M, wheels)
        assert wheels[0].tolist() == pytest.approx([0.5 - 0.071, 0.5 + 0.071])
        set_wheels(1.2, 10.0, 1, M, wheels)  # the turn is kept, the speed gives way
        assert wheels[0].tolist() == pytest.approx([1.2 - 0.71, 1.2])
        set_wheels(-5.0, -1000.0, 1, M, wheels)
        assert wheels[0].tolist() == [1.2, -1.2]

    @pytest.mark.parametrize(("end", "dx", "forward", "turns"), [
        (FRONT, 1.0, 1, False), (FRONT, -1.0, 0, True), (EITHER, -1.0, -1, False), (BACK, -1.0, -1, False),
        (BACK, 1.0, 0, True),
    ])
    def test_leading_end(self, end, dx, forward, turns):
        """The end that is asked for goes first, and the robot turns where that end points away."""
        wheels = np.zeros((3, 2))
        steer(view_of((0.0, 0.0, 0.0)), 1, dx, 1e-9, 0.5, end, M, wheels)
        assert wheels[0].mean() == pytest.approx(0.5 * forward, abs=1e-6)
        assert (abs(wheels[0, 1] - wheels[0, 0]) > 0.5) == turns

    @given(st.floats(-0.6, 0.6), st.floats(-0.5, 0.5), st.floats(-3.1, 3.1))
    @settings(max_examples=25)
    def test_gets_there_and_stays(self, x, y, theta):
        """A robot gets to where it is driven and stays there."""
        bodies = view_of((0.0, 0.0, theta), ball=(-0.7, -0.6, 0, 0))
        list(driven(bodies, 150, lambda wheels: drive_to(bodies, 1, x, y, 1.0, EITHER, M, wheels)))
        assert bodies[1, [X, Y]] == pytest.approx([x, y], abs=0.01)
        assert math.hypot(*bodies[1, [VX, VY]]) < 0.05

    @given(st.floats(0.1, 0.9), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
    @settings(max_examples=40)
    def test_pose_field(self, distance, bearing, course):
        """The field leads to the place, and arrives there within 15 degrees of the course."""
        x, y, ux, uy = distance * math.cos(bearing), distance * math.sin(bearing), math.cos(course), math.sin(course)
        closest, heads = math.inf, 0.0
        for _ in range(2000):
            dx, dy = to_pose(x, y, 0.0, 0.0, ux, uy, M)
            length = math.hypot(dx, dy)
            if length == 0.0 or (closest < 0.05 and math.hypot(x, y) > closest + 0.02):
                break
            if math.hypot(x, y) < closest:
                closest, heads = math.hypot(x, y), (dx * ux + dy * uy) / length
            x, y = x + 0.001 * dx / length, y + 0.001 * dy / length
        assert closest < 0.0235  # a ball's radius; the robot is wider
        assert heads > math.cos(math.radians(15))

    def test_passing_others(self):
        """A robot bends its course round another in its way, on the side where it would pass it anyway."""
        view = view_of((0.0, 0.0, 0.0), (0.1, -0.01, 0.0))
        dx, dy = around(view, 1, 1.0, 0.0, 1.0, M)
        assert dy > 0.3
        assert around(mirrored(view), 1, 1.0, 0.0, 1.0, M) == (dx, -dy)
        assert around(view, 1, 1.0, 0.0, 0.09, M) == (1.0, 0.0)  # it is behind what is to be reached
        assert around(view, 1, -1.0, 0.0, 1.0, M) == (-1.0, 0.0)

    def test_slides_along_walls(self):
        """A robot at a wall drives along it instead of into it."""
        view = view_of((0.0, 0.61, 0.0))
        assert along_walls(view, 1, 1.0, 1.0, M) == (1.0, 0.0)
        assert along_walls(view, 1, 1.0, -1.0, M) == (1.0, -1.0)


class TestBall:
    @pytest.mark.parametrize(("x", "y", "has"), [
        (0.06, 0.0, True), (0.055, 0.03, True), (0.04, 0.04, False), (-0.06, 0.0, False), (0.2, 0.0, False),
    ])
    def test_who_has_it(self, x, y, has):
        """A robot has the ball if that is close before its front."""
        assert has_ball(view_of((0.0, 0.0, 0.0), ball=(x, y, 0, 0)), 1, M) == has

    def test_comes_and_passes_beside(self):
        """Speed and course of a ball that comes are reported, and how far aside it passes."""
        # rolls to -x at 0.5 m/s, 5 cm to the left of a robot that looks at it
        speed, ux, uy, aside = coming(view_of((0.0, 0.0, 0.0), ball=(0.4, 0.05, -0.5, 0)), 1, M)
        assert (speed, ux, uy, aside) == pytest.approx((0.5, -1.0, 0.0, 0.05))
        assert (aside * uy, -aside * ux) == pytest.approx((0.0, 0.05))

    @pytest.mark.parametrize("speed", [0.5, -0.01, 0.0])
    def test_does_not_come(self, speed):
        """A ball that rolls away, or hardly rolls, does not come."""
        view = view_of((0.0, 0.0, 0.0), ball=(0.4, 0.05, speed, 0))
        assert coming(view, 1, M) == (0.0, 0.0, 0.0, 0.0)

    def test_where_it_will_be(self):
        """The ball is foreseen at most half a second ahead and within the walls."""
        # 0.24 m are 0.2 s at 1.2 m/s; 1.2 m would be a second, of which half counts; and walls stop it
        assert soon(view_of((0.0, 0.0, 0.0), ball=(0.24, 0.0, 0.5, -0.5)), 1, M) == pytest.approx((0.34, -0.1))
        assert soon(view_of((-0.6, 0.0, 0.0), ball=(0.6, 0.0, 0.2, 0.0)), 1, M) == pytest.approx((0.7, 0.0))
        assert soon(view_of((-0.6, 0.0, 0.0), ball=(0.6, 0.6, 0.5, 0.5)), 1, M) == pytest.approx((0.75, 0.65))

    @pytest.mark.parametrize("y", [0.06, -0.06])
    def test_spins_the_ball_forward(self, y):
        """A robot beside the ball turns so that its rim drives the ball forward."""
        wheels = np.zeros((3, 2))
        spin(view_of((0.0, 0.0, 0.0), ball=(0.0, y, 0, 0)), 1, 1.0, 0.0, M, wheels)
        omega = wheels[0, 1] - wheels[0, 0]
        assert -omega * y > 0  # the rim's speed at (0, y) is -omega y along x


class TestGoalkeeping:
    @pytest.mark.parametrize(("ball", "limit", "way"), [
        ((0.2, 0.6, 0, 0), 0.05, keep_line), ((0.2, 0.6, 0, 0), 0.20, keep_line),
        ((-0.3, 0.6, 0, 0), 0.20, lambda bodies, robot, _, m, wheels: static.guard(bodies, robot, m, wheels)),
    ])
    def test_keep_line(self, ball, limit, way):
        """The keeper stands on its line, as near to the ball as its limit lets it; static's goes no further than the post."""
        bodies = view_of((-0.60, -0.3, 0.5), ball=ball)
        list(driven(bodies, 120, lambda wheels: way(bodies, 1, limit, M, wheels)))
        assert bodies[1, [X, Y]] == pytest.approx([-0.70, limit], abs=0.015)
        assert abs(math.sin(bodies[1, THETA])) > 0.99  # its side to the pitch


def match(home, away, seed, seconds=60.0):
    """Goals of home and away."""
    played = starting(Recipe(home=TeamSettings(kind=home), away=TeamSettings(kind=away), seed=seed,
                             referee=RefereeSettings(duration_s=seconds)), logged=False)
    played.advance(round(seconds / FRAME_S) + 1)
    return played.score


class TestTeams:
    @pytest.mark.slow
    @given(views(), st.sampled_from(SCRIPTED), st.sampled_from(list(Kind)), st.integers(0, 9))
    @settings(max_examples=50)
    def test_wheel_limit(self, view, team, kind, seed):
        """No team drives its wheels beyond their limit, whatever it sees."""
        rng = np.random.default_rng(seed)
        m = Measures.of(PITCHES[kind], top=2.0, axle=0.1, acceleration=5.0, frame_s=0.05)
        count = len(view) // 2
        script, wheels = TEAMS[team].script, np.full((count, 2), np.nan)
        memory, chance = script.new_memory(count, m, rng, People()), seeded(rng)
        for _ in range(30):
            script.play(view, m.packed(), chance, wheels, *memory)
            assert np.abs(wheels).max() <= m.top + 1e-12
            view[BALL, :2] += rng.normal(0, 0.05, 2)

    def test_static_against_itself(self):
        """Static against static favours neither side."""
        goals = np.array([match("static", "static", seed, 90.0) for seed in range(8)])
        assert goals.sum() > 5
        assert abs(goals[:, 0].sum() - goals[:, 1].sum()) <= 4 * math.sqrt(goals.sum())

    def test_human_like_strength(self):
        """Human-like teams beat random and lose to static."""
        people = np.array([match("human-like", "random", seed) for seed in range(4)]).sum(axis=0)
        machine = np.array([match("human-like", "static", seed) for seed in range(4)]).sum(axis=0)
        assert people[0] > people[1]
        assert machine[0] < machine[1]

    def test_random_hold(self):
        """A random robot holds its wheels for two fifths of a second."""
        memory = np.zeros(3, dtype=ACTION)
        view, wheels, chance = view_of(), np.zeros((3, 2)), splitmix()
        seen = []
        for _ in range(96):
            moving_randomly.play(view, PACKED, chance, wheels, memory)
            seen.append(tuple(wheels[0]))
        assert [len(set(seen[i : i + 24])) for i in range(0, 96, 24)] == [1, 1, 1, 1]
        assert len(set(seen)) == 4


class TestStatic:
    def wheels(self, view, memory=None):
        out = np.zeros((len(view) // 2, 2))
        static.play(view, PACKED, splitmix(), out, nobody(len(out)) if memory is None else memory, ON)
        return out

    def test_role_hysteresis(self):
        """A role changes hands only when another robot is clearly nearer."""
        memory = nobody(3)
        ball = (0.2, 0.0, 0, 0)
        self.wheels(view_of((-0.7, 0.0, 0.0), (-0.1, 0.1, 0.0), (-0.2, -0.1, 0.0), ball=ball), memory)
        assert jobs(memory) == [1, 2]
        self.wheels(view_of((-0.7, 0.0, 0.0), (-0.1, 0.1, 0.0), (-0.05, -0.1, 0.0), ball=ball), memory)
        assert jobs(memory) == [1, 2]  # the other is nearer by 5 cm only
        self.wheels(view_of((-0.7, 0.0, 0.0), (-0.1, 0.1, 0.0), (0.1, -0.1, 0.0), ball=ball), memory)
        assert jobs(memory) == [1, 3]
        self.wheels(view_of((-0.5, 0.0, 0.0), (-0.7, 0.1, 0.0), (0.1, -0.1, 0.0), ball=ball), memory)
        assert jobs(memory) == [2, 3]

    @pytest.mark.parametrize(("ball", "sign"), [
        ((0.0, 0.15, -0.8, 0.0), 1), ((0.0, -0.15, -0.8, 0.0), -1),
        ((0.0, -0.15, -0.7, 0.28), 1),  # crosses x = -0.7 at y = +0.13
    ])
    def test_keeper_meets_ball(self, ball, sign):
        """The keeper goes to where the ball will cross its line."""
        wheels = self.wheels(view_of((-0.70, 0.0, math.pi / 2), (0.3, 0.4, 0.0), (0.3, -0.4, 0.0), ball=ball))
        assert sign * wheels[0].mean() > 0.3

    @pytest.mark.parametrize("rule", static.RULES.names)
    def test_rule(self, rule):
        """Each rule keeps a field player out of its own goal area, or away from the keeper, in a scene of its own."""
        with_it, without = (self.scene(rule, on) for on in (True, False))
        assert with_it > without + 0.02

    def scene(self, rule, on):
        """Metres from the own goal area's front to the field player that comes nearest, in a film for one rule."""
        rules = np.ones(1, dtype=static.RULES)
        rules[rule] = on
        attacker, supporter, ball = {
            # it races back with a ball that will be in the area
            "yields": ((-0.25, 0.15, math.pi), (0.3, -0.4, 0.0), (-0.2, 0.3, -1.0, -0.1)),
            "escapes": ((-0.53, 0.0, math.pi), (0.3, -0.4, 0.0), (0.0, 0.0, 0.0, 0.0)),
            "clears": ((-0.2, 0.1, math.pi), (-0.2, -0.1, math.pi), (-0.68, 0.1, 0.0, 0.0)),
        }[rule]
        bodies, memory = view_of((-0.70, 0.0, math.pi / 2), attacker, supporter, ball=ball), nobody(3)
        if rule == "escapes":
            memory["escaping"][1], memory["left"][1], memory["right"][1] = 18, 0.8, 0.8
        return min(bodies[2:4, X].min() + M.goal_x - M.area_depth for _ in driven(bodies, 45, plays(bodies, memory, rules)))

    def test_shooting(self):
        """A static team scores in at least 7 of 20 scenes and never in its own goal."""
        rng, scored = np.random.default_rng(0), 0
        for _ in range(20):
            places = rng.uniform([-0.4, -0.5, -3.0, -0.3, -0.4], [0.4, 0.4, 3.0, 0.5, 0.4])
            bodies = view_of((-0.70, 0.0, 0.0), tuple(places[:3]), (-0.5, -0.1, 0.0), ball=(*places[3:], 0, 0))
            goal = next(filter(None, driven(bodies, 300, plays(bodies, nobody(3)))), 0)
            assert goal >= 0
            scored += goal
        assert scored >= 7

    @pytest.mark.parametrize("creeps", [(0.0, 0.0, 0.0), (0.09, 0.0, 0.0), (-0.05, 0.08, 0.5)])
    def test_backing_off(self, creeps):
        """A robot that is held backs off after 0.43 s, one that gets on does not."""
        # stands, or is pushed about by what it pushes at
        view = view_of((-0.70, 0.0, math.pi / 2), (0.0, 0.0, 0.0), (-0.4, -0.3, 0.0), ball=(0.5, 0.0, 0, 0))
        view[2, VX:] = creeps
        memory = nobody(3)
        drives = np.array([self.wheels(view, memory)[1].mean() for _ in range(48)])
        first = int(np.argmax(drives < 0))
        assert first * FRAME_S == pytest.approx(0.43, abs=0.03)
        assert (drives[:first] > 0).all()
        assert (drives[first : first + 17] < 0).all()
        view[2, VX:], memory = (0.6, 0.0, 0.0), nobody(3)
        assert all(self.wheels(view, memory)[1].mean() > 0 for _ in range(120))

    @pytest.mark.parametrize(("wheels", "motion", "is_held"), [
        # forward at 0.8 m/s: less than 0.2 is held, sideways counts for nothing
        ((0.8, 0.8), (0.19, 0.0, 0.0), True), ((0.8, 0.8), (0.21, 0.0, 0.0), False),
        ((0.8, 0.8), (0.0, 0.7, 0.0), True), ((-0.8, -0.8), (0.7, 0.0, 0.0), True),
        # rims of 0.71 m/s turn it at 20 rad/s: less than 5 is held
        ((-0.71, 0.71), (0.3, 0.0, 4.9), True), ((-0.71, 0.71), (0.3, 0.0, 5.1), False),
        # it is told to all but stand
        ((0.0, 0.0), (0.0, 0.0, 0.0), False), ((0.07, 0.07), (0.0, 0.0, 0.0), False),
    ])
    def test_who_is_held(self, wheels, motion, is_held):
        """A robot is held if it moves far less than its wheels tell it to."""
        view = view_of((0.0, 0.0, 0.0))
        view[1, VX:] = motion
        assert held(view, 1, M, np.array([wheels] * 3)) == is_held

    @pytest.mark.parametrize(("x", "y"), [
        (-0.66, 0.1), (-0.66, 0.3),  # in the goal area
        (-0.58, 0.0), (-0.58, 0.2), (-0.58, 0.37), (-0.66, 0.37),  # at its edge
        (-0.55, 0.0), (-0.55, 0.3),  # before it: there is no room to get behind the ball
        (-0.728, 0.25), (-0.728, 0.3), (-0.728, 0.37),  # at the goal line
    ])
    def test_ball_at_goal_area(self, x, y):
        """A ball in or about the goal area is played within 3 s, and not into the own goal."""
        bodies = view_of((-0.68, 0.19, -math.pi / 2), (-0.3, 0.1, 0.0), (-0.2, -0.3, 0.0), ball=(x, y, 0, 0))
        film = driven(bodies, round(3.0 / FRAME_S) - 1, plays(bodies, nobody(3)))
        assert next(goal for goal in film if goal or np.hypot(*(bodies[BALL, :2] - [x, y])) >= 0.1) >= 0


class TestHumanLike:
    def test_reacts_late(self):
        """People react to what they see after their delay."""
        people = People(delay_s=(0.2, 0.2))
        runs = []
        for moves in (False, True):
            rng = np.random.default_rng(5)
            memory, chance = human_like.new_memory(3, M, rng, people), seeded(rng)
            wheels, seen = np.zeros((3, 2)), []
            for frame in range(60):
                view = view_of((-0.7, 0.0, 1.5), (-0.2, 0.1, 0.0), (-0.3, -0.2, 0.0))
                view[BALL, Y] = 0.4 if moves and frame >= 30 else 0.0
                human_like.play(view, PACKED, chance, wheels, *memory)
                seen.append(wheels.copy())
            runs.append(np.array(seen))
        differs = np.abs(runs[0] - runs[1]).max(axis=(1, 2)) > 1e-9
        assert int(np.argmax(differs)) == 30 + 12

    def test_people_differ(self):
        """People differ in tactic and wobble; their skill and pace keep to the ranges of the settings."""
        people = [human_like.new_memory(3, M, np.random.default_rng(seed), People())[2][0] for seed in range(60)]
        assert {int(p["tactic"]) for p in people} == {0, 1, 2}
        assert all(0.6 <= p["skill"] <= 1.0 and 0.3 <= p["pace"] <= 0.6 for p in people)
        assert np.std([p["wobble"] for p in people]) > 0.03

    def test_driven_robot(self):
        """A person drives one robot at the speed of its skill, and the others keep to its pace."""
        rng = np.random.default_rng(1)
        people = People(skill=(0.9, 0.9), pace=(0.3, 0.3), tactics=("chaser",))
        memory, chance, wheels = human_like.new_memory(3, M, rng, people), seeded(rng), np.zeros((3, 2))
        view = view_of((-0.7, 0.2, 1.5), (-0.2, 0.0, 0.0), (-0.6, -0.5, 0.0), ball=(0.3, 0.0, 0, 0))
        human_like.play(view, PACKED, chance, wheels, *memory)
        top = np.abs(wheels).max(axis=1)
        assert top[1] == pytest.approx(0.9 * M.top, rel=0.05)
        assert max(top[0], top[2]) <= 0.3 * M.top + 1e-9

    @pytest.mark.parametrize("wrong", [
        {"delay_s": (0.3, 0.1)}, {"delay_s": (-0.1, 0.1)}, {"skill": (0.5, 1.1)}, {"pace": (0.0, 0.5)},
        {"tactics": ()}, {"tactics": ("lazy",)}, {"wobble_rad": (0.0, math.nan)},
    ])
    def test_refuses(self, wrong):
        """Settings of people that make no sense are refused by name."""
        with pytest.raises(ValidationError, match=next(iter(wrong))):
            People(**wrong)
