"""Intervals against published examples and coverage; verdicts on tables where the right one is plain."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from support.points import curve, over_decays, point, table

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.numbers.claims import Claim, Evidence, Range, counted, findings
from pitchlore.pipeline.numbers.statistics import (
    UNDEFINED,
    Estimate,
    difference,
    greatest,
    least,
    magnitude,
    mean,
    mean_interval,
    weighted_sum,
    welch,
    wilson,
)
from pitchlore.pipeline.stages.paradigms.claims import AT_PEAK, CLAIMS, NEVER, PEAK, SOMETIMES, verdicts
from pitchlore.schemas.paradigms import Paradigms, Verdicts

REPRODUCED, UNDECIDED, CONTRADICTED = "reproduced", "not reproduced", "contradicted"

probabilities = st.floats(0, 1)
counts = st.integers(1, 3000)


@given(st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_is_scipys(drawn):
    """Wilson's interval is SciPy's."""
    k, n = drawn
    expected = stats.binomtest(k, n).proportion_ci(0.95, "wilson")
    assert wilson(k, n) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_wilson_of_fractions():
    """Wilson's interval takes counts that are not whole, and ends at 0 and 1."""
    assert (wilson(0.0, 3)[0], wilson(3.0, 3)[1]) == (0.0, 1.0)
    assert sum(wilson(1.5, 3)) == pytest.approx(1.0)  # half of the trainings: symmetric about .5
    # n = 3, p = 1: z²/(n + z²) = 3.8415/6.8415 are open below
    assert wilson(3.0, 3)[0] == pytest.approx(1 - 3.841459 / 6.841459, abs=1e-6)


def test_student_interval():
    """A mean has Student's interval; NaN does not count, and one value has none."""
    values = [4.0, 5.0, 4.5, 7.0]
    expected = stats.t.interval(0.95, 3, loc=np.mean(values), scale=stats.sem(values))
    assert mean_interval(values) == pytest.approx(expected)
    assert mean_interval([*values, np.nan]) == pytest.approx(expected)
    assert mean_interval([4.0]) is None
    assert mean_interval([np.nan, 4.0]) is None
    assert mean_interval([]) is None
    assert mean_interval([4.0, 4.0]) == (4.0, 4.0)


@given(*(st.lists(st.integers(-50, 50), min_size=2, max_size=most, unique=True) for most in (6, 9)))
def test_welch_interval(one, other):
    """A difference of means has Welch's interval."""
    expected = stats.ttest_ind(one, other, equal_var=False).confidence_interval(0.95)
    assert welch([*one, np.nan], other) == pytest.approx((expected.low, expected.high), rel=1e-6, abs=1e-6)


def test_welch_few_values():
    """A difference of means has an interval only with two values on either side."""
    assert welch([1.0], [1.0, 2.0]) is None
    assert welch([1.0, np.nan], [1.0, 2.0]) is None
    assert welch([3.0, 3.0], [1.0, 1.0]) == (2.0, 2.0)


def proportion(p, n):
    """A proportion with Wilson's interval."""
    return Estimate(p, *wilson(p * n, n))


def newcombe(p1, n1, p2, n2):
    """Interval of a difference of two proportions."""
    _, *interval = difference(proportion(p1, n1), proportion(p2, n2))
    return interval


@pytest.mark.parametrize(
    ("k1", "n1", "k2", "n2", "low", "high"),
    [  # Newcombe 1998, table II, method 10
        (56, 70, 48, 80, 0.0524, 0.3339),
        (9, 10, 3, 10, 0.1705, 0.8090),
        (10, 10, 0, 20, 0.6791, 1.0000),
        (10, 10, 0, 10, 0.6075, 1.0000),
    ],
)
def test_newcombe_interval(k1, n1, k2, n2, low, high):
    """A difference of proportions has Newcombe's interval."""
    assert newcombe(k1 / n1, n1, k2 / n2, n2) == pytest.approx([low, high], abs=5e-5)


@given(probabilities, counts, probabilities, counts)
def test_difference_bounds(p1, n1, p2, n2):
    """The interval of a difference contains it, stays in bounds and is antisymmetric."""
    low, high = newcombe(p1, n1, p2, n2)
    assert -1 - 1e-12 <= low <= p1 - p2 + 1e-12
    assert p1 - p2 - 1e-12 <= high <= 1 + 1e-12
    other = newcombe(p2, n2, p1, n1)
    assert other == pytest.approx([-high, -low], abs=1e-12)


