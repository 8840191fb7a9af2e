"""Claims about seasons: the paper's own facts, and verdicts where the right one is plain."""

import math

import polars as pl
import pytest
from scipy import stats
from support.seasons import ablations, apprentices, evaluation, evolving, rising, season, tables, world

from pitchlore.pipeline.game.tactics.executors.actions import LIMIT_S
from pitchlore.pipeline.numbers.statistics import mean_interval, wilson
from pitchlore.pipeline.stages.report import table3
from pitchlore.pipeline.stages.report.claims import CLAIMS, season_verdicts
from pitchlore.pipeline.stages.report.measures import (
    OTHER,
    SeasonTables,
    greatest_in_games,
    grown_without_training,
    least_step,
    mean_in_games,
    overall_other,
    paper_value,
    pooled,
    seasons_of,
    slope,
    total,
)
from pitchlore.pipeline.stages.report.summary import (
    ablated,
    attributed,
    beside_table_3,
    mean_curves,
    measured,
    seasons_played,
    settings_compared,
)
from pitchlore.schemas import Claims, Evaluations, Games, Growth
from pitchlore.schemas.situations import MOVES_RANDOMLY

HUMAN, STATIC, RANDOM, PERSON = "human-like", "static", "random", "person"
NONE = Evaluations.empty()


def judged(games, growth, evaluations=NONE):
    """Verdicts on the paper's claims."""
    return season_verdicts(seasons_of(games, growth, evaluations))


def claim(found, text, opponent=None, quantity=""):
    rows = found.filter(pl.col("claim").str.contains(text, literal=True) & pl.col("quantity").str.contains(quantity, literal=True))
    rows = rows if opponent is None else rows.filter(pl.col("opponent") == opponent)
    assert rows.height == 1, rows
    return rows.row(0, named=True)


@pytest.mark.parametrize(("column", "measure", "value"), [
    ("humans", mean_in_games(OTHER, 1, 10), 2.32), ("humans", mean_in_games(OTHER, 11, 20), 3.08), ("humans", mean_in_games(OTHER, 21, 35), 2.39),
    ("humans", mean_in_games(OTHER, 11, 35), 2.67), ("humans", slope(OTHER, 1, 10), 0.63), ("humans", slope(OTHER, 11, 35), -0.02),
    ("humans", overall_other(1, 35), 2.50), ("humans", greatest_in_games(OTHER, 1, 35), 7.35),
    (STATIC, mean_in_games(OTHER, 1, 10), 0.0), (STATIC, mean_in_games(OTHER, 11, 20), 3.61), (STATIC, mean_in_games(OTHER, 21, 35), 3.04),
    (STATIC, mean_in_games(OTHER, 11, 35), 3.27), (STATIC, slope(OTHER, 11, 35), 0.02), (STATIC, overall_other(1, 35), 2.38),
])
def test_paper_table(column, measure, value):
    """Measures of the paper's own table have the values known of it."""
    assert paper_value(measure, column) == pytest.approx(value, abs=0.0051)


def test_contradictory_claims():
    """Claims that the paper's own table does not bear out are contradictory; none that says "about" is among them."""
    found = judged(Games.empty(), Growth.empty(), NONE)
    assert found.filter(pl.col("stated").str.starts_with("about"), pl.col("verdict") == "not judged").height == 9
    denied = found.filter(pl.col("verdict") == "contradictory")
    assert denied["quantity"].to_list() == [
        "share of games 2 to 35 with other actions", "slope of other actions in games 11 to 35, % a game",
        "other actions in games 11 to 35, mean %",
    ]
    assert (found.filter(pl.col("verdict") != "contradictory")["verdict"] == "not judged").all()
    assert found["measured"].null_count() == found.height == len(CLAIMS)


