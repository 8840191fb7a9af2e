"""The decisions that a season logged, as arrays for learners that know nothing of this project."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl

from pitchlore.pipeline.arena.env import BEHAVIOURS
from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.arena.match.sighted import NUMBERS, scale, scales
from pitchlore.pipeline.engine.teams import apprentice
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES, Decisions, Sights
from pitchlore.schemas.sights import SIGHT
from pitchlore.schemas.situations import MOVES_RANDOMLY

_EPISODE = ("match_id", "team", "robot", "episode")


def decisions_of(store: Store, season: str) -> pl.DataFrame:
    """The logged decisions of a season's apprentice, with what it saw and what V did after it, in order.

    They are those that the season's own learner learns from: columns of schemas Decisions and Sights.
    """
    own = apprentice(store, season).store
    made = pl.concat([own.read_table(each, "decisions", Decisions) for each in own.receipts("decisions")])
    seen = pl.concat([own.read_table(each, "sights", Sights) for each in own.receipts("sequences")])
    both = made.filter("chosen").join(
        seen, on=("match_id", "team", "robot", "t_ns"), maintain_order="left")
    return both.sort(*_EPISODE, "t_ns", maintain_order=True)


def export(decisions: pl.DataFrame, path: Path) -> None:
    """Write decisions as an .npz file.

    Arrays: ``observations`` float32 [T, 33], as the environments show sights; ``actions`` int64 [T], indices
    in ``BEHAVIOURS``; ``rewards`` float32 [T], goals; ``changes`` float32 [T], those of V a second later, 0
    where they are not known; ``terminals`` bool [T], after a goal; ``timeouts`` bool [T], where an episode
    ends otherwise. An episode is that of a robot in a stretch of play.
    """
    sight = decisions["sight"].to_numpy().astype(np.float32)
    of = scales(MatchSettings())
    observations = np.zeros((len(sight), NUMBERS), dtype=np.float32)
    for row, numbers in zip(observations, sight, strict=True):
        row[: len(SIGHT)] = numbers
        scale(row, of)
    observations[np.arange(len(sight)), len(SIGHT) + decisions["role"].to_physical().to_numpy()] = 1.0
    assert len(ROLES) == NUMBERS - len(SIGHT)
    places = {f"{code:03d}": place for place, code in enumerate(BEHAVIOURS)}
    code = decisions["behaviour_id"].str.split("-").list.last().fill_null(f"{MOVES_RANDOMLY:03d}")
    last = decisions.select(pl.struct(_EPISODE).rle_id()).to_series()
    ends = (last != last.shift(-1)).fill_null(value=True).to_numpy()
    rewards = decisions["reward"].to_numpy().astype(np.float32)
    aside = path.with_suffix(".part.npz")
    np.savez(aside, observations=observations,
             actions=code.replace_strict(places, return_dtype=pl.Int64).to_numpy(), rewards=rewards,
             changes=decisions["change"].fill_null(0.0).to_numpy().astype(np.float32),
             terminals=ends & (rewards != 0), timeouts=ends & (rewards == 0))
    aside.rename(path)
