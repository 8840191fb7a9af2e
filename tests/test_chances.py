"""Expected goals: what is in the way of a shot, models that have not seen its match, the table, the pages."""

import json
import shutil

import numpy as np
import polars as pl
import pytest
from support.league import copied
from support.recordings import RSIM, bodies_of, imported
from support.rows import bodies

from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.settings import ChanceSettings, EventSettings, Settings
from pitchlore.pipeline.stages.events.derive import events
from pitchlore.pipeline.stages.events.in_way import in_way
from pitchlore.pipeline.stages.values.chances import (
    FEATURES,
    ShotModels,
    chances,
    chances_from_bytes,
    chances_to_bytes,
    shot_features,
)
from pitchlore.pipeline.stages.values.shooting import CONTROLS, fit_shots, left_out
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made
from pitchlore.pipeline.views.scout.content.answers import kept
from pitchlore.pipeline.views.scout.content.matches import line
from pitchlore.pipeline.views.scout.content.sources import played
from pitchlore.pipeline.views.scout.content.write import write_pages
from pitchlore.schemas import Chances, Shots

VSSS = PITCHES[Kind.VSSS]


# ---- what is in the way


def at(ball, team="home", **robots):
    """The adversaries in the way of a ball at a place that a team sees."""
    turn = 1 if team == "home" else -1
    table = bodies(np.array([0.0]), ball=(turn * ball[0], turn * ball[1]), **{
        name: (turn * x, turn * y, 0.0, "m") for name, (x, y) in robots.items()})
    asked = pl.Series([team]), pl.Series([0]), *(np.array([float(each)]) for each in ball)
    return in_way(table, *asked, VSSS).row(0)


@pytest.mark.parametrize(("place", "count", "cover"), [
    ((0.5, 0.0), 1, 0.0),
    ((0.5, 0.1), 1, 0.1),
    ((0.5, 0.15), 0, 0.15),  # beyond the angle, which is 0.2 / 0.75 of the way wide on each side
    ((-0.3, 0.0), 0, 0.3),  # behind the ball
    ((0.8, 0.0), 1, 0.05),  # in the goal
    ((0.9, 0.0), 0, 0.15),  # beyond the net
])
@pytest.mark.parametrize("team", ["home", "away"])
def test_in_way(place, count, cover, team):
    """An adversary in the angle of the goal is in the way; how near one is to the ball's way is its cover."""
    other = "away_1" if team == "home" else "home_1"
    own = "home_1" if team == "home" else "away_1"
    found = at((0.0, 0.0), team, **{other: place, own: (0.3, 0.0)})
    assert found == (count, pytest.approx(cover, abs=1e-6))


def test_nobody_in_way():
    """Where no adversary is seen, nothing is known."""
    assert at((0.0, 0.0), home_1=(0.3, 0.0)) == (None, None)
    table = bodies(np.array([0.0]), ball=(0, 0), away_1=(0.3, 0, 0, "m")).with_columns(suspect=True)
    assert in_way(table, pl.Series(["home"]), pl.Series([0]), np.zeros(1), np.zeros(1), VSSS).row(0) == (None, None)


def test_aside():
    """From the wing, the way leads to the goal's middle."""
    assert at((0.35, 0.4), away_1=(0.55, 0.2)) == (1, pytest.approx(0.0, abs=1e-6))
    assert at((0.35, 0.4), away_1=(0.55, 0.4))[0] == 0


def test_before_the_touch():
    """Nothing after the touch has a part in what a shot is judged by, its cover and count included."""
    log, table = imported(RSIM), bodies_of(RSIM)
    shots = events(table, log.referee, log.info.pitch, EventSettings()).shots
    shot = shots.row(5, named=True)
    then = table.filter(pl.col("t_ns") <= shot["t_ns"])
    own = in_way(then, shots["team"][5:6], shots["t_ns"][5:6], *(
        shots[name][5:6].cast(pl.Float64).to_numpy() for name in ("x", "y")), log.info.pitch)
    assert own.row(0) == (shot["in_way"], shot["cover"])
    judged = shot_features(shots, log.info.pitch)
    changed = shots.with_columns(speed=9.0, outcome=pl.lit("goal", dtype=shots.schema["outcome"]), by=None)
    np.testing.assert_array_equal(shot_features(changed, log.info.pitch), judged)


