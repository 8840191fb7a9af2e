"""The noun models: the matches that V is fitted to."""

from __future__ import annotations

from hashlib import sha256

from pitchlore.pipeline.engine.inputs import Held
from pitchlore.pipeline.engine.outputs import need
from pitchlore.pipeline.engine.stage import Output, Scope
from pitchlore.pipeline.settings import ModelSettings
from pitchlore.pipeline.stages.sides.derive import UNUSABLE
from pitchlore.pipeline.store import Store


def matches_to_fit(store: Store, output: Output, scope: Scope, settings: ModelSettings) -> tuple[str, ...]:
    """The matches that the models of a group are fitted to, sorted; each league has models of its own.

    Matches that are no course of play (``stages.sides.UNUSABLE``) are left out.

    The matches of a league stand until there are twice as many, so that all fits together cost a few times
    as much as the last one, however many matches come one by one. ``matches_at_most`` matches stand as long
    as these are there. Of more matches, those with the least hash of their ids are taken, a fair sample.

    Raises:
        NotFound: if one of the matches is not there.
    """
    leagues: dict[str, list[str]] = {}
    for match in scope.matches:
        held = need(store, "matches", match)
        if UNUSABLE.isdisjoint(held.details.get("flaws", ())):
            leagues.setdefault(league_kind(held), []).append(match)
    standing = store.readable("models", output.name)
    before = standing.details.get("matches", {}) if standing is not None else {}
    chosen = (_chosen(matches, set(before.get(kind, ())), settings) for kind, matches in leagues.items())
    return tuple(sorted(match for matches in chosen for match in matches))


def league_kind(match: Held) -> str:
    """The league of a match."""
    return str(match.details["pitch"]["kind"])


def _chosen(matches: list[str], before: set[str], settings: ModelSettings) -> list[str]:
    """The matches of one league; its standing models were fitted to those of ``before``."""
    enough = len(before) == settings.matches_at_most or len(matches) < 2 * len(before)
    if before <= set(matches) and enough and 0 < len(before) <= settings.matches_at_most:
        return sorted(before)
    drawn = sorted(matches, key=lambda match: sha256(match.encode()).digest())
    return drawn[:settings.matches_at_most]