def test_sums_and_extremes():
    """Sums, means, extremes and magnitudes of estimates are those worked by hand."""
    one, other = Estimate(0.5, 0.4, 0.7), Estimate(0.2, 0.17, 0.24)
    # .5 - .2: down √(.1² + .04²) = .10770, up √(.2² + .03²) = .20224
    assert weighted_sum([1, -1], [one, other]) == pytest.approx((0.3, 0.3 - 0.107703, 0.3 + 0.202237), abs=1e-6)
    # half of each: down √(.05² + .015²), up √(.1² + .02²)
    assert mean([one, UNDEFINED, other]) == pytest.approx((0.35, 0.35 - 0.052202, 0.35 + 0.101980), abs=1e-6)
    wide = Estimate(0.45, 0.1, 0.9)
    assert greatest([one, wide, UNDEFINED]) == Estimate(0.5, 0.4, 0.9)
    assert least([one, wide, UNDEFINED]) == Estimate(0.45, 0.1, 0.7)
    assert magnitude(Estimate(-0.2, -0.3, -0.1)) == Estimate(0.2, 0.1, 0.3)
    assert magnitude(Estimate(-0.1, -0.3, 0.1)) == Estimate(0.1, 0.0, 0.3)
    assert not any(e.defined for e in (mean([UNDEFINED]), greatest([]), least([]), weighted_sum([1, -1], [one, UNDEFINED])))


def test_one_rule():
    """A claim is reproduced inside its range, contradicted outside, and else undecided."""
    inside = Range("", 0.0, 1.0)
    assert inside.verdict(Estimate(0.5, 0.0, 1.0)) == REPRODUCED  # the ends belong to it
    assert inside.verdict(Estimate(0.5, -0.1, 0.9)) == UNDECIDED
    assert inside.verdict(Estimate(1.2, 1.0, 1.4)) == UNDECIDED  # touches
    assert inside.verdict(Estimate(1.2, 1.1, 1.4)) == CONTRADICTED
    assert inside.verdict(UNDEFINED) == UNDECIDED
    above = Range("", low=0.0, strict=True)
    assert above.verdict(Estimate(0.5, 0.0, 1.0)) == UNDECIDED
    assert above.verdict(Estimate(0.0, 0.0, 0.0)) == CONTRADICTED  # 0 is not above 0
    assert above.verdict(Estimate(-0.1, -0.2, 0.0)) == CONTRADICTED
    assert Range("", high=0.0, strict=True).verdict(Estimate(0.1, 0.0, 0.2)) == CONTRADICTED
    assert above.verdict(UNDEFINED) == UNDECIDED
    assert above.verdict(Estimate(0.5, 0.1, 1.0)) == REPRODUCED
    assert above.verdict(Estimate(-0.5, -1.0, -0.1)) == CONTRADICTED


def test_verdict_order():
    """The paper's own number comes first, then the count of observations, then the range, then the claim's kind."""
    def verdict(estimate, observations=5, printed=None, **kind):
        claim = Claim("Table 3", "It grows", "growth", Range("above 0", low=0.0, strict=True),
                      lambda _: [Evidence(estimate, observations, {"settings": "paper"}, printed)], **kind)
        [row] = findings([claim], None, least=5)
        assert [row[name] for name in ("item", "claim", "quantity", "stated", "settings")] == [
            "Table 3", "It grows", "growth", "above 0", "paper"]
        return row["verdict"]

    grows, unclear, falls = Estimate(2, 1, 3), Estimate(1, -1, 3), Estimate(-2, -3, -1)
    assert verdict(grows) == verdict(grows, printed=0.1) == "reproduced"
    assert verdict(grows, printed=0.0) == verdict(grows, 0, printed=-1.0) == "contradictory"
    assert verdict(grows, 4) == verdict(UNDEFINED, 0) == verdict(falls, 4, by_construction=True) == "not judged"
    assert [verdict(e, by_construction=True) for e in (grows, unclear, falls)] == ["by construction", UNDECIDED, CONTRADICTED]


def test_counts_in_words():
    """Words are counted, the most frequent first."""
    assert counted(["b", "a", "c", "a", "c"]) == "5 claims: 2 a, 2 c, 1 b"
    assert counted([]) == "0 claims: "


