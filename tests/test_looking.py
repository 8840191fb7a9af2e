"""The learner that looks: sights, what came of them, appraisals, and the team that plays by them."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.looking import PLACE, SMALL, decided, looks, pairs_of, two_places
from support.played import whole

from pitchlore.pipeline.arena.match import controllers
from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.appraising import action_value as worth
from pitchlore.pipeline.arena.teams.appraising import appraiser_of
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import AppraisalSettings, GramSettings
from pitchlore.pipeline.stages.policies.appraise import actions, fit_action_values
from pitchlore.pipeline.stages.sequences.sights import sights
from pitchlore.pipeline.stages.situations.rules import TABLE_1
from pitchlore.pipeline.state.observation import see_from
from pitchlore.schemas import (
    SIDES,
    Appraisals,
    Occasions,
    Sequences,
    Sights,
    Values,
)
from pitchlore.schemas.sights import SIGHT


def view_of(*bodies):
    """A view of the ball and robots at (x, y, theta, vx, vy)."""
    return np.array([[*body, 0.0] for body in bodies])


def seen(view, robot):
    out = np.empty(len(SIGHT), dtype=np.float32)
    see_from(view, robot, 0.75, out)
    return dict(zip(SIGHT, out.tolist(), strict=True))


# ---- sights


def test_worked_sight():
    """Observation of a robot behind a resting ball, by hand."""
    view = view_of((0.0, 0.3, 0, 0, 0), (-0.4, 0.0, 0, 0.5, 0.1), (0.0, 0.1, 0, 0, 0), (0.3, 0.3, 0, 0, 0), (0.7, 0.3, 0, 0, 0))
    found = seen(view, 1)
    assert found["ball_distance"] == pytest.approx(0.5)
    assert (found["ball_dx"], found["ball_dy"]) == pytest.approx((0.4, 0.3))
    assert found["nearer"] == 1
    assert found["deeper"] == 0
    assert (found["mate_distance"], found["adversary_distance"]) == pytest.approx((0.2, 0.3))
    assert found["behind"] == pytest.approx((0.4 * 0.75 - 0.3 * 0.3) / 0.5 / np.hypot(0.75, 0.3))
    assert found["faces_ball"] == pytest.approx(0.8)
    assert found["adversary_behind"] == pytest.approx(0.75 / np.hypot(0.75, 0.3))
    assert found["home"] == pytest.approx(0.35)
    assert (found["to_own_line"], found["to_their_line"]) == (9.0, 9.0)
    assert np.isnan(seen(view[[0, 1, 3]], 1)["mate_x"])


@given(st.integers(0, 1 << 30), st.integers(1, 3))
def test_sights_are_mirrored(seed, robot):
    """Both half-widths look the same."""
    view = np.random.default_rng(seed).normal(scale=0.4, size=(7, 6))
    view[0, 1] += 0.001  # a ball on the line has no side
    mirrored = view * [1, -1, -1, 1, -1, -1]
    np.testing.assert_allclose(list(seen(view, robot).values()), list(seen(mirrored, robot).values()), atol=1e-5)


@pytest.fixture(scope="module")
def played():
    """A log of a minute in which a team of equal actions plays at both sides, with what it saw."""
    table = pairs_of(goalkeeper=[44, 88], midfield=[11, 44], striker=[21, 44, 118])
    policy = PolicyTables(table, Appraisals.empty())
    of = TeamSettings(kind="learned", policy="it", explore=1.0)
    recipe = Recipe(home=of, away=of, seed=3, referee=RefereeSettings(duration_s=60.0))
    noted = []
    players = controllers_of(recipe, {"it": policy})
    with pytest.MonkeyPatch.context() as patch:
        decide = controllers.appraising.decide

        def spy(view, *rest):
            noted.append([list(seen(view, robot).values()) for robot in (1, 2, 3)])
            decide(view, *rest)

        patch.setattr(controllers.appraising, "decide", spy)
        log = whole(MatchInPlay(recipe, players))
    return log, np.array(noted)


def test_sights_are_what_players_saw(played):
    """A log's sights are those by which its robots decided, in both halves and of both teams."""
    log, noted = played
    found = sights(log, Values.empty(), GramSettings())
    assert found.height == log.decisions.height
    assert log.decisions["team"].n_unique() == 2
    by_time = found.sort("t_ns", "team", "robot")
    theirs = noted.reshape(-1, len(SIGHT))
    np.testing.assert_allclose(by_time["sight"].to_numpy(), theirs, atol=1e-4)
    assert found["change"].null_count() == found.height, "without V no change is known"
    Sights.validate(found)


