"""Share of time that an apprentice earns by looking, by its own log."""

from __future__ import annotations

import numpy as np
import polars as pl
from scipy.special import stdtrit

from pitchlore.pipeline.arena.teams.appraising import action_values_at, appraiser_of
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.settings import AppraisalSettings
from pitchlore.pipeline.stages.policies.appraise import fit_action_values
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES, Decisions, Sights


def earned(store: Store, decided: pl.DataFrame, parts: int = 5) -> float:
    """Share of time in actions that surely are worth more, where they were chosen, than the best constant.

    The appraisals are fitted anew to the season's log without each fifth of its matches. The lower bound is
    that of the jackknife (Student). Constants, the first second of an episode and decisions at random do not
    count.

    Args:
        store: the season's own store.
        decided: decisions of logged matches, with what was seen.
        parts: number of parts of the jackknife.
    """
    made = pl.concat([store.read_table(each, "decisions", Decisions) for each in store.receipts("decisions")])
    seen = pl.concat([store.read_table(each, "sights", Sights) for each in store.receipts("sequences")])
    matches = made["match_id"].unique().sort()
    pairs = decided.select("role", "behaviour_id").unique().sort("role", "behaviour_id")
    settings = AppraisalSettings(least_share=0.0)
    lasts = (decided["end_ns"] - decided["t_ns"]).to_numpy()
    start = pl.col("t_ns").min().over("match_id", "episode")
    since = decided.select(pl.col("t_ns") - start).to_series().to_numpy()
    gains = []
    for part in range(parts):
        left = matches.gather_every(parts, part)
        kept = ~pl.col("match_id").is_in(left.implode())
        found, _ = fit_action_values(made.filter(kept), seen.filter(kept), pairs, settings, 1)
        gains.append(_gains(found, decided))
    gain = np.array(gains)
    mean = gain.mean(0)
    error = np.sqrt((parts - 1) / parts * ((gain - mean) ** 2).sum(0))
    surely = mean - stdtrit(parts - 1, 0.975) * error > 0
    counts = surely & (since >= 1e9) & ~decided["random"].to_numpy()
    return float((lasts * counts).sum() / lasts.sum())


def _gains(appraisals: pl.DataFrame, decided: pl.DataFrame) -> F64:
    """Worth of the chosen actions, less that of the role's action that is worth most on average."""
    appraiser, _ = appraiser_of(decided.select("role", "behaviour_id").unique(), appraisals)
    value = action_values_at(appraiser, np.ascontiguousarray(decided["sight"].to_numpy(), dtype=np.float32))
    code = decided["behaviour_id"].str.split("-").list.last().cast(pl.Int64).to_numpy()
    chosen = value[np.searchsorted(appraiser.codes[1:], code) + 1, np.arange(len(code))]
    best = np.zeros(len(code))
    for number, role in enumerate(ROLES):
        own = (decided["role"].cast(pl.String) == role).to_numpy()
        offered = np.flatnonzero(appraiser.allowed[number])
        best[own] = value[offered[value[np.ix_(offered, own)].mean(1).argmax()], own]
    gain: F64 = chosen - best
    return gain