# ---- models


def shots_of(match, n=60, seed=0, reported=True):
    """Shots of a match that become goals by their distance; not at all by it, if not told."""
    rng = np.random.default_rng([seed, int(match.removeprefix("m"))])
    distance, angle = rng.uniform(0.05, 1.0, n), rng.uniform(0.2, 2.0, n)
    chance = 1 / (1 + np.exp(8 * (distance - 0.3))) if reported else np.full(n, 0.3)
    goal = rng.random(n) < chance
    return Shots.validate(pl.DataFrame({
        "match_id": match, "team": np.where(rng.random(n) < 0.5, "home", "away"), "t_ns": np.arange(n) * 10**9,
        "segment": 0, "robot": 1, "role": "striker", "x": 0.0, "y": 0.0, "speed": 1.0, "distance": distance,
        "angle": angle, "outcome": np.where(goal, "goal", "blocked"), "by": None,
        "in_way": rng.integers(0, 3, n), "cover": rng.uniform(0, 0.4, n),
    }).cast(pl.Schema(Shots.dtypes())))


def league(matches=8, **how):
    return {f"m{n}": (shots_of(f"m{n}", **how), VSSS) for n in range(matches)}


def judged(tables, models, **settings):
    return {match: Chances.validate(chances(match, shots, pitch, models, ChanceSettings(**settings)))
            for match, (shots, pitch) in tables.items()}


def test_cross_fitted():
    """A match's own goals have no part in its expected goals, but in those of the others."""
    tables = league()
    flipped = dict(tables)
    other = pl.when(pl.col("outcome") == "goal").then(pl.lit("missed")).otherwise(pl.lit("goal"))
    flipped["m3"] = tables["m3"][0].with_columns(outcome=other.cast(pl.Enum(Shots.dtypes()["outcome"].categories))), VSSS
    before, after = (judged(each, fit_shots(each, 1.0)[0]) for each in (tables, flipped))
    assert after["m3"].equals(before["m3"])
    assert not after["m4"].equals(before["m4"])


def test_true_probabilities():
    """The features that tell goals are learned: as many are expected as come, and better than by the rate."""
    tables = league(20)
    models, report = fit_shots(tables, 1.0)
    xg = pl.concat(judged(tables, models).values())["xg"].to_numpy()
    scored = np.concatenate([(shots["outcome"] == "goal").to_numpy() for shots, _ in tables.values()])
    spread = np.sqrt((xg * (1 - xg)).sum())
    for low, high in ((0, 1.01), (0, 0.2), (0.5, 1.01)):
        own = (xg >= low) & (xg < high)
        assert abs(scored[own].sum() - xg[own].sum()) < 3 * spread
    assert report["xg"]["log_loss"] < report["rate"]["log_loss"] - 0.1
    assert report["xg"]["expected"] == pytest.approx(xg.sum(), abs=0.01)
    assert (report["matches"], report["shots"], report["goals"]) == (20, 1200, scored.sum())


def test_nothing_to_learn():
    """Where nothing tells goals, the model is no better than the rate: the control."""
    _, report = fit_shots(league(20, reported=False), 1.0)
    assert report["xg"]["log_loss"] > report["rate"]["log_loss"] - 0.003


def test_controls():
    """The plainer models of the report are those that are fitted by themselves."""
    tables = league()
    features = np.concatenate([shot_features(*each) for each in tables.values()])
    scored = np.concatenate([(shots["outcome"] == "goal").to_numpy() for shots, _ in tables.values()])
    match = np.repeat(np.arange(len(tables)), 60)
    rate = left_out(features, scored, match, CONTROLS["rate"], 1.0)
    assert rate[:60] == pytest.approx(scored[60:].mean())
    xg = left_out(features, scored, match, range(len(FEATURES)), 1.0)
    own = pl.concat(judged(tables, fit_shots(tables, 1.0)[0]).values())["xg"].to_numpy()
    np.testing.assert_allclose(xg, own, atol=1e-9)


