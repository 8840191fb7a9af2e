"""Values: features of a moment, models that do not know a match's own goals, and what situations change."""

from __future__ import annotations

import io

import numpy as np
import polars as pl
import pytest
from sklearn.ensemble import HistGradientBoostingClassifier
from support.rows import MATCH, S, bodies, consecutive, situations
from threadpoolctl import threadpool_limits

from pitchlore.pipeline.engine import models as flow
from pitchlore.pipeline.engine.stage import Output, Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.pipeline.numbers import trees
from pitchlore.pipeline.settings import ModelSettings, MomentSettings, ValueSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.pipeline.values.fitting import fit, grow
from pitchlore.pipeline.values.models import Logistic, Models, from_bytes, shipped, to_bytes, to_json
from pitchlore.pipeline.values.moments import Ball, Robots, features, moments
from pitchlore.pipeline.values.worths import values, worths
from pitchlore.schemas import Moments, Referee, Values, Worths
from pitchlore.schemas.values import FEATURES, NAMED

VSSS = PITCHES[Kind.VSSS]
NAMES = list(FEATURES)
NEAR = SCALES[Kind.VSSS].near
TOP = 1.2


def referee(*rows):
    return pl.DataFrame([(MATCH, round(t * S), event, team, None, None, None) for t, event, team in rows],
                        schema=Referee.dtypes(), orient="row")


#: Few trees, each of few leaves.
SMALL = ModelSettings(trees=4, leaves=4, leaf_samples=5, boosting_goals=2, folds=2)
PLAIN = ModelSettings(boosting_goals=10_000)
NOTHING = referee()
#: Logistic models alone, and both kinds: scikit-learn takes a second to bin the features for each fold.
BOTH = pytest.mark.parametrize("settings", [PLAIN, pytest.param(SMALL, marks=pytest.mark.slow)])


def ball(x=0.0, y=0.0, vx=0.0, vy=0.0):
    return Ball(*(np.array([part], dtype=np.float64) for part in (x, y, vx, vy)))


def robots(*places):
    """(x, y, theta[, vx, vy]) each, at one moment; NaN where one is missing."""
    rows = [(*place, 0.0, 0.0)[:5] for place in places]
    return Robots(*np.array(rows, dtype=np.float64).reshape(len(rows), 5).T[:, :, None])


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
        own, their = (Robots(*rng.uniform(-30, 30, (5, 11, 4))) for _ in range(2))
        rolling = Ball(*rng.uniform(-20, 20, (4, 4)))
        found = features(rolling, own, their, PITCHES[Kind.SIM2D])
        assert found.shape == (4, len(FEATURES))
        assert found.dtype == np.float32
        assert np.isfinite(found).all()
        shuffled = Robots(*(part[::-1] for part in own))
        np.testing.assert_array_equal(features(rolling, shuffled, their, PITCHES[Kind.SIM2D]), found)

    @pytest.mark.parametrize("kind", list(Kind))
    def test_mirror(self, kind):
        """Mirroring left and right makes no difference."""
        rng, pitch = np.random.default_rng(2), PITCHES[kind]
        size = np.array([pitch.goal_x, pitch.width / 2, np.pi, 1, 1])
        own, their = (Robots(*(rng.uniform(-1, 1, (5, 3, 50)) * size[:, None, None])) for _ in range(2))
        own.x[1, :9] = own.theta[2, 5:15] = their.vx[0, 10:20] = np.nan
        rolling = Ball(*(rng.uniform(-1, 1, (4, 50)) * size[[0, 1, 3, 4], None]))
        rolling.y[:5] = 0.0
        mirrored = Ball(rolling.x, -rolling.y, rolling.vx, -rolling.vy)
        one = features(rolling, own, their, pitch)
        two = features(mirrored, *(Robots(r.x, -r.y, -r.theta, r.vx, -r.vy) for r in (own, their)), pitch)
        np.testing.assert_allclose(two, one, atol=2e-6)

    def test_meanings(self):
        """Each feature has a meaning, and the named ones come first."""
        assert features(ball(), robots(), robots(), VSSS).shape == (1, len(FEATURES))
        assert NAMES[NAMED - 1] == "their_behind"


