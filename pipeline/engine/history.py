"""The log of a data folder's runs: the last ones, a small file each, so that no server is asked.

A run that is killed writes nothing. Nothing that a stage makes depends on the log.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic
from typing import NamedTuple

from pitchlore.pipeline.base.errors import CorruptFile, PitchloreError, in_one_line
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine.costs import Cost
from pitchlore.pipeline.engine.progress import Leg, RunReport, StageReport
from pitchlore.pipeline.settings import HistorySettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.paths import listed
from pitchlore.pipeline.store.sealed import read_model, sealed

#: The folder of the log in a data folder, and its name in reports.
LOG = "runs"
_END = ".json"
#: Format of an entry's name, by the moment of its start.
_NAME = "%Y%m%d-%H%M%S-%f"
#: Most failures of a run that are reported one by one.
_REPORTED = 20


class StageEntry(Frozen):
    """Work of a run in a stage.

    Attributes:
        noun: the stage.
        made: number of outputs that were made anew.
        kept: number of outputs whose bytes are what they were.
        failed: number of outputs that could not be made.
        cost: cost of its pieces.
    """

    noun: str
    made: int = 0
    kept: int = 0
    failed: int = 0
    cost: Cost = Cost()


class RunEntry(Frozen):
    """A run that has ended.

    Attributes:
        name: unique in the data folder; begins with the moment of the start, UTC.
        what: run, import, train, or the noun of a single stage.
        began: moment of the start, UTC.
        seconds: length, by the clock.
        stages: work done, stage by stage; versions are stages of one output.
        knowledge: the newest version of the knowledge afterwards, None if there is none.
        policy: the newest version of the policies, as the run knows it; None if there is none.
        failures: reasons by output, the first 20.
        error: reason why the run ended before its time, in one line; None if it came to its end.
        legs: where the clock went, in order.
    """

    name: str
    what: str
    began: datetime
    seconds: float
    stages: tuple[StageEntry, ...] = ()
    knowledge: int | None = None
    policy: int | None = None
    failures: Mapping[str, str] = {}
    error: str | None = None
    legs: tuple[Leg, ...] = ()

    @property
    def made(self) -> int:
        """Number of outputs and versions that were made anew."""
        return sum(stage.made for stage in self.stages)

    @property
    def kept(self) -> int:
        """Number of outputs and versions that stayed as they were."""
        return sum(stage.kept for stage in self.stages)

    @property
    def failed(self) -> int:
        """Number of outputs that could not be made."""
        return sum(stage.failed for stage in self.stages)

    @property
    def cost(self) -> Cost:
        """Cost of all stages together."""
        total = Cost()
        for stage in self.stages:
            total.include(stage.cost)
        return total


class Log(NamedTuple):
    """The runs of a data folder that are remembered.

    Attributes:
        entries: in the order of their start.
        damaged: errors of damaged entries, by name.
    """

    entries: list[RunEntry]
    damaged: dict[str, CorruptFile]


class Note:
    """A run that is under way, for the log.

    Attributes:
        what: run, import, train, or the noun of a single stage.
        report: its work until now.
    """

    def __init__(self, what: str) -> None:
        self.what = what
        self.report = RunReport()
        self._began, self._begun = datetime.now(UTC), monotonic()

    def entry(self, error: str | None = None) -> RunEntry:
        """The run as it ends now."""
        report = self.report
        stages = [StageEntry(noun=stage.noun, made=len(stage.made), kept=stage.unchanged,
                             failed=len(stage.failed), cost=stage.cost) for stage in report.stages]
        new = {"knowledge": report.knowledge_is_new, "policies": report.policy_is_new}
        stages += [StageEntry(noun=noun, made=int(new[noun]), kept=int(not new[noun]), cost=cost)
                   for noun, cost in report.versions.items()]
        return RunEntry(
            name=f"{self._began:{_NAME}}", what=self.what, began=self._began,
            seconds=round(monotonic() - self._begun, 6), stages=tuple(stages), knowledge=report.knowledge,
            policy=report.policy, failures=dict(list(report.failures.items())[:_REPORTED]), error=error,
            legs=tuple(report.legs),
        )

    def write(self, store: Store, settings: HistorySettings, error: str | None = None) -> None:
        """Add the run to the log as it ends now, and drop the oldest of more than are kept.

        Raises:
            StorageFailed: if the folder or its bucket cannot be written.
        """
        if settings.runs:
            entry = self.entry(error)
            store.keep(store.root / LOG / f"{entry.name}{_END}", sealed(entry))
        there = _paths(store)
        for path in there[:max(0, len(there) - settings.runs)]:
            store.drop(Path(path))


@contextmanager
def noted(store: Store, what: str, settings: HistorySettings) -> Iterator[Note]:
    """A run that is added to the log when the body ends, even by an error.

    If the log cannot be written, that is one more failure of the run's report.
    """
    note = Note(what)
    try:
        yield note
    except Exception as error:
        with suppress(PitchloreError):  # the error that ended the run says more
            note.write(store, settings, in_one_line(error))
        raise
    try:
        note.write(store, settings)
    except PitchloreError as error:
        note.report.stages.append(StageReport(noun=LOG, failed={"log": str(error)}))


def log(store: Store) -> Log:
    """The runs of a data folder that are remembered."""
    found = Log([], {})
    for path in _paths(store):
        try:
            entry = read_model(path, RunEntry)
        except CorruptFile as error:
            found.damaged[Path(path).name.removesuffix(_END)] = error
        else:
            if entry is not None:  # else it was dropped meanwhile
                found.entries.append(entry)
    return found


def _paths(store: Store) -> list[str]:
    """The paths of the entries, the oldest first; before them those of a clock that was ahead."""
    now = f"{store.root / LOG}/{datetime.now(UTC):{_NAME}}{_END}"
    return sorted(listed(store.root / LOG, _END), key=lambda path: (path <= now, path))
