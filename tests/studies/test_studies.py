"""Every study runs, on a tiny setting; what studies share does what it says."""

from __future__ import annotations

import ast
import json
import re
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import current_thread, main_thread

import ball_goals.study
import harness
import pages.study
import paradigms.study
import polars as pl
import pytest
import scale.growth
import scale.study
import seasons.study
import sensitivity.study
import soak.league
import soak.questions
import soak.study
import surely.acts
import surely.study
import transfer.study
import usual.study
import values.level
import values.shipped
import values.study
from conftest import ROOT, clip
from PIL import Image
from scout import expected_goals, teams_apart
from support.sessions import migrated
from support.shown import FewTrees
from world import game, rules, thousand

from pitchlore.flows.server import Keeper, database
from pitchlore.pipeline.settings import ModelSettings
from pitchlore.pipeline.store import outputs

STUDIES = ROOT / "data" / "studies"


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """Studies play in threads of the test: processes take seconds to start."""
    monkeypatch.setattr(harness, "ProcessPoolExecutor", lambda number, _context: ThreadPoolExecutor(number))


def same_columns(made, study, *names):
    """Tables that were made have the columns of those that are kept."""
    for name in names:
        assert pl.read_csv(made / name).columns == pl.read_csv(STUDIES / study / name).columns


@pytest.fixture
def short_sample(tmp_path, monkeypatch):
    """Studies find two minutes of the sample, which have goals, in place of all of it."""
    clip(0.0, 120.0).write_parquet(path := tmp_path / harness.RSIM)
    monkeypatch.setattr(harness, "SAMPLE", path)


@pytest.fixture
def commands_here(monkeypatch, call):
    """Commands of studies are called in this process: others take seconds to start."""
    def command(*words):
        code, _, said = call(*words)
        assert code == 0, said

    def answer(league, *words, data=None, user=None):
        if current_thread() is not main_thread():  # an actor of the soak
            return process(league, *words, data=data, user=user)
        code, said, error = call(*words, "--data", data or league.data)
        assert code == 0, error
        return subprocess.CompletedProcess(words, code, said, error)

    process = soak.league.League.call
    for study in (teams_apart, expected_goals, harness, surely.study, paradigms.study, seasons.study):
        monkeypatch.setattr(study, "command", command)
    for league in (scale.study.Bench, soak.league.League):
        monkeypatch.setattr(league, "call", answer)


@pytest.fixture
def few_trees(monkeypatch):
    """Copies of runs that are called here are quickly fitted."""
    monkeypatch.setattr("pitchlore.flows.commands.common.RunSettings", FewTrees)


class TestParts:
    def test_goes_on(self, tmp_path, monkeypatch):
        """A study that was stopped makes what is missing, and nothing twice; what ended is not kept."""
        made = []

        def square(job):
            if job[0] == "three" and len(made) == 2:
                raise KeyboardInterrupt
            made.append(job[0])
            return job[1] ** 2

        jobs = [("two", 2), ("one", 1), ("three", 3), ("four", 4)]
        with pytest.raises(KeyboardInterrupt), harness.going_on(tmp_path, __file__) as parts:
            parts(jobs, square)
        with (kept := tmp_path / ".test_studies.parts").open("a") as file:
            file.write('["torn')
        made.append("stopped")
        with harness.going_on(tmp_path, __file__) as parts, ThreadPoolExecutor(2) as pool:
            assert parts(jobs, square, pool) == [4, 1, 9, 16]
            assert parts(jobs[::-1], square) == [16, 9, 1, 4]
            assert len(kept.read_text().splitlines()) == 5
        assert made[:3] == ["two", "one", "stopped"]
        assert sorted(made[3:]) == ["four", "three"]
        assert not kept.exists()

    def test_of_other_software(self, tmp_path, monkeypatch):
        """Parts that other software has made are made again."""
        stopped = harness.going_on(tmp_path, __file__)
        assert stopped.__enter__()([1], lambda _: "old") == ["old"]
        monkeypatch.setattr(harness, "software", lambda: "other")
        with harness.going_on(tmp_path, __file__) as parts:
            assert parts([1], lambda _: "new") == ["new"]