def tracks(until=10.0, each=0.5, spans=((0.0, 100.0),), **places):
    """Bodies that stand still; segment n from its first to its last second, nothing between."""
    places = places or {"ball": (0.25, 0.1), "home_1": (0.1, 0.2, 0.3, "m"), "away_1": (0.5, -0.1, 3.0, "m")}
    index = pl.lit(None, dtype=pl.Int32)
    for n, (lo, hi) in enumerate(spans):
        index = pl.when(pl.col("t_ns").is_between(round(lo * S), round(hi * S))).then(n).otherwise(index)
    return bodies(np.arange(0, until, each), **places).with_columns(segment=index.cast(pl.Int32))


def looked_at(table, events=NOTHING, **settings):
    return Moments.validate(moments(table, events, VSSS, MomentSettings(**settings)))


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


def played(seed, *, matches=6, segments=8, told=True):
    """Moments of matches in segments of twelve seconds, the last five of which precede a goal, if one comes.

    ``ball_x`` tells who scores; all other features are noise, and all are if not ``told``.
    """
    rng = np.random.default_rng(seed)
    parts = []
    for match in range(matches):
        n = 12 * segments
        scorer = np.repeat(rng.permutation(np.arange(segments) % 3 - 1), 12)
        sign = np.where(np.arange(n) % 12 >= 7, scorer, 0)
        noise = rng.normal(size=(2, n, len(FEATURES))).astype(np.float32)
        noise[:, ::7, 20] = np.nan
        for side, (team, table) in enumerate(zip(("home", "away"), noise, strict=True)):
            view = sign * (1, -1)[side]
            if told:
                table[:, 0] = view + rng.normal(0, 0.4, n)
            parts.append(pl.DataFrame({
                "match_id": f"match-{match}", "team": team, "t_ns": np.arange(n) * S,
                "segment": np.repeat(np.arange(segments), 12), "scores": view == 1,
                "features": pl.Series(table).arr.eval(pl.element().fill_nan(None)),
            }).select(list(Moments.dtypes())).cast(pl.Schema(Moments.dtypes())))
    return Moments.validate(pl.concat(parts))


def flipped(table, which):
    """The opposite outcome where ``which`` holds."""
    return table.with_columns(scores=pl.when(which).then(~pl.col("scores")).otherwise("scores"))


def same_fit(one, two):
    parts = [each if isinstance(each, trees.Trees) else [getattr(each, name) for name in Logistic.__slots__]
             for each in (one, two)]
    return all(np.array_equal(a, b) for a, b in zip(*parts, strict=True))


class TestTrees:
    def grown(self, seed=0, settings=SMALL):
        rng = np.random.default_rng(seed)
        table = rng.normal(size=(400, 6)).astype(np.float32)
        table[rng.random(table.shape) < 0.1] = np.nan
        scores = (np.nan_to_num(table[:, 0]) + np.nan_to_num(table[:, 1]) ** 2 + rng.normal(size=400)) > 1
        return table, scores, grow(table, scores, settings)

    @pytest.mark.parametrize("settings", [SMALL, SMALL.model_copy(update={"trees": 12, "leaves": 12})])
    def test_same_as_scikit_learn(self, settings):
        """The arrays give what scikit-learn's own model gives; little evidence is more penalty."""
        table, scores, ours = self.grown(settings=settings)
        builder = HistGradientBoostingClassifier(
            max_iter=settings.trees, learning_rate=settings.learning_rate, max_leaf_nodes=settings.leaves,
            min_samples_leaf=settings.leaf_samples, early_stopping=False, random_state=settings.seed,
            l2_regularization=settings.tree_penalty / settings.evidence,
        )
        with threadpool_limits(1):
            theirs = builder.fit(table, scores)
        new = np.random.default_rng(9).normal(size=(300, 6)).astype(np.float32)
        new[::5, 0] = new[::3, 1] = np.nan
        for each in (table, new):
            np.testing.assert_allclose(trees.logits(ours, each), theirs.decision_function(each), atol=1e-9)

    def test_nan(self):
        """NaN goes the way that it went when the trees grew."""
        rng = np.random.default_rng(3)
        table = rng.normal(size=(300, 1)).astype(np.float32)
        missing = np.arange(300) % 3 == 0
        table[missing] = np.nan
        for scores in (missing, ~missing):
            ours = grow(table, scores, SMALL)
            unknown, known = trees.logits(ours, np.array([[np.nan], [0.0]], dtype=np.float32))
            assert (unknown > known) == scores[0]

    def test_twice(self):
        """The same moments give the same trees."""
        assert same_fit(self.grown()[-1], self.grown()[-1])


