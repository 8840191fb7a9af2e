"""Moments of play: features as each team sees them, and whether it scores soon."""

import numpy as np
import polars as pl
import pytest
from support.of_values import NAMES, VSSS, looked_at, tracks
from support.rows import S, referee

from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.pipeline.stages.values.moments import BallStates, RobotStates, features
from pitchlore.schemas.values import FEATURES, NAMED

NEAR = SCALES[Kind.VSSS].near
TOP = 1.2


def ball(x=0.0, y=0.0, vx=0.0, vy=0.0):
    return BallStates(*(np.array([part], dtype=np.float64) for part in (x, y, vx, vy)))


def robots(*places):
    """(x, y, theta[, vx, vy]) each, at one moment; NaN where one is missing."""
    rows = [(*place, 0.0, 0.0)[:5] for place in places]
    return RobotStates(*np.array(rows, dtype=np.float64).reshape(len(rows), 5).T[:, :, None])


def seen(*args, pitch=VSSS):
    """The features of one moment by name."""
    (row,) = features(*args, pitch)
    return dict(zip(NAMES, row.astype(np.float64).tolist(), strict=True))


MISSING = (np.nan,) * 5


class TestFeatures:
    def test_kick_off(self):
        """A resting ball in the centre, a robot of each team on the line between the goals."""
        found = seen(ball(), robots((-0.3, 0, 0), (-0.6, 0, 0)), robots((0.45, 0, np.pi)))
        angle = 2 * np.arctan(0.2 / 0.75)
        expected = {
            "ball_x": 0, "ball_y": 0, "goal_distance": 0.5, "goal_angle": angle, "ball_vx": 0, "ball_speed": 0,
            "on_target": 0, "against_target": 0, "own_distance": 0.3 / NEAR, "their_distance": 1,
            "own_behind": 1, "their_behind": 1, "own_goal_distance": 0.5, "own_goal_angle": angle, "ball_vy": 0,
            "cover": 0, "own_cover": 0, "keeper": 0.3 / 0.2, "own_keeper": 0.15 / 0.2, "own_closing": 0,
            "their_closing": 0, "own_heading": 1, "their_heading": 1, "own_second": 0.6 / NEAR, "their_second": 5,
            "own_ahead": 0, "their_ahead": 0,
        }
        assert found == pytest.approx(expected, abs=1e-6)
        assert list(found) == NAMES
        assert NAMES[NAMED - 1] == "their_behind", "the named ones come first"

    def test_corner(self):
        """A ball in the adversary's corner, and robots that move."""
        found = seen(ball(0.6, 0.39, 0.3, -0.4), robots((0.6, 0.09, np.pi / 2, 0.0, 0.6), (0.7, 0, 0)),
                     robots((0.75, 0.1, 0), (0, 0, 0)))
        assert found["ball_x"] == pytest.approx(0.6 / 0.75)
        assert found["ball_y"] == pytest.approx(0.6)
        assert found["ball_speed"] == pytest.approx(0.5 / TOP)
        assert found["ball_vy"] == pytest.approx(0.4 / TOP), "towards the line between the goals"
        assert found["own_closing"] == pytest.approx((0.6 + 0.4) / TOP)
        assert found["keeper"] == pytest.approx(0.1 / 0.2)
        assert found["own_ahead"] == pytest.approx(0.5)
        assert found["their_ahead"] == pytest.approx(0.5)
        # both ends of such a robot play the ball
        assert found["own_heading"] == pytest.approx(0.09 / np.hypot(0.15, 0.09))
        # the ball sees the posts at 0.15 ahead, 0.19 and 0.59 to the side
        assert found["goal_angle"] == pytest.approx(np.arctan2(0.59, 0.15) - np.arctan2(0.19, 0.15))

    @pytest.mark.parametrize(("moving", "on", "against"), [
        ((0.25, 0.0, 0.5, 0.0), np.exp(-1.0), 0.0),
        ((0.25, 0.0, -0.5, 0.0), 0.0, np.exp(-2.0)),
        ((0.25, 0.0, 0.5, 0.19), np.exp(-1.0), 0.0),
        ((0.25, 0.0, 0.5, 0.21), 0.0, 0.0),
        ((0.25, 0.5, 0.25, -0.25), np.exp(-2.0), 0.0),
        ((0.25, 0.0, 0.04, 0.0), 0.0, 0.0),
        ((0.25, 0.0, 0.0, 0.0), 0.0, 0.0),
    ])
    def test_on_target(self, moving, on, against):
        """exp(-t) where the ball rolls between the posts in t seconds; 0 beside them, and where it hardly rolls."""
        found = seen(ball(*moving), robots((0, 0, 0)), robots((0.5, 0, 0)))
        assert (found["on_target"], found["against_target"]) == pytest.approx((on, against), abs=1e-7)

    def test_missing_robot(self):
        """A robot that is missing is not there; of what only it could tell nothing is known."""
        there, gone = robots((-0.3, 0, 0), (0.2, 0.1, 1)), robots((-0.3, 0, 0), (0.2, 0.1, 1), MISSING)
        assert seen(ball(), gone, there) == seen(ball(), there, there)
        nobody = seen(ball(), robots(MISSING), there)
        unknown = {name for name, value in nobody.items() if np.isnan(value)}
        assert unknown == {"own_behind", "own_closing", "own_heading"}
        far = {"own_distance": 5, "own_second": 5, "own_cover": 3, "own_keeper": 5, "own_ahead": 0}
        assert {name: nobody[name] for name in far} == far

    def test_unknown_heading(self):
        """Without a heading and a velocity, only what needs them is not known."""
        found = seen(ball(), robots((-0.3, 0, np.nan, np.nan, np.nan)), robots((0.5, 0, 0)))
        assert {name for name, value in found.items() if np.isnan(value)} == {"own_heading", "own_closing"}

    def test_no_robots(self):
        """A team without robots is like one whose robots are all missing."""
        there = robots((-0.3, 0, 0), (0.2, 0.1, 1))
        np.testing.assert_equal(seen(ball(), robots(), there), seen(ball(), robots(MISSING), there))
        np.testing.assert_equal(seen(ball(), there, robots()), seen(ball(), there, robots(MISSING, MISSING)))

    def test_eleven(self):
        """Teams of eleven have the same features, in whatever order their robots are."""
        rng = np.random.default_rng(1)
        own, their = (RobotStates(*rng.uniform(-30, 30, (5, 11, 4))) for _ in range(2))
        rolling = BallStates(*rng.uniform(-20, 20, (4, 4)))
        found = features(rolling, own, their, PITCHES[Kind.SIM2D])
        assert found.shape == (4, len(FEATURES))
        assert found.dtype == np.float32
        assert np.isfinite(found).all()
        shuffled = RobotStates(*(part[::-1] for part in own))
        np.testing.assert_array_equal(features(rolling, shuffled, their, PITCHES[Kind.SIM2D]), found)

    @pytest.mark.parametrize("kind", list(Kind))
    def test_mirror(self, kind):
        """Mirroring left and right makes no difference."""
        rng, pitch = np.random.default_rng(2), PITCHES[kind]
        size = np.array([pitch.goal_x, pitch.width / 2, np.pi, 1, 1])
        own, their = (RobotStates(*(rng.uniform(-1, 1, (5, 3, 50)) * size[:, None, None])) for _ in range(2))
        own.x[1, :9] = own.theta[2, 5:15] = their.vx[0, 10:20] = np.nan
        rolling = BallStates(*(rng.uniform(-1, 1, (4, 50)) * size[[0, 1, 3, 4], None]))
        rolling.y[:5] = 0.0
        mirrored = BallStates(rolling.x, -rolling.y, rolling.vx, -rolling.vy)
        one = features(rolling, own, their, pitch)
        two = features(mirrored, *(RobotStates(r.x, -r.y, -r.theta, r.vx, -r.vy) for r in (own, their)), pitch)
        np.testing.assert_allclose(two, one, atol=2e-6)


