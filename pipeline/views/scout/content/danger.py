"""The most dangerous behaviours of a team: what each is worth in all, at least."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pitchlore.pipeline.engine.knowledge import learned_from, lineage
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.scout.content.sources import Known, LeagueMatch

#: Behaviours that the report names.
BEHAVIOURS = 5
_KEEPER = "goalkeeper"


def matches_learned(store: Store, known: Known | None, league: Sequence[LeagueMatch]) -> list[LeagueMatch]:
    """The matches of a league that the newest knowledge was learned from; none without knowledge."""
    versions = () if known is None else lineage(store, known.manifest)
    learned = {match for version in versions for match in learned_from(version)}
    return [match for match in league if match.name in learned]


def dangerous(cards: Sequence[dict[str, Any]], sides: int) -> list[dict[str, Any]]:
    """The most dangerous of a team's behaviours: the lower end of the value times the support, each match.

    Args:
        cards: behaviours of the gallery; their danger is the lower end times the support, None without an
            interval.
        sides: the team's sides in matches that the knowledge was learned from.

    Returns:
        At most BEHAVIOURS, the greatest first, only those above 0, each with ``per_match``.
    """
    above = [card for card in cards if card["danger"] is not None and card["danger"] > 0]
    first = sorted(above, key=lambda card: (-card["danger"], card["id"]))[:BEHAVIOURS]
    return [card | {"per_match": card["danger"] / sides if sides else None} for card in first]


def of_keeper(behaviours: Sequence[dict[str, Any]]) -> str:
    """A note where most of the most dangerous behaviours are the goalkeeper's; empty where few are."""
    own = sum(card["role"] == _KEEPER for card in behaviours)
    if 2 * own <= len(behaviours):
        return ""
    return (f"{own} of these {len(behaviours)} are the goalkeeper's. V is the team's chance less the "
            "adversary's: a behaviour that ends a chance of the adversary is worth as much as one that makes "
            "one of its own. So they say where the team defends well, not how it attacks.")
