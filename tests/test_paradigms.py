"""The study: runs are seeded one by one, and are summed up as they are; rules are compared in test_rules."""

import itertools
import os
import re
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError
from support import literal_learning as literal
from support.points import point, table
from support.training import learn

from pitchlore.pipeline.stages.paradigms import curves, runner
from pitchlore.pipeline.stages.paradigms.curves import Curve, Exploration
from pitchlore.pipeline.stages.paradigms.experiments import BESIDE, OTHER_GAMES, Design, sweeps
from pitchlore.pipeline.stages.paradigms.games import matrix
from pitchlore.pipeline.stages.paradigms.readings import informative
from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.ivq import IVQ
from pitchlore.pipeline.stages.paradigms.rules.lenient import Lenient
from pitchlore.pipeline.stages.paradigms.rules.rules import RULES
from pitchlore.pipeline.stages.paradigms.rules.selection import ActionSelection
from pitchlore.pipeline.stages.paradigms.runner import Runs, Training, play_runs, stream
from pitchlore.schemas import Paradigms

SEEDS = (7, 11)


def quick_training(ticks=400, **rest):
    return Training(np.geomspace(16.0, 0.05, ticks), **rest)


def same(one: Runs, other: Runs):
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)


# -- seeded run by run ------------------------------------------------------------------------------------


@pytest.mark.parametrize("settings", [IQ(), Lenient(cooling=0.97, discount=0.9)])
def test_company(monkeypatch, settings):
    """A run is the same, whatever runs and workers are beside it; no runs give empty columns."""
    game, training, testing = matrix.fully_stochastic_climbing(), quick_training(), runner.Testing(5, 1, 1.0)
    together = play_runs(game, settings, training, testing, runs=range(23), seeds=SEEDS)
    assert len(set(together.last.tolist())) > 1
    for runs, workers in ((range(23), 1), (range(23), 7), (range(5, 9), 2), (range(20, 2, -3), 3), (range(4, 5), 64), (range(0), 2)):
        monkeypatch.setattr(os, "cpu_count", lambda workers=workers: workers)
        apart = play_runs(game, settings, training, testing, runs=runs, seeds=SEEDS)
        same(apart, Runs(*(column[list(runs)] for column in together)))


def test_seeds():
    """The same seeds make the same runs, and other seeds others."""
    def q(seeds, run):
        return learn(matrix.climbing(), IQ(), quick_training(50), run=run, seeds=seeds).q.tobytes()

    assert q(SEEDS, 0) == q(SEEDS, 0)
    every = [(SEEDS, 0), ((0, 0), 0), ((0, 0), 1), ((0, 1), 0), ((1, 0), 0), ((0, 2**40), 0), ((2**40, 0), 0)]
    assert len({q(seeds, run) for seeds, run in every}) == len(every)


# -- runs that learn nothing ------------------------------------------------------------------------------

#: While all actions are tried alike, praise never fades, and 50 times it makes values rise without end.
EXPLODING = IVQ(influence=50.0, bracket="outside", discount=1.0)


def hot(ticks):
    return Training(np.full(ticks, 1e12))


def test_diverged_run():
    """A run that diverges counts as no success, even where action 0 is the optimum; its memory stays finite."""
    training = hot(200)
    played = play_runs(matrix.climbing(), EXPLODING, training, runner.Testing(), runs=range(20), seeds=SEEDS)
    assert played.diverged.all()
    assert (played.success == 0).all()
    assert (played.last == -1).all()
    assert np.isnan(played.length).all()
    expected = literal.play(stream(SEEDS, 0), literal.MatrixGame(matrix.CLIMBING, 2), EXPLODING, training, runner.Testing())
    assert expected.diverged
    memory = learn(matrix.climbing(), EXPLODING, training, run=0, seeds=SEEDS)
    assert np.isfinite(memory.q).all()
    assert np.abs(memory.q).max() > 1e6


def test_marked_runs():
    """Only those runs that diverge are marked."""
    # so few steps that some have and some have not
    training = hot(12)
    runs = range(40)
    played = play_runs(matrix.climbing(), EXPLODING, training, runner.Testing(), runs=runs, seeds=SEEDS)
    alone = [literal.play(stream(SEEDS, run), literal.MatrixGame(matrix.CLIMBING, 2), EXPLODING, training, runner.Testing()) for run in runs]
    assert played.diverged.tolist() == [run.diverged for run in alone]
    assert 0 < played.diverged.sum() < len(runs)
    assert played.success.tolist() == [run.success for run in alone]


