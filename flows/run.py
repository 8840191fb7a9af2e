"""The flow that chains all stages, for all that is new."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from prefect import Task
from prefect.artifacts import create_markdown_artifact
from pydantic import BaseModel

from flows import behaviours, decisions, goals, grams, knowledge, policies, situations, trajectories
from flows.catalog import refresh
from flows.matches import Recording, import_all, inbox
from flows.stage import Stage, StageReport, data_folder, listener, match_names, our_flow, run_stage
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
        return "\n".join(lines)


class _Run:
    """One run over the matches of a store, stage by stage; a match that fails drops out."""

    def __init__(self, store: Store, settings: Settings) -> None:
        self.store = store
        self.settings = settings
        self.report = RunReport()
        self.matches: list[str] = []

    def stage(self, job: Task[..., Any], stage: Stage[S], names: Sequence[str], settings: S) -> set[str]:
        """Run a stage and take its report down; the names that failed."""
        report = run_stage(job, stage, self.store, names, settings)
        total = self.report.stage(report.noun)
        total.made += report.made
        total.kept += report.kept
        total.failed |= report.failed
        return set(report.failed)

    def per_match(self, job: Task[..., Any], stage: Stage[S], settings: S) -> None:
        """Run a stage of one output a match."""
        failed = self.stage(job, stage, self.matches, settings)
        self.matches = [match for match in self.matches if match not in failed]

    def round(self, n: int) -> None:
        """Count the grams of one length in every match, then select the behaviours among them."""
        names = [grams.output(match, n) for match in self.matches]
        failed = {grams.of(name)[0] for name in
                  self.stage(grams.make_grams, grams.STAGE, names, self.settings.grams)}
        self.matches = [match for match in self.matches if match not in failed]
        self.stage(behaviours.make_behaviours, behaviours.STAGE, [behaviours.round_name(n)],
                   self.settings.behaviours)


@our_flow(name="run")
def run_flow(
    data: Path, recordings: list[Recording] | None = None, settings: Settings = Settings(), train: bool = True
) -> dict[str, Any]:
    """Import what is new in the inbox (or ``recordings``) and bring every stage up to date."""
    store = data_folder(data)
    run = _Run(store, settings)
    run.report.stages.append(import_all(store, inbox(store) if recordings is None else recordings))
    run.matches = match_names(store)
    run.per_match(trajectories.make_trajectories, trajectories.STAGE, settings.trajectories)
    run.per_match(situations.make_situations, situations.STAGE, settings.situations)
    run.per_match(goals.make_goals, goals.STAGE, settings.goals)
    if run.matches:
        for round_ in settings.behaviours.rounds:
            run.round(round_.n)
        run.per_match(decisions.make_decisions, decisions.STAGE, settings.decisions)
        _versions(run, train)
    refresh(store)
    create_markdown_artifact(run.report.markdown(), key="run", description="what the run did")
    return run.report.model_dump()


def _versions(run: _Run, train: bool) -> None:
    """Emit knowledge and train a policy if there is anything new."""
    store, report = run.store, run.report
    listener.get().begin("knowledge", 1)
    report.knowledge, report.knowledge_is_new = knowledge.make_knowledge(
        store.root, "knowledge", run.settings.knowledge)
    listener.get().advance("knowledge", "knowledge")
    knowledge.publish(store, report.knowledge)
    if train:
        listener.get().begin("policies", 1)
        report.policy, report.policy_is_new = policies.make_policy(
            store.root, "policy", run.settings.policies)
        listener.get().advance("policies", "policy")
        policies.publish(store, report.policy)