def test_paper_intervals():
    """The paper's intervals are those of its 100 runs."""
    assert (PEAK.decay, PEAK.p) == (0.9997, 0.7)
    expected = stats.binomtest(70, 100).proportion_ci(0.95, "wilson")
    assert (PEAK.low, PEAK.high) == pytest.approx((expected.low, expected.high))
    assert NEVER.high == pytest.approx(0.0370, abs=5e-5)
    assert NEVER.high == SOMETIMES.low
    assert AT_PEAK.low < 0.9997 < AT_PEAK.high


def judged(points, text, **where):
    """{(reading, decay): verdict} of the claim that contains the text."""
    found = verdicts(points).filter(pl.col("claim").str.contains(text, literal=True))
    for column, value in where.items():
        found = found.filter(pl.col(column).str.contains(value, literal=True))
    return {(row["reading"], row["decay"]): row["verdict"] for row in found.iter_rows(named=True)}


def only(points, text, **where):
    (verdict,) = judged(points, text, **where).values()
    return verdict


@pytest.mark.parametrize(("text", "points", "expected"), [
    # a claim of probability one is judged by what 100 successes in 100 runs leave possible
    *(("Without penalty IQ", [point(4, "IQ", p, k=0.0, runs=runs)], expected) for p, runs, expected in (
        (1.0, 100, REPRODUCED), (0.99, 100, UNDECIDED), (0.99, 2000, REPRODUCED), (0.963, 2000, UNDECIDED),
        (0.9, 2000, CONTRADICTED))),
    # one of "never" by what no success in 100 runs leaves possible
    *(("JAQ never converges", [over_decays("JAQ", {0.99: 0.0, 0.9997: p}, runs=runs)], expected) for p, runs, expected in (
        (0.0, 100, REPRODUCED), (0.01, 100, UNDECIDED), (0.01, 2000, REPRODUCED), (0.035, 2000, UNDECIDED),
        (0.05, 2000, CONTRADICTED))),
    # one of "sometimes" begins where "never" ends
    *(("IVQ sometimes converges", [over_decays("IVQ", {0.99: 0.0, 0.9997: p})], expected) for p, expected in (
        (0.05, REPRODUCED), (0.035, UNDECIDED), (0.02, CONTRADICTED))),
    # that IVQ alone converges is contradicted if another learner converges more often
    *(("IVQ alone", [over_decays("IVQ", {0.99: 0.1, 0.9997: 0.6}), over_decays("IQ", {0.99: 0.0}),
                     over_decays("JAQ", {0.99: p, 0.9997: 0.0})], expected) for p, expected in (
        (0.0, REPRODUCED), (0.55, UNDECIDED), (0.7, CONTRADICTED))),
    # a curve falls by its two ends
    *(("IQ's probability falls as k falls", [curve(4, "IQ", {0: 0.9, -10: 0.2, -30: p})], expected) for p, expected in (
        (0.5, REPRODUCED), (0.9, UNDECIDED), (1.0, CONTRADICTED))),
])
def test_probabilities(text, points, expected):
    """A claim about how often learners converge is judged by all runs that bear on it."""
    assert only(table(*points), text) == expected


@pytest.mark.parametrize(
    ("p", "runs", "expected"),
    [(0.7, 2000, REPRODUCED), (0.62, 2000, UNDECIDED), (0.541, 2000, CONTRADICTED), (0.9, 2000, CONTRADICTED),
     (0.66, 100, UNDECIDED)],
)
def test_value_from_figure(p, runs, expected):
    """A value read off a figure is judged with the interval of the paper's runs."""
    points = table(point(5, "IVQ", p, decay=0.9997, runs=runs))
    row = verdicts(points).filter(pl.col("claim").str.contains("near 0.7")).row(0, named=True)
    assert row["verdict"] == expected
    assert row["measured"] == p
    assert row["low"] < p < row["high"]


