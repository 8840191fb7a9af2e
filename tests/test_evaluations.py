"""Evaluations: hand-worked statistics, fair pairs, and results that do not depend on who played them."""

from functools import cache

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from support.deeds import die_of_a_pair
from support.watched import Replayed

from pitchlore.flows.commands.playing import Learners
from pitchlore.pipeline.arena.env import env
from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import TeamSettings, team_slug
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.physics.referee import RefereeEvent
from pitchlore.pipeline.base.errors import BadSettings, NotFound, WorkerLost
from pitchlore.pipeline.engine import evaluations as flow
from pitchlore.pipeline.engine.games import Turn, store_of, take_game
from pitchlore.pipeline.engine.placement.processes import Processes
from pitchlore.pipeline.engine.teams import apprentice, entrant, learned_team
from pitchlore.pipeline.numbers.statistics import wilson
from pitchlore.pipeline.stages import evaluations as stage
from pitchlore.pipeline.stages.evaluations import Entrant, Evaluation, Pair, results_of_pair, summarise
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Evaluations, Policies

pytestmark = pytest.mark.slow

SHORT = RefereeSettings(duration_s=4.0)


def scripted(kind):
    return Entrant(name=kind, settings=TeamSettings(kind=kind))


def short(team="static", opponent="random"):
    return Evaluation(team=scripted(team), opponent=scripted(opponent), referee=SHORT)


def played(*scores, decided=None):
    """Rows of schema Evaluations from the scores of consecutive matches, two to a pair."""
    rows = [
        {"evaluation": "v1-static-0123456789ab", "team": "v1", "policy_version": 1, "knowledge_version": 1,
         "opponent": "static", "seed": i // 2, "match": 1 + i % 2, "side": ("home", "away")[i % 2],
         "match_seed": i // 2, "duration_s": 480.0, "goals_for": ours, "goals_against": theirs,
         "actions": None if decided is None else decided[i][0],
         "other_actions": None if decided is None else decided[i][1]}
        for i, (ours, theirs) in enumerate(scores)
    ]
    return Evaluations.validate(pl.DataFrame(rows, schema=Evaluations.dtypes()))


def test_summary_by_hand():
    """The numbers of a summary are those worked by hand."""
    # pairs' mean differences: (2 + 0) / 2 = 1, (-1 + 4) / 2 = 1.5, (3 + 4) / 2 = 3.5: mean 2, sd √1.75
    found = summarise(played((2, 0), (1, 1), (0, 1), (5, 1), (3, 0), (4, 0)))
    assert (found.matches, found.pairs, found.wins, found.draws, found.losses) == (6, 3, 4, 1, 1)
    half = 4.302653 * (1.75 / 3) ** 0.5  # t with 2 degrees of freedom, 97.5 %
    assert found.goal_difference == pytest.approx((2.0, 2 - half, 2 + half), abs=1e-5)
    assert found.goals_for.value == pytest.approx(15 / 6)
    assert found.goals_against.value == pytest.approx(3 / 6)
    assert found.win_rate == pytest.approx((4 / 6, *wilson(2, 3)))
    assert found.learned_share is None


def test_static_beats_random():
    """In the arena the static team beats the random one."""
    whole = Evaluation(team=scripted("static"), opponent=scripted("random"), referee=RefereeSettings(duration_s=60.0))
    found = summarise(pl.concat(results_of_pair(Pair(evaluation=whole, seed=seed), {}) for seed in range(10)))
    assert found.matches == 20
    assert found.wins >= 19
    assert found.goal_difference.low > 1


def test_learned_share():
    """The share of learned actions is a mean over the matches that had any action."""
    found = summarise(played((0, 0), (0, 0), (0, 0), (0, 0), decided=[(10, 5), (100, 100), (0, 0), (4, 1)]))
    # pairs: (0.5 + 1) / 2 and 0.25, for the third match says nothing
    assert found.learned_share.value == pytest.approx((0.75 + 0.25) / 2)


def test_time_of_constant_team(tmp_path):
    """All time of a constant team is in learned behaviours, also of one that stands and loses: that is no merit."""
    policies = {}
    team = entrant(Store(tmp_path), "constant:184", policies)
    whole = Evaluation(team=team, opponent=entrant(Store(tmp_path), "static", {}), referee=RefereeSettings(duration_s=60.0))
    found = summarise(results_of_pair(Pair(evaluation=whole, seed=1), policies))
    assert found.goal_difference.value < 0
    assert (found.learned_time.value, found.learned_share.value) == (1.0, 1.0)


