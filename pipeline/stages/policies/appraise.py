"""Appraisals: how much more than another an action is worth at an observation, fitted to what V did after it.

A logged decision says what a robot saw, which action it began, and how V, the chance to score soon, had
changed a second later. Part of that change comes from the observation alone, whatever is done: it is what
boosted trees expect of all decisions together. Trees for each action are fitted to what is left of it, over
the decisions of all matches and roles. V is cross-fitted by match, so that no match judges itself. A goal
comes ten seconds and twenty decisions later: its sign says little of one decision, and the change of V says
more.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import polars as pl
from sklearn.ensemble import HistGradientBoostingRegressor

from pitchlore.pipeline.numbers.arrays import F32, F64
from pitchlore.pipeline.numbers.threads import one_thread
from pitchlore.pipeline.numbers.trees import Trees, arrays_of, logits, rows_of, trees_of, without_trees
from pitchlore.pipeline.settings import AppraisalSettings
from pitchlore.schemas import KEYS, ROLES, Appraisals
from pitchlore.schemas.sights import SIGHT
from pitchlore.schemas.situations import MOVES_RANDOMLY

#: The codes of a behaviour, as text.
_CODES = pl.col("behaviour_id").str.split("-").list.slice(1)
#: Most observations at which actions are compared.
_LOOKED = 20_000


def actions(occasions: pl.DataFrame, codes: Iterable[int], settings: AppraisalSettings) -> pl.DataFrame:
    """The actions that a team chooses from, as pairs of one state to value.

    Args:
        occasions: rows of schema Occasions, of the team that is imitated.
        codes: codes of Table 1, all.
        settings: ``codes``.

    Returns:
        Columns role, key (the coarsest), state (0), behaviour_id (of one code), initial (0) and value (null),
        as :func:`pipeline.stages.policies.train.train` takes them; sorted, without moves randomly.
    """
    if settings.codes == "all":
        found = pl.DataFrame({"code": [f"{code:03d}" for code in codes]}).join(
            pl.DataFrame({"role": ROLES}), how="cross")
    else:
        found = occasions.filter(pl.col("count") > 0).select(
            pl.col("role").cast(pl.String), code=pl.col("behaviour_id").str.split("-").list.slice(1),
        ).explode("code")
    return found.filter(pl.col("code") != f"{MOVES_RANDOMLY:03d}").unique().select(
        pl.col("role").cast(pl.Enum(ROLES)), pl.lit(KEYS[-1], dtype=pl.Enum(KEYS)).alias("key"),
        pl.lit(0, dtype=pl.Int64).alias("state"), behaviour_id=pl.col("role") + "-" + pl.col("code"),
        initial=pl.lit(0.0), value=pl.lit(None, dtype=pl.Float64),
    ).sort("role", "behaviour_id")


def fit_action_values(
    decisions: pl.DataFrame, observations: pl.DataFrame, pairs: pl.DataFrame, settings: AppraisalSettings,
    version: int, watched: pl.DataFrame | None = None, habits: pl.DataFrame | None = None,
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Fit the trees of each action that was chosen at least once, and keep the actions that are worth a try.

    An action's worth is relative: to what is expected of all decisions at the same observation.

    Args:
        decisions: rows of schema Decisions; those of more than one code are passed over.
        observations: rows of schema Sights of the same matches.
        pairs: pairs of :func:`actions`.
        settings: the trees, ``least_share``, ``watched`` and ``habits``.
        version: version of the policy.
        watched: rows of schema Sights of the team that is imitated; decisions are passed over.
        habits: rows of schema HabitTrees of that team.

    Returns:
        Rows of schema Appraisals. An action that was chosen fewer than two ``leaf_samples`` times, and that
        nobody was watched at so often, has its mean alone, as if ``leaf_samples`` more decisions had changed
        nothing. And the pairs that are kept.
    """
    at = "match_id", "team", "robot", "t_ns"
    seen = observations["sight"].rechunk()  # polars 1 cannot take no row of several pieces
    made = (
        decisions.filter("chosen").select(*at, "role", code=_CODES).filter(pl.col("code").list.len() == 1)
        .join(observations.select(*at, "change").with_row_index("row"), on=at, maintain_order="left")
        .filter(pl.col("change").is_not_null())
        .select("role", pl.col("code").list.first().cast(pl.Int16), "row", "change"))
    grown = _appraised(made, seen, set(made["code"]), settings)
    if settings.watched and watched is not None:
        shown = watched.with_row_index("row", offset=len(seen)).filter(
            pl.col("change").is_not_null(), pl.col("code") != MOVES_RANDOMLY).select(made.columns)
        seen = pl.concat([seen, watched["sight"]], rechunk=True)
        with_trees = {code for code, trees in grown.items() if len(trees.start)}
        by_others = _appraised(shown, seen, set(shown["code"]) - with_trees, settings)
        grown |= {code: trees for code, trees in by_others.items() if len(trees.start)}
        made = pl.concat([made, shown])
    appraisals = _rows_of_all(grown, habits if settings.habits else None, settings.habits, version)
    if habits is not None:
        grown = {code: trees_of(appraisals.filter(code=code)) for code in grown}
    looked = made.gather_every(-(-made.height // _LOOKED) or 1)
    kept = [_kept(own, _rows(seen, looked.filter(role=role)), grown, settings.least_share)
            for (role,), own in pairs.group_by("role", maintain_order=True)]
    return appraisals, pl.concat([pairs.clear(), *kept])


def _rows_of_all(
    grown: dict[int, Trees], habits: pl.DataFrame | None, weight: float, version: int
) -> pl.DataFrame:
    """Rows of schema Appraisals: each action's trees, and after them its habit's, times a weight."""
    schema = pl.Schema(Appraisals.dtypes())
    rows = [Appraisals.empty(), *(
        rows_of(trees, list(SIGHT), version, code).cast(schema) for code, trees in grown.items())]
    if habits is not None:
        after = {code: 1 + len(trees.start) for code, trees in grown.items()}
        place = pl.col("code").cast(pl.Int32).replace_strict(after, default=0, return_dtype=pl.Int32)
        rows.append(habits.with_columns(
            pl.lit(version).alias("version"), pl.col("tree") + place, pl.col("value") * weight).cast(schema))
    return pl.concat(rows).sort("code", "tree", "node")


def _rows(seen: pl.Series, moments: pl.DataFrame) -> F32:
    """Observations at moments, float32 [T, 30], by their ``row`` in ``seen``."""
    return np.asarray(seen.gather(moments["row"]).to_numpy(), dtype=np.float32)


def _appraised(
    made: pl.DataFrame, seen: pl.Series, codes: set[int], settings: AppraisalSettings
) -> dict[int, Trees]:
    """The trees of some codes: of what is left of V's change after what is expected at the observation.

    Args:
        made: columns code, row in ``seen``, and change; what is expected is that of all its rows.
        seen: observations, of these moments and maybe others.
        codes: codes of the wanted trees; each is in ``made``.
        settings: the trees.
    """
    observation, change = _rows(seen, made), made["change"].to_numpy()
    expected = _grow(observation, change, settings.model_copy(update={
        "trees": settings.expected_trees, "leaves": settings.expected_leaves}))
    left, code = change - logits(expected, observation), made["code"].to_numpy()
    return {int(each): _grow(observation[code == each], left[code == each], settings)
            for each in sorted(codes)}


def _kept(
    own: pl.DataFrame, observation: F32, grown: dict[int, Trees], least_share: float
) -> pl.DataFrame:
    """The pairs of a role whose action is the best at enough observations; those never tried stay, too."""
    codes = own.select(_CODES.list.first().cast(pl.Int64)).to_series().to_list()
    tried = [code for code in codes if code in grown]
    if not len(observation) or not tried:
        return own
    best = np.array([logits(grown[code], observation) for code in tried]).argmax(axis=0)
    share = dict(zip(tried, np.bincount(best, minlength=len(tried)) / len(best), strict=True))
    return own.filter(pl.Series([code not in share or bool(share[code] >= least_share) for code in codes]))


def _grow(observation: F32, change: F64, settings: AppraisalSettings) -> Trees:
    """Trees fitted to changes, from float32 [T, 30] and float64 [T]."""
    if len(change) < 2 * settings.leaf_samples:
        return without_trees(change.sum() / (len(change) + settings.leaf_samples))
    builder = HistGradientBoostingRegressor(  # type: ignore[no-untyped-call]
        max_iter=settings.trees, learning_rate=settings.learning_rate, max_leaf_nodes=settings.leaves,
        min_samples_leaf=settings.leaf_samples, l2_regularization=settings.tree_penalty,
        max_bins=settings.bins, early_stopping=False, random_state=settings.seed,
    )
    with one_thread():
        return arrays_of(builder.fit(observation, change))
