"""Progress and reports of stages."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol

from pydantic import BaseModel, Field

from pitchlore.pipeline.base.text import as_markdown
from pitchlore.pipeline.engine.costs import Cost, mebibytes


class Listener(Protocol):
    """Progress of a run, as the command line's bars show it."""

    def begin(self, noun: str, total: int) -> None:
        """A stage starts with this many pieces of work."""

    def advance(self, noun: str, name: str) -> None:
        """A piece of a stage's work has ended."""


class Silence:
    """A listener that does nothing."""

    def begin(self, noun: str, total: int) -> None:
        """Do nothing."""

    def advance(self, noun: str, name: str) -> None:
        """Do nothing."""


#: A leg that took less is not reported, seconds.
_SHOWN_S = 0.01

listener: ContextVar[Listener] = ContextVar("listener", default=Silence())  # noqa: B039 (Silence has no state)


class StageReport(BaseModel):
    """Outcome of a stage.

    Attributes:
        noun: the stage.
        made: names of the outputs that were made anew.
        same: names of the outputs that were made again with the same bytes.
        kept: number of outputs that were already there.
        failed: name of each output that could not be made, with the reason.
        notes: other remarks, a line each.
        cost: sum of its pieces' costs.
    """

    noun: str
    made: list[str] = []
    same: list[str] = []
    kept: int = 0
    failed: dict[str, str] = {}
    notes: list[str] = []
    cost: Cost = Field(default_factory=Cost)

    @property
    def unchanged(self) -> int:
        """Number of outputs whose bytes are what they were."""
        return self.kept + len(self.same)

    def count(self, name: str, new: bool | None) -> None:
        """Count an output: its bytes are new or the same, or it was done before (None)."""
        if new is None:
            self.kept += 1
        else:
            (self.made if new else self.same).append(name)

    def add(self, other: StageReport) -> None:
        """Add another report on the same stage."""
        self.made += other.made
        self.same += other.same
        self.kept += other.kept
        self.failed |= other.failed
        self.notes += other.notes
        self.cost.include(other.cost)

    def markdown(self) -> str:
        """The report as Markdown."""
        lines = [f"{len(self.made)} made, {self.unchanged} kept, {len(self.failed)} in quarantine", ""]
        if self.cost.pieces:
            lines += [*_table({self.noun: self.cost}), ""]
        lines += [f"- {as_markdown(name)}" for name in self.made]
        lines += [f"- **{as_markdown(name)}**: {as_markdown(why)}" for name, why in self.failed.items()]
        return "\n".join([*lines, *(f"- {as_markdown(note)}" for note in self.notes)])


class Leg(BaseModel):
    """A stretch of a run by the clock: stages that are made together, or work of the run itself.

    Attributes:
        name: its stages, or what the run does itself.
        seconds: length, by the clock.
        work_s: seconds of the pieces that were done in it; 0 of work that has no pieces.
    """

    name: str
    seconds: float
    work_s: float


class RunReport(BaseModel):
    """Outcome of a run.

    Attributes:
        stages: in order.
        knowledge: the newest version, None if there is none.
        knowledge_is_new: whether this run emitted it.
        policy: the newest version, None if there is none.
        policy_is_new: whether this run trained it.
        versions: cost of looking for new versions, and of making them, by noun.
        notes: lacks and mixtures of its knowledge, a line each.
        legs: where its clock went, in order.
    """

    stages: list[StageReport] = []
    knowledge: int | None = None
    knowledge_is_new: bool = False
    policy: int | None = None
    policy_is_new: bool = False
    versions: dict[str, Cost] = {}
    notes: list[str] = []
    legs: list[Leg] = []

    @contextmanager
    def leg(self, name: str) -> Iterator[None]:
        """Count the body as a leg, if it took a hundredth of a second."""
        begun, before = time.perf_counter(), self._work_s()
        yield
        seconds, work_s = time.perf_counter() - begun, self._work_s() - before
        if seconds >= _SHOWN_S:
            self.legs.append(Leg(name=name, seconds=round(seconds, 3), work_s=round(work_s, 3)))

    def _work_s(self) -> float:
        return sum(cost.seconds for cost in self.costs.values())

    @property
    def failures(self) -> dict[str, str]:
        """Each output that could not be made, with the reason."""
        return {f"{stage.noun} {name}": why for stage in self.stages for name, why in stage.failed.items()}

    @property
    def made(self) -> int:
        """Number of outputs that were made anew, versions included."""
        return sum(len(s.made) for s in self.stages) + self.knowledge_is_new + self.policy_is_new

    @property
    def costs(self) -> dict[str, Cost]:
        """Costs of each stage with work, versions included."""
        return {stage.noun: stage.cost for stage in self.stages if stage.cost.pieces} | self.versions

    def stage(self, noun: str) -> StageReport:
        """The report of a stage; an empty one is added if there is none."""
        for report in self.stages:
            if report.noun == noun:
                return report
        self.stages.append(StageReport(noun=noun))
        return self.stages[-1]

    def add_version(self, noun: str, version: int, cost: Cost, *, new: bool) -> None:
        """Record the newest version of a noun, whether it is new, and what it has cost."""
        if noun == "knowledge":
            self.knowledge, self.knowledge_is_new = version, new
        else:
            self.policy, self.policy_is_new = version, new
        self.versions[noun] = cost

    def markdown(self) -> str:
        """The report as Markdown."""
        lines = ["| stage | made | kept | failed |", "|---|---|---|---|"]
        lines += [f"| {s.noun} | {len(s.made)} | {s.unchanged} | {len(s.failed)} |"
                  for s in self.stages]
        if self.costs:
            lines += ["", *_table(self.costs), ""]
        lines += [f"- **{as_markdown(what)}**: {as_markdown(why)}" for what, why in self.failures.items()]
        lines += [f"- {as_markdown(note)}" for stage in self.stages for note in stage.notes]
        lines += [f"- {as_markdown(note)}" for note in self.notes]
        return "\n".join(lines)


def _table(costs: Mapping[str, Cost]) -> list[str]:
    """Costs of stages, as a table in Markdown."""
    lines = ["| stage | pieces | seconds | read, MiB | written, MiB | slowest piece | its seconds |",
             "|---|---|---|---|---|---|---|"]
    return [*lines, *(
        f"| {noun} | {cost.pieces} | {cost.seconds:.2f} | {mebibytes(cost.bytes_in)} | "
        f"{mebibytes(cost.bytes_out)} | {as_markdown(cost.slowest or '')} | {cost.slowest_s:.2f} |"
        for noun, cost in costs.items())]
