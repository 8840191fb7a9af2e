"""Likeness of two teams: by the shares of their situations, match by match."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.stages.situations.rules import TABLE_1
from pitchlore.schemas import ROLES

#: Ways to halve matches; of each half, ways to learn from a part and to judge the rest.
HALVINGS, SPLITS = 200, 5
#: Matches on each side from which on it is said how well they are told apart.
_TOLD = 4
#: Role and code of each share of a description.
SHARES = tuple(product(ROLES, sorted(TABLE_1)))


class Likeness(NamedTuple):
    """How far one half of a team's matches is from other matches.

    Attributes:
        rival: the other matches.
        matches: number of matches on each side.
        distance: Hellinger's distance of the mean descriptions, from 0 (the same shares) to 1 (none in
            common), mean over halvings.
        auc: how often a match of the one is more like it than a match of the other, mean over halvings; .5
            if nothing tells them apart. None of fewer than four matches on each side.
        most: values of ``distance`` and ``auc`` that 97.5 % of the halvings do not exceed.
    """

    rival: str
    matches: int
    distance: float
    auc: float | None
    most: tuple[float, float | None]


def described(situations: pl.DataFrame) -> F64:
    """A team's side of a match as square roots of shares, float64 [S] in the order of SHARES.

    Args:
        situations: rows of schema Situations of one side of a match.
    """
    counts = situations.drop_nulls("role").group_by("role", "code").len()
    places = {share: place for place, share in enumerate(SHARES)}
    found = np.zeros(len(SHARES))
    for role, code, count in counts.iter_rows():
        found[places[role, code]] = count
    shares: F64 = np.sqrt(found / max(found.sum(), 1.0))
    return shares


def told(one: F64, other: F64, rng: np.random.Generator, splits: int = SPLITS) -> float:
    """How well matches of two teams are told apart: the area under the ROC curve, mean over splits.

    Half of the matches of each are learned from. A match of the other half goes to the team whose mean
    description is nearer.

    Args:
        one: float64 [M, S], descriptions of matches of one team, two or more.
        other: the same of the other.
        rng: draws the half of each that is learned from.
        splits: number of draws.
    """
    found = []
    for _ in range(splits):
        learned, judged = zip(*(
            np.array_split(rng.permutation(rows), 2) for rows in (one, other)), strict=True)
        means = [rows.mean(axis=0) for rows in learned]
        first, second = (np.linalg.norm(rows - means[1], axis=1) - np.linalg.norm(rows - means[0], axis=1)
                         for rows in judged)
        above = first[:, None] - second[None]
        found.append(float((above > 0).mean() + (above == 0).mean() / 2))
    return float(np.mean(found))


def likeness(own: F64, rivals: Mapping[str, F64]) -> list[Likeness]:
    """Distances of a half of a team's matches from its other half, and from the matches of others.

    All are of the same number of matches, so that chance adds the same to each.

    Args:
        own: float64 [M, S], descriptions of the team's matches.
        rivals: descriptions of others' matches, by name; a rival without matches is left out.

    Returns:
        The team's other half first; nothing of fewer than two matches.
    """
    rivals = {name: rows for name, rows in rivals.items() if len(rows)}
    matches = min(len(own) // 2, *map(len, rivals.values())) if rivals else len(own) // 2
    if not matches:
        return []
    rng = np.random.default_rng(0)
    distances: dict[str, list[float]] = {}
    aucs: dict[str, list[float]] = {}
    for _ in range(HALVINGS):
        drawn = rng.permutation(own)
        first = drawn[:matches]
        others = {"its own other matches": drawn[matches:2 * matches]} | {
            name: rng.permutation(rows)[:matches] for name, rows in rivals.items()}
        for name, rows in others.items():
            distances.setdefault(name, []).append(
                float(np.linalg.norm(first.mean(axis=0) - rows.mean(axis=0)) / np.sqrt(2)))
            if matches >= _TOLD:
                aucs.setdefault(name, []).append(told(first, rows, rng))
    return [Likeness(
        name, matches, float(np.mean(found)), float(np.mean(aucs[name])) if aucs else None,
        (float(np.quantile(found, 0.975)), float(np.quantile(aucs[name], 0.975)) if aucs else None))
        for name, found in distances.items()]


def spectrum(sides: Sequence[F64]) -> dict[int, float]:
    """Shares of situations by code, all roles together: the mean over matches.

    Args:
        sides: descriptions, see :func:`described`.
    """
    shares = np.mean(np.square(sides), axis=0)
    found = dict.fromkeys(sorted(TABLE_1), 0.0)
    for (_, code), share in zip(SHARES, shares, strict=True):
        found[code] += float(share)
    return found