@pytest.mark.parametrize(
    ("values", "expected", "low", "high"),
    [
        ({0.9995: 0.5, 0.9997: 0.7, 0.9999: 0.4}, REPRODUCED, 0.9997, 0.9997),
        ({0.9995: 0.5, 0.9997: 0.69, 0.9998: 0.7}, UNDECIDED, 0.9997, 0.9998),  # .69 and .70 cannot be distinguished
        ({0.9995: 0.5, 0.9997: 0.6, 0.9998: 0.7}, CONTRADICTED, 0.9998, 0.9998),
    ],
)
def test_the_best_decay(values, expected, low, high):
    """The best decay is undecided while it cannot be distinguished from another."""
    row = verdicts(table(over_decays("IVQ", values))).filter(pl.col("claim").str.contains("best decay"))
    assert row["verdict"].item() == expected
    assert (row["measured"].item(), row["low"].item(), row["high"].item()) == (max(values, key=values.get), low, high)


def test_best_decay_neighbours():
    """The best decay is judged only with neighbours on both sides, and a fall only by two points."""
    for values in ({0.9997: 0.7}, {0.9997: 0.7, 0.9999: 0.3}, {0.9996: 0.7, 0.9998: 0.3}):
        assert judged(table(over_decays("IVQ", values)), "best decay") == {}
    assert judged(table(curve(4, "IQ", {0: 0.9})), "falls as k falls") == {}


def test_other_equilibrium():
    """The other equilibrium's probability is what the optimum leaves of all equilibria."""
    points = table(over_decays("IQ", {0.99: 0.01}, equilibrium=0.9), over_decays("JAQ", {0.99: 0.5}, equilibrium=0.5))
    found = verdicts(points).filter(pl.col("claim").str.contains("at best to (a1, b1)", literal=True))
    assert found["measured"].to_list() == pytest.approx([0.89, 0.0])
    assert found["verdict"].to_list() == [REPRODUCED, CONTRADICTED]


KS = (0, -2, -5, -10, -30)


def test_lead_over_k():
    """A learner leads another by its mean over k."""
    def penalty(iq, jaq, ivq):
        return table(curve(4, "IQ", dict(zip(KS, iq, strict=True))), curve(4, "JAQ", dict(zip(KS, jaq, strict=True))),
                     curve(4, "IVQ", dict(zip(KS, ivq, strict=True))))

    as_told = penalty((1, 0.8, 0.6, 0.3, 0.1), (1, 0.7, 0.5, 0.5, 0.5), (1, 0.9, 0.7, 0.3, 0.1))
    equal = penalty(*[(1, 0.8, 0.6, 0.3, 0.1)] * 3)
    # JAQ better near zero and worse far off; IQ above IVQ
    reverse = penalty((1, 0.8, 0.6, 0.6, 0.6), (1, 0.9, 0.9, 0.0, 0.0), (1, 0.7, 0.5, 0.6, 0.6))
    for text in ("JAQ performs best over all", "IQ is better than JAQ", "IVQ is best with k near zero", "IVQ is better than JAQ"):
        assert [only(points, text) for points in (as_told, equal, reverse)] == [REPRODUCED, UNDECIDED, CONTRADICTED], text


def test_shared_k():
    """A lead is the mean over the k that both learners have."""
    points = table(curve(4, "IQ", {-1: 0.9, -4: 0.7, -5: 0.1}), curve(4, "JAQ", {-1: 0.5, -4: 0.5, -30: 1.0}))
    row = verdicts(points).filter(pl.col("claim").str.contains("IQ is better than JAQ"))
    assert row["measured"].item() == pytest.approx(0.3)  # (.4 + .2) / 2
    # four proportions with weights ±1/2; each of Newcombe's intervals counts half
    halves = [newcombe(0.9, 2000, 0.5, 2000), newcombe(0.7, 2000, 0.5, 2000)]
    down = np.hypot(0.4 - halves[0][0], 0.2 - halves[1][0]) / 2
    assert row["low"].item() == pytest.approx(0.3 - down)
    # a k "near zero" is one from -5 on, but not 0
    points = table(curve(4, "IQ", {0: 0.9, -1: 0.6, -5: 0.8, -6: 0.1}), curve(4, "JAQ", dict.fromkeys((0, -1, -5, -6), 0.5)))
    row = verdicts(points).filter(pl.col("claim").str.contains("IQ is better than JAQ"))
    assert row["measured"].item() == pytest.approx(0.2)  # (.1 + .3) / 2


