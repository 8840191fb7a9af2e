"""Work that a run would do: outputs by stage and reason, and their cost by the log. Nothing is changed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from textwrap import shorten
from typing import Any, Literal, NamedTuple

from pitchlore.pipeline.base.errors import CorruptFile, NotFound, PitchloreError
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine.arrivals import Arrivals
from pitchlore.pipeline.engine.catalog import check_files
from pitchlore.pipeline.engine.costs import Cost
from pitchlore.pipeline.engine.freshness import FreshnessCache
from pitchlore.pipeline.engine.history import log
from pitchlore.pipeline.engine.lacking import lacking
from pitchlore.pipeline.engine.matches import standing
from pitchlore.pipeline.engine.outputs import digests, match_names
from pitchlore.pipeline.engine.recordings import INBOX, WATCHING, Recording, strangers, waiting
from pitchlore.pipeline.engine.stage import Output, Per, Scope, Stage
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import standing_version
from pitchlore.pipeline.importers.readers import open_parts
from pitchlore.pipeline.importers.source import slug
from pitchlore.pipeline.settings import ImportSettings, ModelSettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.work import Work
from pitchlore.schemas import Table

#: Reason why an output would be made: it was never made; its key is another; its receipt or a file is damaged
#: or missing; something that it is made from would be made again; a stage has refused it before.
Why = Literal["new", "changed", "damaged", "after", "refused"]
#: Most settings that are named where the key of an output is another.
_SAID = 4
#: Most characters of a value.
_WIDE = 60


class Todo(Frozen):
    """An output that a run would make.

    Attributes:
        name: the output; of a recording that is no match yet, its path.
        why: kind of reason.
        detail: the reason, for people.
        sure: whether it would be made in any case; not if the outputs that are made before it may turn out
            as they are now, byte for byte.
    """

    name: str
    why: Why
    detail: str
    sure: bool = True


class StagePlan(Frozen):
    """The work of a run in a stage.

    Attributes:
        noun: the stage.
        per: unit of an output: match, group of matches, or version.
        inputs: nouns that it is made from.
        fresh: number of outputs that stay.
        todo: outputs to make.
        each_s: cost of an output by the log, in seconds; null if no run of the log made one. For a match the
            mean, else that of the last run which made one.
    """

    noun: str
    per: str
    inputs: tuple[str, ...]
    fresh: int
    todo: tuple[Todo, ...]
    each_s: float | None

    def work_s(self, *, sure: bool) -> float:
        """Cost of the outputs that are made in any case, or else of the others, in seconds."""
        return (self.each_s or 0.0) * self.count(sure=sure)

    def count(self, *, sure: bool) -> int:
        """Number of outputs that are made in any case, or else of the others; none that was refused."""
        return sum(one.sure is sure and one.why != "refused" for one in self.todo)

    def reasons(self, named: int) -> Iterator[tuple[str, bool, str]]:
        """Each reason, whether it holds in any case, and its outputs: so many named, the others counted."""
        names: dict[tuple[str, bool], list[str]] = {}
        for one in self.todo:
            names.setdefault((one.detail, one.sure), []).append(one.name)
        for (detail, sure), of in names.items():
            more = f" and {len(of) - named} more" if len(of) > named else ""
            yield detail, sure, f"{', '.join(of[:named])}{more}"


class RunPlan(Frozen):
    """The work that a run would do.

    Attributes:
        stages: in order.
        notes: remarks of the run, as why there would be no knowledge, a line each.
        runs: number of runs in the log, by which the cost is estimated.
    """

    stages: tuple[StagePlan, ...]
    notes: tuple[str, ...]
    runs: int

    @property
    def work_s(self) -> tuple[float, float]:
        """Cost of what is made in any case, and of what else may be made, in seconds, piece by piece."""
        sure, perhaps = (sum(stage.work_s(sure=each) for stage in self.stages) for each in (True, False))
        return sure, perhaps

    @property
    def counts(self) -> tuple[int, int]:
        """Number of outputs that are made in any case, and of those that else may be."""
        sure, perhaps = (sum(stage.count(sure=each) for stage in self.stages) for each in (True, False))
        return sure, perhaps

    @property
    def unpriced(self) -> list[str]:
        """The nouns with work whose cost is not known."""
        return [stage.noun for stage in self.stages if stage.todo and stage.each_s is None]


def run_plan(
    store: Store, settings: Settings, limits: ImportSettings = ImportSettings(), *, train: bool = True
) -> RunPlan:
    """The work that :func:`pipeline.engine.run.run` would do now with these settings.

    Recordings of the inbox that are not known by their stamps are opened and hashed. A match that a stage has
    refused is taken to be refused again. Of outputs that are made from others which would be made again, it
    is not known whether they are made: only if those come out with other bytes.

    Args:
        store: the data folder; only read. The copy of a bucket gets the files of its inbox.
        settings: settings of the stages.
        limits: bounds of the cost of reading a recording.
        train: whether a policy would be made.

    Raises:
        StorageFailed: if the bucket cannot be reached.
    """
    if store.mirror is not None:
        store.mirror.pull(store.root / INBOX)
    planner = _Planner(store, settings)
    planner.recordings(limits)
    for stage_group in STAGES.stage_groups():
        if stage_group[0].per is Per.MATCH:
            planner.of_matches(stage_group)
        else:
            planner.of_group(stage_group[0])
    planner.versions(train=train)
    return RunPlan(stages=tuple(planner.stages), notes=tuple(planner.notes), runs=len(log(store).entries))


class _Planner:
    """A plan as it grows, stage by stage.

    Attributes:
        stages: done so far.
        todo: outputs to make so far, by noun and name.
        coming: recordings that would become matches.
        notes: as of :class:`RunPlan`.
    """

    def __init__(self, store: Store, settings: Settings) -> None:
        self.store, self.settings, self.costs = store, settings, _costs(store)
        self.unread = store.unreadable_receipts("matches")
        self.scope = Scope(matches=tuple(match_names(store))).but(self.unread)
        self.damaged = _damaged(store) if self.scope.matches else {}
        self.refused = {(each.noun, each.name): each.reason for each in store.quarantined()}
        self.stages: list[StagePlan] = []
        self.todo: dict[str, dict[str, Todo]] = {}
        self.coming: list[str] = []
        self.notes: list[str] = []

    def add(self, stage: Stage, fresh: int, todo: Sequence[Todo]) -> None:
        """Add the plan of a stage."""
        self.todo[stage.noun] = {one.name: one for one in todo}
        self.stages.append(StagePlan(
            noun=stage.noun, per=stage.per.value, inputs=stage.inputs, fresh=fresh, todo=tuple(todo),
            each_s=self.costs.get(stage.noun)))

    def recordings(self, limits: ImportSettings) -> None:
        """The matches: recordings to import, and damaged ones."""
        todo = [Todo(name=name, why="damaged", detail=f"{why}; mended from its log, if that is whole")
                for (noun, name), why in self.damaged.items() if noun == "matches"]
        todo += [Todo(name=name, why="damaged", detail=str(error)) for name, error in self.unread.items()]
        arrivals = Arrivals(self.store)
        for recording in [*waiting(self.store), *map(_abandoned, self.store.abandoned(WATCHING))]:
            content = arrivals.content(recording.files())
            if content is None or standing(self.store, recording, content) is None:
                todo += self.arriving(recording, limits)
        todo += [Todo(name=name, why="refused", detail=why) for name, why in strangers(self.store).items()]
        held = {one.name for one in todo if one.why in ("damaged", "changed")}
        self.coming = [one.name for one in todo if one.why == "new"]
        self.add(STAGES["matches"], len({*self.scope.matches} - held), todo)

    def arriving(self, recording: Recording, limits: ImportSettings) -> Iterator[Todo]:
        """The match of a recording that is not known by its stamps, if it would be imported."""
        name = slug(recording.file.name)
        try:
            with self.store.opened(recording.at(self.store.here).file, megabytes=limits.megabytes) as file:
                source = open_parts([(recording.file.name, file)], recording.provider, limits)
            name, sha256 = source.match_id, source.sha256
        except PitchloreError as error:
            yield Todo(name=recording.label(self.store), why="refused", detail=str(error))
            return
        if standing(self.store, recording, sha256) is not None:
            return
        reason = self.refused.get(("matches", name))
        if reason is not None:
            yield Todo(name=recording.label(self.store), why="refused", detail=_as_before(reason))
        elif source.format is None and source.provider is None:
            yield Todo(name=recording.label(self.store), why="refused",
                       detail="is empty, or not a recording of a known format")
        elif (there := self.store.readable("matches", name)) is None:
            yield Todo(name=recording.label(self.store), why="new", detail="a recording that is no match yet")
        elif ("matches", name) not in self.damaged:
            stage = STAGES["matches"]
            detail = _versions(there, {stage.noun: stage.version}) or ["its map is another"]
            yield Todo(name=name, why="changed", detail=", ".join(detail))

    def of_matches(self, stage_group: Sequence[Stage]) -> None:
        """The outputs of each match, by stages that follow each other."""
        cache = FreshnessCache(self.store, stage_group, self.settings, self.scope)
        held = {match for match in self.scope.matches if cache.holds(Output(match, match))}
        dropped = set[str]()
        for stage in stage_group:
            todo = []
            for output in stage.outputs(self.scope, [m for m in self.scope.matches if m not in dropped]):
                again = [noun for noun in stage.inputs if output.name in self.todo[noun] or self._group(noun)]
                if output.name in held and not again:
                    continue
                one = self.reason(stage, output, again)
                if one is not None:
                    todo.append(one)
                    if one.why == "refused":
                        dropped.add(output.name)
            fresh = len(self.scope.matches) - len(dropped | {one.name for one in todo})
            self.add(stage, fresh, [*todo, *(
                Todo(name=name, why="new", detail="a new match") for name in self.coming)])
        self.scope = self.scope.model_copy(
            update={"matches": tuple(m for m in self.scope.matches if m not in dropped)})

    def _group(self, noun: str) -> bool:
        """True if a noun has one output for all matches, and that would be made."""
        return STAGES[noun].per is Per.GROUP and self._some(noun)

    def _some(self, noun: str) -> bool:
        """True if outputs of a noun would be made, which no stage has refused."""
        return any(one.why != "refused" for one in self.todo[noun].values())

    def of_group(self, stage: Stage) -> None:
        """The output of all matches."""
        (output,) = stage.outputs(self.scope)
        if not self.scope.matches and not self.coming:
            self.add(stage, 0, ())
            return
        again = [noun for noun in stage.inputs if self._some(noun) and not self._only_new(noun)]
        one = self.reason(stage, output, again) if self.scope.matches else Todo(
            name=output.name, why="new", detail="not made yet")
        if self.coming and (one is None or not one.sure) and self._takes_more(stage, output):
            one = Todo(name=output.name, why="after", detail=f"new matches: {len(self.coming)}")
        self.add(stage, int(one is None), [one] if one is not None else [])

    def _only_new(self, noun: str) -> bool:
        """True if all outputs to make of a noun are of new matches, or were refused."""
        return all(one.why == "refused" or name in self.coming for name, one in self.todo[noun].items())

    def _takes_more(self, stage: Stage, output: Output) -> bool:
        """True if new matches would be among those that the output of a group is made from."""
        if stage.choose is None:
            return True
        own = stage.settings(self.settings)
        assert isinstance(own, ModelSettings)
        receipt = self.store.readable(stage.noun, output.name)
        before = {} if receipt is None else receipt.details.get("matches", {})
        there = len(self.scope.matches) + len(self.coming)
        return not before or any(
            len(fitted) < own.matches_at_most and there >= 2 * len(fitted) for fitted in before.values())

    def versions(self, *, train: bool) -> None:
        """The versions that would be emitted, unless there is nothing to know."""
        nothing = lacking(self.store, self.scope) if self.scope.matches else []
        changing = any(map(self._some, STAGES["knowledge"].inputs))
        self.notes += [] if changing else nothing
        for noun in STAGES.versioned:
            stage = STAGES[noun]
            again = [each for each in stage.inputs if self._some(each)]
            newest = self.store.newest_whole(noun)
            wanted = noun == "knowledge" or train
            if not wanted or (not again and (nothing or not self.scope.matches)):
                self.add(stage, int(newest is not None), ())
                continue
            one = self.version(stage, again, newest)
            self.add(stage, int(one is None), [one] if one is not None else [])

    def version(self, stage: Stage, again: Sequence[str], newest: Receipt | None) -> Todo | None:
        """The next version of a noun, if it would be made."""
        name = f"version {self.store.versions(stage.noun)[-1] + 1 if newest is not None else 1}"
        if again:
            return Todo(name=name, why="new" if newest is None else "after", detail=_after(again), sure=False)
        if standing_version(self.store, stage, self.settings, self.scope) is not None:
            return None
        if newest is None:
            return Todo(name=name, why="new", detail="not made yet")
        assert stage.plan is not None
        own = stage.settings(self.settings)
        plan = stage.plan(self.store, self.scope, own, stage)
        work = stage.work(stage.noun, own, plan.inputs, seed=plan.seed)
        # its tables may be those of the newest version, which then stands
        return Todo(name=name, why="changed", detail=_differences(newest, work), sure=False)

    def reason(self, stage: Stage, output: Output, again: Sequence[str]) -> Todo | None:
        """The reason why an output would be made, None if it would not.

        Args:
            stage: its stage.
            output: the output.
            again: nouns of its inputs that would be made again before.
        """
        name, own = output.name, stage.settings(self.settings)
        if (stage.noun, name) in self.damaged:
            return Todo(name=name, why="damaged", detail=self.damaged[stage.noun, name])
        try:
            receipt = self.store.receipt(stage.noun, name)
        except CorruptFile as error:
            return Todo(name=name, why="damaged", detail=str(error))
        work = None
        with suppress(NotFound, CorruptFile):  # an input is missing or damaged, so that it is made before
            sources = STAGES.sources(self.store, stage, output, own, self.scope.of(output))
            work = stage.work(name, own, digests(sources))
        if again and (receipt is None or work is None or work.key == receipt.key):
            if receipt is None:
                return Todo(name=name, why="new", detail="not made yet")
            return Todo(name=name, why="after", detail=_after(again), sure=False)
        if work is not None and self.store.holding(work) is not None:
            return None
        if (stage.noun, name) in self.refused:
            return Todo(name=name, why="refused", detail=_as_before(self.refused[stage.noun, name]))
        if receipt is None or work is None:
            return Todo(name=name, why="new", detail="not made yet")
        if work.key != receipt.key:
            return Todo(name=name, why="changed", detail=_differences(receipt, work))
        return Todo(name=name, why="damaged", detail="a file is lost")


def _as_before(reason: str) -> str:
    return f"as before: {reason}"


def _abandoned(file: Path) -> Recording:
    return Recording(file=file)


def _after(nouns: Sequence[str]) -> str:
    return f"after {', '.join(nouns)}"


def _damaged(store: Store) -> dict[tuple[str, str], str]:
    """The outputs with damaged or lost files, each with the first of these."""
    found: dict[tuple[str, str], str] = {}
    for file in check_files(store):
        found.setdefault((file.receipt.noun, file.receipt.name), f"{file.record.path} is lost or damaged")
    return found


def _costs(store: Store) -> dict[str, float]:
    """Seconds of an output of each noun, by the log: the mean of a match's, else the last one's."""
    found: dict[str, Cost] = defaultdict(Cost)
    for entry in log(store).entries:
        for stage in entry.stages:
            if stage.cost.pieces and stage.noun in STAGES:
                if STAGES[stage.noun].per is not Per.MATCH:
                    found.pop(stage.noun, None)
                found[stage.noun].include(stage.cost)
    return {noun: round(cost.seconds / cost.pieces, 6) for noun, cost in found.items()}


class _Change(NamedTuple):
    """Inputs of a noun that are others than before."""

    more: int = 0
    gone: int = 0
    other: int = 0

    def __str__(self) -> str:
        counts = {"more": self.more, "gone": self.gone, "changed": self.other}
        return ", ".join(f"{count} {word}" for word, count in counts.items() if count)


def _differences(receipt: Receipt, work: Work) -> str:
    """The differences between the key of an output and that of the work that would make it."""
    found = _versions(receipt, work.versions)
    found += list(_settings(receipt.settings, work.settings))[:_SAID]
    found += _schemas(receipt, work.schemas)
    if receipt.seed != work.seed:
        found.append(f"seed {receipt.seed} → {work.seed}")
    changes: dict[str, _Change] = {}
    for label in {*receipt.inputs, *work.inputs}:
        before, now = receipt.inputs.get(label), work.inputs.get(label)
        if before != now:
            noun = label.partition("/")[0]
            held = changes.get(noun, _Change())
            changes[noun] = _Change(held.more + (before is None), held.gone + (now is None),
                                    held.other + (before is not None and now is not None))
    found += [f"input {noun} ({change})" for noun, change in sorted(changes.items())]
    return "; ".join(found) or "made under a key of another version of Pitchlore"


def _versions(receipt: Receipt, now: Mapping[str, int]) -> list[str]:
    return [f"stage {noun} version {receipt.versions.get(noun, 'none')} → {version}"
            for noun, version in now.items() if receipt.versions.get(noun) != version]


def _settings(before: Mapping[str, Any], now: Mapping[str, Any], path: str = "") -> Iterator[str]:
    """The settings that differ, each as ``name: before → now``."""
    for key in dict.fromkeys([*before, *now]):
        old, new = before.get(key), now.get(key)
        if isinstance(old, dict) and isinstance(new, dict):
            yield from _settings(old, new, f"{path}{key}.")
        elif old != new:
            yield f"setting {path}{key}: {shorten(str(old), _WIDE)} → {shorten(str(new), _WIDE)}"


def _schemas(receipt: Receipt, schemas: Sequence[type[Table]]) -> list[str]:
    tags = {record.table for record in receipt.files.values() if record.table is not None}
    others = [schema.tag() for schema in schemas if schema.NAME in receipt.files and schema.tag() not in tags]
    return [f"table {tag}" for tag in others]
