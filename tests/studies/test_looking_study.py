"""The study of the team that looks: what counts as reached, and what an action says of what was seen."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from looking.aims import EARNED, Aim, aims
from looking.decisions import information
from looking.learners import ARMS, HELD
from looking.rows import replaced

from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.schemas import ROLES
from pitchlore.schemas.sights import SIGHT


def results(ours, blind=-5.0, spread=0.5):
    """Results of five apprentices: a mean against each opponent and in each arm."""
    wiggle = spread * np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    rows = [{"arm": arm.name, "opponent": opponent, "difference": float(each)}
            for arm in ARMS[HELD.season] for opponent in arm.opponents
            for each in (blind if arm.blind else ours) + wiggle]
    return pl.DataFrame(rows)


@pytest.fixture
def control():
    """Fifty pairs of the best constant team, which loses by one goal."""
    return pl.DataFrame({"difference": np.random.default_rng(1).normal(-1.0, 1.0, 50)})


def reached(found: pl.DataFrame, control: pl.DataFrame, share: float = 0.6) -> dict[str, Aim]:
    decided = pl.DataFrame({EARNED: share + 0.01 * np.arange(5)})
    return {aim.aim: aim for aim in aims(found, HELD, control, decided)}


def test_aims_of_a_good_team(control):
    """A team that is six goals better everywhere, and loses when it is blind, reaches all; each panel member counts."""
    found = reached(results(6.0), control)
    assert all(aim.reached for aim in found.values())
    assert len(found) == 2 + len(PANEL) + 1 + 4 + 1
    assert found["2. ahead of static by more than best-constant (Welch)"].mean == pytest.approx(7.0, abs=0.5)
    assert found["4. loses when it is blind"].mean == pytest.approx(11.0)


def test_aims_need_the_lower_bound(control):
    """A mean above the aim is not enough where the apprentices differ; a team that is as good blind fails aim 4."""
    wide = reached(results(3.0, spread=4.0), control)
    assert wide["1. ahead of best-constant, head to head"].mean > 2
    assert not wide["1. ahead of best-constant, head to head"].reached
    same = reached(results(6.0, blind=6.0), control)
    assert not same["4. loses when it is blind"].reached
    idle = reached(results(6.0), control, share=0.49)
    assert [aim for aim, found in idle.items() if not found.reached] == ["6. earns half of its time, by its own log (a share)"]


def decided(rng, follows):
    """Decisions whose action follows the ball's place, or nothing."""
    sight = rng.normal(scale=0.4, size=(4000, len(SIGHT))).astype(np.float32)
    up = sight[:, list(SIGHT).index("ball_x")] > 0.25
    code = np.where(up if follows else rng.random(len(up)) < up.mean(), "021", "044")
    role = rng.choice(ROLES, len(up))
    return pl.DataFrame({"role": role, "behaviour_id": [f"{a}-{b}" for a, b in zip(role, code, strict=True)],
                         "sight": pl.Series(sight, dtype=pl.Array(pl.Float32, len(SIGHT)))})


def test_information():
    """An action that follows what is seen has its whole entropy in common with it; one by chance has nothing."""
    rng = np.random.default_rng(0)
    up = 0.266  # a normal ball beyond a quarter of a metre
    entropy = -(up * np.log2(up) + (1 - up) * np.log2(1 - up))
    assert information(decided(rng, follows=True)) == pytest.approx(entropy, abs=0.03)
    assert information(decided(rng, follows=False)) == pytest.approx(0.0, abs=0.01)


def test_rows_of_other_learners_stay(tmp_path):
    """A learner that is measured alone replaces its own rows of a table; those of others stay, in the order of learners."""
    path = tmp_path / "aims.csv"
    replaced(path, {"looking-held": pl.DataFrame({"mean": [1.234, 2.0]}), "looking": pl.DataFrame({"mean": [3.0]})}, 2)
    replaced(path, {"looking-held": pl.DataFrame({"mean": [4.0]})}, 2)
    assert path.read_text().splitlines() == ["season,mean", "looking,3.00", "looking-held,4.00"]