def test_surely(tmp_path, commands_here):
    """Behaviours that are called sure are counted in other matches; of moved outcomes the corrected rule calls hardly any so."""
    surely.study.main(tmp_path, tmp_path / "data", 1, ("random",), (2, 2), minutes=2.0)
    same_columns(tmp_path, "surely", "surely.csv")
    surely.acts.main(tmp_path, tmp_path / "data")
    same_columns(tmp_path, "surely", "acts.csv")
    said = {(row["outcomes"], row["rule"]): row["said"] for row in pl.read_csv(tmp_path / "surely.csv").filter(pl.col("pays") == "-").iter_rows(named=True)}
    assert said["as they were", "today"] > said["as they were", "rates"] >= said["moved", "rates"]


def test_the_makefile_names_every_study():
    """Each file of a study that is run is called by a target or a page, and each that is called is there."""
    pages = (ROOT / "Makefile", ROOT / "docs" / "explanation" / "scale.md")
    called = {path for page in pages for path in re.findall(r"/python data/studies/(\S+\.py)", page.read_text())}
    runs = {str(path.relative_to(STUDIES)) for path in STUDIES.rglob("*.py") if '__name__ == "__main__"' in path.read_text()}
    steps = re.findall(r'Step\("(\S+\.py)"', (STUDIES / "from_recordings" / "everything.py").read_text())
    assert called | {"peers/offline.py", "peers/online.py", *steps} == runs, "peers/study.py calls these two"


def imported(path, names):
    """Modules in a folder of Python's path that a file imports, by way of others too."""
    found, left = set(), [path]
    while left:
        tree = ast.parse(left.pop().read_text())
        given = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names} | {
            name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module
            for name in (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))}
        new = (given & names.keys()) - found
        found |= new
        left += [names[name] for name in new]
    return found


