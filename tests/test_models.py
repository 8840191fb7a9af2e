"""Models of scoring soon: trees, logistic and shipped ones, and who is judged by which."""

import io

import numpy as np
import polars as pl
import pytest
from sklearn.ensemble import HistGradientBoostingClassifier
from support.of_values import NAMES, looked_at, tracks
from support.rows import S
from threadpoolctl import threadpool_limits

from pitchlore.pipeline.engine import models as flow
from pitchlore.pipeline.engine.stage import Output, Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.numbers import trees
from pitchlore.pipeline.settings import ModelSettings
from pitchlore.pipeline.stages.values.fitting import fit, grow, levelled
from pitchlore.pipeline.stages.values.models import (
    Logistic,
    Models,
    features_of,
    from_bytes,
    shipped,
    to_bytes,
    to_json,
)
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import Moments
from pitchlore.schemas.values import FEATURES, NAMED

#: Few trees, each of few leaves.
SMALL = ModelSettings(trees=4, leaves=4, leaf_samples=5, boosting_goals=2, folds=2)
PLAIN = ModelSettings(boosting_goals=10_000)
#: Logistic models alone, and both kinds: scikit-learn takes a second to bin the features for each fold.
BOTH = pytest.mark.parametrize("settings", [PLAIN, pytest.param(SMALL, marks=pytest.mark.slow)])


def played(seed, *, matches=6, segments=8, reported=True):
    """Moments of matches in segments of twelve seconds, the last five of which precede a goal, if one comes.

    ``ball_x`` tells who scores; all other features are noise, and all are if not ``reported``.
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
            if reported:
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
    @pytest.mark.parametrize("settings", [SMALL, SMALL.model_copy(update={"trees": 12, "leaves": 12})])
    def test_same_as_scikit_learn(self, settings):
        """The arrays give what scikit-learn's own model gives; little evidence is more penalty."""
        rng = np.random.default_rng(0)
        table = rng.normal(size=(400, 6)).astype(np.float32)
        table[rng.random(table.shape) < 0.1] = np.nan
        scores = (np.nan_to_num(table[:, 0]) + np.nan_to_num(table[:, 1]) ** 2 + rng.normal(size=400)) > 1
        ours = grow(table, scores, settings)
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
        table = played(seed, matches=10, segments=24, reported=False)
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
        noise = played(0, matches=10, segments=24, reported=False)
        known = Logistic(np.array([0]), np.zeros(1), np.ones(1), np.array([3.0]), np.array([-2.0]))
        ready = Models((known,), np.array([1.0, 0.0]), (), 0)
        reported = played(1, matches=1, segments=30)
        models, report = fit(reported, PLAIN, ready)
        assert report["kind"] == min(("shipped", "logistic"), key=lambda kind: report[kind]["log_loss"])
        assert report["shipped"]["auc"] > 0.85
        assert all(same_fit(each, known) for each in models.fits) == (report["kind"] == "shipped")
        assert models.chances(reported).mean() == pytest.approx(reported["scores"].mean(), abs=0.02)
        few = PLAIN.model_copy(update={"goals_at_least": 2, "block_s": 12.0})
        first = reported.filter(pl.col("segment") < 10)
        models, report = fit(first, few, ready)
        assert report["kind"] == "shipped"
        assert to_bytes(from_bytes(to_bytes(models))) == to_bytes(models)
        assert "shipped" in fit(noise, PLAIN, ready)[1]
        assert "shipped" not in fit(noise, PLAIN)[1]

    def test_few_goals(self):
        """With few goals there is no model, nor with all in one fold."""
        table = played(0, matches=1)
        models, report = fit(table, PLAIN)
        assert models is None
        assert (report["goals"], report["kind"]) == (5, None)
        assert fit(table, PLAIN.model_copy(update={"goals_at_least": 5, "block_s": 12.0}))[0] is not None
        known = Logistic(np.array([0]), np.zeros(1), np.ones(1), np.array([1.0]), np.array([3.0]))
        moved, report = fit(table, PLAIN, Models((known,), np.array([1.0, 0.0]), (), 0))
        offset, error = report["level"]["offset"], report["level"]["error"]
        assert (report["kind"], offset < -2 * error < 0) == (None, True), "it says goals far too often"
        chance, scores = moved.chances(table), table["scores"].to_numpy()
        assert 0.1 * (scores - chance).sum() == pytest.approx(offset, abs=0.02), "the most probable offset"
        assert levelled(moved, features_of(table[:0]), scores[:0], 0.1)[1] == {"offset": 0.0, "error": 1.0}, "without moments"
        assert fit(Moments.empty(), PLAIN)[0] is None
        # nor with all goals in one fold, as in a match that is shorter than a stretch
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
        chosen = flow.matches_to_fit(store, Output("all"), scope, own)
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
        # if fewer are wanted than the models were fitted to, they do not stand
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
