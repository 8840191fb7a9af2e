"""The command line: help, options, settings, and commands that make things."""

import json
import os
import re
from dataclasses import fields
from typing import get_args, get_type_hints

import polars as pl
import pytest
from conftest import ROOT, clip
from support.closed import as_user, close
from support.receipts import put_receipt, receipt_at

from pitchlore.flows.cli import COMMANDS
from pitchlore.flows.commands.playing import Learners, Playing, option
from pitchlore.flows.commands.run import _print_rounds
from pitchlore.flows.commands.run import run as run_command
from pitchlore.flows.commands.situations import situations as situations_command
from pitchlore.pipeline.arena.match.recipe import team_slug
from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.store import Store


def test_help_examples(call):
    """The help has an example of every command."""
    code, out, _ = call("--help")
    assert code == 0
    for command in COMMANDS:
        assert command.name.split()[0] in out
        assert f"Example: {command.example}" in " ".join(call(*command.name.split(), "--help")[1].split())


def test_help_of_evaluate_fits_a_screen(call, monkeypatch):
    """It has at most 24 lines of 100 columns, and names every option."""
    monkeypatch.setenv("COLUMNS", "100")
    lines = call("evaluate", "--help")[1].splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 100
    said = set(re.findall(r"--[a-z-]+", " ".join(lines)))
    assert said >= {option(field.name) for model in (Playing, Learners) for field in fields(model)}


def test_the_how_to_explains_options_of_learned_teams():
    """The page that the help names has a row for each option of learned teams."""
    page = (ROOT / "docs" / "how-to" / "play.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(--[a-z-]+)", page, re.MULTILINE)) == {option(field.name) for field in fields(Learners)}


def test_kinds_of_commands():
    """The commands that take a kind of match take every kind."""
    for command in (run_command, situations_command):
        (kind,) = [each for each in get_type_hints(command).items() if each[0] == "kind"]
        words = {word for part in (kind[1], *get_args(kind[1])) for word in get_args(part) if isinstance(word, str)}
        assert words == {each.value for each in Kind}


def test_run_on_an_older_folder(copied):
    """Behaviours that another version of the stage made have no counts by team, and run says nothing of them."""
    file = copied / "behaviours" / "all.receipt.json"
    said = receipt_at(file)
    put_receipt(file, said, details={"report": said["details"]["reports"][0]})
    _print_rounds(Store(copied))


def test_evaluate_output(call, tmp_path):
    """`evaluate` prints text for people, and JSON for programs, and plays no match twice."""
    words = ("evaluate", "--policy", "static", "--against", "human-like", "--matches", "2", "--minutes", "0.05",
             "--on", "processes:1", "--data", tmp_path)
    code, out, _ = call(*words, "--json")
    found = json.loads(out)
    assert code == 0
    assert (found["matches"], found["pairs"], found["played_now"]) == (2, 1, 2)
    assert found["wins"] + found["draws"] + found["losses"] == 2
    assert set(found["win_rate"]) == {"value", "low", "high"}
    code, out, _ = call(*words)
    assert code == 0
    assert "0 matches played now" in out
    assert "Fouls a match: static took 0.0 restarts, 0.0 of them penalties; human-like took" in " ".join(out.split())
    assert "a second script" in out
    _, out, _ = call("sql", "select count(*) n from evaluations", "--json", "--data", tmp_path)
    assert json.loads(out) == [{"n": 2}]


@pytest.mark.parametrize("words", [
    ("record", "--minutes", "0"), ("record", "--minutes", "nan"), ("play", "--minutes", "inf"), ("evaluate", "--minutes", "-1"),
    ("record", "--robots", "0"), ("play", "--robots", "0"), ("record", "--matches", "0"), ("evaluate", "--matches", "3"),
    ("record", "--seed", "-1"), ("play", "--seed", "-1"), ("season", "--seed", "99999999"), ("season", "--seed", "-1"),
    ("season", "--games", "0"), ("record", "--explore", "2"), ("evaluate", "--explore", "2"),
    ("season", "--settings", "bst"), ("run", "--settings", "papr"), ("record", "--lcb-weight", "-1"), ("record", "--home", "static", "--explore", "0.5"), ("record", "--robots", "99"),
    ("evaluate", "--policy", "static", "--min-visits", "3"), ("record", "--seed", "x"), ("record", "--sed", "1"), ("recrod",),
    ("runs", "--last", "\x1b[2J"),
])
def test_bad_options(call, tmp_path, words):
    """An option that does not fit is one line of error that says what to do next."""
    code, out, err = call(*words, *(("--data", tmp_path / "data") if len(words) > 1 else ()))
    line = err.splitlines()[-1]  # after a progress bar, if it had begun
    assert (code, out) == (1, "")
    assert sum("pitchlore: " in row for row in err.splitlines()) == 1
    assert line.startswith("pitchlore: ")
    assert "Unexpected" not in line
    assert line.isprintable()
    assert words[-2 if len(words) > 1 else 0].strip("-") in line
    assert any(step in line for step in ("--help`.", "Ask for 4.", "Leave it out", "Mend the option", "Play with fewer robots", "(did you mean best?)", "(did you mean paper?)"))
    assert not (tmp_path / "data" / "matches").exists()


