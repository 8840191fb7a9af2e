"""Imitation: a team's habits, learned from the motion of its robots."""

import numpy as np
import polars as pl
import pytest
from support.played import whole

from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.appraising import action_values_at, appraiser_of
from pitchlore.pipeline.engine.imitations import imitation_of
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.settings import ImitationSettings
from pitchlore.pipeline.stages.policies.imitate import habits, imitate
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES, Clues, Policies
from pitchlore.schemas.options import OPTIONS
from pitchlore.schemas.sights import SIGHT

SETTINGS = ImitationSettings(rounds=2, trees=20, leaf_samples=20)
#: Places of three options that the robots of these tests know.
NEAR, FAR, NEVER = OPTIONS.index(44), OPTIONS.index(88), OPTIONS.index(184)


def watched(windows: int = 600, told: float = 0.5, seed: int = 0) -> tuple[pl.DataFrame, np.ndarray]:
    """A robot that takes NEAR where the ball is on its left half, else FAR; some windows tell nothing of it."""
    rng = np.random.default_rng(seed)
    sight = np.zeros((windows, len(SIGHT)), dtype=np.float32)
    sight[:, 0] = rng.uniform(-1, 1, windows)
    done = np.where(sight[:, 0] < 0, NEAR, FAR)
    ratios = np.zeros((windows, len(OPTIONS)), dtype=np.float32)
    clear = rng.random(windows) < told
    ratios[np.flatnonzero(clear), done[clear]] = 6.0
    at = np.arange(windows) * 200_000_000
    table = pl.DataFrame({
        "match_id": [f"match-{w % 2}" for w in range(windows)], "team": "home", "robot": 1, "role": "striker",
        "start_ns": at, "end_ns": at + 200_000_000, "segment": 0, "sight": pl.Series(sight),
        "ratios": pl.Series(ratios)})
    return table.cast(pl.Schema(Clues.dtypes())), done


def test_windows_that_do_not_tell():
    """A window whose motion tells nothing gets the option that the team has at such an observation."""
    table, done = watched()
    sight, ratios = (table[name].to_numpy() for name in ("sight", "ratios"))
    _, posterior = habits(ratios, sight, np.full(len(done), 2), np.arange(len(done)) % 2, SETTINGS)
    silent = (ratios == 0).all(axis=1)
    assert silent.mean() > 0.4
    assert (posterior.argmax(axis=1)[silent] == done[silent]).mean() > 0.9


def test_policy():
    """The policy offers what the team did, and prefers it where the team did it."""
    pairs, appraisals = imitate(watched()[0], SETTINGS, 7)
    assert set(pairs["behaviour_id"]) == {"striker-044", "striker-088"}
    assert pairs["value"].sum() == pytest.approx(1.0, abs=0.05)
    assert appraisals["version"].unique().to_list() == [7]
    rows = pairs.select(
        pl.lit(7).alias("version"), pl.lit(1).alias("knowledge_version"), "role", "key", "state", "behaviour_id",
        q="initial", visits=pl.lit(0), evidence=pl.lit(0.0)).select(list(Policies.dtypes()))
    values, _ = appraiser_of(rows.cast(pl.Schema(Policies.dtypes())), appraisals)
    sight = np.zeros((2, len(SIGHT)), dtype=np.float32)
    sight[:, 0] = -0.5, 0.5
    worth = action_values_at(values, sight)
    near, far = (values.codes.tolist().index(code) for code in (44, 88))
    assert worth[near, 0] > worth[far, 0]
    assert worth[near, 1] < worth[far, 1]


@pytest.mark.parametrize("windows", [0, 1, 30])
def test_little_to_learn_from(windows):
    """A team that was hardly seen gives a policy of what there is."""
    pairs, appraisals = imitate(watched(windows)[0], SETTINGS, 1)
    assert pairs.height <= 2 * len(ROLES)
    assert appraisals["code"].n_unique() == pairs["behaviour_id"].n_unique()


def test_same_seed_same_policy():
    """The same clues and settings give the same policy."""
    table, _ = watched()
    for one, other in zip(imitate(table, SETTINGS, 1), imitate(table, SETTINGS, 1), strict=True):
        assert one.equals(other)


@pytest.mark.slow
def test_rebuilt_team(copied, call, tmp_path):
    """A team is rebuilt beside the folder's tables; it plays, and decides in each window; again, nothing is new."""
    before = {path: path.read_bytes() for path in copied.rglob("*.receipt.json")}
    (tmp_path / "small.toml").write_text("[policies.imitation]\nrounds = 1\ntrees = 5\n")
    words = ("imitate", "blue", "--settings", tmp_path / "small.toml", "--data", copied)
    code, said, _ = call(*words)
    assert (code, "imitated:blue is rebuilt from 2 of its matches (policy version 1, new)" in said) == (0, True)
    assert {path: path.read_bytes() for path in before} == before
    policies: dict[str, PolicyTables] = {}
    team = entrant(Store(copied), "imitated:blue", policies).settings
    assert team.clock_s == 0.2
    recipe = Recipe(home=team, away=TeamSettings(kind="static"), seed=1, referee=RefereeSettings(duration_s=10.0))
    decided = whole(MatchInPlay(recipe, controllers_of(recipe, policies))).decisions
    assert decided.height > 100
    assert decided["random"].mean() < 0.1
    assert "(policy version 1, unchanged)" in call(*words)[1]
    assert verify_all(Store(copied)).files > verify_all(imitation_of(Store(copied), "blue")).files > 0
    (knowledge,) = imitation_of(Store(copied), "blue").root.glob("knowledge/v0001/*behaviours*.parquet")
    assert set(pl.read_parquet(knowledge)["team"]) <= {"blue"}


def test_nobody_to_rebuild(finished, call):
    """A name that no match has is refused with those that there are; a team that nobody rebuilt does not play."""
    assert call("imitate", "red", "--data", finished)[2] == (
        f"pitchlore: {finished}: no match is of a team 'red' (there are: blue, yellow). Import its matches first.\n")
    assert call("evaluate", "--policy", "imitated:the reds", "--against", "static", "--data", finished)[2] == (
        f"pitchlore: {finished}: nothing imitates 'the reds' yet. Make it with `pitchlore imitate 'the reds'`.\n")
