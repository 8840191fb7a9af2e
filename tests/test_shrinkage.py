"""Values of grams: means with errors by match, shrunk towards families, merged version by version."""


import numpy as np
import polars as pl
import pytest

from pitchlore.pipeline.numbers.estimates import estimated
from pitchlore.pipeline.numbers.sums import exact
from pitchlore.pipeline.settings import BehaviourSettings, RoundSettings
from pitchlore.pipeline.stages.behaviours.select import select
from pitchlore.pipeline.stages.behaviours.shrinkage import valued
from pitchlore.pipeline.stages.knowledge import merge_behaviours
from pitchlore.schemas import Behaviours, Grams

Z = 1.959964
NEW = ("low", "high", "mean", "error", "family", "family_spread", "family_size", "paper", "x", "y")
TABLE = {name: dtype for name, dtype in Grams.dtypes().items() if name not in ("team", "kind")}


def table(*found, role="striker"):
    """(codes, values of the instances, match by match) each."""
    rows = []
    for codes, matches in found:
        sums, counts = ([fun(match) for match in matches] for fun in (sum, len))
        each = [value for match in matches for value in match]
        rows.append({
            "role": role, "codes": codes, "n": len(codes), "count": len(each), "value_sum": sum(each),
            "value_square_sum": sum(value**2 for value in each), "match_square_sum": sum(s**2 for s in sums),
            "match_product_sum": sum(s * n for s, n in zip(sums, counts, strict=True)),
            "match_count_square_sum": sum(n**2 for n in counts), "paper_sum": 0.0, "placed": 0, "x_sum": 0.0,
            "y_sum": 0.0,
        })
    return pl.DataFrame(rows, schema=TABLE)


def alone(*values):
    """Each instance in a match of its own."""
    return [[value] for value in values]


class TestEstimated:
    @pytest.mark.parametrize(("row", "value", "variance"), [
        # of five: half of the shrinkage is trusted, the variance being .25 and .75 of the family's and its own
        ((1.0, 0.75**0.5, 0.0, 0.5, 5), 1 - 0.5 * 0.75, 0.75 * (1 - 0.8 * 0.375) + 0.375**2),
        # of many: halfway, of equal variances
        ((1.0, 0.5, 0.0, 0.5, 10**9), 0.5, 0.125),
        ((1.0, 0.5, 0.0, 0.0, 10**12), 0.0, 0.0),
        ((1.0, 0.5, 0.0, 0.5, 3), 1.0, 0.25),
        ((1.0, 0.5, None, None, None), 1.0, 0.25),
        ((1.0, None, 0.0, 0.5, 5), 1.0, None),
        ((1.0, None, None, None, None), 1.0, None),
    ])
    def test_by_hand(self, row, value, variance):
        """A value lies between mean and family, by the share of the variance that is error; see Morris (1983)."""
        schema = dict.fromkeys(("mean", "error", "family", "family_spread"), pl.Float64) | {"family_size": pl.Int64}
        found = estimated(pl.DataFrame([row], schema=schema, orient="row")).row(0, named=True)
        assert found["value"] == pytest.approx(value, abs=1e-6)
        half = None if variance is None else Z * variance**0.5
        assert (found["low"], found["high"]) == (
            (None, None) if half is None else pytest.approx((value - half, value + half), abs=1e-4))


