"""Every study runs, on a tiny setting; what studies share does what it says."""

from __future__ import annotations

import json
import re
import shutil
from concurrent.futures import ThreadPoolExecutor

import harness
import polars as pl
import pytest
from conftest import ROOT
from scout import expected_goals, teams_apart
from world import game, rules, thousand

STUDIES = ROOT / "data" / "studies"


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """Studies play in threads of the test: processes take seconds to start."""
    monkeypatch.setattr(harness, "ProcessPoolExecutor", lambda number, _context: ThreadPoolExecutor(number))


@pytest.fixture
def commands_here(monkeypatch, call, prefect_server):
    """Commands of studies are called in this process: others take seconds to start."""
    def command(*words):
        code, _, said = call(*words)
        assert code == 0, said

    for study in (teams_apart, expected_goals):
        monkeypatch.setattr(study, "command", command)


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


def test_the_makefile_names_every_study():
    """Each file of a study that runs as one is a target's, and each that a target calls is there."""
    called = set(re.findall(r"\$\(BIN\)/python data/studies/(\S+\.py)", (ROOT / "Makefile").read_text()))
    runs = {str(path.relative_to(STUDIES)) for path in STUDIES.rglob("*.py") if '__name__ == "__main__"' in path.read_text()}
    assert called == runs


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
def test_the_scouts(tmp_path, monkeypatch, commands_here):
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