@pytest.mark.parametrize("rule", [rule.settings for rule in RULES], ids=lambda rule: rule.__name__)
def test_equal_values(rule):
    """Between values that are all equal, chance decides."""
    pays_nothing = replace(matrix.matrix_game("nothing", np.zeros((3, 3))), success=np.arange(9)[np.newaxis] == 0)
    runs = 1_800
    played = play_runs(pays_nothing, rule(), quick_training(5), runner.Testing(), runs=range(runs), seeds=SEEDS)
    counts = np.bincount(played.last, minlength=9)
    # 200 each; the standard deviation is sqrt(1800 * 1/9 * 8/9) = 13
    assert (np.abs(counts - runs / 9) < 5 * 13.4).all()
    assert played.success.mean() == counts[0] / runs


# -- curves -----------------------------------------------------------------------------------------------


def climbing_curve(**fields):
    """IQ in the climbing game, cooling fast, with other fields."""
    return Curve(**{"figure": 5, "game": "climbing", "learner": "IQ", "reading": "printed", "rule": IQ(),
                    "decays": (0.99,)} | fields)


@pytest.mark.parametrize(("decay", "temperature", "floor", "ticks"), [
    # ln(.01 / 16) = -7.377759, and its quotient by ln(decay) rounded up:
    (0.9997, 16.0, 0.01, 24_589),  # / -.000300045 = 24588.8
    (0.9999, 16.0, 0.01, 73_774),  # / -.000100005 = 73773.9
    (0.998, 16.0, 0.01, 3_686),  # / -.002002003 = 3685.2
    (0.99, 1.0, 0.01, 459),  # ln(.01) = -4.605170, / -.010050336 = 458.2
    (0.5, 16.0, 0.125, 8),  # 16 * .5**7 is the floor itself, not below it
    (0.5, 16.0, 20.0, 1),  # at least one
])
def test_training_end(decay, temperature, floor, ticks):
    """Training ends when the temperature is below the floor."""
    curve = climbing_curve(temperature=temperature, floor=floor)
    assert curve.ticks(decay) == ticks
    assert temperature * decay**ticks < floor
    assert ticks == 1 or temperature * decay ** (ticks - 1) >= floor


def spied(monkeypatch):
    """Everything that curves have played from now on, instead of playing it."""
    calls = []

    def record(game, settings, training, testing, *, runs, seeds):
        calls.append((game, settings, training, testing, runs, seeds))
        count = len(runs)
        return Runs(np.ones(count), np.full(count, 4.0), np.zeros(count, np.int64), np.zeros(count, np.bool_),
                    np.zeros(count, np.bool_), np.zeros(count, np.int64))

    monkeypatch.setattr(curves, "play_runs", record)
    return calls


def test_curve(monkeypatch):
    """A curve trains at the paper's temperatures and tests greedily."""
    calls = spied(monkeypatch)
    climbing_curve().play(None, 0.99, runs=5, seed=3)
    [(game, settings, training, testing, runs, seeds)] = calls
    assert (game.name, settings, runs, seeds[0]) == ("climbing", IQ(), range(5), 3)
    np.testing.assert_allclose(training.temperatures, [16 * 0.99**t for t in range(735)], rtol=1e-12)
    assert training.temperatures[-1] >= 0.01
    assert (training.selection, training.tick) == (ActionSelection.BOLTZMANN, "step")
    assert testing == runner.Testing(tests=1, steps=1, temperature=0.0)


def test_other_exploration(monkeypatch):
    """A curve may explore and test otherwise."""
    calls = spied(monkeypatch)
    explored = climbing_curve(exploration=Exploration(selection="epsilon-greedy", start=1.0, end=0.01))
    explored.play(None, 0.99, runs=1, seed=0)
    climbing_curve(test_by="last temperature").play(None, 0.99, runs=1, seed=0)
    (_, _, training, *_), (_, _, plain, testing, *_) = calls
    assert (training.selection, len(training.temperatures)) == (ActionSelection.EPSILON_GREEDY, 735)
    np.testing.assert_allclose(training.temperatures[[0, 367, -1]], [1.0, 0.1, 0.01], rtol=1e-12)
    assert testing.temperature == plain.temperatures[-1] == pytest.approx(16 * 0.99**734)


@pytest.mark.parametrize("fields", [
    {"selection": "boltzmann", "start": 0.0, "end": 0.1}, {"selection": "boltzmann", "start": 1.0, "end": 0.0},
    {"selection": "epsilon-greedy", "start": 16.0, "end": 0.01}, {"selection": "mixed", "start": 0.1, "end": 2.0},
])
def test_bad_exploration(fields):
    """Exploration with values out of bounds is refused."""
    with pytest.raises(ValidationError):
        Exploration(**fields)


