"""The noun models: the matches that V is fitted to."""

from __future__ import annotations

from hashlib import sha256

from flows.stage import Output, Scope
from pipeline.errors import CorruptFile
from pipeline.settings import ModelSettings
from pipeline.store import Store


def choose(store: Store, output: Output, scope: Scope, settings: ModelSettings) -> tuple[str, ...]:
    """The matches that the models of a group are fitted to, sorted.

    Models stand until there are twice as many matches as they were fitted to, so that all fits together
    cost a few times as much as the last one, however many matches come one by one. Models of
    ``matches_at_most`` matches stand as long as these are there. Of more matches, those with the least hash
    of their ids are taken, a fair sample.
    """
    try:
        standing = store.receipt("models", output.name)
    except CorruptFile:
        standing = None
    before = {label.split("/")[1] for label in standing.inputs} if standing is not None else set()
    enough = len(before) == settings.matches_at_most or len(scope.matches) < 2 * len(before)
    if before <= set(scope.matches) and enough and 0 < len(before) <= settings.matches_at_most:
        return tuple(sorted(before))
    drawn = sorted(scope.matches, key=lambda match: sha256(match.encode()).digest())
    return tuple(sorted(drawn[:settings.matches_at_most]))