def test_new_match():
    """A match that the models were not fitted to is judged by all of theirs."""
    tables = league()
    models, _ = fit_shots(tables, 1.0)
    new = chances("m9", shots_of("m9"), VSSS, models, ChanceSettings())
    everything = sum(int((shots["outcome"] == "goal").sum()) for shots, _ in tables.values())
    assert new.select("goals", "shots").unique().rows() == [(everything, 480)]


@pytest.mark.parametrize("more", [0, 1])
def test_goals_at_least(more):
    """With fewer goals in the other matches there are no expected goals, and their number is reported."""
    tables = league(3)
    models, _ = fit_shots(tables, 1.0)
    goals = int(models.goals[0])
    found = judged(tables, models, goals_at_least=goals + more)["m0"]
    assert found["xg"].null_count() == 60 * more
    assert found.select("goals", "shots").unique().rows() == [(goals, 120)]


def test_one_match():
    """A league of one match has no other match to learn from; one in which every shot is a goal has nothing to tell goals from."""
    tables = league(1)
    models, report = fit_shots(tables, 1.0)
    assert judged(tables, models)["m0"].select("xg", "goals", "shots").unique().rows() == [(None, 0, 0)]
    assert "xg" not in report
    assert judged(tables, None)["m0"].select("xg", "goals", "shots").unique().rows() == [(None, 0, 0)]
    tables = {match: (shots.with_columns(outcome=pl.lit("goal", dtype=shots.schema["outcome"])), pitch)
              for match, (shots, pitch) in league(3).items()}
    assert judged(tables, fit_shots(tables, 1.0)[0])["m0"]["xg"].null_count() == 60


def test_no_shots():
    """Matches without shots have no chances, and harm no other."""
    empty = {"m0": (Shots.empty(), VSSS)}
    models, report = fit_shots(empty, 1.0)
    assert report == {"matches": 1, "shots": 0, "goals": 0}
    assert judged(empty, models)["m0"].is_empty()
    with_one = league() | {"m9": (Shots.empty(), VSSS)}
    assert judged(with_one, fit_shots(with_one, 1.0)[0])["m0"].equals(judged(league(), fit_shots(league(), 1.0)[0])["m0"])


def test_unknown_way():
    """Where no adversary is seen, none is in the way; a table of version 1 has neither column."""
    shots = shots_of("m0").with_columns(pl.lit(None, dtype=pl.Int16).alias("in_way"),
                                        pl.lit(None, dtype=pl.Float32).alias("cover"))
    found = shot_features(shots, VSSS)
    np.testing.assert_allclose(found[:, 2:4], [[np.log(3.1), 0.0]] * 60)
    assert np.isfinite(shot_features(shots.with_columns(angle=pl.lit(0.0, dtype=pl.Float32)), VSSS)).all()


def test_other_pitch():
    """The same shot on a pitch of another size is the same."""
    twice = VSSS.model_copy(update={"length": 2 * VSSS.length, "goal_width": 2 * VSSS.goal_width})
    shots = shots_of("m0")
    larger = shots.with_columns(distance=2 * pl.col("distance"), cover=2 * pl.col("cover"))
    np.testing.assert_allclose(shot_features(larger, twice), shot_features(shots, VSSS), rtol=1e-6)


def test_bytes():
    """Models are kept as they are, and no pickle is read."""
    models, _ = fit_shots(league(), 1.0)
    again = chances_from_bytes(chances_to_bytes(models))
    assert chances_to_bytes(models) == chances_to_bytes(fit_shots(league(), 1.0)[0])
    assert again.matches == models.matches
    for name in ("weights", "goals", "shots"):
        np.testing.assert_array_equal(getattr(again, name), getattr(models, name))


