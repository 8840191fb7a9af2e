"""Effects of doing a behaviour by the draws of a trial, and estimates of them from recordings without draws.

A *pair* is a role and a code, with the cells in which it is seen. All values are changes of V in the second
that follows, less what the team itself does there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from doing.trial import USUAL, Seconds
from doing.watched import Watched
from scipy.stats import spearmanr
from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor

from pitchlore.pipeline.numbers.arrays import F32, F64, I64, Bools
from pitchlore.pipeline.numbers.threads import one_thread
from pitchlore.schemas import ROLES
from pitchlore.schemas.options import OPTIONS

#: Cells by role and code.
Pairs = Mapping[tuple[str, int], I64]
#: Folds by match; trees of what is expected, of propensities; the least propensity that is used.
FOLDS, LEAST = 3, 0.02
EXPECTED = {"max_iter": 80, "learning_rate": 0.08, "max_leaf_nodes": 15, "min_samples_leaf": 200,
            "l2_regularization": 20.0, "early_stopping": False, "random_state": 0}
OF_OPTION = EXPECTED | {"max_iter": 40, "max_leaf_nodes": 6, "min_samples_leaf": 100}
PROPENSITY = EXPECTED | {"max_iter": 15, "learning_rate": 0.2, "min_samples_leaf": 100}
#: Moments of a role at which propensities are learned, at most.
_MOST = 8_000
#: Further moments of an option that the team is taken to have had without any change.
_AS_USUAL = 100


def clues(sight: F32, role: I64) -> F32:
    """Inputs of trees: the sight and the role, float32 [n, 31]."""
    return np.column_stack([sight, role.astype(np.float32)])


def _grown(observation: F32, change: F64, how: Mapping[str, object]) -> HistGradientBoostingRegressor:
    with one_thread():
        trees = HistGradientBoostingRegressor(**how)  # type: ignore[no-untyped-call]
        trees.fit(observation, change)
        return trees


def _told(trees: HistGradientBoostingRegressor, observation: F32) -> F64:
    with one_thread():
        found: F64 = trees.predict(observation)  # type: ignore[no-untyped-call]
    return found


def expected(observation: F32, change: F64, match: I64, learned: Bools | None = None) -> F64:
    """Change that is expected at each observation, by trees of the rows of other matches (``learned``)."""
    learned = np.ones(len(match), dtype=bool) if learned is None else learned
    found, fold = np.empty(len(match)), np.unique(match, return_inverse=True)[1] % FOLDS
    for own in np.unique(fold):
        rest = learned & (fold != own)
        trees = _grown(observation[rest], change[rest], EXPECTED)
        found[fold == own] = _told(trees, observation[fold == own])
    return found


class Drawn(NamedTuple):
    """Sums by pair and match of what is left of V's change after what is expected.

    Attributes:
        did: float64 [P, M, 2], drawn seconds: weighted sum, and sum of weights. A weight is one over the
            chance of the draw, times a constant.
        went_on: the same of seconds in which the team went on; all weights are 1.
        seconds: int64 [P], drawn seconds.
    """

    did: F64
    went_on: F64
    seconds: I64

    def effects(self, times: F64 | None = None) -> F64:
        """Effect of each pair, float64 [P]; ``times``: how often each match counts, float64 [M]."""
        times = np.ones(self.did.shape[1]) if times is None else times
        one, other = (np.einsum("pmk,m->pk", sums, times) for sums in (self.did, self.went_on))
        with np.errstate(invalid="ignore"):
            found: F64 = one[:, 0] / one[:, 1] - other[:, 0] / other[:, 1]
        return found

    def agreement(self, times: int = 100) -> float:
        """Rank correlation that the effects of two such trials would have, by halves of the matches."""
        rng, matches, found = np.random.default_rng(0), self.did.shape[1], []
        for _ in range(times):
            half = (rng.permutation(matches) < matches // 2).astype(float)
            found.append(spearmanr(self.effects(half), self.effects(1 - half), nan_policy="omit").statistic)
        return float(2 * np.mean(found) / (1 + np.mean(found)))

    def drawn_anew(self, times: int, seed: int = 0) -> F64:
        """Effects with matches drawn anew, float64 [times, P] (bootstrap)."""
        rng, matches = np.random.default_rng(seed), self.did.shape[1]
        return np.array([
            self.effects(np.bincount(rng.integers(matches, size=matches), minlength=matches).astype(float))
            for _ in range(times)])


def of_draws(seconds: Seconds, pairs: Pairs, offered: Bools, left: F64) -> Drawn:
    """The sums of a trial.

    Args:
        seconds: seconds of the trial.
        pairs: pairs that were offered.
        offered: bool [roles, 36, options].
        left: float64 [n], V's change less what is expected of the team itself at the observation.
    """
    weight = offered.sum(axis=2)[seconds.role, seconds.cell].astype(np.float64)
    matches, match = np.unique(seconds.match, return_inverse=True)
    did, went_on = np.zeros((2, len(pairs), len(matches), 2))
    count = np.zeros(len(pairs), dtype=np.int64)
    for place, ((role, code), cells) in enumerate(pairs.items()):
        there = (seconds.role == ROLES.index(role)) & np.isin(seconds.cell, cells)
        drawn = there & (seconds.option == OPTIONS.index(code))
        usual = there & (seconds.option == USUAL)
        np.add.at(did[place], match[drawn], np.column_stack([left * weight, weight])[drawn])
        np.add.at(went_on[place], match[usual], np.column_stack([left, np.ones(len(left))])[usual])
        count[place] = drawn.sum()
    return Drawn(did, went_on, count)


def left_of(seconds: Seconds, ahead: int = 0) -> F64:
    """V's change less what is expected of the team itself, cross-fitted by match; ``ahead``: column of it."""
    observation = clues(seconds.sight, seconds.role)
    change = seconds.change[:, ahead].astype(np.float64)
    return change - expected(observation, change, seconds.match, seconds.option == USUAL)


