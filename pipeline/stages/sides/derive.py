"""Sides: for whom each side of a match counts."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.settings import SideSettings
from pitchlore.schemas import SIDES, Sides

#: In a pool: all teams that no pool names.
_ALL_OTHERS = "*"


def sides(match: pl.DataFrame, settings: SideSettings) -> pl.DataFrame:
    """The sides of a match: two rows of schema Sides from its row of schema Matches.

    Raises:
        BadSettings: if a pool has the name of a team that is not in it.
    """
    played = match.row(0, named=True)
    rows = []
    for side, other in zip(SIDES, SIDES[::-1], strict=True):
        of = _pool(played[side], settings)
        wanted = settings.teams is None or played[side] in settings.teams or of in settings.teams
        right = settings.kind is None or played["kind"] == settings.kind
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