@pytest.mark.parametrize(("game", "k", "says"), [
    ("penalty", -7.0, -7.0), ("grid", 7.0, -7.0), ("climbing", None, -30.0),
    ("partially stochastic climbing", None, -30.0), ("fully stochastic climbing", None, -65.0),
])
def test_game_of_curve(monkeypatch, game, k, says):
    """A curve plays the game of its name, with its penalty."""
    calls = spied(monkeypatch)
    climbing_curve(game=game, ks=() if k is None else (k,)).play(k, 0.99, runs=1, seed=0)
    assert (calls[0][0].name, calls[0][0].rewards.min()) == (game, says)


def test_unknown_game():
    """A curve in an unknown game is refused."""
    with pytest.raises(ValidationError, match="there is no game 'chess': name one of penalty, climbing,"):
        climbing_curve(game="chess")


def test_point(monkeypatch):
    """A point is a row of the schema and says what was played."""
    seen = []
    monkeypatch.setattr(curves, "play_runs", lambda *what, **how: seen.append(play_runs(*what, **how)) or seen[-1])
    row = Paradigms.validate(climbing_curve().play(None, 0.99, runs=40, seed=3)).row(0, named=True)
    [played] = seen
    assert (row["k"], row["steps"], row["runs"], row["tests"], row["seed"]) == (None, 735, 40, 1, 3)
    assert row["p_optimal"] == np.mean(played.last == 0)
    # (a0, b0), (a1, b1) and no other is an equilibrium: from (a2, b2) the first gains by a1
    assert row["p_equilibrium"] == np.mean(np.isin(played.last, [0, 4]))
    assert row["p_low"] < row["p_equilibrium"]
    assert 0 <= row["p_low"] <= row["p_optimal"] <= row["p_high"] <= 1
    assert row["diverged"] == 0


def test_grid_point():
    """A point of the grid has a path and no equilibrium."""
    curve = climbing_curve(
        figure=6, game="grid", learner="IL-B", rule=IQ(discount=0.9), ks=(0.0,), temperature=1.0, decays=(0.999,),
        tests=20, test_steps=100)
    row = Paradigms.validate(curve.play(0.0, 0.999, runs=30, seed=0)).row(0, named=True)
    assert row["p_equilibrium"] is None
    assert row["p_optimal"] > 0
    assert 4 <= row["path_low"] <= row["path_length"] <= row["path_high"]


def test_diverged_point():
    """A point whose runs all diverged is a row of the schema without success."""
    exploding = climbing_curve(rule=EXPLODING, temperature=1e12, floor=1e11)
    row = Paradigms.validate(exploding.play(None, 0.99, runs=5, seed=0)).row(0, named=True)
    assert (row["diverged"], row["p_optimal"], row["p_equilibrium"], row["path_length"]) == (5, 0, 0, None)


def test_random_numbers(monkeypatch):
    """No two points of the study share random numbers."""
    calls = spied(monkeypatch)
    points = 0
    for sweep in sweeps(Design(sensitivity=True, comparison=True)):
        for curve in sweep.curves:
            for k, decay in curve.points():
                curve.play(k, decay, runs=1, seed=sweep.seed)
                points += 1
    seeds = [seeds for *_, seeds in calls]
    assert len(set(seeds)) == points > 1_000
    assert {seed for seed, _ in seeds} == {0, 1_000, 2_000}  # what is confirmed chose nothing, nor what is compared


# -- the design -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("design", [
    Design(), Design(quick=True), Design(sensitivity=True), Design(figures=(5,), runs=2000, sensitivity=True, seed=9),
    Design(figures=(5,), comparison=True),
], ids=["all", "quick", "sensitivity", "one", "comparison"])
def test_names_of_sweeps(design):
    """Sweeps have names of their own that any disk takes."""
    made = sweeps(design)
    names = [sweep.name for sweep in made]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z0-9][a-z0-9-]*", name) for name in names)
    for sweep in made:
        for curve in sweep.curves:
            assert f"{curve.study}-{curve.figure}-" in sweep.name
            assert f"-r{sweep.runs}-s{sweep.seed}" in sweep.name
    described = [(c.study, c.figure, c.game, c.learner, c.reading, *point)
                 for sweep in made for c in sweep.curves for point in c.points()]
    assert len(set(described)) == len(described)  # a point is played once


