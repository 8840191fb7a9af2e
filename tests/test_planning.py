"""The plan of a run: what it says is what the run then does, and it changes nothing."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import clip, run

from pitchlore.pipeline.engine.chain import Chain
from pitchlore.pipeline.engine.planning import RunPlan, run_plan
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import GoalSettings, KnowledgeSettings, Settings
from pitchlore.pipeline.store import Store

OF_MATCH = ("sides", "trajectories", "situations", "options", "goals", "events", "moments")
COMMON = Settings()


def nothing(data: Path) -> Settings:
    return COMMON


def other_setting(data: Path) -> Settings:
    return Settings(goals=GoalSettings(before_s=1.5))


def other_knowledge(data: Path) -> Settings:
    return Settings(knowledge=KnowledgeSettings(optimistic=0.5))


def one_more(data: Path) -> Settings:
    clip(400.0, 440.0).write_csv(data / "inbox" / "third.csv")
    return COMMON


def damaged(data: Path) -> Settings:
    path = next((data / "events").glob("*.passes.parquet"))
    path.write_bytes(path.read_bytes()[:-1])
    return COMMON


def lost(data: Path) -> Settings:
    next((data / "sequences").glob("*.receipt.json")).unlink()
    return COMMON


def unreadable(data: Path) -> Settings:
    path = next((data / "moments").glob("*.receipt.json"))
    path.write_text(path.read_text().replace('"noun"', '"nuon"'))
    return COMMON


def bad(data: Path) -> Settings:
    (data / "inbox" / "notes.txt").write_text("dear diary")
    run(data)
    return COMMON


#: What happens to a finished folder, and the reasons that the plan then has, by noun.
CASES: dict[str, tuple[Callable[[Path], Settings], dict[str, set[str]]]] = {
    "nothing": (nothing, {}),
    "setting": (other_setting, {"goals": {"setting before_s: 2.0 → 1.5"}, "sequences": {"after goals"}}),
    "knowledge": (other_knowledge, {"knowledge": {"setting optimistic: 0.0 → 0.5"}, "policies": {"after knowledge"}}),
    "new": (one_more, {**{noun: {"a new match"} for noun in (*OF_MATCH, "chances", "values", "sequences")},
                       "matches": {"a recording that is no match yet"}, "behaviours": {"new matches: 1"}}),
    "damaged": (damaged, {"events": {"is lost or damaged"}}),
    "lost": (lost, {"sequences": {"not made yet"}}),
    "unreadable": (unreadable, {"moments": {"checksum differs"}, "values": {"after moments"}}),
    "refused": (bad, {"matches": {"as before: notes.txt: is not a recording"}}),
}


def tree(data: Path) -> dict[str, tuple[int, bytes]]:
    """Time and bytes of every file."""
    return {str(path): (path.stat().st_mtime_ns, path.read_bytes()) for path in data.rglob("*") if path.is_file()}


def of(plan: RunPlan, *, sure: bool) -> set[tuple[str, str]]:
    """Noun and name of the outputs of a plan; the match of a recording, and the next version, have no name yet."""
    return {(stage.noun, "new" if one.detail == "a new match" or stage.noun in ("matches", *STAGES.versioned) else one.name)
            for stage in plan.stages for one in stage.todo if one.sure is sure and one.why != "refused"}


@pytest.mark.parametrize("case", CASES)
def test_what_is_planned_is_done(copied, case):
    """The plan names each stage's reason, changes nothing, and the run makes what it says and nothing else."""
    change, reasons = CASES[case]
    settings, before = change(copied), {each.name for each in Store(copied).receipts("matches")}
    held = tree(copied)
    plan = run_plan(Store(copied), settings)
    assert tree(copied) == held
    said = {stage.noun: {one.detail for one in stage.todo} for stage in plan.stages if stage.todo}
    for noun, wanted in reasons.items():
        assert all(any(each in detail for detail in said[noun]) for each in wanted), said[noun]
    if case in ("nothing", "refused"):
        assert said.keys() == reasons.keys()
    report = run(copied, settings=settings)
    done = {(stage.noun, name if name in before or name == "all" else "new")
            for stage in report.stages for name in (*stage.made, *stage.same)}
    done |= {(noun, "new") for noun, new in (("knowledge", report.knowledge_is_new), ("policies", report.policy_is_new)) if new}
    assert of(plan, sure=True) <= done <= of(plan, sure=True) | of(plan, sure=False)
    again = run_plan(Store(copied), settings)
    assert of(again, sure=True) | of(again, sure=False) == set()
    assert all(stage.each_s for stage in plan.stages)
    assert plan.work_s[0] == pytest.approx(sum(stage.each_s * sum(one.sure and one.why != "refused" for one in stage.todo) for stage in plan.stages))


