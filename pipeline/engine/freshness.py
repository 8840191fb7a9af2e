"""Remember what a run has found done: a match whose receipts are as they were is not looked at again.

To know that an output is done takes its receipt, those of its inputs, and a key over them: a millisecond a
match. The cache takes the stamps of the receipts, 0.1 ms a match. Without it, all is looked at.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pitchlore.pipeline.base.digests import canonical, digest
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine.stage import Output, Per, Scope, Stage
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.sealed import read_cache, sealed


class Done(Frozen):
    """The stamps of the receipts of a match when its outputs were done.

    Attributes:
        stamps: by what the outputs of all matches depend on (:func:`_basis`), by match.
    """

    stamps: Mapping[str, Mapping[str, str]]


class FreshnessCache:
    """The matches for which all outputs of a stage group are known to be done.

    Damaged files are not noticed here, but by :func:`pipeline.engine.catalog.check_files`: while the store
    doubts any, nothing is known to be done. Nothing is in a bucket either, for another machine may write to
    it.

    Args:
        store: holds the outputs.
        stage_group: stages of matches that follow each other.
        settings: settings of all stages.
        scope: scope of the run.
    """

    def __init__(self, store: Store, stage_group: Sequence[Stage], settings: Settings, scope: Scope) -> None:
        self._store = store
        self._basis = None if store.suspect or store.mirror else _basis(store, stage_group, settings, scope)
        self._held = (read_cache(_path(store), Done) if self._basis else None) or Done(stamps={})
        self._known = self._held.stamps.get(self._basis or "", {})
        self._now = _stamps(store, stage_group) if self._basis else {}
        self._found = dict[str, str]()

    def holds(self, output: Output) -> bool:
        """True if the outputs of a match were done, and have not been touched since."""
        return output.name in self._now and self._known.get(output.name) == self._now[output.name]

    def note(self, output: Output) -> None:
        """Note that the outputs of a match are done, as this was found after the cache was made."""
        if output.name in self._now:
            self._found[output.name] = self._now[output.name]

    def keep(self) -> None:
        """Write what was noted, in place of what was known of this stage group."""
        if self._basis is None or self._found == self._known:
            return
        others = {basis: found for basis, found in self._held.stamps.items()
                  if _leg_of(basis) != _leg_of(self._basis)}
        self._store.keep(_path(self._store), sealed(Done(stamps={**others, self._basis: self._found})))


def forget_freshness(store: Store) -> None:
    """Forget what is done: the next run looks at everything."""
    store.drop(_path(store))


def _path(store: Store) -> Path:
    return store.root / ".done.json"


def _stamps(store: Store, stage_group: Sequence[Stage]) -> dict[str, str]:
    """The stamps of all receipts of each match, those of a stage group and of what it is made from."""
    nouns = sorted({*(stage.noun for stage in stage_group), *_inputs(stage_group, Per.MATCH)})
    by_noun = [store.stamps(noun) for noun in nouns]
    complete = set.intersection(*(set(found) for found in by_noun))
    return {name: digest(repr([found[name] for found in by_noun]).encode())[:16] for name in complete}


def _inputs(stage_group: Sequence[Stage], per: Per) -> set[str]:
    """The nouns of a unit that a stage group is made from."""
    return {noun for stage in stage_group for noun in stage.inputs if STAGES[noun].per is per}


def _basis(store: Store, stage_group: Sequence[Stage], settings: Settings, scope: Scope) -> str | None:
    """All that the outputs of a stage group depend on besides their match's receipts, as ``noun SHA-256``.

    None if the stage group is not of matches, or if something that it is made from is missing.
    """
    if stage_group[0].per is not Per.MATCH:
        return None
    parts: list[object] = [
        [stage.noun, stage.settings(settings).model_dump(mode="json"), stage.version,
         [schema.tag() for schema in stage.schemas]] for stage in stage_group]
    for noun in sorted(_inputs(stage_group, Per.GROUP)):
        receipt = store.readable(noun, scope.name)
        if receipt is None:
            return None
        parts.append(receipt.digests())
    return f"{stage_group[0].noun} {digest(canonical(parts))}"


def _leg_of(basis: str) -> str:
    return basis.partition(" ")[0]