def test_missing_games():
    """Measures of a phase need all its games."""
    games, growth = tables(season(last=12, without=(4,), other=lambda g: float(g)))
    (one,) = seasons_of(games, growth, NONE)["paper", STATIC]
    assert mean_in_games(OTHER, 5, 12)(one) == pytest.approx(8.5)
    assert total(pl.col("other_actions"), 5, 6)(one) == 110
    assert slope(OTHER, 5, 12)(one) == pytest.approx(1.0)
    assert math.isnan(mean_in_games(OTHER, 1, 10)(one))
    assert math.isnan(least_step("states", 3, 5)(one))
    assert math.isnan(mean_in_games(OTHER, 5, 13)(one))


def test_no_decisions():
    """A game without decisions says nothing of shares."""
    games, growth = season(other=lambda g: 10.0, last=3)
    games = games.with_columns(pl.when(pl.col("game") == 2).then(0).otherwise(pl.col(c)).alias(c).cast(pl.Int64)
                               for c in ("actions", "random_actions", "other_actions"))
    assert mean_in_games(OTHER, 1, 3)(SeasonTables(games, growth, NONE)) == 10.0
    assert slope(OTHER, 1, 3)(SeasonTables(games, growth, NONE)) == pytest.approx(0.0, abs=1e-12)


def test_steps_and_growth():
    """The least step may fall, and growth without training adds up over all roles."""
    games, growth = tables(season(last=4, states=lambda g: (5, 9, 7, 12)[g - 1], behaviours=lambda g: 2 * g,
                                  knowledge=lambda g: (1, 2, 2, 3)[g - 1]))
    (one,) = seasons_of(games, growth, NONE)["paper", STATIC]
    assert least_step("states", 1, 4)(one) == -2
    assert grown_without_training("behaviours", 1, 4)(one) == 3 * 2  # game 3, all three roles


def test_intervals():
    """The interval of a mean over seasons is Student's, and that of a count of seasons Wilson's."""
    estimate, n = pooled([4.0, 5.0, 4.5, 7.0, math.nan], "mean")
    assert (estimate.value, n) == (5.125, 4)
    # s = 1.315, t(3) = 3.182
    assert estimate.high - estimate.value == pytest.approx(3.182446 * 1.3149778 / 2, abs=1e-4)
    estimate, n = pooled([1.0] * 5, "seasons")
    assert estimate.low == pytest.approx(5 / (5 + 3.841459), abs=1e-6)
    assert pooled([math.nan], "mean") == pooled([], "mean")


def test_rate_interval():
    """A rate is as uncertain as its few trials and its few seasons make it, within 0 and 1."""
    # no season differs: the trials alone make it uncertain
    estimate, _ = pooled([1.0] * 5, "rate", 25)
    assert (estimate.low, estimate.high) == (pytest.approx(125 / (125 + 3.841459), abs=1e-6), 1.0)
    # seasons differ by far more than 1,000 trials each do: Student's, t(2) = 4.303, s = 0.1
    estimate, n = pooled([0.5, 0.6, math.nan, 0.7], "rate", 1000)
    assert n == 3
    assert estimate == pytest.approx((0.6, 0.6 - 4.302653 * 0.1 / 3**0.5, 0.6 + 4.302653 * 0.1 / 3**0.5), abs=1e-5)
    # never beyond what a rate can be
    estimate, _ = pooled([0.0, 1.0], "rate", 10)
    assert estimate == (0.5, 0.0, 1.0)
    # of one apprentice it is unknown how others differ
    assert math.isnan(pooled([0.9], "rate", 1000)[0].low)


@pytest.mark.parametrize(("pooling", "values", "ends"), [
    ("mean", [0.0, 2.0], (-11.706205, 13.706205)), ("count", [0.0, 2.0], (0.0, 13.706205)),
    ("percent", [98.0, 100.0], (99 - 12.706205, 100.0)), ("share", [0.0, 1.0], (0.0, 1.0)),
])
def test_interval_ends(pooling, values, ends):
    """An interval ends where the quantity does."""
    estimate, _ = pooled(values, pooling)
    assert (estimate.low, estimate.high) == pytest.approx(ends, abs=1e-5)