def test_sweeps_of_designs():
    """Designs of other runs, seeds or speed do not share sweeps."""
    designs = [Design(), Design(quick=True), Design(runs=2000), Design(seed=1)]
    names = [{sweep.name for sweep in sweeps(design)} for design in designs]
    assert all(a.isdisjoint(b) for a, b in itertools.combinations(names, 2))


def test_default_runs():
    """A design has the paper's runs and figures, unless others are wanted."""
    assert {(s.curves[0].figure, s.runs) for s in sweeps(Design())} == {(4, 100), (5, 100), (6, 3)}
    assert {s.runs for s in sweeps(Design(runs=50))} == {50}
    grid = sweeps(Design(figures=(6,)))
    assert {s.curves[0].figure for s in grid} == {6}
    policies = sum(s.runs * len([*c.points()]) for s in grid for c in s.curves if c.reading == "printed")
    assert policies == 4 * 16 * 4 * 3 == 960 * 4 // 5  # learners, penalties, decays, runs; the paper's 960 need 5 decays


def test_quick_design():
    """A quick design plays a few points of every curve of the paper's games."""
    def points(design):
        found = {}
        for curve in (curve for sweep in sweeps(design) for curve in sweep.curves):
            named = (curve.figure, curve.game, curve.learner, curve.reading)
            found.setdefault(named, {}).update(dict.fromkeys(curve.points(), curve.tests))
        return found

    whole, thin = points(Design()), points(Design(quick=True))
    assert thin.keys() == {named for named in whole if named[1] not in OTHER_GAMES}
    for named, few in thin.items():
        assert few.keys() <= whole[named].keys()
        assert 1 <= len(few) <= 6
        assert max(few.values()) <= 20  # tests
        ks = [k for k, _ in whole[named] if k is not None]
        if ks:  # both ends of the penalty
            assert {min(ks), max(ks)} <= {k for k, _ in few}


def test_learners():
    """The paper's learners and five peers are in every matrix game."""
    learners = {}
    for sweep in sweeps(Design(figures=(4, 5))):
        learners.setdefault(sweep.curves[0].game, set()).add(sweep.curves[0].learner)
    five = {"hysteretic", "distributed", "lenient", "FMQ", "WoLF-PHC"}
    assert learners.keys() == {"penalty", "climbing", *OTHER_GAMES}
    assert all(names >= {"IQ", "JAQ", "IVQ"} | five and not names & {*BESIDE} for names in learners.values())


def test_informative_readings():
    """Informative readings are those that change one thing, and the best."""
    rows = [
        point(5, "IVQ", 0.1, study="sensitivity"),
        point(5, "IVQ", 0.2, study="sensitivity", reading="influence outside"),
        point(5, "IVQ", 0.7, study="sensitivity", reading="influence outside, discount 0.9"),
        point(5, "IVQ", 0.6, study="sensitivity", reading="influence outside, discount 0.5"),
        point(5, "IVQ", 0.05, study="sensitivity", reading="influence outside, discount 0.1"),
        point(5, "JAQ", 0.0, study="sensitivity", reading="discount 0.9, beliefs by recency 0.1"),
        point(5, "IVQ", 0.9, study="confirmation", reading="influence outside, discount 0.92"),
    ]
    reported = informative(table(*rows), best=1)
    assert sorted(reported.select("learner", "reading").rows()) == [
        ("IVQ", "influence outside"), ("IVQ", "influence outside, discount 0.9"), ("IVQ", "printed"),
        ("JAQ", "discount 0.9, beliefs by recency 0.1"),
    ]
    assert len(informative(table(*rows), best=2)) == 5


# -- what a user choosing a learner relies on -------------------------------------------------------------


@pytest.mark.parametrize("learner", ["hysteretic", "distributed", "team"])
def test_peers_climb(learner):
    """Hysteretic and distributed learners nearly always solve the climbing game, and so does one for the team."""
    [curve] = [c for s in sweeps(Design(figures=(5,), beside=BESIDE)) for c in s.curves if (c.game, c.learner) == ("climbing", learner)]
    row = curve.play(None, 0.9997, runs=200, seed=0).row(0, named=True)
    assert row["p_optimal"] > 0.99
    assert row["p_low"] > 0.95


def test_independent_learners_seldom_do():
    """Independent learners seldom solve the climbing game, but often reach an equilibrium."""
    row = climbing_curve().play(None, 0.9997, runs=200, seed=0).row(0, named=True)
    assert row["p_high"] < 0.15
    assert row["p_equilibrium"] > 0.5