class TestModels:
    @BOTH
    def test_obvious_rule(self, settings):
        """The features that tell the goal are learned, and probabilities are true."""
        table = played(0)
        models, report = fit(table, settings)
        assert (report["matches"], report["moments"], report["kind"] in report) == (6, table.height, True)
        kinds = {"logistic", "boosting"} if settings is SMALL else {"logistic"}
        assert kinds == {"logistic", "boosting"} & set(report)
        for kind in kinds:
            assert report[kind]["auc"] > 0.85
            assert report[kind]["log_loss"] < 0.7 * report["rate"]["log_loss"]
        chances = models.chances(table)
        assert chances.mean() == pytest.approx(table["scores"].mean(), abs=0.01)
        assert report["kind"] == min(kinds, key=lambda kind: report[kind]["log_loss"])

    @pytest.mark.parametrize("seed", range(4))
    def test_nothing_to_learn(self, seed):
        """Where nothing tells the goal, nothing is learned, though a model's errors would tell it backwards."""
        table = played(seed, matches=10, segments=24, told=False)
        models, report = fit(table, PLAIN)
        assert report["logistic"]["auc"] == pytest.approx(0.5, abs=0.05)
        assert report["logistic"]["log_loss"] > report["rate"]["log_loss"] - 0.002
        assert models.calibration[0] >= 0
        assert np.ptp(models.chances(table)) < 0.3

    @BOTH
    def test_own_goals(self, settings):
        """A match's own goals have no part in its fit; they have in all others."""
        table = played(1, matches=settings.folds)
        before, _ = fit(table, settings)
        after, _ = fit(flipped(table, pl.col("match_id") == "match-1"), settings)
        assert before.block_ns == 0
        assert [same_fit(a, b) for a, b in zip(before.fits, after.fits, strict=True)] == [
            fold == 1 for fold in range(settings.folds)]
        own = table.filter(match_id="match-1")
        calibrated = Models(before.fits[1:2], before.calibration, (), 0).chances(own)
        np.testing.assert_allclose(before.chances(own), calibrated, atol=1e-12)

    def test_other_match(self):
        """A match that no model was fitted to gets the mean of all logits."""
        models, _ = fit(played(1, matches=5), PLAIN)
        new = played(2, matches=1).with_columns(match_id=pl.lit("new"))
        table = new["features"].to_numpy()
        logits = np.mean([each.logits(table) for each in models.fits], axis=0)
        a, b = models.calibration
        np.testing.assert_allclose(models.chances(new), 1 / (1 + np.exp(-(a * logits + b))), atol=1e-12)

    def test_blocks(self):
        """With fewer matches than folds, a stretch of time is left out instead."""
        table = played(3, matches=1, segments=40)
        before, _ = fit(table, PLAIN)
        fold = pl.col("t_ns") // (60 * S) % 5
        after, _ = fit(flipped(table, fold == 3), PLAIN)
        assert before.block_ns == 60 * S
        assert [same_fit(a, b) for a, b in zip(before.fits, after.fits, strict=True)] == [
            each == 3 for each in range(5)]
        own = table.filter(fold == 3)
        alone = Models(before.fits[3:4], before.calibration, (), 0).chances(own)
        np.testing.assert_allclose(before.chances(own), alone, atol=1e-12)

    def test_ready_model(self):
        """A model that is ready is kept where the own ones are no better, and is calibrated."""
        noise = played(0, matches=10, segments=24, told=False)
        known = Logistic(np.array([0]), np.zeros(1), np.ones(1), np.array([3.0]), np.array([-2.0]))
        ready = Models((known,), np.array([1.0, 0.0]), (), 0)
        told = played(1, matches=1, segments=30)
        models, report = fit(told, PLAIN, ready)
        assert report["kind"] == min(("shipped", "logistic"), key=lambda kind: report[kind]["log_loss"])
        assert report["shipped"]["auc"] > 0.85
        assert all(same_fit(each, known) for each in models.fits) == (report["kind"] == "shipped")
        assert models.chances(told).mean() == pytest.approx(told["scores"].mean(), abs=0.02)
        few = PLAIN.model_copy(update={"goals_at_least": 2, "block_s": 12.0})
        first = told.filter(pl.col("segment") < 10)
        models, report = fit(first, few, ready)
        assert report["kind"] == "shipped"
        assert to_bytes(from_bytes(to_bytes(models))) == to_bytes(models)
        assert "shipped" in fit(noise, PLAIN, ready)[1]
        assert "shipped" not in fit(noise, PLAIN)[1]

    def test_few_goals(self):
        """With few goals there is no model."""
        table = played(0, matches=1)
        models, report = fit(table, PLAIN)
        assert models is None
        assert (report["goals"], report["kind"]) == (5, None)
        assert fit(table, PLAIN.model_copy(update={"goals_at_least": 5, "block_s": 12.0}))[0] is not None
        assert fit(Moments.empty(), PLAIN)[0] is None

    def test_goals_in_one_fold(self):
        """Nor with all goals in one fold, as in a match that is shorter than a stretch."""
        short = played(0, matches=1, segments=4)
        assert fit(short, PLAIN.model_copy(update={"goals_at_least": 2}))[0] is None
        table = played(0, matches=5)
        alone = table.with_columns(pl.col("scores") & (pl.col("match_id") == "match-1"))
        assert fit(alone, PLAIN.model_copy(update={"goals_at_least": 2}))[0] is None

    def test_unknown_outcomes(self):
        """Moments of unknown outcome are not learned from."""
        table = played(0)
        cut = flipped(table, pl.col("segment") == 0).with_columns(
            scores=pl.when(pl.col("segment") == 0).then(None).otherwise("scores"))
        one, _ = fit(cut, PLAIN)
        two, _ = fit(table.filter(pl.col("segment") != 0), PLAIN)
        assert to_bytes(one) == to_bytes(two)

    def test_moments_apart(self):
        """Models are fitted to moments that lie apart."""
        _, report = fit(played(0), PLAIN.model_copy(update={"moments_apart_s": 3.0}))
        assert report["moments"] == 6 * 2 * 8 * 12 / 3

    @BOTH
    def test_same_bytes(self, settings):
        """The same moments give the same bytes, and bytes give the models that they are of."""
        table = played(4)
        one, two = (fit(table, settings)[0] for _ in range(2))
        assert to_bytes(one) == to_bytes(two)
        again = from_bytes(to_bytes(one))
        assert to_bytes(again) == to_bytes(one)
        assert (again.matches, again.block_ns, len(again.fits)) == (one.matches, one.block_ns, settings.folds)
        np.testing.assert_array_equal(again.chances(table), one.chances(table))

    def test_missing_robots(self):
        """A logistic model puts a missing robot far off."""
        models, _ = fit(played(0), PLAIN)
        unknown = played(5, matches=1).head(1)
        row = unknown["features"].to_numpy().copy()
        row[0, 8:12] = np.nan
        far = row.copy()
        far[0, 8:12] = 5, 5, 0, 0
        chances = [models.chances(unknown.with_columns(features=pl.Series(each))) for each in (row, far)]
        assert chances[0] == chances[1]

    def test_shipped(self):
        """The model that is shipped knows where the goal is, and is of no match."""
        models = shipped()
        assert models.matches == ()
        near = looked_at(tracks(until=0.5, ball=(0.6, 0.0, 0.5, 0.0), home_1=(0.5, 0.0, 0.0, "m"), away_1=(-0.5, 0, 0, "m")))
        home, away = models.chances(near)
        assert 0 < away < home < 1

    def test_as_json(self):
        """A model as readable numbers says what its fits say on average."""
        models, _ = fit(played(0), PLAIN)
        found = to_json(models)
        assert found["features"] == NAMES[:NAMED]
        assert found["weight"][0] == pytest.approx(np.mean([each.weight[0] for each in models.fits]), abs=1e-6)


