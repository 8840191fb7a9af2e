"""The flow that chains all stages, for all that is new."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from prefect import Task
from prefect.artifacts import create_markdown_artifact
from pydantic import BaseModel

from flows import behaviours, decisions, goals, grams, knowledge, policies, situations, trajectories
from flows.catalog import refresh
from flows.matches import Recording, import_all
from flows.stage import Scope, Stage, StageReport, data_folder, match_names, our_flow, run_one, run_stage
from pipeline.settings import Settings
from pipeline.store import Store

S = TypeVar("S", bound=BaseModel)


class RunReport(BaseModel):
    """What a run did.

    Attributes:
        stages: in order.
        knowledge: the newest version, None if there is none.
        knowledge_is_new: whether this run emitted it.
        policy: the newest version, None if there is none.
        policy_is_new: whether this run trained it.
    """

    stages: list[StageReport] = []
    knowledge: int | None = None
    knowledge_is_new: bool = False
    policy: int | None = None
    policy_is_new: bool = False

    @property
    def failures(self) -> dict[str, str]:
        """What could not be made, with the reason."""
        return {f"{stage.noun} {name}": why for stage in self.stages for name, why in stage.failed.items()}

    @property
    def made(self) -> int:
        """How many outputs were made anew, versions included."""
        return sum(len(s.made) for s in self.stages) + self.knowledge_is_new + self.policy_is_new

    def stage(self, noun: str) -> StageReport:
        """The report of a stage, made if it is not there."""
        for report in self.stages:
            if report.noun == noun:
                return report
        self.stages.append(StageReport(noun=noun))
        return self.stages[-1]

    def markdown(self) -> str:
        """The report as a person wants to read it."""
        lines = ["| stage | made | kept | failed |", "|---|---|---|---|"]
        lines += [f"| {s.noun} | {len(s.made)} | {s.kept} | {len(s.failed)} |" for s in self.stages]
        lines += [f"- **{what}**: {why}" for what, why in self.failures.items()]
        lines += [f"- {note}" for stage in self.stages for note in stage.notes]
        return "\n".join(lines)


class _Run:
    """One run over the matches of a store, stage by stage; a match that fails drops out."""

    def __init__(self, store: Store, settings: Settings) -> None:
        self.store = store
        self.settings = settings
        self.report = RunReport()
        self.scope = Scope(
            matches=tuple(match_names(store)), lengths=tuple(r.n for r in settings.behaviours.rounds))

    def drop(self, failed: set[str]) -> None:
        """Go on without the matches that failed."""
        left = tuple(match for match in self.scope.matches if match not in failed)
        self.scope = self.scope.model_copy(update={"matches": left})

    def stage(self, job: Task[..., Any], stage: Stage[S], names: Sequence[str], settings: S) -> set[str]:
        """Run a stage and take its report down; the names that failed."""
        report = run_stage(job, stage, self.store, names, settings, self.scope)
        total = self.report.stage(report.noun)
        total.made += report.made
        total.kept += report.kept
        total.failed |= report.failed
        return set(report.failed)

    def per_match(self, job: Task[..., Any], stage: Stage[S], settings: S) -> None:
        """Run a stage of one output a match."""
        self.drop(self.stage(job, stage, self.scope.matches, settings))

    def round(self, n: int) -> bool:
        """Count the grams of one length in every match, then select the behaviours among them."""
        names = [grams.output(match, n) for match in self.scope.matches]
        failed = self.stage(grams.make_grams, grams.STAGE, names, self.settings.grams)
        self.drop({grams.of(name)[0] for name in failed})
        if not self.scope.matches:
            return False
        return not self.stage(behaviours.make_behaviours, behaviours.STAGE, [self.scope.round(n)],
                              self.settings.behaviours)

    def emit(self, train: bool) -> None:
        """Emit knowledge and train a policy if there is anything new."""
        version, self.report.knowledge_is_new = run_one(
            knowledge.make_knowledge, "knowledge",
            self.store.root, "knowledge", self.settings.knowledge, self.scope)
        knowledge.publish(self.store, version)
        if train:
            version, self.report.policy_is_new = run_one(
                policies.make_policy, "policies", self.store.root, "policy", self.settings.policies)
            policies.publish(self.store, version)

    def look_at_versions(self) -> None:
        """Report the newest versions, and those that cannot be read."""
        for noun in ("knowledge", "policies"):
            unreadable = self.store.unreadable(noun)
            if unreadable:
                self.report.stage(noun).failed |= unreadable
        known, learned = self.store.latest("knowledge"), self.store.latest("policies")
        self.report.knowledge = known.version if known else None
        self.report.policy = learned.version if learned else None


@our_flow(name="run")
def run_flow(
    data: Path, recordings: list[Recording] | None = None, settings: Settings = Settings(), train: bool = True
) -> dict[str, Any]:
    """Import what is new in the inbox (or ``recordings``) and bring every stage up to date."""
    store = data_folder(data)
    imported = import_all(store, recordings)
    run = _Run(store, settings)
    run.report.stages.append(imported)
    imported.failed |= store.unreadable("matches")
    run.per_match(trajectories.make_trajectories, trajectories.STAGE, settings.trajectories)
    run.per_match(situations.make_situations, situations.STAGE, settings.situations)
    run.per_match(goals.make_goals, goals.STAGE, settings.goals)
    known = bool(run.scope.matches) and all(run.round(n) for n in run.scope.lengths)
    if known:
        run.per_match(decisions.make_decisions, decisions.STAGE, settings.decisions)
    if known and run.scope.matches:
        run.emit(train)
    run.look_at_versions()
    refresh(store)
    create_markdown_artifact(run.report.markdown(), key="run", description="what the run did")
    return run.report.model_dump()