# ---- pages


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """A league whose matches have expected goals by a model that stands in for one of many goals."""
    own = copied(tmp_path_factory)
    weights = np.array([[-2.0, -2.0, 0.2, 0.5, -0.5, 0.3]])
    models = ShotModels((), weights, np.array([123]), np.array([1456]))
    for match in list(played(own)):
        shots = match.shots
        table = chances(match.name, shots, match.pitch, models, ChanceSettings())
        work = STAGES["chances"].work(match.name, ChanceSettings(), {})
        if match.home.name == "blue" and match.away.name == "yellow":
            own.commit(work, Made([(table, Chances)], details={"goals_at_least": 30}))
    return own


def test_through_the_stages(store, tmp_path):
    """The stages fit the models of a league's shots, and judge each match by those of the others."""
    shutil.copytree(store.root, tmp_path / "data")
    own = Store(tmp_path / "data")
    STAGES.make(own, Settings(chances=ChanceSettings(goals_at_least=1)), scope_of(own))
    matches = list(played(own))
    tables = {match.name: (match.shots, match.pitch) for match in matches}
    models, report = fit_shots(tables, Settings().models.penalty)
    receipt = own.receipt("models", "all")
    assert receipt.details["shots"] == {"vsss": json.loads(json.dumps(report))}
    known = 0
    for match in matches:
        found = match.chances
        assert found.equals(chances(match.name, *tables[match.name], models, ChanceSettings(goals_at_least=1)))
        (goals,) = found["goals"].unique()
        assert goals == sum((shots["outcome"] == "goal").sum() for name, (shots, _) in tables.items() if name != match.name)
        assert found["xg"].null_count() == (0 if goals else found.height)
        known += goals > 0
    assert known


def test_on_the_pages(store, tmp_path):
    """A match's page has the sum a side and each shot's xG, and says what it rests on; else why there is none."""
    write_pages(store, tmp_path)
    reported = 0
    for match in played(store):
        page = (tmp_path / "matches" / f"{match.name}.html").read_text()
        numbers = line(match, kept(match))["numbers"]
        if match.chances["xg"].null_count():
            assert "At least 30 goals, and a shot that fails, are needed." in page
            assert {each["xg"] for each in numbers.values()} == {None}
            assert ", xG " not in page
            assert "greater its xG" not in page
            continue
        reported += 1
        assert "1,456 shots and 123 goals" in page
        for side, each in numbers.items():
            own = match.chances.filter(pl.col("team") == side)["xg"].sum()
            assert each["xg"] == pytest.approx(own)
            assert f"<td>{own:.2f}<td>" in page
        for xg in match.chances["xg"]:
            assert f", xG {xg:.2f}" in page
            assert f"<td>{xg:.2f}<td>" in page
    assert reported == 1
    team = next(path.read_text() for path in (tmp_path / "teams").glob("blue*"))
    assert "Expected goals are known in 1 of 2 matches." in team


def test_page_is_anew(store, tmp_path):
    """A page's key holds its chances, and how many goals they need, though no table says so."""
    shutil.copytree(store.root, tmp_path / "data")
    own = Store(tmp_path / "data")
    write_pages(own)
    match = next(match for match in played(own) if match.chances["xg"].null_count())
    table = match.chances
    work = STAGES["chances"].work(match.name, ChanceSettings(goals_at_least=20), {})
    own.commit(work, Made([(table, Chances)], details={"goals_at_least": 20}))
    assert write_pages(own).new == 1
    assert "At least 20 goals" in (own.root / "scout" / "matches" / f"{match.name}.html").read_text()
    own.commit(work, Made([(table.with_columns(goals=pl.lit(7, dtype=pl.Int32)), Chances)], details={"goals_at_least": 20}))
    write_pages(own)
    assert "became 7 goals" in (own.root / "scout" / "matches" / f"{match.name}.html").read_text()