def test_team_decides_by_the_clock(played):
    """All robots decide at once, each half second of play, among the actions of their role."""
    log, _ = played
    rows = log.decisions.filter(pl.col("ends").is_null())
    spans = ((rows["end_ns"] - rows["t_ns"]) / 1e9).to_list()
    assert spans == pytest.approx([0.5] * len(spans), abs=1e-6)
    chosen = log.decisions.drop_nulls("behaviour_id").select("role", "behaviour_id").unique()
    known = {f"{role}-{code:03d}" for role, codes in (
        ("goalkeeper", [44, 88]), ("midfield", [11, 44]), ("striker", [21, 44, 118])) for code in codes}
    assert set(chosen["behaviour_id"]) == known, "exploration tries them all"
    assert (chosen["role"].cast(pl.String) == chosen["behaviour_id"].str.head(-4)).all()


def test_holds_what_it_tries():
    """A robot holds a tried action for its time, from its first decision on, whatever becomes of its role.

    With three decisions to a try, the three of each are of one code, and other tries are of others.
    """
    alike = [11, 21, 44, 88, 118]
    policy = PolicyTables(pairs_of(goalkeeper=alike, midfield=alike, striker=alike), Appraisals.empty())
    of = TeamSettings(kind="learned", policy="it", explore=1.0, explore_s=1.5, clock_s=0.5)
    recipe = Recipe(home=of, away=TeamSettings(kind="static"), seed=3, referee=RefereeSettings(duration_s=60.0))
    match = MatchInPlay(recipe, controllers_of(recipe, {"it": policy}))
    made = whole(match).decisions.filter(team="home").sort("robot", "t_ns").with_columns(
        code=pl.col("behaviour_id").str.split("-").list.last(), number=pl.int_range(pl.len()).over("robot", "episode"))
    assert made["random"].all()
    tries = made.group_by("robot", "episode", pl.col("number") // 3).agg(pl.col("code").unique())
    assert set(tries["code"].list.len()) == {1}
    assert set(tries["code"].list.first()) == {f"{code:03d}" for code in alike}
    begun = made.filter(pl.col("number") % 3 == 0).sort("robot", "t_ns")["code"]
    assert 0.05 < (begun == begun.shift()).mean() < 0.4, "a fifth by chance"


def test_changes_by_hand(played):
    """V a second later less V now, for the own team; a goal within that second counts as one."""
    log, _ = played
    start = 10_000_000_000
    made = log.decisions.clear().vstack(pl.DataFrame([
        {**log.decisions.row(0, named=True), "team": team, "robot": 1, "t_ns": start + at, "end_ns": start + end,
         "reward": reward, "episode": 0, "ends": ends}
        for team, sign in zip(SIDES, (1.0, -1.0), strict=True)
        for at, end, reward, ends in ((0, 500_000_000, 0.0, None), (500_000_000, 1_200_000_000, sign, "terminal"))
    ], schema=log.decisions.schema))
    values = Values.of([{
        "match_id": log.info.match_id, "t_ns": start + at * 100_000_000, "segment": 0, "home": 0.0, "away": 0.0,
        "value": 0.01 * at} for at in range(12)])
    found = sights(MatchLog(log.info, log.frames, log.referee, made), values, GramSettings())
    assert found["change"].to_list() == pytest.approx([0.1, 1 - 0.05, -0.1, -1 + 0.05])


def test_watched_moments(played):
    """Robots of a team that logs no decisions are watched at each step in which they are in a situation."""
    log, _ = played
    t_ns = log.frames.t_ns
    step = 200_000_000
    rows = [(1, 44, 10 * step, 13 * step, 14 * step, 1.0), (1, 21, 13 * step, 13 * step + step // 2, 14 * step, 1.0),
            (2, 11, 20 * step + 1, 21 * step, 22 * step, 0.0)]
    watched = pl.DataFrame([
        {"match_id": log.info.match_id, "team": "away", "robot": robot, "role": "striker", "code": code, "start_ns": start,
         "end_ns": end, "episode": 0 if over < 20 * step else 1, "over_ns": over, "reward": reward}
        for robot, code, start, end, over, reward in rows])
    watched = watched.cast({name: of for name, of in Sequences.dtypes().items() if name in watched.columns})
    values = Values.of([{"match_id": log.info.match_id, "t_ns": at * step, "segment": 0, "home": 0.0, "away": 0.0,
                         "value": 0.01 * at} for at in range(30)])
    alone = MatchLog(log.info, log.frames, log.referee, log.decisions.filter(team="home"))
    of = GramSettings(watched_s=0.2)
    found = sights(alone, values, of, watched).drop_nulls("code")
    at = t_ns[np.searchsorted(t_ns, np.arange(10, 14) * step)].tolist()  # the first samples that are at least so late
    assert found["t_ns"].to_list() == at, "robot 2 began after the first sample of its only step"
    assert found["code"].to_list() == [44, 44, 44, 21]
    assert set(found["team"]) == {"away"}
    # all end within the second in which V is looked at again, by a goal for them; V is that of home
    assert found["change"].to_list() == pytest.approx([1 + 0.01 * t / step for t in at], abs=1e-6)
    assert sights(log, values, of, watched)["code"].null_count() == log.decisions.height, "both teams decide"
    assert sights(alone, values, GramSettings(), watched)["code"].drop_nulls().is_empty()


# ---- appraisals


def test_what_is_not_tried_is_watched():
    """An action that was never chosen is appraised by what was watched; one that was often chosen is not."""
    sight, code, change = two_places(1)
    made, looked = decided(sight, np.full(len(code), 88), change)
    pairs = pairs_of(goalkeeper=[], midfield=[], striker=[21, 44, 88])
    _, shown = decided(sight, code, change)
    watched = shown.with_columns(pl.Series("code", code, dtype=pl.Int16))
    own, _ = fit_action_values(made, looked, pairs, SMALL, 1, watched)
    assert set(own["code"]) == {88}, "as the setting is off"
    found, kept = fit_action_values(made, looked, pairs, SMALL.model_copy(update={"watched": True}), 1, watched)
    assert found.filter(code=88).equals(own)
    appraiser, _ = appraiser_of(kept, found)
    places = list(appraiser.codes).index(21), list(appraiser.codes).index(44)
    new = two_places(2)[0][:500]
    up = new[:, PLACE["ball_x"]] > 0
    better = np.array([worth(appraiser, places[0], each) > worth(appraiser, places[1], each) for each in new])
    assert np.mean(better == up) > 0.95


def test_learns_what_to_do_where():
    """The best action of each place is found, and one that is the best nowhere is no longer offered."""
    sight, code, change = two_places(1)
    pairs = pairs_of(goalkeeper=[], midfield=[], striker=[21, 44, 88, 118])
    found, kept = fit_action_values(*decided(sight, code, change), pairs, SMALL, 7)
    Appraisals.validate(found)
    assert set(found["version"]) == {7}
    assert kept["behaviour_id"].to_list() == ["striker-021", "striker-044", "striker-118"], "118 was never tried"
    appraiser, names = appraiser_of(kept, found)
    new = two_places(2)[0][:500]
    best = [max(range(1, 3), key=lambda action: worth(appraiser, action, each)) for each in new]
    chosen = [names[2 * len(appraiser.codes) + action] for action in best]
    wanted = ["striker-021" if up else "striker-044" for up in new[:, PLACE["ball_x"]] > 0]
    assert np.mean([a == b for a, b in zip(chosen, wanted, strict=True)]) > 0.95


def test_learns_nothing_from_shuffled_changes():
    """The control: with the changes dealt out anew, no action is distinguished from another by place."""
    sight, code, change = two_places(1)
    shuffled = np.random.default_rng(5).permutation(change)
    found, kept = fit_action_values(
        *decided(sight, code, shuffled), pairs_of(goalkeeper=[], midfield=[], striker=[21, 44]), SMALL, 1)
    appraiser, _ = appraiser_of(kept, found)
    new = two_places(2)[0][:500]
    up = new[:, PLACE["ball_x"]] > 0
    gain = np.array([worth(appraiser, 1, each) - worth(appraiser, 2, each) for each in new])
    assert abs(gain[up].mean() - gain[~up].mean()) < 0.02, "0.2 in truth"


def test_little_evidence_is_shrunk():
    """An action that was chosen a few times has its mean alone, of what is left of it: next to nothing."""
    sight, code, change = two_places(1)
    few = slice(0, 30)
    found, _ = fit_action_values(
        *decided(sight[few], np.full(30, 21), np.full(30, 0.5)), pairs_of(goalkeeper=[], midfield=[], striker=[21]), SMALL, 1)
    assert found.height == 1
    share = 30 / (30 + SMALL.leaf_samples)
    assert found["value"].to_list() == pytest.approx([0.5 * (1 - share) * share])
    assert fit_action_values(*decided(sight, code, change), pairs_of(goalkeeper=[], midfield=[], striker=[21]), SMALL, 1)[0].equals(
        fit_action_values(*decided(sight, code, change), pairs_of(goalkeeper=[], midfield=[], striker=[21]), SMALL, 1)[0])


def test_watched_actions():
    """Actions are those of the watched behaviours by role, code by code; all codes if that is asked for."""
    seen_ = Occasions.of([
        {"version": 1, "role": role, "key": "role0", "state": 0, "behaviour_id": f"{role}-{codes}", "count": count,
         "value": None, "initial": 0.0, "team": None, "kind": None}
        for role, codes, count in (("goalkeeper", "194", 0), ("midfield", "044-021", 3), ("striker", "021", 2), ("striker", "088", 0))])
    found = actions(seen_, TABLE_1, AppraisalSettings())
    assert found["behaviour_id"].to_list() == ["midfield-021", "midfield-044", "striker-021"]
    assert actions(seen_, TABLE_1, AppraisalSettings(codes="all")).height == 3 * 31


# ---- the team


def test_team_takes_the_best():
    """A team takes what is appraised highest; two teams of the same tables play the same match."""
    table = pairs_of(goalkeeper=[88, 118], midfield=[44, 118], striker=[44, 118])
    leaf = {"version": 1, "tree": 0, "node": 0, "feature": None, "threshold": None, "missing_left": None, "left": None, "right": None}
    appraisals = Appraisals.of([leaf | {"code": code, "value": value} for code, value in ((44, 0.3), (88, 0.2), (118, 0.1))])
    recipe = Recipe(home=TeamSettings(kind="learned", policy="it"), away=TeamSettings(kind="static"), seed=4,
                    referee=RefereeSettings(duration_s=30.0))

    def log():
        return whole(MatchInPlay(recipe, controllers_of(recipe, {"it": PolicyTables(table, appraisals)}))).decisions

    made = log()
    assert set(made["behaviour_id"]) == {"goalkeeper-088", "midfield-044", "striker-044"}
    assert not made["random"].any()
    assert made.equals(log())


def test_team_acts_on_what_it_sees():
    """At each decision a striker takes what is appraised highest at the place of the ball."""
    ball, shoots = looks()
    assert (shoots == (ball > 0)).all()
    assert 0.05 < shoots.mean() < 0.95