@pytest.mark.slow
def test_exported_evaluation(call, tmp_path):
    """An exported evaluation says what it is of, and is the same when it is made again."""
    words = ("evaluate", "--policy", "human-like", "--against", "random", "--matches", "4", "--seed", "3", "--minutes", "0.05")
    first, again = tmp_path / "first", tmp_path / "again"
    _, out, _ = call(*words, "--on", "processes:1", "--json", "--export", first, "--data", tmp_path / "data")
    reported = json.loads(out)
    said = json.loads((first / "human-like-random-minutes-0-05.json").read_text())
    assert said["command"] == "pitchlore " + " ".join(words)
    assert said["seeds"] == {"first": 3, "last": 4}
    assert said["settings"]["referee"]["duration_s"] == 3.0
    assert said["note"] == reported["note"]
    assert "a second script" in said["note"]
    assert said["software"].startswith("pitchlore ")
    assert said["summary"] == {name: reported[name] for name in said["summary"]}
    matches = pl.read_csv(first / "human-like-random-minutes-0-05.matches.csv")
    assert matches.select("seed", "match", "side").rows() == [(3, 1, "home"), (3, 2, "away"), (4, 1, "home"), (4, 2, "away")]
    assert matches["goals_for"].mean() == reported["goals_for"]["value"]
    # played by others, then not at all
    for data in ("other", "data"):
        assert call(*said["command"].split()[1:], "--on", "threads:2", "--export", again, "--data", tmp_path / data)[0] == 0
        assert {file.name: file.read_bytes() for file in again.iterdir()} == {
            file.name: file.read_bytes() for file in first.iterdir()}


@pytest.mark.slow
def test_options_of_an_evaluation(call, tmp_path):
    """Results with other options stand beside the usual ones, under names and a title that say which."""
    words = ("evaluate", "--policy", "constant:044", "--against", "random", "--matches", "2", "--minutes", "0.02",
             "--on", "processes:1", "--data", tmp_path / "data", "--export", tmp_path / "export")
    assert call(*words)[0] == 0
    code, out, _ = call(*words, "--least-s", "0.4", "--no-begin-ended")
    assert code == 0
    assert "--least-s 0.4 --no-begin-ended" in " ".join(out.split())
    assert "intervals are over 1 pair." in " ".join(out.split())
    usual = "constant-044-random-minutes-0-02"
    assert {path.name for path in (tmp_path / "export").glob("*.json")} == {
        f"{usual}.json", f"{usual}-least-s-0-4-no-begin-ended.json"}
    said = json.loads((tmp_path / "export" / f"{usual}-least-s-0-4-no-begin-ended.json").read_text())
    assert said["command"].endswith("--minutes 0.02 --least-s 0.4 --no-begin-ended")


@pytest.mark.slow
def test_panel(call, tmp_path):
    """One table has a row for each opponent of the panel, all with the same seeds, and the files have safe names."""
    words = ("evaluate", "--policy", "constant:044", "--matches", "2", "--seed", "5", "--minutes", "0.02",
             "--on", "processes:1", "--data", tmp_path / "data")
    code, out, _ = call(*words, "--json", "--export", tmp_path / "export")
    said = json.loads(out)
    assert (code, said["team"]) == (0, "constant:044")
    assert [each["opponent"] for each in said["panel"]] == list(PANEL)
    assert {(each["matches"], each["seed"], each["played_now"]) for each in said["panel"]} == {(2, 5, 2)}
    assert {path.name for path in (tmp_path / "export").iterdir()} == {
        team_slug("constant:044", word, "minutes-0.02") + end for word in PANEL for end in (".json", ".matches.csv")}
    code, out, _ = call(*words)
    rows = [row for row in out.splitlines() if row.startswith("│")]
    assert (code, [row.split()[1] for row in rows]) == (0, list(PANEL))
    assert "0 matches played now, 14 before" in out
    assert "constant:044 is the same team: its home side is measured" in out
    assert call(*words, "--least-s", "0.4", "--export", tmp_path / "slow")[0] == 0
    (slow,) = (tmp_path / "slow").glob("constant-044-constant-021-*.json")
    settings = json.loads(slow.read_text())["settings"]
    assert settings["team"]["settings"]["clock"]["least_s"] == 0.4
    assert "clock" not in settings["opponent"]["settings"], "the panel plays as it is"