def test_fouls():
    """A penalty is its taker's; its goal comes within 5 s, both ends included, before any other restart, and is its taker's."""
    penalty, goal, kick = ("fault", "home", 0, 0, "penalty"), ("goal", "home", 1, 0, "goal"), ("fault", "away", 0, 0, "goal kick")
    said = [(0, "kick-off", "home", 0, 0, "kick-off"), (9, "stop", None, 0, 0, "penalty: stuck ball"), (10, *penalty), (15, *goal),
            (16, "kick-off", "away", 1, 0, "kick-off"), (17, *goal), (20, *penalty), (25.1, *goal), (30, *penalty), (31, *kick),
            (32, *goal), (40, *penalty), (41, "goal", "away", 0, 1, "goal"), (50, "fault", None, 0, 0, "free ball")]
    events = [RefereeEvent(round(second * 1e9), *rest) for second, *rest in said]
    assert tuple(stage.fouls_of(events, "home").values()) == (4, 1, 4, 0, 1, 0)
    assert tuple(stage.fouls_of(events, "away").values()) == (1, 4, 0, 4, 0, 1)
    assert summarise(played((1, 0), (0, 2))).penalties_for is None


def test_interval_bounds():
    """No interval reaches beyond what its quantity can be."""
    # pairs of 5 and 0 goals, shares .9 and 1.0: Student's with one degree of freedom is ±31.8 and ±.64
    found = summarise(played((0, 5), (0, 5), (0, 0), (0, 0), decided=[(10, 9), (10, 9), (10, 10), (10, 10)]))
    assert found.goals_against[1:] == (0.0, pytest.approx(2.5 + 12.706205 * 2.5, abs=1e-4))
    assert found.goal_difference[1:] == pytest.approx((-2.5 - 31.765512, -2.5 + 31.765512), abs=1e-4)
    assert found.learned_share[1:] == (pytest.approx(0.95 - 12.706205 * 0.05, abs=1e-5), 1.0)
    found = summarise(played((3, 1), (3, 1), (1, 3), (1, 3), decided=[(10, 0), (10, 0), (10, 2), (10, 2)]))
    assert found.learned_share.low == 0.0
    assert (found.goals_for.low, found.goals_for.high > 14) == (0.0, True)


def test_one_pair():
    """A single pair has a mean, but no interval of it."""
    assert summarise(played((1, 0), (0, 2))).goal_difference == (-0.5, None, None)


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=4, max_size=20).filter(
    lambda scores: len(scores) % 2 == 0))
def test_summary_of_pairs(scores):
    """A summary is one of the pairs, in any order and seen from either side."""
    found = summarise(played(*scores))
    assert found == summarise(played(*scores).sample(fraction=1.0, shuffle=True, seed=1))
    assert found.wins + found.draws + found.losses == len(scores)
    for rate in (found.win_rate, found.draw_rate, found.loss_rate):
        assert 0 <= rate.low <= rate.value <= rate.high <= 1
    means = [(a - b + c - d) / 2 for (a, b), (c, d) in zip(scores[::2], scores[1::2], strict=True)]
    assert found.goal_difference.value == pytest.approx(sum(means) / len(means))
    if len(set(means)) > 1:
        wanted = stats.t.interval(0.95, len(means) - 1, loc=sum(means) / len(means), scale=stats.sem(means))
        assert found.goal_difference[1:] == pytest.approx(wanted)
    # seen by the opponent, wins are losses and the difference turns its sign
    other = summarise(played(*((theirs, ours) for ours, theirs in scores)))
    assert other.win_rate == found.loss_rate
    assert other.goal_difference.value == pytest.approx(-found.goal_difference.value)