def test_files_without_the_tests():
    """Each study that a target runs without the tests on Python's path imports nothing of them; the soak does."""
    ours, theirs = ({".".join(path.relative_to(root).with_suffix("").parts): path for path in root.rglob("*.py")}
                    for root in (STUDIES, ROOT / "tests"))
    files = re.findall(r"^\t\S+/python data/studies/(\S+\.py)", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert len(files) > 15
    for file in files:
        assert imported(STUDIES / file, ours | theirs) & theirs.keys() == set(), file
    assert imported(STUDIES / "soak" / "study.py", ours | theirs) >= {"support.idle", "hostile.make", "harness"}


@pytest.mark.slow
def test_rules(tmp_path, monkeypatch):
    monkeypatch.setattr(rules, "SECONDS", 10.0)
    monkeypatch.setattr(rules, "LEFT_OUT", {"yields": ("yields",)})
    rules.main(tmp_path, seeds=range(1, 3))
    found = pl.read_csv(tmp_path / "rules.csv")
    assert found.columns == pl.read_csv(STUDIES / "world" / "rules.csv").columns
    assert found["left_out"].to_list() == ["yields", "all"]
    assert found["matches"].to_list() == [4, 4]


@pytest.mark.slow
def test_game(tmp_path, monkeypatch):
    monkeypatch.setattr(game, "SECONDS", 10.0)
    monkeypatch.setattr(game, "PAIRINGS", game.PAIRINGS[:2])
    game.main(tmp_path, tmp_path, seeds=(1, 2))
    found, there = (pl.read_csv(folder / "game.csv") for folder in (tmp_path, STUDIES / "world"))
    assert found.columns == there.columns
    sample = there.row(0)[: -1]
    assert found.row(0)[:-1] == sample  # of the same recording
    assert found["matches"].to_list() == [1, 2, 2, 2, 2]


@pytest.mark.slow
def test_thousand(tmp_path):
    assert thousand.main(tmp_path, [("random", 3), ("static", 2)])
    found, there = (json.loads((folder / "thousand.json").read_text()) for folder in (tmp_path, STUDIES / "world"))
    assert found.keys() == there.keys()
    assert found["static against static"].keys() == there["static against static"].keys()
    assert found["random against random"]["frames"] == 3 * 1201


@pytest.mark.slow
def test_the_scouts(tmp_path, monkeypatch, commands_here, few_trees, short_sample):
    """Both studies of the scout, on the same matches, which are played once."""
    for study, name, value in (
            (teams_apart, "TEAMS", teams_apart.TEAMS[:3]), (teams_apart, "MINUTES", 1), (teams_apart, "SHUFFLES", 20), (expected_goals, "DEALS", 2),
            (expected_goals, "_SETTINGS", "[chances]\ngoals_at_least = 2\n")):
        monkeypatch.setattr(study, name, value)
    teams = teams_apart.play(str(tmp_path / "played"), 1)
    for study in (teams_apart, expected_goals):
        monkeypatch.setattr(study, "play", lambda data, _: shutil.copytree(tmp_path / "played", data, dirs_exist_ok=True) and teams)
    teams_apart.main(tmp_path)
    expected_goals.main(tmp_path, tmp_path)
    for name in ("teams", "xg", "xg-calibration"):
        assert pl.read_csv(tmp_path / f"{name}.csv").columns == pl.read_csv(STUDIES / "scout" / f"{name}.csv").columns
    assert set(pl.read_csv(tmp_path / "xg.csv")["game"]) >= {"five teams against static", harness.RSIM}


@pytest.mark.slow
def test_ball_goals(tmp_path, monkeypatch):
    """The sample's rows are those that are kept; a match that is played has rows, too."""
    monkeypatch.setattr(ball_goals.study, "SECONDS", 20.0)
    monkeypatch.setattr(ball_goals.study, "PAIRINGS", [("static", "random")])
    ball_goals.study.main(tmp_path, tmp_path, seeds=[1])
    found, there = (pl.read_csv(folder / "found.csv") for folder in (tmp_path, STUDIES / "ball_goals"))
    sample = pl.col("game") == "rc-robosim VSSS"
    assert found.filter(sample).equals(there.filter(sample))
    assert set(found["game"]) == {"rc-robosim VSSS", "played here"}
    for name in ("kinds.csv", "restarts.csv"):
        same_columns(tmp_path, "ball_goals", name)


@pytest.mark.slow
def test_values(tmp_path, monkeypatch, short_sample):
    """A pairing with goals enough for both halves, and the sample; then the model that is shipped."""
    study = values.study
    for name, value in (("PAIRINGS", [("static", "random")]), ("SECONDS", 120.0), ("RESAMPLES", 5), ("_DEALS", 2)):
        monkeypatch.setattr(study, name, value)
    monkeypatch.setattr(study, "ModelSettings", lambda: ModelSettings(trees=5))
    study.main(tmp_path, tmp_path, matches=2)
    assert pl.read_csv(tmp_path / "models.csv")["game"].to_list() == ["static - random", harness.RSIM]
    same_columns(tmp_path, "values", "calibration.csv", "halves.csv", "increment.csv")
    assert set(pl.read_csv(STUDIES / "values" / "models.csv").columns) >= set(pl.read_csv(tmp_path / "models.csv").columns)
    monkeypatch.setattr(values.shipped, "_PAIRINGS", study.PAIRINGS)
    values.shipped.main(tmp_path / "shipped.json", matches=2)
    made, there = (json.loads(path.read_text()) for path in (tmp_path / "shipped.json", ROOT / "pipeline/stages/values/shipped.json"))
    assert made.keys() == there.keys()
    monkeypatch.setattr(values.level, "PAIRINGS", ())
    values.level.main(tmp_path, tmp_path)
    same_columns(tmp_path, "values", "level.csv")


@pytest.mark.slow
def test_usual(tmp_path, monkeypatch):
    """Kinds with a recording that is absent stay; the sample gives its kind's rates again."""
    monkeypatch.setattr(usual.study, "THERE", False)
    there = ROOT / "pipeline" / "stages" / "situations" / "usual.json"
    shutil.copy(there, tmp_path)
    usual.study.main(tmp_path / "usual.json", tmp_path)
    assert json.loads((tmp_path / "usual.json").read_text()) == json.loads(there.read_text())


@pytest.mark.slow
def test_scale(tmp_path, monkeypatch, commands_here, few_trees):
    """Both studies of scale; receipts that were written just now count, as they do where a run takes longer."""
    monkeypatch.setattr(outputs, "settled", lambda *_: True)
    monkeypatch.setattr(scale.study, "QUESTIONS", {"one": "select count(*) from matches"})
    monkeypatch.setattr(scale.study, "MINUTES", 0.1)
    scale.study.main(tmp_path, [1])
    scale.growth.main(tmp_path, [2])
    same_columns(tmp_path, "scale", "scale.csv", "growth.csv")
    assert pl.read_csv(tmp_path / "scale.csv")["matches"].to_list() == [1, 1, 1, 2, 2, 3, 3, 3, 3, 3]
    assert pl.read_csv(tmp_path / "growth.csv")["distinct"][0] > 0


@pytest.fixture
def tiny(tmp_path):
    """Writes settings of seasons with one game of six seconds; gives their path."""
    def write(name, base):
        path = tmp_path / f"{name}.toml"
        path.write_text(f'base = "{base}"\nopponents = ["static"]\ngames = 1\n[referee]\nduration_s = 6\n')
        return str(path)

    return write


def stamps(data):
    """Times of the receipts of a data folder."""
    return {path: path.stat().st_mtime_ns for path in data.rglob("*.receipt.json")}


@pytest.mark.slow
def test_seasons(tmp_path, tiny, commands_here):
    """The study plays, measures and writes; played again, nothing is played anew."""
    measuring = ("--policy", "tiny-static-101", "--against", "random", "--matches", 2, "--minutes", 0.1)
    plan = seasons.study.Plan(seasons=((tiny("tiny", "best-in-games"), 1, ()),), evaluations=(measuring,))
    out, data = tmp_path / "studies" / "seasons", tmp_path / "data"
    seasons.study.main(out, data, plan)
    same_columns(out, "seasons", *(path.name for path in (STUDIES / "seasons").glob("*.csv")))
    assert pl.read_csv(out / "games.csv").select("settings", "seed", "game").rows() == [("tiny", 101, 1)]
    assert pl.read_csv(out / "claims.csv").height == pl.read_csv(STUDIES / "seasons" / "claims.csv").height
    assert (out / "README.md").read_text().startswith("# Seasons: an apprentice that learns by watching")
    assert len(list((tmp_path / "studies" / "evaluations").glob("tiny-static-101-random-*"))) == 2
    before = stamps(data)
    seasons.study.main(out, data, plan)
    assert stamps(data) == before


@pytest.mark.slow
def test_sensitivity(tmp_path, tiny, commands_here):
    """The study plays and writes; played again, nothing is played anew."""
    out, data, settings = tmp_path / "out", tmp_path / "data", [tiny("paper-vary-tiny", "paper")]
    sensitivity.study.main(out, data, settings, [101], 1)
    same_columns(out, "sensitivity", "sensitivity.csv")
    assert "| paper-vary-tiny |" in (out / "README.md").read_text()
    before = stamps(data)
    sensitivity.study.main(out, data, settings, [101], 1)
    assert stamps(data) == before


@pytest.mark.slow
def test_paradigms(tmp_path, commands_here):
    """The study plays each of its plans and writes; played again, nothing is played anew."""
    out, data, plan = tmp_path / "out", tmp_path / "data", (("--quick", "--figure", 5, "--runs", 2),)
    paradigms.study.main(out, data, plan)
    kept = STUDIES / "paradigms"
    for kind in ("points", "verdicts"):
        (made,) = out.glob(f"figure-5-r2*.{kind}.csv")
        assert pl.read_csv(made).columns == pl.read_csv(kept / f"figure-5-r100.{kind}.csv").columns
    before = stamps(data)
    paradigms.study.main(out, data, plan)
    assert before == stamps(data) != {}


#: A simulator in which bodies stay where they are placed.
STILL = """
import json, sys
state = [0.0] * 41
print(json.dumps({}), flush=True)
for line in sys.stdin:
    asked = json.loads(line)
    if "place" in asked:
        ball, *teams = asked["place"]
        state = [*ball[:2], 0.0, *ball[2:], *(x for team in teams for robot in team for x in (*robot, 0.0, 0.0, 0.0))]
    print(json.dumps(state), flush=True)
"""


@pytest.mark.slow
def test_transfer(tmp_path, monkeypatch):
    """Controls play in our arena and in another, in which nobody scores; rows of what is not played stay."""
    study, still = transfer.study, tmp_path / "still.py"
    still.write_text(STILL)
    monkeypatch.setattr(study, "SERVERS", {"still": (still,), "absent": (still,)})
    monkeypatch.setattr(study, "HOW", study.HOW | {"referee": study.RefereeSettings(duration_s=10.0)})
    shutil.copy(STUDIES / "transfer" / "transfer.csv", tmp_path)
    study.main(tmp_path, [sys.executable, "-"], tmp_path / "data", [], seeds=range(2))
    found, there = (pl.read_csv(folder / "transfer.csv") for folder in (tmp_path, STUDIES / "transfer"))
    assert found.filter(simulator="still")["difference"].to_list() == [0.0, 0.0]
    assert found.filter(simulator="our arena", team="random")["difference"][0] < 0
    assert found.filter(simulator="rSim 1.2").equals(there.filter(simulator="rSim 1.2"))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # they are no findings
def test_fuzz(tmp_path):
    import fuzz.study  # it makes the recordings that it breaks, which takes a second

    before = signal.getsignal(signal.SIGALRM)
    try:
        assert fuzz.study.main(tmp_path, 2.0, 1) == 0
    finally:
        signal.signal(signal.SIGALRM, before)
    same_columns(tmp_path, "fuzz", "fuzz.csv")


def test_judge_of_the_soak():
    """An answer without a word that lacks a match which stood all the time is wrong; so is one with other rows."""
    truth = [(kind, name, 2, "x") for kind in soak.questions.MADE_FROM for name in ("kept", "other")]
    judge = soak.questions.Judge(truth, frozenset({"kept"}))
    whole, standing = [row for row in truth if row[1] == "kept"], {("matches", "kept"), ("matches", "ssl-1")}
    live = ("matches", "ssl-1", 1, "y")
    assert judge.wrong([*whole, live]) == judge.lacking([*whole, live], standing) == []
    assert judge.lacking(whole, standing) == ["a smaller answer without a word: matches of ssl-1"]
    assert judge.lacking([live], standing, "goals.kept.json") == ["a smaller answer without a word: matches of kept"]
    assert len(judge.lacking([*whole, live], {*standing, ("matches", "other"), ("goals", "other")})) == 2
    assert judge.wrong([("matches", "kept", 1, "x")]) == ["wrong rows: matches of kept, 1"]
    less = [row for row in whole if row[0] != "situations"]
    assert judge.wrong(less) == ["goals of kept without its situations"]
    assert judge.wrong(less, said="left out: /league/situations/kept.receipt.json: is not what was written") == []


@pytest.mark.slow
def test_soak(tmp_path, monkeypatch, commands_here):
    """A moment of everything, in processes of its own; before and after, what a quiet run makes is made here."""
    monkeypatch.setattr(soak.league, "STARTS_S", (0, 25))
    (out := tmp_path / "out").mkdir()
    migrated(Keeper(tmp_path / "league").folder, database())
    assert soak.study.main(tmp_path, out, 0.3, 255) == 0  # the seed presses Ctrl-C at once
    same_columns(out, "soak", "samples.csv")
    reported, there = (json.loads((folder / "figures.json").read_text()) for folder in (out, STUDIES / "soak"))
    assert reported.keys() == there.keys()
    assert reported["of these different"] == 0


def test_pictures_of_pages(browser, tmp_path):
    """Two folders of pages are put side by side, each page in all its looks, and measured."""
    for name, tall in (("before", 700), ("today", 2000)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "index.html").write_text(f'<!doctype html><body style="margin:0"><main style="height:{tall}px"><svg class="pitch"></svg></main>')
    pages.study.main(browser, tmp_path, tmp_path / "before", tmp_path / "today", ["first"])
    same_columns(tmp_path, "pages", "pages.csv")
    (row,) = pl.read_csv(tmp_path / "pages.csv").rows()
    assert row == ("first", 700, 0, 2000, 0, 700, 2000)
    sizes = []
    for more in ("", "-more"):
        with Image.open(tmp_path / f"first{more}.webp") as image:
            sizes.append(image.size)
    assert sizes == [(820 + 12 + 820, 720), (195 + 12 + 683 + 12 + 348, 600)]
