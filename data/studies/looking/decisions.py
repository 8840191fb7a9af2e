"""Decisions of an apprentice in a few logged matches: how brief, what they follow, what they earn."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import polars as pl
from looking.aims import EARNED
from looking.earned import earned
from looking.learners import STATIC, USUAL

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.engine.teams import apprentice, labelled
from pitchlore.pipeline.numbers.arrays import F32, I64
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.stages.sequences.sights import sights
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES, Values
from pitchlore.schemas.decisions import BRIEF_FRAMES
from pitchlore.schemas.sights import SIGHT

#: Seeds of the logged matches.
LOGGED = range(2_100_000, 2_100_004)


def described(store: Store, word: str) -> dict[str, object]:
    """A row on the decisions of an apprentice in a few logged matches against static."""
    player = apprentice(store, word)
    label, tables = labelled(player.store, player.manifest)
    made, seen = [], []
    for seed in LOGGED:
        recipe = Recipe(
            **USUAL.of_match(), home=player.team.settings, away=TeamSettings(kind=STATIC), seed=seed)
        receipt, _ = record(store, recipe, {label: tables})
        whole = log.read(store.read(receipt, "log"), where=receipt.name)
        made.append(whole.decisions.drop_nulls("behaviour_id"))
        seen.append(sights(whole, Values.empty(), GramSettings()))
    decided = pl.concat(made).join(
        pl.concat(seen), on=("match_id", "team", "robot", "t_ns"), maintain_order="left")
    return {
        "team": word, "decisions": decided.height, "two frames or fewer": brief(decided),
        "bits of sight in the action": information(decided), EARNED: earned(player.store, decided)}


def brief(decided: pl.DataFrame) -> float:
    """Share of decisions that last two frames or fewer."""
    frames = (decided["end_ns"] - decided["t_ns"]).to_numpy() * USUAL.physics.hz / 1e9
    return float((frames <= BRIEF_FRAMES + 0.5).mean())


def information(decided: pl.DataFrame) -> float:
    """Mutual information of what is seen and the action, given the role, in bits, less that of shuffles.

    What is seen is in :func:`cells`.
    """
    seen = cells(decided["sight"].to_numpy())
    rng, action = np.random.default_rng(0), decided["behaviour_id"].to_numpy()
    roles = decided["role"].cast(pl.String).to_numpy()
    total = 0.0
    for role in ROLES:
        own = roles == role
        true = _bits(seen[own], action[own])
        chance = np.mean([_bits(rng.permutation(seen[own]), action[own]) for _ in range(20)])
        total += own.mean() * (true - chance)
    return float(total)


def cells(seen: F32) -> I64:
    """Sights, [n, 30], in 36 cells: the ball's third, the robot's distance to it, whether it is behind it."""
    of = {name: seen[:, place] for place, name in enumerate(SIGHT)}
    found: I64 = (np.digitize(of["ball_x"], [-0.25, 0.25]) * 12
                  + np.digitize(of["ball_distance"], [0.1, 0.25, 0.5]) * 3
                  + np.digitize(of["behind"], [-0.3, 0.6]))
    return found


def _bits(one: npt.NDArray[np.generic], other: npt.NDArray[np.generic]) -> float:
    """Mutual information of two discrete variables, bits, by their counts."""
    _, first = np.unique(one, return_inverse=True)
    _, second = np.unique(other, return_inverse=True)
    joint = np.zeros((first.max() + 1, second.max() + 1))
    np.add.at(joint, (first, second), 1 / len(first))
    outer = joint.sum(1, keepdims=True) * joint.sum(0, keepdims=True)
    there = joint > 0
    return float((joint[there] * np.log2(joint[there] / outer[there])).sum())
