"""Habits: what a team does at what its robots see, learned from the clues to its options alone.

A team's habits are the probability of each option at an observation. They are learned together with the
options themselves (expectation maximisation): options of windows by clues and habits, habits by options of
windows. Boosted trees hold the habits. So a window whose motion does not tell, because the robot is held,
gets the option that the team has at such observations elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import polars as pl
from sklearn.ensemble import HistGradientBoostingClassifier

from pitchlore.pipeline.numbers.arrays import F32, F64, I64
from pitchlore.pipeline.numbers.threads import one_thread
from pitchlore.pipeline.numbers.trees import Trees, arrays_of, logits, rows_of, without_trees
from pitchlore.pipeline.settings import HabitSettings
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.schemas import ROLES, Habits, HabitTrees
from pitchlore.schemas.options import OPTIONS
from pitchlore.schemas.sights import SIGHT

#: Rounds in which habits of roles are learned; they cost little.
_ROUNDS = 20
#: Length of the stretches of a single match that are told from each other, ns.
_BLOCK_NS = 60_000_000_000


#: Fits habits to several sets of windows, each observations and options; their trees by option, in order.
Fits = Callable[[Sequence[tuple[F32, I64]], HabitSettings], Sequence[dict[int, Trees]]]


def one_by_one(sets: Sequence[tuple[F32, I64]], settings: HabitSettings) -> list[dict[int, Trees]]:
    """The habits of each set of windows."""
    return [fit_habits(observation, option, settings) for observation, option in sets]


def team_habits(
    clues: pl.DataFrame, team: Team, settings: HabitSettings, version: int, fits: Fits = one_by_one
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """The habits of a team.

    Args:
        clues: rows of schema Clues, of the team, in roles that are known.
        team: the team.
        settings: rounds and trees; all clues are learned from.
        version: version of the knowledge.
        fits: fits habits to the windows of each half of the matches.

    Returns:
        Rows of schema Habits and of schema HabitTrees; none without clues.
    """
    if clues.is_empty():
        return Habits.empty(), HabitTrees.empty()
    match = clues["match_id"].rank("dense").to_numpy().astype(np.int64)
    # one match alone is parted by its minutes
    block = clues["start_ns"].to_numpy() // _BLOCK_NS
    fold = (match if match.max() > 1 else block) % 2
    observation = np.ascontiguousarray(clues["sight"].to_numpy(), dtype=np.float32)
    role = clues["role"].to_physical().to_numpy().astype(np.int64)
    with one_thread():  # also for threads that fit both folds at once: each would restore what it found
        grown, posterior = habits(clues["ratios"].to_numpy(), observation, role, fold, settings, fits)
    taken = []
    for place, of_role in enumerate(ROLES):
        windows, all_of_role = posterior[role == place].sum(axis=0), max((role == place).sum(), 1)
        taken += [{"role": of_role, "option": OPTIONS[option], "windows": windows[option],
                   "share": windows[option] / all_of_role} for option in sorted(grown)]
    known = Habits.of([{"version": version, **team._asdict(), **row} for row in taken
                       if row["windows"] > 0 and row["share"] >= settings.least_share])
    whole, schema = _of_all_options(grown, observation, settings), pl.Schema(HabitTrees.dtypes())
    return known, pl.concat([
        rows_of(trees, list(SIGHT), version, code).cast(schema)
        for code, trees in zip(OPTIONS, whole, strict=True)])


def _of_all_options(grown: dict[int, Trees], observation: F32, settings: HabitSettings) -> list[Trees]:
    """Trees of all options; one that the team has not has its share of the doubt, in the mean."""
    found = np.array([logits(trees, observation) for trees in grown.values()])
    top = found.max(axis=0)
    both = float((top + np.log(np.exp(found - top).sum(axis=0))).mean())
    rare = without_trees(both + np.log(settings.doubt / len(OPTIONS)))
    return [grown.get(option, rare) for option in range(len(OPTIONS))]


def habits(
    ratios: F32, observation: F32, role: I64, fold: I64, settings: HabitSettings, fits: Fits = one_by_one
) -> tuple[dict[int, Trees], F64]:
    """Learn the habits of a team.

    Args:
        ratios: float32 [W, A], see schema Clues.
        observation: float32 [W, 30].
        role: int64 [W], index in ROLES; before any trees, habits are those of the role.
        fold: int64 [W], 0 or 1: habits that a window's option is told by are learned from the other fold.
        settings: rounds and trees.
        fits: fits the habits of both folds.

    Returns:
        The trees of each option's logit, by its index, of those that the team has; and the options of all
        windows, float64 [W, A].
    """
    rng = np.random.default_rng(settings.seed)
    likelihood = np.exp((ratios - ratios.max(axis=1, keepdims=True)).astype(np.float64))
    posterior = _of_roles(likelihood, role)
    halves = [np.flatnonzero(fold == part) for part in (0, 1)]
    for _ in range(settings.rounds):
        drawn, before = _draw(posterior, rng), np.full(ratios.shape, settings.doubt / ratios.shape[1])
        if all(map(len, halves)):
            grown = fits([(observation[half], drawn[half]) for half in halves[::-1]], settings.of_rounds)
            for own, others in zip(halves, grown, strict=True):
                before[own] += (1 - settings.doubt) * probabilities(others, observation[own], ratios.shape[1])
        posterior = _weighed(likelihood, before)
    return fit_habits(observation, _draw(posterior, rng), settings), posterior


def _of_roles(likelihood: F64, role: I64) -> F64:
    """The options of all windows by habits of roles alone, float64 [W, A]."""
    shares = np.full((len(ROLES), likelihood.shape[1]), 1 / likelihood.shape[1])
    for _ in range(_ROUNDS):
        posterior = _weighed(likelihood, shares[role])
        shares = np.array(
            [posterior[role == each].sum(axis=0) + 1 / shares.shape[1] for each in range(len(ROLES))])
        shares /= shares.sum(axis=1, keepdims=True)
    return _weighed(likelihood, shares[role])


def _weighed(likelihood: F64, before: F64) -> F64:
    """Probabilities, float64 [W, A], from those before anything was seen."""
    both = likelihood * before
    shares: F64 = both / both.sum(axis=1, keepdims=True)
    return shares


def fit_habits(observation: F32, option: I64, settings: HabitSettings) -> dict[int, Trees]:
    """Trees of the logit of each option that was drawn often enough, by its index."""
    found, counts = np.unique(option, return_counts=True)
    common = found[counts >= settings.leaf_samples]
    if len(common) < 2:
        return {int(found[counts.argmax()]): without_trees(0.0)}
    kept = np.isin(option, common)
    builder = HistGradientBoostingClassifier(  # type: ignore[no-untyped-call]
        max_iter=settings.trees, learning_rate=settings.learning_rate, max_leaf_nodes=settings.leaves,
        min_samples_leaf=settings.leaf_samples, l2_regularization=settings.tree_penalty, early_stopping=False,
        random_state=settings.seed)
    with one_thread():
        builder.fit(observation[kept], option[kept])
    if len(common) == 2:  # scikit-learn fits one logit, of the second
        return {int(common[0]): without_trees(0.0), int(common[1]): arrays_of(builder)}
    return {int(code): arrays_of(builder, place) for place, code in enumerate(common)}


def probabilities(grown: dict[int, Trees], observation: F32, options: int) -> F64:
    """Probability of each of so many options at observations, float64 [W, A]; 0 of those without trees."""
    found = np.full((len(observation), options), -np.inf)
    for option, trees in grown.items():
        found[:, option] = logits(trees, observation)
    found = np.exp(found - found.max(axis=1, keepdims=True))
    shares: F64 = found / found.sum(axis=1, keepdims=True)
    return shares


def _draw(posterior: F64, rng: np.random.Generator) -> I64:
    """One option of each window by its probability, int64 [W]."""
    edges = posterior.cumsum(axis=1)
    drawn: I64 = (edges < edges[:, -1:] * rng.random((len(edges), 1))).sum(axis=1)
    return drawn