def test_one_season():
    """One season is measured without an interval and not judged."""
    found = judged(*tables(season("paper", STATIC, other=evolving(0))), NONE)
    row = claim(found, "nothing evolves")
    assert (row["measured"], row["low"], row["high"], row["seasons"], row["verdict"]) == (0.0, None, None, 1, "not judged")


def test_paper_claims():
    """Most of what the paper says is reproduced where it holds."""
    found = judged(*world())
    assert list(found.schema.items()) == list(Claims.dtypes().items())
    assert claim(found, "nothing evolves")["verdict"] == "reproduced"
    assert claim(found, "from game 11 on", quantity="11 less those")["verdict"] == "reproduced"
    assert claim(found, "Both halves")["verdict"] == "reproduced"  # 5 of 5: at least .57
    assert claim(found, "The rate of new actions", STATIC)["verdict"] == "reproduced"
    assert claim(found, "Actions in a game", STATIC)["verdict"] == "contradicted"  # 1,000, not 3,976
    assert claim(found, "the striker knows more states")["verdict"] == "reproduced"
    assert claim(found, "makes more goals", quantity="direct or indirect")["measured"] == pytest.approx(2.0)
    # the paper's words against its table stay so, whatever ours show
    row = claim(found, "a tendency to increase")
    assert (row["verdict"], row["measured"] > 0) == ("contradictory", True)


def test_by_construction():
    """A result that could not be otherwise holds by construction and is no evidence."""
    found = judged(*world())
    by_construction = found.filter(pl.col("verdict") == "by construction")
    assert by_construction["claim"].unique(maintain_order=True).to_list() == [
        "The first game knows only random actions", "The number of states never falls", "States increase during playing",
        "States increase during training", "Actions increase only during training", "Actions increase during training"]
    assert by_construction.height == 12
    # moves randomly takes 0.4 s: three robots decide 3,600 times in eight minutes, near enough to both columns
    steady = [season("paper", kind, s, actions=round(3 * 480 / LIMIT_S[MOVES_RANDOMLY])) for s in range(5) for kind in (HUMAN, STATIC)]
    found = judged(*tables(*steady), NONE)
    assert {claim(found, "Actions in a game", kind)["verdict"] for kind in (HUMAN, STATIC)} == {"by construction"}
    # should one of them not hold, that is said, and few seasons say nothing of it either
    forgetful = [season("paper", STATIC, s, states=lambda g: 100 - g) for s in range(5)]
    assert claim(judged(*tables(*forgetful), NONE), "never falls", STATIC)["verdict"] == "contradicted"
    assert claim(judged(*tables(*forgetful[:4]), NONE), "only during training", STATIC)["verdict"] == "not judged"


def test_people():
    """Seasons against people are the human column: the second script says nothing of people any more."""
    people = [season("paper", PERSON, s, other=lambda g, s=s: rising(s)(g) if g > 2 else 0.0) for s in range(5)]
    games, growth = (pl.concat(parts) for parts in zip(world(), *people, *ablations(), strict=True))
    before, found = judged(*world(), NONE), judged(games, growth, NONE)
    assert claim(before, "used from game 2 on")["verdict"] == "reproduced"
    row = claim(found, "used from game 2 on")
    assert (row["opponent"], row["measured"], row["seasons"], row["verdict"]) == (PERSON, 0.0, 5, "contradicted")
    assert row["table_3"] == claim(before, "used from game 2 on")["table_3"] == pytest.approx(0.87, abs=0.005)
    assert set(found["opponent"]) == {PERSON, STATIC, f"{PERSON} less {STATIC}", f"{STATIC} less {PERSON}"}
    assert found.height == before.height