def of_moments(*values, each=1.0, segment=0):
    """V to home, one value each second."""
    return Values.validate(pl.DataFrame(
        {"match_id": MATCH, "t_ns": [round(i * each * S) for i in range(len(values))], "segment": segment,
         "home": [max(v, 0.0) for v in values], "away": [max(-v, 0.0) for v in values], "value": list(values)},
        schema=Values.dtypes()))


def worth(table, known=None, events=NOTHING, paths=None, **settings):
    known = of_moments(*np.linspace(-0.5, 0.5, 11)) if known is None else known
    paths = tracks() if paths is None else paths
    found = Worths.validate(worths(table, known, events, paths, ValueSettings(**settings)))
    assert found.select("team", "robot", "start_ns").equals(table.select("team", "robot", "start_ns"))
    return found


class TestWorths:
    def test_change(self):
        """A change is V after minus V before, to the robot's team; V lies on a straight line between moments."""
        table = situations(consecutive([1, 11], start=1.0, each=1.5), consecutive([46], team="away", start=2.0, each=1.0))
        found = worth(table)
        assert found["before"].to_list() == pytest.approx([-0.4, -0.25, 0.3])
        assert found["after"].to_list() == pytest.approx([-0.25, -0.1, 0.2])
        assert found["change"].to_list() == pytest.approx([0.15, 0.15, -0.1])

    def test_telescopes(self):
        """Changes of situations that follow each other add up to the change from the first to the last."""
        known = of_moments(*np.random.default_rng(0).uniform(-1, 1, 11))
        table = situations(consecutive([1, 11, 21, 46, 184], start=0.7, each=1.3))
        found = worth(table, known)
        assert found["change"].sum() == pytest.approx(found["after"][-1] - found["before"][0], abs=1e-12)
        assert found["after"][:-1].to_list() == found["before"][1:].to_list()

    def test_beyond_moments(self):
        """Before the first moment and after the last, V is that of the nearest."""
        found = worth(situations(consecutive([1], start=0.0, each=9.0)), of_moments(0.25, -0.5))
        assert found.select("before", "after").row(0) == (0.25, -0.5)

    def test_segments(self):
        """V is that of the situation's own stretch of play."""
        known = pl.concat([of_moments(0.1, 0.2), of_moments(0.5, 0.75, segment=1)])
        table = situations(consecutive([1], each=1.0), consecutive([1], start=1.0, each=1.0, segment=1))
        assert worth(table, known)["after"].to_list() == [0.2, 0.75]

    def test_unknown_value(self):
        """Without V nothing is known, and nothing changes, also before a goal."""
        table = situations(consecutive([1, 11], each=1.0))
        found = worth(table, Values.empty(), referee((2.0, "goal", "home")), tracks(until=2.5))
        assert found["before"].null_count() == 2
        assert found["after"].to_list() == [None, 1.0]
        assert found["change"].to_list() == [0.0, 0.0]
        assert worth(situations()).is_empty()

    @pytest.mark.parametrize(("team", "sign"), [("home", 1), ("away", -1)])
    def test_goal(self, team, sign):
        """After a goal V is 1 or -1, for the last situation of each robot alone."""
        table = situations(consecutive([1, 11], each=1.0), consecutive([46], robot=2, start=0.5, each=1.4),
                           consecutive([21, 22], team="away", each=1.0))
        found = worth(table, of_moments(0.1, 0.2, 0.3), referee((2.2, "goal", team)), tracks(spans=((0, 2), (3, 9))))
        assert found["after"].to_list() == pytest.approx([0.2, sign, sign, -0.2, -sign])
        assert found["change"].to_list() == pytest.approx([0.1, sign - 0.2, sign - 0.15, -0.1, -sign + 0.2])

    def test_before_goal(self):
        """A situation that ends long before the goal does not end with it."""
        paths = tracks(spans=((0, 2), (3, 9)))
        for end, with_goal in ((0.9, False), (1.1, True)):
            table = situations(consecutive([1], each=end))
            (after,) = worth(table, of_moments(0.0, 0.0), referee((2.2, "goal", "home")), paths, goal_s=1.0)["after"]
            assert (after == 1.0) == with_goal

    @pytest.mark.parametrize("events", [referee((2.2, "goal", None)), referee((2.2, "fault", "home")), referee()])
    def test_no_goal(self, events):
        """A goal of unknown team, a fault and the end of a recording change nothing."""
        found = worth(situations(consecutive([1], each=2.0)), of_moments(0.0, 0.25, 0.5), events,
                      tracks(spans=((0, 2), (3, 9))))
        assert found["after"].to_list() == [0.5]

    def test_places(self):
        """Places are where the robot starts, as its own team sees it; null where it was not seen."""
        table = situations(consecutive([1]), consecutive([11], team="away"), consecutive([21], robot=2))
        found = worth(table).select("x", "y").rows()
        assert found[0] == pytest.approx((0.1, 0.2))
        assert found[1] == (None, None), "robot 2 was not seen"
        assert found[2] == pytest.approx((-0.5, 0.1)), "away's view is turned"


