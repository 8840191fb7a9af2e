"""The arena for learners: the libraries' own checks, and a match through it beside the same match alone."""

import math
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from support.played import policy, starting
from support.watched import Replayed

from pitchlore.pipeline.arena.env import BEHAVIOURS, ID, env, parallel_env
from pitchlore.pipeline.arena.match.controllers import LearnedTeam, PolicyTables, controller_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.camera import CameraSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.constant import constant
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.state.observation import see_from
from pitchlore.schemas import ROLES, Appraisals
from pitchlore.schemas.sights import SIGHT

with warnings.catch_warnings():
    warnings.simplefilter("ignore", DeprecationWarning)  # PettingZoo's tests import its old games
    from pettingzoo.test import parallel_api_test, parallel_seed_test

pytestmark = pytest.mark.slow

ACTIONS = ("wheels", "behaviours")
#: Two halves of three seconds: both teams kick off, and change sides.
SHORT = MatchSettings(referee=RefereeSettings(duration_s=6.0))
TOP = SHORT.physics.wheel_speed


@pytest.fixture(autouse=True)
def _hidden_window(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


def recipe_of(home="human", away="human", seed=3, settings=SHORT):
    return Recipe(**settings.of_match(), home=TeamSettings(kind=home), away=TeamSettings(kind=away), seed=seed)


def begun(one, seed=3):
    """An environment whose match has begun."""
    one.reset(seed=seed)
    return one


def wheels_of(team, frames=400):
    """Wheels that change every half second, in [-1, 1], float32 [frames, 3, 2]: what a learner might try."""
    drawn = np.random.default_rng(team).uniform(-1, 1, (-(-frames // 30), 3, 2)).astype(np.float32)
    return np.repeat(drawn, 30, axis=0)[:frames]


def played(match):
    """Bodies and score at each frame, before it is played."""
    while not match.over:
        match.call()
        yield match.bodies.copy(), match.score
        match.move()


class TestLibraries:
    @pytest.mark.parametrize("options", [
        {"actions": "wheels"}, {"actions": "behaviours"},
        {"opponent": "static", "side": "away", "actions": "behaviours", "observations": "sights"},
    ])
    def test_pettingzoo(self, options, capsys):
        parallel_api_test(parallel_env(**options, minutes=0.02), 100)
        parallel_seed_test(lambda: parallel_env(**options, minutes=0.02), 30)
        assert "Passed" in capsys.readouterr().out

    @pytest.mark.parametrize("options", [{"actions": "wheels"}, {"actions": "behaviours"},
                                         {"actions": "behaviours", "observations": "sights"}])
    def test_gymnasium(self, options):
        """Also its render modes: rgb_array, and human in a window that nobody sees."""
        check_env(gymnasium.make(ID, **options, minutes=0.02).unwrapped)

    @pytest.mark.parametrize("observations", ["bodies", "sights"])
    @pytest.mark.parametrize("actions", ACTIONS)
    def test_stable_baselines3(self, actions, observations):
        checker = pytest.importorskip(
            "stable_baselines3.common.env_checker", reason="stable-baselines3 needs torch and is not installed")
        checker.check_env(env(actions=actions, observations=observations, minutes=0.02))


class TestSameMatch:
    def test_as_by_the_same_wheels(self):
        """Each frame of a parallel match, its pauses and second half included, is that of the match alone."""
        scripts = [wheels_of(team) for team in (0, 1)]
        alone = played(MatchInPlay(recipe_of(), tuple(Replayed(TOP * s.astype(float)) for s in scripts), logged=False))
        one = begun(parallel_env(settings=SHORT))
        sides = set()
        for frame, (bodies, score) in enumerate(alone):
            assert (one.match.bodies.tobytes(), one.match.score) == (bodies.tobytes(), score)
            sides.add(one.match.attacks)
            if one.agents:
                pairs = zip(one.possible_agents, np.concatenate([s[frame] for s in scripts]), strict=True)
                one.step(dict(pairs))
        assert one.match.over
        assert sides == {1.0, -1.0}

    def test_as_against_a_named_team(self):
        """Driven on the away side, against static, with steps of three frames."""
        script = wheels_of(1)
        recipe = recipe_of(home="static")
        alone = list(played(MatchInPlay(
            recipe, (controller_of(recipe.home, recipe, 0), Replayed(TOP * script.astype(float))), logged=False)))
        one = begun(env("static", side="away", step_s=0.05, settings=SHORT))
        for frame in range(0, len(alone) - 3, 3):
            held = np.repeat(script[frame:frame + 1], 3, axis=0)
            assert np.array_equal(held, script[frame:frame + 3])
            one.step(script[frame].ravel())
            assert one.match.bodies.tobytes() == alone[frame + 3][0].tobytes()

    def test_always_the_same_behaviour_is_the_constant_team(self):
        alone = starting(recipe_of("learned", "learned"), constant("constant:044").policy(), logged=False)
        alone.advance(10_000)
        one = begun(env("constant:044", actions="behaviours", settings=SHORT))
        both = begun(parallel_env(actions="behaviours", settings=SHORT))
        reach = BEHAVIOURS.index(44)
        over = False
        while not over:
            over = one.step(np.full(3, reach))[3]
            both.step(dict.fromkeys(both.agents, reach))
        assert one.match.bodies.tobytes() == both.match.bodies.tobytes() == alone.bodies.tobytes()

    def test_robots_one_by_one_are_the_team(self):
        """The robots of one side as agents play the match that one agent for all of them plays."""
        script = wheels_of(1)
        one, robots = (begun(make("static", side="away", settings=SHORT)) for make in (env, parallel_env))
        assert robots.agents == ["away_1", "away_2", "away_3"]
        for frame in range(200):
            _, reward, _, _, info = one.step(script[frame].ravel())
            _, rewards, _, _, infos = robots.step(dict(zip(robots.agents, script[frame], strict=True)))
            assert set(rewards.values()) == {reward}
            assert infos["away_2"] == info
        assert one.match.bodies.tobytes() == robots.match.bodies.tobytes()

    def test_a_policy_as_opponent(self):
        known = PolicyTables(policy(*((role, 0, "184", 0.5) for role in ROLES)))
        one = begun(env(LearnedTeam(TeamSettings(kind="learned"), known), settings=SHORT))
        for _ in range(60):
            one.step(np.zeros(6, np.float32))
        before = one.match.bodies[4:].copy()
        one.step(np.zeros(6, np.float32))
        assert np.allclose(one.match.bodies[4:], before, atol=1e-6)  # it stands: that is all it knows

    def test_robots_can_begin_anew(self):
        """Robots that begin the same anew at each step play as a team that looks and knows nothing else; a push goes on."""
        kick, reach = BEHAVIOURS.index(21), BEHAVIOURS.index(44)
        looks = LearnedTeam(TeamSettings(kind="learned", clock_s=0.2),
                            PolicyTables(constant("constant:021").policy(), Appraisals.of([])))
        team = begun(parallel_env(looks, side="away", actions="behaviours", step_s=0.2), seed=1)
        anew, on = (begun(parallel_env(actions="behaviours", step_s=0.2), seed=1) for _ in range(2))
        same = []
        for _ in range(30):
            team.step(dict.fromkeys(team.agents, reach))
            anew.begin_anew(anew.agents[:3])
            for each in (anew, on):
                each.step(dict.fromkeys(each.agents[:3], kick) | dict.fromkeys(each.agents[3:], reach))
            assert team.match.in_play, "no restart: there such a team decides at once"
            assert team.match.bodies.tobytes() == anew.match.bodies.tobytes()
            same.append(anew.match.bodies.tobytes() == on.match.bodies.tobytes())
        assert same[0]
        assert not same[-1]
        with pytest.raises(BadSettings, match="no match"):
            parallel_env().begin_anew(["home_1"])

    def test_every_behaviour_can_be_chosen(self):
        one = parallel_env(actions="behaviours", settings=SHORT)
        ended = {}
        for index, code in enumerate(BEHAVIOURS):
            one.reset(seed=3)
            one.step(dict.fromkeys(one.agents, index))
            one.step(dict.fromkeys(one.agents, index))
            ended[code] = one.match.bodies.tobytes()
        assert len(BEHAVIOURS) == 32
        assert len(set(ended.values())) > 20  # at a kick-off some want the same


class TestSeeds:
    @pytest.mark.parametrize("make", [env, parallel_env])
    def test_later_matches_follow_from_it(self, make):
        def seeds(seed):
            one = make(settings=SHORT)
            one.reset(seed=seed)
            found = [one.match.recipe.seed]
            for _ in range(2):
                one.reset()
                found.append(one.match.recipe.seed)
            return found

        assert seeds(5) == seeds(5)
        assert seeds(5)[0] == 5
        assert len({*seeds(5), *seeds(6)}) == 6


class TestRewards:
    def test_are_goals(self):
        """Nobody stands in the way of a team that reaches and kicks: the rewards add up to the score."""
        one = begun(env("constant:184", actions="behaviours", minutes=1.0), seed=1)
        rewards, over = [], False
        while not over:
            _, reward, goal, over, info = one.step(np.full(3, BEHAVIOURS.index(21)))
            rewards.append(reward)
            assert not goal
        ours, theirs = info["score"]
        assert ours > 0
        assert sum(rewards) == ours - theirs
        assert len(rewards) == 60 / 0.4
        assert one.match.score == (ours, theirs)

    def test_a_goal_can_end_the_episode(self):
        one = begun(parallel_env(actions="behaviours", goal_ends=True, minutes=1.0), seed=1)
        kick, stand = BEHAVIOURS.index(21), BEHAVIOURS.index(184)
        while one.agents:
            _, rewards, terminated, truncated, infos = one.step(
                {name: kick if name.startswith("away") else stand for name in one.agents})
        assert rewards == {name: 1.0 if name.startswith("away") else -1.0 for name in one.possible_agents}
        assert set(terminated.values()) == {True}
        assert set(truncated.values()) == {False}
        assert infos["away_1"]["score"] == (1, 0)
        assert infos["home_1"]["score"] == (0, 1)


def second_half(**options):
    """An environment in its second half, and its observations there."""
    one = begun(parallel_env(settings=SHORT, **options))
    for frame in range(250):
        seen, *_ = one.step({name: wheels_of(0)[frame, int(name[-1]) - 1] for name in one.agents})
    return one, seen


class TestObservations:
    @pytest.mark.parametrize("agent", ["home_1", "home_3", "away_2"])
    def test_layout(self, agent):
        """By hand, in the second half, when away attacks +x."""
        one, seen = second_half()
        assert one.match.attacks == -1.0
        got, own = seen[agent], int(agent[-1])
        sign = -1.0 if agent.startswith("home") else 1.0
        bodies = one.match.bodies
        teams = [bodies[1:4], bodies[4:]] if agent.startswith("home") else [bodies[4:], bodies[1:4]]
        robots = [teams[0][own - 1], *np.delete(teams[0], own - 1, axis=0), *teams[1]]
        ball = bodies[0]
        expected = [sign * ball[0] / 0.85, sign * ball[1] / 0.65, sign * ball[3] / 2.4, sign * ball[4] / 2.4]
        for x, y, theta, vx, vy, omega in robots:
            expected += [
                sign * x / 0.85, sign * y / 0.65, sign * math.cos(theta), sign * math.sin(theta),
                sign * vx / 1.2, sign * vy / 1.2, omega / (2.4 / 0.071),
            ]
        home, away = one.match.score
        lead = (home - away) * (1 if agent.startswith("home") else -1)
        expected += [lead / 10, 1 - 251 / 361, float(one.match.in_play)]
        np.testing.assert_allclose(got, expected, atol=1e-6)
        assert got in one.observation_space(agent)

    def test_sights(self):
        """Observations of teams that look, scaled by hand in the second half; each role is there once a team."""
        one, seen = second_half(observations="sights")
        place = list(SIGHT).index
        for team, side in enumerate(("home", "away")):
            rows = [seen[f"{side}_{number}"] for number in (1, 2, 3)]
            view = one.match.views[team]
            for robot, row in enumerate(rows, start=1):
                known = np.empty(len(SIGHT), dtype=np.float32)
                see_from(view, robot, 0.75, known)
                assert row[place("ball_x")] == pytest.approx(view[0, 0] / 0.85, abs=1e-6)
                assert row[place("vx")] == pytest.approx(known[place("vx")] / 1.2, abs=1e-6)
                assert row[place("ball_vx")] == pytest.approx(known[place("ball_vx")] / 2.4, abs=1e-6)
                assert row[place("nearer")] == known[place("nearer")] / 2
                assert row[place("behind")] == known[place("behind")]
                assert row[place("to_own_line")] == pytest.approx(known[place("to_own_line")] / 9)
                assert row in one.observation_space(f"{side}_1")
            assert sorted(row[len(SIGHT):].argmax() for row in rows) == [0, 1, 2]
            assert {row[len(SIGHT):].sum() for row in rows} == {1.0}

    def test_sights_of_a_robot_without_teammates(self):
        """An unknown number is 0."""
        one = env(robots=1, observations="sights", settings=SHORT)
        seen, _ = one.reset(seed=3)
        assert seen.shape == (33,)
        assert seen[list(SIGHT).index("mate_x")] == 0.0
        assert np.isfinite(seen).all()

    def test_of_a_team_are_those_of_its_first_robot(self):
        one, both = env("static", side="away", settings=SHORT), parallel_env(settings=SHORT)
        assert np.array_equal(one.reset(seed=3)[0], both.reset(seed=3)[0]["away_1"])

    def test_are_the_cameras(self):
        """With noise, two teams see the same errors, and nobody sees the truth."""
        noisy = SHORT.model_copy(update={"camera": CameraSettings(position_noise=0.01)})
        one = parallel_env(settings=noisy)
        seen, _ = one.reset(seed=3)
        truth = one.match.bodies[0, 0] / 0.85
        assert seen["home_1"][0] == -seen["away_1"][0] != pytest.approx(truth)

    def test_each_step_has_its_own(self):
        one = env(settings=SHORT)
        first, _ = one.reset(seed=3)
        kept = first.copy()
        one.step(np.ones(6, np.float32))
        assert np.array_equal(first, kept)


class TestPictures:
    def test_of_the_moment(self):
        one = begun(env(render_mode="rgb_array", settings=SHORT))
        first = one.render()
        for _ in range(30):
            one.step(np.ones(6, np.float32))
        assert first.shape == (560, 640, 3)
        assert (one.render() != first).any()
        assert begun(parallel_env(settings=SHORT)).render() is None, "it has no mode"


class TestErrors:
    @pytest.mark.parametrize(("make", "said"), [
        (lambda: env("nobody"), "'nobody' is no team.*static, human-like, pressing, counter, random"),
        (lambda: env("learned"), "is no team"),
        (lambda: env("constant:999"), "there is no action 999"),
        (lambda: env(side="left"), "no side 'left'.*home, away"),
        (lambda: env(actions="legs"), "actions: .*'wheels' or 'behaviours'"),
        (lambda: parallel_env(robots=0), r"matches\.robots: .*greater than or equal to 1"),
        (lambda: parallel_env(minutes=-1.0), r"duration_s: .*greater than 0"),
        (lambda: env().step(np.zeros(6)), "no match to play on.*Call reset first"),
        (lambda: parallel_env().step({}), "no match to play on.*Call reset first"),
    ])
    def test_of_the_door(self, make, said):
        with pytest.raises(BadSettings, match=said):
            make()

    @pytest.mark.parametrize(("actions", "given", "said"), [
        ("wheels", np.zeros(4), r"shape \(4,\).*shape \(6,\)"),
        ("wheels", np.full(6, np.nan), "finite numbers"),
        ("behaviours", np.array([0, 1, 32]), "whole numbers from 0 to 31"),
        ("behaviours", np.array([0, 1, -1]), "whole numbers from 0 to 31"),
        ("behaviours", np.array([0.0, 1.0, 2.0]), "whole numbers from 0 to 31"),
    ])
    def test_of_an_action(self, actions, given, said):
        one = begun(env(actions=actions, settings=SHORT))
        with pytest.raises(BadSettings, match=said):
            one.step(given)

    @pytest.mark.parametrize(("agents", "wheels", "said"), [
        (5, 2, "no action of away_3"), (6, 3, "3 pairs of wheel speeds"),
    ])
    def test_of_agents(self, agents, wheels, said):
        one = begun(parallel_env(settings=SHORT))
        with pytest.raises(BadSettings, match=said):
            one.step({name: np.zeros(wheels) for name in one.agents[:agents]})