def adjusted(moments: Watched, label: I64, pairs: Pairs, left: F64) -> F64:
    """Mean of what is left of V's change at moments that are labelled so."""
    found = []
    for (role, code), cells in pairs.items():
        own = left[_at(moments, role, cells) & (label == OPTIONS.index(code))]
        found.append(own.mean() if len(own) else np.nan)
    return np.array(found)


def left_of_moments(moments: Watched) -> F64:
    """V's change beyond what is expected at the observation, cross-fitted by match, float64 [n]."""
    return moments.change - expected(clues(moments.sight, moments.role), moments.change, moments.match)


def _at(moments: Watched, role: str, cells: I64) -> Bools:
    there: Bools = (moments.role == ROLES.index(role)) & np.isin(moments.cell, cells)
    return there


def doubly_robust(moments: Watched, label: I64, pairs: Pairs, left: F64) -> F64:
    """Doubly robust estimates (Robins, Rotnitzky and Zhao 1994), for moments of the cells of each pair.

    Outcome: what is expected at the observation, and an offset of each role and option. Propensity: trees by
    role. Moments with a propensity below LEAST are left out.
    """
    observation = clues(moments.sight, moments.role)
    fold = np.unique(moments.match, return_inverse=True)[1] % FOLDS
    places = {pair: place for place, pair in enumerate(pairs)}
    found = np.full(len(pairs), np.nan)
    rng = np.random.default_rng(0)
    for role in (role for role in ROLES if any(role == own for own, _ in pairs)):
        mine = moments.role == ROLES.index(role)
        chance = np.zeros((len(left), len(OPTIONS)))
        for own in np.unique(fold):
            rest = np.flatnonzero(mine & (fold != own) & (label >= 0))
            rest = rng.permutation(rest)[:_MOST]
            with one_thread():
                model = HistGradientBoostingClassifier(**PROPENSITY)  # type: ignore[no-untyped-call]
                model.fit(observation[rest], label[rest])
                here = np.flatnonzero(mine & (fold == own))
                told = model.predict_proba(observation[here])  # type: ignore[no-untyped-call]
            chance[np.ix_(here, model.classes_)] = told
        for (of_role, code), cells in pairs.items():
            if of_role != role:
                continue
            option = OPTIONS.index(code)
            there = _at(moments, role, cells) & (chance[:, option] >= LEAST)
            did = label == option
            if (there & did).sum() < 30:
                continue
            seen = mine & did
            outcome = left[seen].sum() / (seen.sum() + _AS_USUAL)
            weight = np.where(did, 1 / np.maximum(chance[:, option], LEAST), 0.0)
            psi = outcome + weight * (left - outcome)
            found[places[of_role, code]] = (psi - left)[there].mean()
    return found


class Effects(NamedTuple):
    """A model of doing, learned from the draws of trials of some teams.

    Attributes:
        usual: trees of V's change where those teams went on.
        of_option: trees of what each option changes beyond that, by index in OPTIONS.
    """

    usual: HistGradientBoostingRegressor
    of_option: Mapping[int, HistGradientBoostingRegressor]

    @classmethod
    def fit(cls, seconds: Seconds) -> Effects:
        """Learn it."""
        observation, change = clues(seconds.sight, seconds.role), seconds.change[:, 0].astype(np.float64)
        usual = _grown(observation[seconds.option == USUAL], change[seconds.option == USUAL], EXPECTED)
        left = change - _told(usual, observation)
        return cls(usual, {int(option): _grown(observation[own], left[own], OF_OPTION)
                           for option in np.unique(seconds.option) if option != USUAL
                           and (own := seconds.option == option).sum() >= 2 * OF_OPTION["min_samples_leaf"]})

    def carried_over(self, moments: Watched, pairs: Pairs) -> F64:
        """Mean of what each pair's option would change at a team's moments in the pair's cells, float64 [P].

        It is what it changes beyond what the teams of the trials change there: that this team itself changes
        another amount plays no part. NaN for an option that the trials have not.
        """
        observation, found = clues(moments.sight, moments.role), []
        for (role, code), cells in pairs.items():
            there, known = _at(moments, role, cells), self.of_option.get(OPTIONS.index(code))
            found.append(np.nan if known is None else _told(known, observation[there]).mean())
        return np.array(found)

    def gap(self, moments: Watched, pairs: Pairs, left: F64) -> F64:
        """V's change by the teams of the trials less that by this team, in each pair's cells, float64 [P]."""
        more = _told(self.usual, clues(moments.sight, moments.role)) - (moments.change - left)
        return np.array([more[_at(moments, role, cells)].mean() for (role, _), cells in pairs.items()])
