"""The ceiling of a copy: the same learner, told which options were executed, and a step of improvement by V.

A demonstrator whose robots run our executors logs what it decides. Its recordings leave that out; it lies
beside them. The clone has the habits of :mod:`pipeline.stages.options.of_team`, learned from the executed
option in place of clues. The step of improvement adds A / β to the clone's logit of each option: A is what
boosted trees expect an option to change of V in the second after it, beside what is expected of all options
there (:mod:`pipeline.stages.policies.appraise`). V is that of the recordings, from positions alone,
cross-fitted by match.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline import matches
from pitchlore.pipeline.engine.habits import habitual
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.settings import AppraisalSettings, GramSettings, HabitSettings
from pitchlore.pipeline.stages.options.of_team import team_habits
from pitchlore.pipeline.stages.policies.appraise import fit_action_values
from pitchlore.pipeline.stages.sequences.sights import sights
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Values
from pitchlore.schemas.options import OPTIONS

#: β of the step of improvement. Of .02, .05 and .2 it was the best for the first demonstrator, by 8 pairs
#: against static on seeds from 4,480,000 on, which no row of the table has.
BETA = 0.02
#: Logarithm of the ratio of an option that was not executed.
_NOT_DONE = -60.0
#: What a decision and what was seen at it share.
_AT = ("match_id", "team", "robot", "t_ns")


class Executed(NamedTuple):
    """Decisions of a demonstrator in its recordings.

    Attributes:
        decisions: rows of schema Decisions, of one option each.
        sights: rows of schema Sights, at these decisions.
    """

    decisions: pl.DataFrame
    sights: pl.DataFrame


def decisions_beside(recording: Path) -> Path:
    """Where the decisions of a recorded match lie."""
    return recording.with_suffix(".decisions.parquet")


def executed(store: Store, recordings: Sequence[Path]) -> Executed:
    """Decisions in recorded matches, and sights at them; ``store`` has learned from these, and knows V."""
    made, seen = [], []
    for path in recordings:
        log = matches.read(path.read_bytes(), where=path.name)
        decisions = pl.read_parquet(decisions_beside(path)).filter(
            pl.col("behaviour_id").str.split("-").list.last().cast(pl.Int16).is_in(OPTIONS))
        (receipt,) = (each for each in store.receipts("values") if each.name == log.info.match_id)
        known = replace(log, decisions=decisions)
        made.append(decisions)
        seen.append(sights(known, table_of(store, receipt, Values), GramSettings()))
    return Executed(pl.concat(made), pl.concat(seen))


def clone(done: Executed) -> tuple[pl.DataFrame, pl.DataFrame]:
    """The pairs and appraisals of the copy that was told what was executed."""
    code = pl.col("behaviour_id").str.split("-").list.last().cast(pl.Int16)
    told = done.decisions.select(*_AT, option=code).join(
        done.sights.select(*_AT, "role", "sight"), on=_AT, maintain_order="left")
    option = np.searchsorted(OPTIONS, told["option"].to_numpy())
    ratios = np.full((len(option), len(OPTIONS)), _NOT_DONE, dtype=np.float32)
    ratios[np.arange(len(option)), option] = 0.0
    clues = told.with_columns(pl.Series("ratios", ratios), start_ns=pl.col("t_ns"))
    # no option is in doubt: further rounds would learn the same
    return habitual(*team_habits(clues, Team("demonstrator", "vsss"), HabitSettings(rounds=1), 1), 1)


def improved(done: Executed, pairs: pl.DataFrame, appraisals: pl.DataFrame, beta: float) -> pl.DataFrame:
    """The appraisals of a clone, with what is expected of V over ``beta`` as further trees of each option."""
    gains, _ = fit_action_values(done.decisions, done.sights, pairs, AppraisalSettings(), 1)
    own = gains.filter(pl.col("code").is_in(appraisals["code"].unique().to_list()))
    after = pl.lit(appraisals.select(pl.col("tree").max() + 1).to_series())
    return pl.concat([appraisals, own.with_columns(
        (pl.col("tree") + after.first()).cast(own["tree"].dtype), pl.col("value") / beta)])
