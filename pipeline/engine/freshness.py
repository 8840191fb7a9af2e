"""Remember what a run has found done: a match whose receipts are as they were is not looked at again.

A run that has found nothing to do remembers that, too: while no file changes, the next one asks no output.

To know that an output is done takes its receipt, those of its inputs, and a key over them: a millisecond a
match. The cache takes the stamps of the receipts, 0.1 ms a match. Without it, all is looked at.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pitchlore.pipeline.base.digests import canonical, digest
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.engine.stage import Output, Per, Scope, Stage
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.sealed import Stamp, read_cache, sealed


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


class Idle(Frozen):
    """A run that found nothing to do.

    Attributes:
        basis: digest of all that this depends on.
        kept: number of outputs of each stage.
        notes: lacks and mixtures of the knowledge, a line each.
        knowledge, policy: the newest versions, None if there is none.
    """

    basis: str
    kept: Mapping[str, int]
    notes: tuple[str, ...]
    knowledge: int | None
    policy: int | None


class Standing:
    """A data folder that is as its catalogue has it (:func:`pipeline.engine.catalog.look_at_files`).

    The catalogue lists every receipt and file. So what a run found with the same catalogue, stages and
    settings is so again. Nothing is remembered of a bucket, for another machine may write to it.
    """

    def __init__(self, store: Store, basis: str) -> None:
        self._store, self._basis = store, basis

    @classmethod
    def of(cls, store: Store, catalogue: Stamp | None, settings: Settings, *, train: bool) -> Standing | None:
        """The standing of a folder for a run; None in a bucket, or without such a catalogue.

        Args:
            store: the data folder.
            catalogue: its stamp.
            settings: settings of all stages.
            train: whether the run makes a policy.
        """
        if store.mirror is not None or catalogue is None:
            return None
        nouns = [noun for noun in (*STAGES.of_matches, *STAGES.versioned) if noun != "matches"]
        ways = [_way_of(STAGES[noun], settings) for noun in nouns]
        return cls(store, digest(canonical([catalogue, train, ways])))

    def tell(self, report: RunReport) -> bool:
        """Report what the run before found, if it found nothing to do. Returns whether it did."""
        idle = read_cache(_idle_path(self._store), Idle)
        if idle is None or idle.basis != self._basis:
            return False
        for noun, kept in idle.kept.items():
            report.stage(noun).kept += kept
        report.notes += idle.notes
        report.knowledge, report.policy = idle.knowledge, idle.policy
        return True

    def keep(self, report: RunReport) -> None:
        """Remember a report of a run that made nothing."""
        kept = {stage.noun: stage.kept for stage in report.stages if stage.noun != "matches"}
        self._store.keep(_idle_path(self._store), sealed(Idle(
            basis=self._basis, kept=kept, notes=tuple(report.notes), knowledge=report.knowledge,
            policy=report.policy)))


def forget_freshness(store: Store) -> None:
    """Forget what is done: the next run looks at everything."""
    store.drop(_path(store))
    store.drop(_idle_path(store))


def _path(store: Store) -> Path:
    return store.root / ".done.json"


def _idle_path(store: Store) -> Path:
    return store.root / ".idle.json"


def _way_of(stage: Stage, settings: Settings) -> list[object]:
    """The stage, its settings, version and tags of tables: all that its outputs depend on but inputs."""
    return [stage.noun, stage.settings(settings).model_dump(mode="json"), stage.version,
            [schema.tag() for schema in stage.schemas]]


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
    parts: list[object] = [_way_of(stage, settings) for stage in stage_group]
    for noun in sorted(_inputs(stage_group, Per.GROUP)):
        receipt = store.readable(noun, scope.name)
        if receipt is None:
            return None
        parts.append(receipt.digests())
    return f"{stage_group[0].noun} {digest(canonical(parts))}"


def _leg_of(basis: str) -> str:
    return basis.partition(" ")[0]
