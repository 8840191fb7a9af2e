"""Logs and policies in which the best action follows what robots see."""

import numpy as np
import polars as pl
from support.played import whole

from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.settings import AppraisalSettings, GramSettings
from pitchlore.pipeline.stages.sequences.sights import sights
from pitchlore.schemas import ROLES, Appraisals, Decisions, Policies, Sights, Values
from pitchlore.schemas.sights import SIGHT

SMALL = AppraisalSettings(trees=10, leaf_samples=20, tree_penalty=0.0)
PLACE = {name: place for place, name in enumerate(SIGHT)}


def pairs_of(**codes):
    """Values of actions by role: no action is better than another."""
    return Policies.of([
        {"version": 1, "knowledge_version": 1, "role": role, "key": "role0", "state": 0,
         "behaviour_id": f"{role}-{code:03d}", "q": 0.0, "visits": 0, "evidence": 0.0}
        for role in ROLES for code in sorted(codes[role])])


def decided(sight, code, change, role="striker"):
    """Decisions with what was seen, one second apart."""
    t_ns = np.arange(len(code)) * 1_000_000_000
    made = Decisions.validate(pl.DataFrame({
        "match_id": "it", "team": "home", "robot": 1, "role": role, "t_ns": t_ns, "end_ns": t_ns + 1, "state": 0,
        "behaviour_id": [f"{role}-{each:03d}" for each in code], "chosen": True, "random": False, "reward": 0.0,
        "episode": 0, "ends": None, "value": 0.0}, schema=Decisions.dtypes()))
    looked = Sights.validate(pl.DataFrame({
        "match_id": "it", "team": "home", "robot": 1, "t_ns": t_ns, "role": role, "code": None, "sight": sight, "change": change},
        schema=Sights.dtypes()))
    return made, looked


def two_places(seed, rng_codes=(21, 44, 88)):
    """Where the ball is far up, 021 is worth more, elsewhere 044; 088 is always worth less."""
    rng = np.random.default_rng(seed)
    sight = rng.normal(size=(3000, len(SIGHT))).astype(np.float32)
    code = rng.choice(rng_codes, len(sight))
    up = sight[:, PLACE["ball_x"]] > 0
    change = np.where(code == 88, -0.2, np.where((code == 21) == up, 0.1, -0.1)) + rng.normal(scale=0.05, size=len(code))
    return sight, code, change


def looks(controllers=None, **how):
    """Where the ball is in strikers' decisions, float64 [n], and whether they take 021, as they should in the other half.

    Args:
        controllers: make the controllers of the match, from its recipe and policies.
        how: settings of the team.
    """
    table = pairs_of(goalkeeper=[88], midfield=[11], striker=[21, 44])
    at = {"version": 1, "tree": 1, "missing_left": True}
    split = at | {"code": 21, "node": 0, "feature": "ball_x", "threshold": 0.0, "left": 1, "right": 2, "value": 0.0}
    ends = [at | {"code": 21, "node": node, "feature": None, "threshold": None, "missing_left": None, "left": None,
                  "right": None, "value": value} for node, value in ((1, -1.0), (2, 1.0))]
    appraisals = Appraisals.of([ends[0] | {"tree": 0, "node": 0, "value": 0.0}, split, *ends])
    recipe = Recipe(home=TeamSettings(kind="learned", policy="it", **how), away=TeamSettings(kind="static"), seed=4,
                    referee=RefereeSettings(duration_s=120.0))
    match = MatchInPlay(recipe, (controllers or controllers_of)(recipe, {"it": PolicyTables(table, appraisals)}))
    log = whole(match)
    rows = log.decisions.join(sights(log, Values.empty(), GramSettings()), on=("team", "robot", "t_ns")).filter(role="striker")
    rows = rows.sort("t_ns")
    return rows["sight"].arr.get(PLACE["ball_x"]).to_numpy(), (rows["behaviour_id"] == "striker-021").to_numpy()