def test_stage_version(copied, monkeypatch):
    """A stage whose version was raised is named with both versions; what is made from it may follow."""
    raised = replace(STAGES["events"], version=STAGES["events"].version + 1)
    monkeypatch.setattr("pitchlore.pipeline.engine.planning.STAGES", Chain(*(
        raised if noun == "events" else stage for noun, stage in STAGES.items())))
    stages = {stage.noun: stage for stage in run_plan(Store(copied), COMMON).stages}
    version = STAGES["events"].version
    assert {(one.why, one.detail) for one in stages["events"].todo} == {("changed", f"stage events version {version} → {version + 1}")}
    assert {(one.why, one.sure) for one in stages["chances"].todo} == {("after", False)}
    assert not stages["goals"].todo


def test_command(copied, call):
    """The command prints stages, reasons and cost; JSON has each output; without a run the cost is not known."""
    settings = copied / "goals.toml"
    settings.write_text("[goals]\nbefore_s = 1.5\n")
    code, out, err = call("run", "--plan", "--settings", settings, "--data", copied)
    assert (code, err) == (0, "")
    assert ": setting before_s: 2.0 → 1.5: goals" in out
    assert "To make: 2 outputs, " in out
    code, out, _ = call("run", "--plan", "--json", "--settings", settings, "--data", copied)
    goals = next(stage for stage in json.loads(out)["stages"] if stage["noun"] == "goals")
    assert (code, goals["inputs"], [one["why"] for one in goals["todo"]]) == (
        0, list(STAGES["goals"].inputs), ["changed", "changed"])
    page = copied.parent / "plan & graph.html"
    (copied / "inbox" / "<b>.txt").write_text("dear diary")
    code, out, _ = call("run", "--plan", "--page", page, "--settings", settings, "--data", copied)
    assert (code, out.splitlines()[-1]) == (0, f"{page}: open it in a browser")
    text = page.read_text()
    boxes = dict(re.findall(r'<rect class="(\w+)" [^>]+/><text[^>]+>(\w+)</text>', text)[n][::-1] for n in range(18))
    assert list(boxes) == [*STAGES.of_matches, *STAGES.versioned]
    assert (boxes["goals"], boxes["sequences"], boxes["events"]) == ("new", "perhaps", "fresh")
    assert text.count("<path ") == 23  # counted on the picture: a line that others imply is left out
    assert "setting before_s: 2.0 → 1.5" in text
    assert "<b>" not in text
    assert call("run", "--page", page, "--data", copied)[0] == 1
    (copied / "inbox" / "<b>.txt").unlink()
    shutil.rmtree(copied / "runs")
    code, out, _ = call("run", "--plan", "--data", copied)
    assert (code, out.splitlines()[-1]) == (0, "Nothing to make: every receipt holds. Nothing was changed.")
    code, _, err = call("run", "--plan", "--data", copied / "none")
    assert (code, "there is no such folder" in err) == (1, True)
    new = copied.parent / "new"
    shutil.copytree(copied / "inbox", new / "inbox")
    code, out, _ = call("run", "--plan", "--data", new)
    assert (code, list(new.iterdir())) == (0, [new / "inbox"])
    assert "which do not tell that of matches, sides," in out