def test_one_person():
    """One person's season is measured and not judged; seasons with other settings are no part of the column."""
    games, growth = (pl.concat(parts) for parts in zip(world(), season("paper", PERSON, 1), strict=True))
    assert claim(judged(games, growth, NONE), "used from game 2 on")["verdict"] == "not judged"
    games, growth = (pl.concat(parts) for parts in zip(world(), season("best-in-games", PERSON, 1), strict=True))
    assert claim(judged(games, growth, NONE), "used from game 2 on")["opponent"] == HUMAN


def test_broken_off_season():
    """A season that breaks off is left out of what it does not have."""
    full = [season("paper", STATIC, s, other=evolving(s)) for s in range(5)]
    found = judged(*tables(*full, season("paper", STATIC, 5, last=15, other=evolving(5))), NONE)
    assert claim(found, "nothing evolves")["seasons"] == 6
    assert claim(found, "from game 11 on", quantity="11 to 20")["seasons"] == 5


def test_duplicate_season():
    """The same season twice counts once."""
    again = season("paper", STATIC, 0, other=evolving(0), last=20, name="again")
    found = judged(*tables(season("paper", STATIC, 0, other=evolving(0)), again), NONE)
    assert claim(found, "nothing evolves")["seasons"] == 1


def test_curves():
    """Curves are means over seasons with their interval."""
    games, growth = tables(*(season("paper", STATIC, s, last=2, goals=lambda g, s=s: (s, 0)) for s in (1, 2, 6)))
    found = mean_curves(games, {"for": pl.col("goals_for"), "sum": pl.col("goals_for").cum_sum()})
    assert found.select("what", "game", "seasons", "mean").rows() == [
        ("for", 1, 3, 3.0), ("for", 2, 3, 3.0), ("sum", 1, 3, 3.0), ("sum", 2, 3, 6.0)]
    half = 4.302653 * math.sqrt(7 / 3)  # s² = 7, t(2)
    assert found["high"][0] == pytest.approx(3 + half, abs=1e-4)
    one = mean_curves(growth.filter(pl.col("seed") == 1), {"states": pl.col("states")}, ["role"])
    assert one.select("role", "game", "mean", "low").rows()[:2] == [("goalkeeper", 1, 100.0, None), ("goalkeeper", 2, 200.0, None)]


def test_beside_table_3():
    """Table 3 stands beside the paper's, with what is missing left open."""
    games, _ = tables(season("paper", STATIC, 0, last=37, other=evolving(0)))
    found = beside_table_3(games, "paper")
    assert found.filter(pl.col("opponent") == HUMAN).select("seasons", "pct").unique().rows() == [(0, None)]
    person, _ = tables(season("paper", STATIC, 0), season("paper", PERSON, 0, last=3, other=lambda g: 2.0), season("paper", HUMAN, 0))
    human = beside_table_3(person, "paper").filter(pl.col("opponent") != STATIC)
    assert human["opponent"].unique().to_list() == [PERSON]
    assert human.select("pct", "paper_pct").head(4).rows() == [(2.0, 0.0), (2.0, 0.87), (2.0, 1.04), (None, 0.81)]
    row = found.filter((pl.col("opponent") == STATIC) & (pl.col("game") == 11)).row(0, named=True)
    assert (row["total"], row["other"], row["pct"], row["low"]) == (1000.0, 30.0, 3.0, None)
    assert (row["paper_total"], row["paper_other"], row["paper_pct"]) == (4295, 97, 2.26)
    assert found.filter(pl.col("game") == 37)["paper_total"].to_list() == [None]
    assert found.height == 35 + 37


def test_compared():
    """Settings are compared over the last ten games."""
    games, _ = tables(*(season("best", STATIC, s, last=12, goals=lambda g: (2, 1) if g > 2 else (0, 9)) for s in (0, 1)))
    (row,) = settings_compared(games).iter_rows(named=True)
    assert (row["seasons"], row["games"], row["difference"], row["won"], row["lost"]) == (2, 12, 1.0, 1.0, 0.0)
    assert row["won_low"] == pytest.approx(20 / (20 + 3.841459), abs=1e-6)
    assert settings_compared(Games.empty()).height == 0


