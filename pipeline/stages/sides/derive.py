"""Sides: for whom each side of a match counts."""

from __future__ import annotations

from collections.abc import Iterable

import polars as pl

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.settings import SideSettings
from pitchlore.schemas import SIDES, Sides

#: In a pool: all teams that no pool names.
_ALL_OTHERS = "*"


#: Flaws of a whole match that is no course of play: nothing is learned from it.
UNUSABLE = frozenset({"implausible", "ball lost"})


def sides(match: pl.DataFrame, settings: SideSettings, flaws: Iterable[str] = ()) -> pl.DataFrame:
    """The sides of a match: two rows of schema Sides from its row of schema Matches.

    Args:
        match: its row.
        settings: sides that count.
        flaws: kinds of the flaws that were found as it was read; of those of ``UNUSABLE`` no side counts.

    Raises:
        BadSettings: if a pool has the name of a team that is not in it.
    """
    played = match.row(0, named=True)
    rows = []
    for side, other in zip(SIDES, SIDES[::-1], strict=True):
        of = _pool(played[side], settings)
        wanted = settings.teams is None or played[side] in settings.teams or of in settings.teams
        right = (settings.kind is None or played["kind"] == settings.kind) and UNUSABLE.isdisjoint(flaws)
        rows.append({
            "match_id": played["match_id"], "side": side, "team": played[side], "kind": played["kind"],
            "counts_as": of if wanted and right and side in settings.watch else None,
            "goals": played[f"score_{side}"], "against": played[f"score_{other}"],
        })
    return Sides.of(rows)


def _pool(name: str, settings: SideSettings) -> str:
    """The pool that a team is in; the team itself without one."""
    for wanted in (name, _ALL_OTHERS):
        for pool, names in settings.pools.items():
            if wanted in names:
                return pool
    if name in settings.pools:
        raise BadSettings(f"the pool {name!r} has the name of a team that is not in it", where="sides.pools",
                          next_step="Give the pool another name, or the team's name to the pool")
    return name
