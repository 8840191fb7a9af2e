"""Behaviours that went most with a team's chances, and with its adversaries': by their effect in a match."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pitchlore.pipeline.engine.knowledge import learned_from, lineage
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.scout.content.sources import Known, LeagueMatch
from pitchlore.schemas.behaviours import AGAINST_BALL, AT_BALL, SHOWN_FROM

#: Behaviours that the report names of each kind.
BEHAVIOURS = 5
_KEEPER = "goalkeeper"


def matches_learned(store: Store, known: Known | None, league: Sequence[LeagueMatch]) -> list[LeagueMatch]:
    """The matches of a league that the newest knowledge was learned from; none without knowledge."""
    versions = () if known is None else lineage(store, known.manifest)
    learned = {match for version in versions for match in learned_from(version)}
    return [match for match in league if match.name in learned]


def dangerous(cards: Sequence[dict[str, Any]], sides: int, *, worse: bool = False) -> list[dict[str, Any]]:
    """The behaviours with or against the ball that went most with a team's chances: value times how often.

    Args:
        cards: behaviours of the gallery, with codes, support, low, high and effect.
        sides: the team's sides in matches that the knowledge was learned from.
        worse: instead those that went with the adversaries' chances.

    Returns:
        At most BEHAVIOURS, the greatest first, each with ``per_match``: those that were seen often enough,
        and whose interval excludes 0.
    """
    sign = -1 if worse else 1
    own = [card for card in cards
           if card["support"] >= SHOWN_FROM and {*card["codes"]} & {*AT_BALL, *AGAINST_BALL}
           and card["low"] is not None and sign * card["high" if worse else "low"] > 0]
    first = sorted(own, key=lambda card: (-sign * card["effect"], card["id"]))[:BEHAVIOURS]
    return [card | {"per_match": card["effect"] / sides if sides else None} for card in first]


def of_keeper(behaviours: Sequence[dict[str, Any]]) -> str:
    """A note where most of the first behaviours are the goalkeeper's; empty where few are."""
    own = sum(card["role"] == _KEEPER for card in behaviours)
    if 2 * own <= len(behaviours):
        return ""
    return (f"{own} of these {len(behaviours)} are the goalkeeper's. V is the team's chance less the "
            "adversary's: a behaviour that ends a chance of the adversary is worth as much as one that makes "
            "one of its own. So they say where the team defends well, not how it attacks.")