def grid(il_a=0.5, il_b=0.5, jaq=0.2, ivq=0.5, *, decay=0.99, path=(8, 8, 8, 6), runs=2000, ks=range(16), half=0.05):
    parts = zip(("IL-A", "IL-B", "JAQ", "IVQ"), (il_a, il_b, jaq, ivq), path, strict=True)
    return [row for name, p, steps in parts
            for row in curve(6, name, dict.fromkeys(ks, p), decay=decay, path=steps, half=half, runs=runs, tests=1000)]


def test_jaq_smallest():
    """The claim that JAQ is the smallest is judged at each decay."""
    points = table(grid(decay=0.99), grid(decay=0.995, jaq=0.5), grid(decay=0.9999, il_a=0.1))
    line_up = "IL-A, IL-B, JAQ, IVQ printed"
    assert judged(points, "JAQ has the smallest") == {
        (line_up, 0.99): REPRODUCED, (line_up, 0.995): UNDECIDED, (line_up, 0.9999): CONTRADICTED,
    }


@pytest.mark.parametrize(("ivq", "expected"), [(0.52, REPRODUCED), (0.6, UNDECIDED), (0.8, CONTRADICTED)])
def test_almost_the_same(ivq, expected):
    """Curves are almost the same by their means and by their greatest distance."""
    points = table(grid(ivq=ivq))
    assert only(points, "almost the same", quantity="mean") == expected
    assert only(points, "almost the same", quantity="greatest distance") == expected


def test_crossing_curves():
    """Curves that cross are not the same, although their means are."""
    crossing = curve(6, "IVQ", {k: 0.2 if k < 8 else 0.8 for k in range(16)}, decay=0.99)
    points = table(crossing, curve(6, "IL-B", {k: 0.8 if k < 8 else 0.2 for k in range(16)}, decay=0.99))
    assert only(points, "almost the same", quantity="mean") == REPRODUCED
    assert only(points, "almost the same", quantity="greatest distance") == CONTRADICTED


def test_more_exploration():
    """The effect of more exploration is judged for each learner by itself."""
    reported = table(grid(decay=0.99, path=(9, 9, 9, 9)),
                 grid(decay=0.9999, il_a=0.3, il_b=0.3, jaq=0.2, ivq=0.7, path=(6, 6, 6, 6)))
    for name in ("IL-A", "IL-B"):
        assert only(reported, f"exploration {name}'s probability falls") == REPRODUCED
        assert only(reported, f"exploration {name}'s probability rises") == CONTRADICTED
    assert only(reported, "exploration JAQ's probability rises") == UNDECIDED
    assert set(judged(reported, "exploration IVQ's probability rises").values()) == {REPRODUCED}
    for name in ("IL-A", "IL-B", "JAQ", "IVQ"):
        assert only(reported, f"exploration {name}'s path is shorter") == REPRODUCED
    longer = table(grid(decay=0.99), grid(decay=0.9999, path=(8, 9, 8, 9)))
    assert only(longer, "IL-B's path is shorter") == CONTRADICTED
    assert only(longer, "IL-A's path is shorter") == UNDECIDED
    assert judged(table(grid()), "more exploration") == {}


def test_best_of_both():
    """Being best in probability and path joined is judged by each of the two."""
    def halves(points):
        found = verdicts(points).filter(pl.col("claim").str.contains("joined"))
        return found["verdict"].to_list()

    assert halves(table(grid(path=(8, 6.2, 8, 6)))) == [REPRODUCED, REPRODUCED]
    assert halves(table(grid(il_b=0.9, path=(8, 5, 8, 6)))) == [CONTRADICTED, CONTRADICTED]
    assert halves(table(grid(il_b=0.6, path=(8, 5.6, 8, 6)))) == [UNDECIDED, UNDECIDED]


def test_unwalked_path():
    """A path that nobody walked is null, and one that one run walked is undecided."""
    points = table(grid(decay=0.99, path=(None, 8, 8, 8)), grid(decay=0.9999, path=(None, 6, 6, 6)))
    row = verdicts(points).filter(pl.col("claim").str.contains("IL-A's path")).row(0, named=True)
    assert (row["measured"], row["low"], row["high"], row["verdict"]) == (None, None, None, UNDECIDED)
    # one run that succeeded has a length, but no interval
    alone = table(grid(decay=0.99, half=None), grid(decay=0.9999, half=None))
    assert set(judged(alone, "path is shorter").values()) == {UNDECIDED}