def test_ablated():
    """A change is measured over the last games that all seasons have."""
    seasons = [season("best", STATIC, s, last=14, goals=lambda g, s=s: (s, 0) if g < 13 else (9, 0)) for s in (1, 2, 3)]
    seasons += [season("best-exact", STATIC, s, last=12, goals=lambda g, s=s: (s, 5)) for s in (1, 2)]
    seasons += [season("best-exact", RANDOM, 1, last=12), season("best-new", STATIC, 1, last=2), season("bester", STATIC, 1)]
    found = ablated(tables(*seasons)[0], ("paper", "best"))
    assert found.select("settings", "base", "opponent", "seasons", "seasons_base", "first", "last").rows() == [
        ("best-exact", "best", STATIC, 2, 3, 3, 12), ("best-new", "best", STATIC, 1, 3, 1, 2)]
    row = found.row(0, named=True)
    # -4 and -3, less 1, 2 and 3: Welch's by hand: var/n .25 and 1/3
    expected = stats.ttest_ind([-4, -3], [1, 2, 3], equal_var=False).confidence_interval(0.95)
    assert (row["difference"], row["difference_low"], row["difference_high"]) == pytest.approx((-5.5, *expected))
    assert found.row(1, named=True)["difference_low"] is None
    assert ablated(Games.empty(), ("best",)).height == 0


def test_measured():
    """Apprentices are measured by opponent."""
    games, _ = tables(*(season("best", STATIC, s) for s in range(3)), season("best", HUMAN, 0))
    found = measured(games, pl.concat([apprentices(3, late=lambda s: 2), evaluation("best-human-like-s0", pairs=4)]))
    columns = ("settings", "opponent", "games", "against", "seasons", "matches")
    assert found.select(columns).rows() == [
        ("best", HUMAN, 35, STATIC, 1, 8), ("best", STATIC, 35, RANDOM, 3, 60), ("best", STATIC, 35, STATIC, 3, 60)]
    row = found.row(1, named=True)
    assert (row["won"], row["lost"], row["other"], row["difference"]) == pytest.approx((0.9, 0.0, 95.0, 3.6))
    assert row["won_low"] == pytest.approx(wilson(27, 30)[0])
    assert found.row(0, named=True)["won_low"] is None
    assert measured(games, NONE).height == 0


def test_controls():
    """Constant teams stand beside the apprentices: their means are over pairs."""
    games, _ = tables(*(season("best", STATIC, s) for s in range(5)))
    rows = pl.concat([
        apprentices(5), evaluation("constant:044", goals=lambda i: (5 + i // 2 % 2, 1)),
        evaluation("constant:021", goals=lambda i: (0, i % 2)), evaluation("constant:001"),
    ])
    found = measured(games, rows)
    assert found["settings"].to_list() == ["best", "best", "constant:044", "constant:021"]
    reaches = found.row(2, named=True)
    assert (reaches["opponent"], reaches["games"], reaches["seasons"], reaches["matches"]) == ("–", None, None, 20)
    ends = mean_interval([4.0, 5.0] * 5)
    assert (reaches["difference"], reaches["difference_low"], reaches["difference_high"]) == (4.5, *map(pytest.approx, ends))
    assert found["difference"][3] == -0.5


def test_goals_and_leads():
    """Goals are summed up by their kind, and leads by the game from which they hold."""
    games, _ = tables(season("paper", STATIC, 4, goals=lambda g: (3, 1), lead=lambda g: 5 if g >= 11 else 0))
    (row,) = attributed(games).iter_rows(named=True)
    assert [row[k] for k in ("goals_for", "direct", "indirect", "error", "unknown", "unknown_against")] == [3, 1, 2, 0, 0, 0]
    (row,) = seasons_played(games).iter_rows(named=True)
    assert (row["lead"], row["seeds"], row["games"], row["minutes"]) == ("0; from game 11: 5", "4", "35", 8.0)
    assert table3.CHANGE == 11
