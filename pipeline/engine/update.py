"""Bring all stages up to date: the outputs to make, their order, and the matches that drop out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import takewhile

from pitchlore.pipeline.base.errors import CorruptFile, PitchloreError
from pitchlore.pipeline.base.system import give_back
from pitchlore.pipeline.engine.catalog import check_files, look_at_files
from pitchlore.pipeline.engine.costs import Cost, Spent
from pitchlore.pipeline.engine.freshness import FreshnessCache
from pitchlore.pipeline.engine.lacking import lacking, leagues
from pitchlore.pipeline.engine.making import Outcome
from pitchlore.pipeline.engine.matches import mend_match, remake_receipt
from pitchlore.pipeline.engine.outputs import match_names
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.engine.stage import Output, Scope, Stage
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.paths import SAFE_NAME
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.pipeline.store.sealed import Stamp

#: Makes outputs, each by some stages in order; gives each with its outcome, as it ends.
Perform = Callable[[Mapping[Output, Sequence[Stage]], Settings, Scope], Iterator[tuple[Output, Outcome]]]
#: Makes the next version of a noun unless one stands: its number, whether it is new, and what was spent.
Emit = Callable[[Stage, Settings, Scope], tuple[int, bool, Spent]]


def scope_of(store: Store) -> Scope:
    """The scope of a single stage's flow: all matches that no stage has in quarantine."""
    return Scope(matches=tuple(match_names(store))).but({record.name for record in store.quarantined()})


def bring_up_to_date(
    store: Store, settings: Settings, report: RunReport, perform: Perform, emit: Emit, *, train: bool = True
) -> None:
    """Make all new outputs, stage by stage. A match that fails drops out, and the others continue.

    If there is nothing to know, no version is made. Notes say what is missing.

    Args:
        store: the data folder.
        settings: settings of all stages.
        report: report on the import; the reports of the stages are added.
        perform: makes outputs.
        emit: makes versions.
        train: whether to make a policy.
    """
    scope = Scope(matches=tuple(match_names(store))).but(store.unreadable_receipts("matches"))
    for stage_group in STAGES.stage_groups():
        if not scope.matches:
            break
        with report.leg(group_name([stage.noun for stage in stage_group])):
            failed = bring(store, stage_group, settings, scope, report, perform)
            give_back()
        dropped = {output.match for output in failed}
        scope = scope.but(scope.matches if None in dropped else dropped)
    nothing = lacking(store, scope) if scope.matches else []
    said = report.stage("matches").notes
    report.notes += [line for line in nothing if line not in said]
    if scope.matches and not nothing:
        known = _emitted(STAGES["knowledge"], settings, scope, report, emit)
        report.knowledge_is_new = bool(known)
        if train and known is not None:
            report.policy_is_new = bool(_emitted(STAGES["policies"], settings, scope, report, emit))
        report.notes += leagues(store.newest_whole("knowledge"))
    _look_at_versions(store, report)


def group_name(nouns: Iterable[str]) -> str:
    """The name of a stage group: its first stage, and its last."""
    first, *others = nouns
    return f"{first} to {others[-1]}" if others else first


def _emitted(stage: Stage, settings: Settings, scope: Scope, report: RunReport, emit: Emit) -> bool | None:
    """True if a new version was made; None if it cannot be, which the report counts as a failure."""
    with report.leg(stage.noun):
        try:
            version, new, spent = emit(stage, settings, scope)
        except PitchloreError as error:
            if error.for_all:
                raise
            report.stage(stage.noun).failed["version"] = str(error)
            return None
        give_back()
        if spent.seconds:
            report.versions.setdefault(stage.noun, Cost()).add(f"version {version}", spent)
    return new


def standing_version(store: Store, stage: Stage, settings: Settings, scope: Scope) -> Manifest | None:
    """The version that already holds what would be made next, None if there is work."""
    assert stage.plan is not None
    own = stage.settings(settings)
    plan = stage.plan(store, scope, own, stage)
    return plan.standing or store.standing(stage.work(stage.noun, own, plan.inputs, seed=plan.seed))