class TestValued:
    def test_by_hand(self):
        """A worked example: four grams of one family, each instance in a match of its own."""
        found = valued(table(
            ([1, 11], alone(0.5, 0.3, 0.1)), ([3, 12], alone(0.1, -0.1)), ([3, 11], alone(0.2, 0.2)),
            ([4, 11], alone(-0.5)),
        ), shrink=True)
        # squares around the means .3, 0, .2 and -.5: .08, .02, 0 and 0, together .1 of 4 degrees of freedom
        pooled = 0.1 / 4
        mean, count = np.array([0.3, 0.0, 0.2, -0.5]), np.array([3, 2, 2, 1])
        error = np.sqrt((np.array([0.08, 0.02, 0.0, 0.0]) + 10 * pooled) / (count + 9) / count)
        weight = 1 / error**2
        centre = (weight * mean).sum() / weight.sum()
        excess = (weight * (mean - centre) ** 2).sum() - 3
        between = excess / (weight.sum() - (weight**2).sum() / weight.sum())
        assert between > 0
        assert found["mean"].to_list() == pytest.approx(mean)
        assert found["error"].to_list() == pytest.approx(error)
        assert found["family"].to_list() == pytest.approx([centre] * 4)
        assert found["family_spread"].to_list() == pytest.approx([between**0.5] * 4)
        assert found["family_size"].to_list() == [4] * 4
        share = error**2 / (error**2 + between) / 3
        value = mean - share * (mean - centre)
        assert found["value"].to_list() == pytest.approx(value)
        half = Z * np.sqrt(error**2 * (1 - 0.75 * share) + 2 * share**2 * (mean - centre) ** 2)
        assert found["low"].to_list() == pytest.approx(value - half)
        assert found["high"].to_list() == pytest.approx(value + half)

    def test_equal_grams(self):
        """Equal grams shrink to their mean, which is known better than any of them."""
        codes = [[k, j] for k in range(1, 12) for j in (11, 12)]
        rng = np.random.default_rng(0)
        found = valued(table(*((each, alone(*rng.normal(0.2, 0.3, 20))) for each in codes)), shrink=True)
        raw = valued(table(*((each, alone(0.1, 0.3)) for each in codes)), shrink=True)
        assert raw["value"].to_list() == pytest.approx([0.2] * 22)
        assert found["value"].std() < 0.35 * found["mean"].std()
        assert ((found["high"] - found["low"]) < 0.7 * 2 * Z * found["error"]).all()

    def test_single_gram(self):
        """A gram without others in its family stands for itself."""
        found = valued(table(([1, 11], alone(0.5, 0.3))), shrink=True).row(0, named=True)
        assert found["family_size"] == 1
        assert found["value"] == found["mean"] == pytest.approx(0.4)
        assert found["high"] - found["low"] == pytest.approx(2 * Z * found["error"])

    def test_families(self):
        """A family has one role, and last codes that follow each other in table 1."""
        both = pl.concat([table(([1], alone(0.1, 0.2)), ([2], alone(0.3, 0.5)), ([21], alone(0.9, 0.7))),
                          table(([1], alone(0.4, 0.6)), role="midfield")])
        found = valued(both, shrink=True)
        assert found["family_size"].to_list() == [2, 2, 1, 1]
        assert found["family"].to_list()[2:] == pytest.approx([0.8, 0.5])
        assert found["family"][0] == found["family"][1] == pytest.approx(0.5 * 0.15 + 0.5 * 0.4, abs=0.02)

    def test_not_shrunk(self):
        """Without shrinking the value is the mean, with an interval of its own error."""
        found = valued(table(([1], alone(0.1, 0.2)), ([2], alone(0.3, 0.5))), shrink=False)
        assert found["value"].equals(found["mean"])
        assert all(found[name].null_count() == 2 for name in ("family", "family_spread", "family_size"))
        assert (found["high"] - found["mean"]).to_list() == pytest.approx((Z * found["error"]).to_list())

    def test_matches_differ(self):
        """Where whole matches differ, the error is larger than of the same instances spread over matches."""
        values = [0.5] * 10 + [-0.3] * 10
        together, apart = (valued(table(([1], matches)), shrink=False)["error"].item()
                           for matches in ([values[:10], values[10:]], alone(*values)))
        # squares 20 * .16 of 19 degrees of freedom, and the family's, which is itself
        variance = (3.2 + 10 * 3.2 / 19) / 29
        assert apart == pytest.approx((variance / 20) ** 0.5)
        # sums of matches: 2 * 4**2 where 3.2 * 20 / 19 is expected
        assert together == pytest.approx(apart * (32 / (20 * 3.2 / 19)) ** 0.5)

    def test_no_grams(self):
        """No grams have no values."""
        found = valued(table(), shrink=True)
        assert found.is_empty()
        assert {"value", "low", "high", "error"} <= set(found.columns)

    @pytest.mark.parametrize("shrink", [True, False])
    @pytest.mark.parametrize("seed", [1, 2])
    def test_lucky(self, seed, shrink):
        """Half of many rare grams that are worth nothing have a value above 0, and next to none are selected."""
        rng = np.random.default_rng(seed)
        codes = [(a, b, c, d) for a in range(1, 12) for b in range(1, 12) for c in range(1, 12) for d in (1, 2)][:2000]
        grams = table(*((list(each), alone(*rng.normal(0, 0.2, rng.integers(3, 6)))) for each in codes))
        every = RoundSettings(n=4, rows=1, columns=1, activation=0.1)
        kept = {}
        for by in ("value", "low"):
            settings = BehaviourSettings(select_by=by, shrink=shrink and by == "low", epochs=1)
            kept[by] = select(grams, 1, settings, every).report.groups_kept
        assert 900 < kept["value"] < 1100
        assert kept["low"] <= 60

    @pytest.mark.parametrize("n", [1, 2, 5, 30, 200])
    def test_worth_nothing(self, n):
        """A family that is worth nothing is seldom selected, however small it is."""
        rng = np.random.default_rng(n)
        shares = []
        for _ in range(60):
            found = valued(table(*(([1 + k // 11, 1 + k % 11, 1], alone(*rng.normal(0, 0.2, 12))) for k in range(n))),
                           shrink=True)
            shares.append((found["low"] > 0).mean())
        assert np.mean(shares) < 0.08

    def test_worth_something(self):
        """Grams that are worth something are selected though they are shrunk."""
        rng = np.random.default_rng(0)
        worth = np.repeat([0.0, 0.4], [40, 10])
        found = valued(table(*(([1 + k // 11, 1 + k % 11, 1], alone(*rng.normal(true, 0.2, 20)))
                               for k, true in enumerate(worth))), shrink=True)
        assert (found["low"].to_numpy() > 0)[worth > 0].all()
        assert ((found["low"].to_numpy() <= worth) & (worth <= found["high"].to_numpy())).mean() > 0.9


def known(seed, version=1, support=(3, 40)):
    """A version of behaviours as the selection makes them."""
    rng = np.random.default_rng(seed)
    rows = []
    for code in (1, 11, 46):
        values = exact(rng.normal(0.1, 0.2, rng.integers(*support)))
        rows.append({
            "behaviour_id": f"striker-{code:03d}", "role": "striker", "codes": [code], "n": 1, "support": len(values),
            "mean": values.sum() / len(values), "spread": values.std(), "neuron": seed,
            "error": rng.uniform(0.01, 0.2), "family": rng.normal(0, 0.1), "family_spread": rng.uniform(0.01, 0.2),
            "family_size": rng.integers(1, 30),
            "paper": rng.uniform(-1, 1), "x": rng.uniform(-1, 1), "y": rng.uniform(-1, 1), "version": version,
        })
    made = pl.DataFrame(rows, schema={**Behaviours.dtypes()})
    return Behaviours.validate(estimated(made).select(list(Behaviours.dtypes())))


def old(seed):
    """The same as version 1 of the table had them."""
    nothing = [pl.lit(None, Behaviours.dtypes()[name]).alias(name) for name in NEW]
    return known(seed).with_columns(value=pl.col("mean")).with_columns(nothing)


class TestMerging:
    @pytest.mark.parametrize("ages", ["nnnn", "onnn", "nnno", "oooo"])
    def test_in_steps(self, ages):
        """Behaviours merged in steps are those merged at once, whatever version their tables have."""
        parts = [(known if age == "n" else old)(seed) for seed, age in enumerate(ages)]
        whole = Behaviours.validate(merge_behaviours(parts, 9))
        steps = parts[0]
        for part in parts[1:]:
            steps = Behaviours.validate(merge_behaviours([steps, part], 9))
        exactly = ["behaviour_id", "role", "codes", "n", "support", "mean", "neuron", "version"]
        assert steps.select(exactly).equals(whole.select(exactly))
        for name in set(Behaviours.dtypes()) - set(exactly):
            assert steps[name].is_null().to_list() == whole[name].is_null().to_list()
            assert steps[name].drop_nulls().to_list() == pytest.approx(whole[name].drop_nulls().to_list(), abs=1e-9)
        if "o" in ages:
            assert whole["low"].null_count() == whole["error"].null_count() == whole.height
            assert whole["value"].equals(whole["mean"].alias("value"))

    def test_error_by_hand(self):
        """The error of a merged mean is that of the mean of independent estimates."""
        one, two = known(1), known(2)
        merged = merge_behaviours([one, two], 2)
        n, m = one["support"], two["support"]
        error = ((n * one["error"]) ** 2 + (m * two["error"]) ** 2).sqrt() / (n + m)
        # sorted alike: one code each
        assert merged["error"].to_list() == pytest.approx(error.to_list())
        assert (merged["error"] < pl.DataFrame([one["error"], two["error"].alias("two")]).max_horizontal()).all()

    def test_unshrunk(self):
        """A version that was not shrunk leaves nothing to shrink towards, and no narrower interval."""
        nothing = {name: pl.lit(None, Behaviours.dtypes()[name]) for name in ("family", "family_spread", "family_size")}
        merged = merge_behaviours([known(1), known(2).with_columns(**nothing)], 2)
        assert merged["value"].to_list() == pytest.approx(merged["mean"].to_list())
        assert (merged["high"] - merged["low"]).to_list() == pytest.approx((2 * Z * merged["error"]).to_list())