def test_namesakes():
    """Every reading is judged with the other learners' readings of the same name."""
    points = table(
        over_decays("IQ", {0.99: 0.0}), over_decays("JAQ", {0.99: 0.0}),
        over_decays("JAQ", {0.99: 0.3}, reading="recency"),
        over_decays("IVQ", {0.99: 0.6}), over_decays("IVQ", {0.99: 0.2}, reading="recency"),
        over_decays("IVQ", {0.99: 0.0}, reading="unbracketed"),
    )
    assert judged(points, "IVQ alone") == {
        ("IQ, JAQ, IVQ printed", None): REPRODUCED,
        ("IQ printed; JAQ, IVQ recency", None): CONTRADICTED,
        ("IQ, JAQ printed; IVQ unbracketed", None): CONTRADICTED,
    }
    assert set(judged(points, "JAQ never")) == {("JAQ printed", None), ("JAQ recency", None)}


def test_missing_reading():
    """A learner without the reading is taken as printed, else in its first reading; each line-up is judged once."""
    points = table(
        over_decays("IQ", {0.99: 0.0}), over_decays("IQ", {0.99: 0.0}, reading="a"),
        over_decays("JAQ", {0.99: 0.0}, reading="c"), over_decays("JAQ", {0.99: 0.0}, reading="b"),
        over_decays("IVQ", {0.99: 0.5}, reading="z"),
    )
    assert {reading for reading, _ in judged(points, "IVQ alone")} == {
        "IQ a; JAQ b; IVQ z", "IQ printed; JAQ b; IVQ z", "IQ printed; JAQ c; IVQ z",
    }
    points = table(over_decays("IQ", {0.99: 0.0}, reading="discount 0"), over_decays("JAQ", {0.99: 0.0}, reading="lifetime"),
                   over_decays("IVQ", {0.99: 0.5}, reading="literal"))
    assert judged(points, "IVQ alone").keys() == {("IQ discount 0; JAQ lifetime; IVQ literal", None)}


def test_no_points():
    """Claims without points have no verdict."""
    assert verdicts(Paradigms.empty()).height == 0
    assert set(verdicts(table(over_decays("IQ", {0.99: 0.0})))["figure"]) == {5}
    # peers, other games and other studies are not what the paper speaks of
    others = table(over_decays("FMQ", {0.99: 1.0}), over_decays("IQ", {0.99: 1.0}, game="stochastic climbing"),
                   over_decays("IQ", {0.99: 1.0}, study="sensitivity"))
    assert verdicts(others).height == 0


def test_runs_apart():
    """Each number of runs is judged by itself."""
    points = table(over_decays("IQ", {0.99: 0.01}, runs=100), over_decays("IQ", {0.99: 0.01}, runs=2000))
    found = verdicts(points).filter(pl.col("claim").str.contains("IQ never"))
    assert found.select("runs", "verdict").rows() == [(100, UNDECIDED), (2000, REPRODUCED)]


def test_all_claims():
    """All claims of the paper are judged in its order, whatever the order of the points."""
    everything = table(
        *(curve(4, name, dict.fromkeys(KS, 0.5), decay=decay) for name in ("IQ", "JAQ", "IVQ") for decay in (0.998, 0.9999)),
        *(over_decays(name, {0.999: 0.1, 0.9997: 0.4, 0.9999: 0.1}, equilibrium=0.9) for name in ("IQ", "JAQ", "IVQ")),
        grid(decay=0.99), grid(decay=0.9999),
    )
    found = verdicts(everything)
    assert list(found.schema.items()) == list(Verdicts.dtypes().items())
    order = [(int(claim.item.removeprefix("Figure ")), claim.text, claim.quantity) for claim in CLAIMS]
    assert found.select("figure", "claim", "quantity").unique(maintain_order=True).rows() == order
    assert set(found["figure"]) == {4, 5, 6, 7}
    shuffled = everything.sample(fraction=1.0, shuffle=True, seed=1)
    assert verdicts(shuffled).equals(found)


def test_double_point():
    """A point that is there twice is refused."""
    points = table(over_decays("IQ", {0.99: 0.0}, seed=1), over_decays("IQ", {0.99: 0.5}, seed=2))
    with pytest.raises(SchemaMismatch, match="2 points are there more than once, the first of IQ"):
        verdicts(points)