def test_failed_export(call, tmp_path, monkeypatch):
    """An export that fails leaves what was there."""
    words = ("evaluate", "--policy", "static", "--against", "random", "--minutes", "0.02", "--on", "processes:1",
             "--export", tmp_path / "export", "--data", tmp_path)
    assert call(*words, "--matches", "2")[0] == 0
    before = {file: file.read_bytes() for file in (tmp_path / "export").iterdir()}
    replace = os.replace

    def full(source, target):
        if str(target).endswith("static-random-minutes-0-02.json"):
            raise OSError(28, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", full)
    code, _, err = call(*words, "--matches", "4")
    assert (code, "No space left" in err) == (1, True)
    summary = tmp_path / "export" / "static-random-minutes-0-02.json"
    assert summary.read_bytes() == before[summary]
    assert set((tmp_path / "export").iterdir()) == set(before)  # nothing lies aside


@pytest.mark.parametrize("stem", ["look.4", "Looking", "x" * 49])
def test_name_of_season_settings(call, tmp_path, stem):
    """A file whose name cannot be a season's is refused before a game is played."""
    (tmp_path / f"{stem}.toml").write_text("games = 1\n")
    code, _, err = call("season", "--settings", tmp_path / f"{stem}.toml", "--data", tmp_path / "data")
    assert code == 1
    assert err.startswith(f"pitchlore: {tmp_path / stem}.toml: its name cannot name a season.")
    assert not (tmp_path / "data").exists()


@pytest.mark.slow
def test_import_run_and_train(call, tmp_path):
    """An imported match is run and trained on once, and again only with other settings."""
    recording = tmp_path / "derby.csv"
    clip(0.0, 40.0).write_csv(recording)
    data = tmp_path / "data"
    code, out, _ = call("import", recording, "--json", "--data", data)
    assert code == 0
    (name,) = json.loads(out)["made"]
    assert name.startswith("derby-")
    settings = tmp_path / "club.toml"
    paper = '[grams]\noutcome = "paper"\n[behaviours]\nselect_by = "value"\nshrink = false\n'
    settings.write_text(paper)  # 40 s have too few goals for intervals above 0
    code, out, _ = call("run", "--settings", settings, "--data", data)
    assert code == 0
    assert "knowledge version 1 (new)" in out
    assert "policy version 1 (new)" in out
    code, out, _ = call("run", "--settings", settings, "--data", data)
    assert code == 0
    assert "nothing was recomputed" in out
    receipt = data / "sequences" / f"{name}.receipt.json"
    put_receipt(receipt, receipt_at(receipt), key="0")  # as if of another version
    code, out, _ = call("run", "--settings", settings, "--data", data)
    assert code == 0
    assert "Nothing new. Outputs made again, with the same bytes: 1." in out
    settings.write_text(f"{paper}[policies]\nsweeps = 3\n")
    assert "policy version 2 trained" in call("train", "--settings", settings, "--data", data)[1]
    assert "has not learned" in call("train", "--settings", settings, "--data", data)[1]


def test_import_goes_on(call, tmp_path):
    """`import` names what it cannot take and goes on."""
    good, bad = tmp_path / "good.csv", tmp_path / "notes.txt"
    clip(0.0, 10.0).write_csv(good)
    bad.write_text("dear diary")
    code, out, err = call("import", bad, good, tmp_path / "gone.csv", "--data", tmp_path / "data")
    assert code == 1
    assert "1 imported, 0 already here, 2 not imported" in out
    assert f"failed {bad}: is not a recording" in out
    assert out.count("gone.csv") == 1
    assert "1/3" in err, "the bar counts what was imported"


def test_import_of_a_folder(call, tmp_path):
    """A folder stands for the recordings in it, not for its hidden files, maps and others; those are named once."""
    league, data = tmp_path / "league", tmp_path / "league" / "data"
    for path in ("notes.txt", "map.toml", ".git/x", "b/photo.png", "data/scout/old.json"):
        (league / path).parent.mkdir(parents=True, exist_ok=True)
        (league / path).write_text("")
    says = f"pitchlore: {league}: holds no recording that can be read by itself: b/photo.png, notes.txt. Name one"
    code, _, err = call("import", league, "--data", data)
    assert (code, err.startswith(says), list(data.glob("matches"))) == (1, True, [])
    clip(0.0, 10.0).write_csv(league / "b" / "first.csv")
    clip(0.0, 11.0).write_csv(league / "second.csv")
    code, out, _ = call("import", league, "--data", data)
    assert (code, "2 imported, 0 already here, 0 not imported" in out) == (0, True)
    assert f"{league}: 2 recordings; no recordings, and passed over: b/photo.png, notes.txt.\n" in out
    assert not Store(data).quarantined()
    for name, leads in (("gone.csv", "nothing"), ("round.csv", "round.csv"), ("linked", league / "b")):
        (league / name).symlink_to(leads)
    os.mkfifo(league / "pipe.csv")
    code, out, _ = call("import", league, "--data", data)
    assert (code, "0 imported, 2 already here, 4 not imported" in out) == (1, True)
    assert [f"failed {league / name}: " in out for name in ("gone.csv", "round.csv", "linked", "pipe.csv")] == [True] * 4
    close(league / "b")
    with as_user():
        code, _, err = call("import", league, "--data", data)
    assert (code, err) == (1, f"pitchlore: {league}/b: cannot be read (Permission denied). Make it a folder that you may read.\n")


def test_import_shows_the_flaws(call, tmp_path):
    """`import` shows the flaws of a recording."""
    lossy = clip(0.0, 20.0)
    lossy.filter(~pl.col("t").is_between(5.0, 8.0)).write_csv(tmp_path / "lossy.csv")
    code, out, _ = call("import", tmp_path / "lossy.csv", "--data", tmp_path / "data")
    (receipt,) = Store(tmp_path / "data").receipts("matches")
    assert code == 0
    assert receipt.details["flaws"] == {"direction inferred": 681}
    assert "direction inferred" in out


def test_run_shows_quarantine(call, tmp_path):
    """`run` shows what is still in quarantine, apart from what it puts there itself."""
    bad = tmp_path / "notes.txt"
    bad.write_text("dear diary")
    data = tmp_path / "data"
    call("import", bad, "--data", data)
    (record,) = Store(data).quarantined()
    assert call("run", bad, "--data", data)[2].startswith(
        f"pitchlore: `pitchlore run` takes no files: `pitchlore import {bad}` first. ")
    assert call("run", "x" * 300, "--data", data)[2].startswith("pitchlore: `pitchlore run` does not take the word xxx")
    code, out, _ = call("run", "--data", data)
    assert code == 0
    assert f"still in quarantine\nmatches {record.name}: {record.reason}\n" in out
    (data / "inbox").mkdir()
    bad.rename(data / "inbox" / "notes.txt")
    code, out, _ = call("run", "--data", data)
    assert code == 1
    assert f"failed {data / 'inbox' / 'notes.txt'}" in out.replace("matches ", "")
    assert "still in quarantine" not in out


@pytest.mark.parametrize(("text", "said"), [
    (None, "cannot be read (No such file or directory)."),
    ("policies = 3", "policies"),
    ("[policies\n", "is not TOML"),
])
def test_bad_settings(call, tmp_path, text, said):
    """The error of bad settings names the file and what is wrong in it."""
    path = tmp_path / "s.toml"
    if text is not None:
        path.write_text(text)
    code, _, err = call("run", "--settings", path, "--data", tmp_path)
    assert code == 1
    assert said in err
    assert err.startswith(f"pitchlore: {path}: ")


def test_no_traceback_without_debug(call, finished, monkeypatch):
    monkeypatch.setattr(Store, "versions", lambda *_: 1 / 0)
    code, _, err = call("kb", "list", "--data", finished)
    assert code == 1
    assert err == ("pitchlore: Unexpected ZeroDivisionError: division by zero. "
                   "Run again with --debug and report what it says.\n")
    assert "Traceback" in call("kb", "list", "--data", finished, "--debug")[2]