class TestMoments:
    def test_step(self):
        """One sample each step, for both teams, and only while the ball is in play."""
        found = looked_at(tracks(until=4.0, each=0.1, spans=((0.0, 1.0), (2.0, 2.5))), step_s=0.5)
        times = [0, 0.5, 1.0, 2.0, 2.5]
        for team in ("home", "away"):
            assert (found.filter(team=team)["t_ns"] / S).to_list() == pytest.approx(times)
            assert found.filter(team=team)["segment"].to_list() == [0, 0, 0, 1, 1]
        assert found["team"].to_list() == ["home"] * 5 + ["away"] * 5

    def test_unseen_ball(self):
        """Where the ball is missing, suspect or of unknown velocity there is no moment."""
        table = tracks(until=3.0, each=0.5)
        of_ball, t = pl.col("team") == "ball", pl.col("t_ns")
        table = table.filter(~(of_ball & (t == 0))).with_columns(
            suspect=of_ball & (t == S), vx=pl.when(of_ball & (t == 2 * S)).then(None).otherwise("vx"))
        assert (looked_at(table, step_s=0.5).filter(team="home")["t_ns"] / S).to_list() == [0.5, 1.5, 2.5]
        assert looked_at(table.filter(~of_ball)).is_empty()

    def test_suspect_robot(self):
        """A robot that jumped is missing."""
        table = tracks(until=1.0)
        jumped = table.with_columns(suspect=pl.col("team") == "away")
        np.testing.assert_equal(looked_at(jumped)["features"].to_numpy(),
                                looked_at(table.filter(pl.col("team") != "away"))["features"].to_numpy())

    def test_unknown_features(self):
        """A feature that is not known is null."""
        found = looked_at(tracks(until=0.5, ball=(0.25, 0.1), home_1=(0.1, 0.2, 0.3, "m")))
        unknown = [name for name, value in zip(NAMES, found["features"][0].to_list(), strict=True) if value is None]
        assert unknown == ["their_behind", "their_closing", "their_heading"]

    @pytest.mark.parametrize(("event", "home", "away"), [
        (("goal", "home"), [False, False, True, True], [False] * 4),
        (("goal", "away"), [False] * 4, [False, False, True, True]),
        (("fault", "home"), [False] * 4, [False] * 4),
        (("half", None), [False] * 4, [False] * 4),
        (("goal", None), [False, None, None, None], [False, None, None, None]),
        (None, [False, None, None, None], [False, None, None, None]),
    ])
    def test_scores(self, event, home, away):
        """The scorer within a second is unknown where the recording breaks off, or where a goal's team is unknown."""
        # play is from 0 to 1.5 s, the event at 1.75 s; without one the segment's last sample ends it
        events = referee() if event is None else referee((1.75, *event))
        found = looked_at(tracks(until=1.75, spans=((0.0, 1.5),)), events, step_s=0.5, horizon_s=1.0)
        assert found.filter(team="home")["scores"].to_list() == home
        assert found.filter(team="away")["scores"].to_list() == away

    def test_next_segment(self):
        """A goal of the next stretch of play is not this one's."""
        events = referee((1.2, "fault", None), (2.2, "goal", "home"))
        found = looked_at(tracks(until=3.0, spans=((0.0, 1.0), (1.5, 2.0))), events, step_s=0.5)
        assert found.filter(team="home")["scores"].to_list() == [False, False, False, True, True]

    def test_half_turn(self):
        """Half a turn of everything with the teams swapped swaps what the teams see."""
        table = tracks(until=2.0, ball=(0.25, 0.1, -0.3, 0.2), home_1=(0.1, 0.2, 0.3, "m"), home_2=(-0.6, 0.0, 2.0, "g"),
                       away_1=(0.5, -0.1, 3.0, "m"))
        turned = table.with_columns(
            pl.col("team").cast(pl.String).replace({"home": "away", "away": "home"}).cast(table.schema["team"]),
            -pl.col("x", "y", "vx", "vy"), pl.col("theta") + np.pi).sort("team", "robot", "t_ns")
        one = looked_at(table, referee((2.0, "goal", "home")))
        two = looked_at(turned, referee((2.0, "goal", "away")))
        for team, other in (("home", "away"), ("away", "home")):
            ours, theirs = one.filter(team=team), two.filter(team=other)
            assert ours["scores"].to_list() == theirs["scores"].to_list()
            np.testing.assert_allclose(ours["features"].to_numpy(), theirs["features"].to_numpy(), atol=1e-5)