def look_for_damage(store: Store, report: RunReport) -> Stamp | None:
    """Mend matches from their logs, and report the damage that no stage can mend.

    A match whose receipt is damaged goes into quarantine, unless its log tells all that the receipt did. The
    store suspects damaged outputs from now on, so that they are made again.

    Returns:
        The stamp of the catalogue if it has every file as it is; else None.
    """
    catalogue, damaged = look_at_files(store)
    if catalogue is not None:
        return catalogue
    for record in store.quarantined():
        if record.noun == "matches" and record.error == CorruptFile.__name__ and store.readable(
                "matches", record.name) is not None:  # it was restored
            store.release("matches", record.name)
    unreadable = store.unreadable_receipts("matches")
    for name, error in unreadable.items():
        if remake_receipt(store, name):
            report.stage("matches").made.append(name)
        else:
            if SAFE_NAME.match(name):  # else it is a stray copy, and of no match
                store.quarantine("matches", name, error)
            report.stage("matches").failed[name] = str(error)
    if unreadable:
        damaged = check_files(store)
    for file in damaged:
        if file.receipt.noun == "matches":
            mend_match(store, file.receipt)
    for file in check_files(store) if damaged else ():
        noun, name = file.receipt.noun, file.receipt.name
        if isinstance(file.receipt, Manifest):
            report.stage(noun).failed[f"version {file.receipt.version}"] = str(file.error)
        elif noun == "matches":
            report.stage(noun).failed[name] = str(file.error)
    return None


def bring(
    store: Store, stage_group: Sequence[Stage], settings: Settings, scope: Scope, report: RunReport,
    perform: Perform,
) -> list[Output]:
    """Make the new outputs of a stage group's stages, add to the report, and return those that failed."""
    reports = [report.stage(stage.noun) for stage in stage_group]
    refused = {(record.noun, record.name) for record in store.quarantined()}
    cache = FreshnessCache(store, stage_group, settings, scope)
    todo: dict[Output, Sequence[Stage]] = {}
    for output in stage_group[0].outputs(scope):
        done = stage_group if cache.holds(output) else _done(store, stage_group, output, settings, scope)
        for stage, stage_report in zip(done, reports, strict=False):
            stage_report.kept += 1
            if (stage.noun, output.name) in refused:
                store.release(stage.noun, output.name)
        if len(done) < len(stage_group):
            todo[output] = stage_group[len(done):]
        else:
            cache.note(output)
    cache.keep()
    failed = []
    for output, outcome in perform(todo, settings, scope) if todo else ():
        for noun, new in outcome.made.items():
            report.stage(noun).count(output.name, new)
        for noun, spent in outcome.costs.items():
            report.stage(noun).cost.add(output.name, spent)
        for noun, why in outcome.failed.items():
            report.stage(noun).failed[output.name] = why
            failed.append(output)
    for stage_report in reports:
        stage_report.made.sort()
        stage_report.same.sort()
    return failed


def _done(
    store: Store, stage_group: Sequence[Stage], output: Output, settings: Settings, scope: Scope
) -> Sequence[Stage]:
    """The first stages of a stage group that have made their output of a name."""
    own = scope.of(output)
    return list(takewhile(
        lambda stage: STAGES.done(store, stage, output, stage.settings(settings), own), stage_group))


def _look_at_versions(store: Store, report: RunReport) -> None:
    """Report the newest versions, and those that cannot be read."""
    for noun in STAGES.versioned:
        for version, found in store.tried_versions(noun):
            if isinstance(found, CorruptFile):
                report.stage(noun).failed[f"version {version}"] = str(found)
    known, learned = (store.newest_whole(noun) for noun in STAGES.versioned)
    report.knowledge = known.version if known else None
    report.policy = learned.version if learned else None