def test_seeds_of_pairs():
    """A pair is one seed played twice, with sides swapped; no two share one, and a team never plays itself twice by one."""
    (first, home), (second, away) = Pair(evaluation=short(), seed=3).matches()
    assert (first, second) == (0, 1)
    assert home.seed == away.seed
    assert (home.home, home.away) == (away.away, away.home)
    whole = short("static", "static")
    seeds = [recipe.seed for seed in range(5) for _, recipe in Pair(evaluation=whole, seed=seed).matches()]
    assert len(set(seeds)) == 10
    assert [side for side, _ in Pair(evaluation=whole, seed=0).matches()] == [0, 0]
    swapped = [{r.seed for _, r in Pair(evaluation=short(), seed=seed).matches()} for seed in range(5)]
    assert len(set.union(*swapped)) == 5


def test_names_for_files(tmp_path):
    """The longest names of teams still name an evaluation; a constant team names it in what every file system takes."""
    long = scripted("static").model_copy(update={"name": "a-very-long-name-of-settings-that-somebody-wrote-human-like-12"})
    rows = results_of_pair(Pair(evaluation=short().model_copy(update={"team": long, "opponent": long}), seed=0), {})
    assert rows["evaluation"].str.len_chars().max() == 64
    policies = {}
    team = entrant(Store(tmp_path), "constant:44/21/184", policies)
    rows = results_of_pair(Pair(evaluation=short().model_copy(update={"team": team}), seed=0), policies)
    assert rows["team"].unique().to_list() == ["constant:044/021/184"]
    assert rows["evaluation"].str.starts_with("constant-044-021-184-random-").all()
    assert team_slug("constant:044/021/184", "static") == "constant-044-021-184-static"


def test_names_of_settings():
    """Evaluations of other settings have other names."""
    names = {e.id for e in (short(), short("random", "static"), short().model_copy(
        update={"referee": RefereeSettings(duration_s=5.0)}))}
    assert len(names) == 3


def test_processes(tmp_path, monkeypatch):
    """Matches do not depend on the number of processes; a killed one is one line of error, and what was over is kept."""
    alone, made = flow.evaluate(Store(tmp_path / "a"), short(), range(2), {})
    assert made == 2
    with Processes(2) as executors:
        together, made = flow.evaluate(store := Store(tmp_path / "b"), short(), range(2), {}, executors)
        assert made == 2
        monkeypatch.setattr(flow, "play_pair", die_of_a_pair)
        with pytest.raises(WorkerLost, match="killed") as said:
            flow.evaluate(store, short(), range(4), {}, executors)
    assert "\n" not in str(said.value)
    assert [receipt.name for receipt in store.receipts("evaluations")] == sorted(
        Pair(evaluation=short(), seed=seed).name for seed in range(2))
    assert together.equals(alone)
    assert alone["seed"].to_list() == [0, 0, 1, 1]
    assert alone["actions"].is_null().all()


def test_more_matches(tmp_path, monkeypatch):
    """If more matches are asked for, only those that are not there are played."""
    store, seen = Store(tmp_path), []
    monkeypatch.setattr(flow, "results_of_pair", lambda pair, policies: seen.append(pair.seed) or results_of_pair(pair, policies))
    first, _ = flow.evaluate(store, short(), range(1), {})
    more, made = flow.evaluate(store, short(), range(2), {})
    assert (seen, made) == ([0, 1], 1)
    assert more.head(2).equals(first)
    again, made = flow.evaluate(store, short(), [1], {})
    assert made == 0
    assert again.equals(more.tail(2))


def test_learned_team():
    """A learned team's decisions are counted."""
    team = Entrant(name="v1", settings=TeamSettings(kind="learned", policy="v1 abc"), policy_version=1, knowledge_version=1)
    pair = Pair(evaluation=Evaluation(team=team, opponent=scripted("static"), referee=SHORT), seed=0)
    rows = results_of_pair(pair, {"v1 abc": PolicyTables(Policies.empty())})
    assert (rows["actions"] > 0).all()
    assert (rows["other_actions"] == 0).all()  # it knows nothing, and moves randomly
    assert rows["side"].to_list() == ["home", "away"]


def test_unknown_teams(tmp_path):
    """Unknown teams and policies are refused."""
    store = Store(tmp_path)
    with pytest.raises(BadSettings, match=r"'brazil' is no team, nor a season \(there are: none yet\)\. Name .* season's id\.$"):
        entrant(store, "brazil", {})
    with pytest.raises(BadSettings, match="no team"):
        entrant(store, "../brazil", {})
    with pytest.raises(NotFound):
        entrant(store, "learned", {})
    with pytest.raises(NotFound):
        entrant(store, "7", {})