class TestValues:
    def test_home_and_away(self):
        """V is home's chance minus away's; to away it is minus that."""
        looked = looked_at(tracks(until=3.0), referee((3.0, "goal", "home")))
        found = Values.validate(values(looked, shipped()))
        assert found.height == looked.height / 2
        assert (found["value"] == found["home"] - found["away"]).all()
        np.testing.assert_allclose(found["away"], shipped().chances(looked.filter(team="away")))

    def test_no_moments(self):
        """No moments have no values."""
        assert Values.validate(values(Moments.empty(), shipped())).is_empty()


class TestChoose:
    @pytest.fixture
    def store(self, tmp_path):
        return Store(tmp_path)

    @staticmethod
    def choose(store, matches, commit=True, ssl=(), **settings):
        """The matches that are chosen, and as if the models had been fitted to them."""
        for match in matches:
            kind = "ssl" if match in ssl else "vsss"
            store.commit(Work("matches", match, {}, version=1), Made(details={"pitch": {"kind": kind}}))
        own = ModelSettings(**settings)
        scope = Scope(matches=tuple(sorted(matches)))
        chosen = flow.choose(store, Output("all"), scope, own)
        if commit:
            leagues = {"ssl": [m for m in chosen if m in ssl], "vsss": [m for m in chosen if m not in ssl]}
            store.commit(STAGES["models"].work("all", own, {}), Made(details={"matches": leagues}))
        return chosen

    def test_leagues(self, store):
        """Each league's matches are chosen by themselves."""
        ssl = ["s1", "s2", "s3"]
        assert self.choose(store, ["a", *ssl], ssl=ssl) == ("a", *ssl)
        assert self.choose(store, ["a", "b", *ssl], ssl=ssl) == ("a", "b", *ssl)
        assert self.choose(store, ["a", "b", "c", *ssl], ssl=ssl) == ("a", "b", *ssl)
        assert self.choose(store, ["a", "c", "d", *ssl, "s4"], ssl=[*ssl, "s4"]) == ("a", "c", "d", *ssl), "b was forgotten"
        assert len(self.choose(store, ["a", "b", "c", "d", *ssl], ssl=ssl, matches_at_most=2)) == 4

    def test_one_by_one(self, store):
        """Models stand until there are twice as many matches."""
        names = [f"m{i:02}" for i in range(20)]
        sizes = [len(self.choose(store, names[:n])) for n in range(1, 18)]
        assert sizes == [1, 2, 2, 4, 4, 4, 4, *[8] * 8, 16, 16]

    def test_same_matches(self, store):
        """The matches of a choice stand, whichever come."""
        first = self.choose(store, ["b", "c", "d"])
        assert first == ("b", "c", "d")
        assert self.choose(store, ["a", "b", "c", "d", "e"]) == first

    def test_forgotten_match(self, store):
        """If a match is gone that the models were fitted to, all that are there are chosen anew."""
        self.choose(store, ["a", "b", "c"])
        assert self.choose(store, ["b", "c", "d", "e"]) == ("b", "c", "d", "e")

    def test_corrupt_receipt(self, store):
        """A receipt that cannot be read does not stand."""
        self.choose(store, ["a", "b", "c"])
        (file,) = (store.root / "models").glob("*.receipt.json")
        file.write_bytes(b"{")
        assert self.choose(store, ["a", "b", "c", "d"]) == ("a", "b", "c", "d")

    def test_at_most(self, store):
        """A sample of many matches is chosen that another match hardly changes."""
        names = [f"m{i:03}" for i in range(100)]
        sample = self.choose(store, names, commit=False, matches_at_most=10)
        assert len(sample) == 10
        assert sample == tuple(sorted(sample))
        assert sample == self.choose(store, names[::-1], commit=False, matches_at_most=10)
        assert sample not in (tuple(names[:10]), tuple(names[-10:]))
        more = self.choose(store, [*names, "another"], commit=False, matches_at_most=10)
        assert len(set(more) & set(sample)) >= 9

    def test_fewer_at_most(self, store):
        """If fewer are wanted than the models were fitted to, they do not stand."""
        self.choose(store, ["a", "b", "c", "d"])
        assert len(self.choose(store, ["a", "b", "c", "d"], matches_at_most=2)) == 2


def test_no_pickle(tmp_path):
    """Models with a pickle in the place of numbers are refused, and nothing in it runs."""
    class Harm:
        def __reduce__(self):
            return (tmp_path.joinpath("harm").touch, ())

    out = io.BytesIO()
    np.savez(out, calibration=np.array([Harm()], dtype=object))
    with pytest.raises(ValueError, match="allow_pickle=False"):
        from_bytes(out.getvalue())
    assert not (tmp_path / "harm").exists()
