"""The value of doing: draws find a planted effect, the doubly robust estimate undoes confounding, the study runs."""

from __future__ import annotations

import doing.estimates
import doing.study
import doing.watched
import numpy as np
import polars as pl
import pytest
from doing.estimates import adjusted, doubly_robust, left_of, left_of_moments, of_draws
from doing.study import Inserted, Sizes
from doing.trial import CELLS, USUAL, Game, Seconds, offered_of, played
from doing.watched import Watched

from pitchlore.schemas import ROLES
from pitchlore.schemas.options import OPTIONS
from pitchlore.schemas.sights import SIGHT

REACHES, STANDS = 44, 88
PAIRS = {("striker", REACHES): np.array([0, 1]), ("striker", STANDS): np.array([1])}


@pytest.fixture(autouse=True)
def few_trees(monkeypatch):
    """Trees are few and small: the data are."""
    for name in ("EXPECTED", "OF_OPTION", "PROPENSITY"):
        monkeypatch.setattr(doing.estimates, name, getattr(doing.estimates, name) | {"max_iter": 10, "min_samples_leaf": 20})


def test_draws_find_an_effect():
    """A drawn behaviour's effect is that of its pair, whatever is offered beside it and however good the cell is."""
    rng, n, offered = np.random.default_rng(1), 40_000, offered_of(PAIRS)
    cell, sight = rng.integers(2, size=n), rng.normal(size=(n, len(SIGHT))).astype(np.float32)
    option = np.where(rng.random(n) < 0.5, USUAL, OPTIONS.index(REACHES))
    option[(option != USUAL) & (cell == 1) & (rng.random(n) < 0.5)] = OPTIONS.index(STANDS)
    effect = np.where(option == OPTIONS.index(REACHES), np.where(cell == 1, 0.3, 0.1), 0) - 0.1 * (option == OPTIONS.index(STANDS))
    change = (effect + 0.5 * cell + 0.1 * sight[:, 0] + rng.normal(scale=0.1, size=n)).astype(np.float32)
    seconds = Seconds(np.arange(n) % 20, np.full(n, ROLES.index("striker")), cell, sight, option, np.column_stack([change, change]))
    sums = of_draws(seconds, PAIRS, offered, left_of(seconds))
    assert sums.effects() == pytest.approx([0.2, -0.1], abs=0.02), "both cells count alike, though it is drawn less often in one"
    assert sums.drawn_anew(50).std(axis=0).max() < 0.02


def test_a_confounded_behaviour():
    """A behaviour that is done where things go well anyway is told from one that helps."""
    rng, n = np.random.default_rng(2), 12_000
    sight = rng.normal(size=(n, len(SIGHT))).astype(np.float32)
    label = np.where(rng.random(n) < 1 / (1 + np.exp(-2 * sight[:, 0])), OPTIONS.index(REACHES), OPTIONS.index(STANDS))
    change = 0.3 * sight[:, 0] + rng.normal(scale=0.1, size=n)
    watched = Watched(np.arange(n) % 12, np.full(n, ROLES.index("striker")), np.ones(n, np.int64), sight, label, label, change)
    naive = change[label == OPTIONS.index(REACHES)].mean() - change.mean()
    assert naive > 0.1
    for estimate in (adjusted, doubly_robust):
        assert np.abs(estimate(watched, label, PAIRS, left_of_moments(watched))).max() < naive / 2


def test_robots_do_what_is_drawn():
    """Behaviours are drawn only where they are offered; what is offered nowhere changes no match."""
    game, nowhere = Game("static", 7, 60.0), np.zeros((len(ROLES), CELLS, len(OPTIONS)), bool)
    plain, other = played(game, nowhere, 0.5), played(game, nowhere, 1.0)
    assert plain.goals == other.goals
    assert (plain.seconds.option == USUAL).all()
    offered = nowhere.copy()
    offered[ROLES.index("striker"), :, OPTIONS.index(STANDS)] = True
    found = played(game, offered, 0.5).seconds
    drawn = found.option != USUAL
    assert set(found.option[drawn]) == {OPTIONS.index(STANDS)}
    assert set(found.role[drawn]) == {ROLES.index("striker")}
    strikers = found.role == ROLES.index("striker")
    assert drawn[strikers].mean() == pytest.approx(0.5, abs=0.2)
    assert found.change[drawn].tolist() != plain.seconds.change[:drawn.sum()].tolist()


def test_the_study_runs(tmp_path, monkeypatch, call):
    """A tiny study has the columns of the tables that are kept; a team without insertions is level with itself."""
    for module, name, value in ((doing.study, "REPORTED", ("pressing",)), (doing.watched, "SUPPORT", 8), (doing.watched, "MOMENTS", 12)):
        monkeypatch.setattr(module, name, value)
    monkeypatch.setattr(doing.watched, "command", lambda *words: ended.append(call(*words)[0]))
    ended: list[int] = []
    sizes = Sizes(both := dict.fromkeys(("static", "counter", "pressing"), 2), both, {"carried over": 1, "today": 1}, 120.0, 20)
    doing.study.main(tmp_path, tmp_path / "data", sizes)
    assert ended == [0] * 3
    for name in ("correlations", "seconds", "pairs", "inserted"):
        assert pl.read_csv(tmp_path / f"{name}.csv").columns == pl.read_csv(doing.study.FOLDER / f"{name}.csv").columns
    assert Inserted("static", {}, 60.0).ahead([3])["difference"].to_list() == [0.0]