_SHORT = "games = 1\npractice = 1\n[referee]\nduration_s = 20"
_LOOKS = f'base = "looking"\nclock_s = 0.3\npredict_s = 0.1\n{_SHORT}'
_STATES = f'base = "best-in-games"\n{_SHORT.replace("practice = 1", "practice = 0")}'


@pytest.fixture(scope="module")
def played_season(tmp_path_factory):
    """Seasons after their only game, each played once: the data folder and the season."""
    @cache
    def of(text):
        season = Season(name="short", opponent="static", seed=1, settings=parse_season(text, where="short.toml"))
        take_game(data := tmp_path_factory.mktemp("season"), Turn(season, 1), discard=True)
        return data, season

    return of


@pytest.mark.slow
@pytest.mark.parametrize(("text", "kept"), [
    (_LOOKS, {"clock_s": 0.3, "predict_s": 0.1}), (_STATES, {"clock": {"least_s": 0.4, "interrupts": True, "begin_ended": False}}),
], ids=["looks", "looks up states"])
def test_a_policy_keeps_its_clock(played_season, text, kept):
    """``learned`` and ``learned:1`` play as the season's apprentice does; an option says otherwise."""
    data, season = played_season(text)
    store, own = Store(data), store_of(data, season)
    expected = TeamSettings.model_validate({"kind": "learned"} | kept)
    counted = apprentice(store, season.id).team.settings
    for word in ("learned", "learned:1", "1"):
        team = entrant(own, word, {}).settings
        for name in ("clock", "clock_s", "predict_s"):
            assert getattr(team, name) == getattr(expected, name) == getattr(counted, name)
    assert entrant(own, "learned", {}, clock_s=0.7, predict_s=0.0).settings.clock_s == 0.7
    assert entrant(own, "learned", {}, clock_s=0.7, predict_s=0.0).settings.predict_s == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("text", [_LOOKS, _STATES], ids=["looks", "looks up states"])
def test_an_opponent_in_an_environment(played_season, text):
    """An apprentice plays in an environment, byte for byte, as in a recorded match: by its clock, and predicting."""
    data, season = played_season(text)
    one = env(learned_team(Store(data), season.id), minutes=0.2)
    one.reset(seed=3)
    policies = {}
    team = entrant(Store(data), season.id, policies)
    assert one.match.recipe.away == team.settings
    recipe = one.match.recipe
    recorded = MatchInPlay(recipe, controllers_of(recipe, policies, live=(Replayed(np.zeros((600, 3, 2))), None)), logged=False)
    recorded.advance(600)
    for _ in range(600):
        one.step(np.zeros(6, np.float32))
    assert one.match.bodies.tobytes() == recorded.bodies.tobytes()
    slower = env(learned_team(Store(data), season.id, predict_s=0.2), minutes=0.2)
    slower.reset(seed=3)
    for _ in range(600):
        slower.step(np.zeros(6, np.float32))
    assert slower.match.bodies.tobytes() != recorded.bodies.tobytes()
    with pytest.raises(BadSettings, match="'static' has learned nothing"):
        learned_team(Store(data), "static")


def test_options_of_the_other_kind(played_season, call):
    """An option that no team of a match has is refused before a match is played, in a line that says whose it is."""
    data, season = played_season(_LOOKS)
    for option, whose in (("--clock-s=0.3", "only a team that looks (its policy's learner is \"sight\") has this option"),
                          ("--lcb-weight=0.7", "only a team that looks behaviours up in states has this option")):
        code, _, err = call("evaluate", "--policy", "constant:044", option, "--matches", "2", "--data", data)
        assert (code, f"{option.split('=')[0]}: {whose}" in err) == (1, True)
    _, _, err = call("evaluate", "--policy", season.id, "--min-visits", "3", "--matches", "2", "--data", data)
    assert "--min-visits: only a team that looks behaviours up in states has this option" in err
    (looks, stays), _ = Learners(clock_s=0.3, predict_s=0.1).entrants(Store(data), season.id, "constant:044")
    assert (looks.settings.clock_s, stays.settings.clock_s) == (0.3, 0.5), "each has what its kind has"
    assert (looks.settings.predict_s, stays.settings.predict_s) == (0.1, 0.1)
    assert not (data / "evaluations").exists()
