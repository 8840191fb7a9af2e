"""Fast to the hand: a command loads only what it needs, and one that only looks leaves no trace."""

import json
import os
import subprocess
import sys

import pytest

from pitchlore.flows.cli import COMMANDS, GROUPS, command_line
from pitchlore.pipeline.store import Store

#: Prints for commands, one after the other, which of some packages are loaded behind it.
LOADED = """
import json, sys
from pitchlore.flows.cli import main
for words, packages in json.loads(sys.argv[1]):
    try:
        main(words)
    except SystemExit:
        pass
    print("loaded:", *sorted(set(packages.split()) & set(sys.modules)))
"""
#: What takes long to load and no command that looks needs.
HEAVY = "prefect numba matplotlib pymunk scipy skfuzzy minisom sqlalchemy pygame PIL"
TABLES = "polars pyarrow duckdb dataframely numpy"
#: Commands, and packages that neither they nor those before them need.
LIGHT = [
    (("--help",), f"{HEAVY} {TABLES} pydantic"),
    (("kb", "--help"), f"{HEAVY} {TABLES} pydantic"),
    (("run", "--help"), HEAVY),
    (("kb", "list"), HEAVY),
    (("kb", "show"), HEAVY),
    (("kb", "verify"), HEAVY),
    (("sql", "select count(*) from situations"), HEAVY),
    (("quarantine",), HEAVY),
    (("commentary", "early"), HEAVY),
    (("server", "status"), HEAVY),
    (("replay", "early", "--output", "page.html"), "prefect numba matplotlib pymunk scipy"),
    # its help names the formats that the readers tell, and they load numba
    (("import", "--help"), "prefect matplotlib pymunk minisom skfuzzy sqlalchemy pygame PIL"),
]


def test_loaded_packages(finished, tmp_path, monkeypatch):
    """A command loads none of the packages that it does not need."""
    monkeypatch.setenv("PITCHLORE_DATA", str(finished))
    reported = subprocess.run([sys.executable, "-c", LOADED, json.dumps(LIGHT)], cwd=tmp_path, text=True, check=True,
                              capture_output=True).stdout
    said = [line for line in reported.splitlines() if line.startswith("loaded:")]
    assert list(zip(LIGHT, said, strict=True)) == [(each, "loaded:") for each in LIGHT]


def test_every_command_is_there():
    """The table names modules and functions: each exists, in the file that is named for the command."""
    line = command_line()
    for command in COMMANDS:
        resolved = line[command.name.split()[0]] if " " not in command.name else line[command.name.split()[0]][command.name.split()[1]]
        assert callable(resolved.default_command)
        assert command.target.partition(":")[0].rstrip("_") == command.name.split()[0]
        assert command.example.startswith(f"pitchlore {command.name}")
    assert set(GROUPS) == {command.name.split()[0] for command in COMMANDS if " " in command.name}


#: Commands that look, or that remove something: none of them has anything to do where nothing is.
LOOKING = [
    ("sql", "select 1"), ("kb", "list"), ("kb", "show"), ("kb", "diff", "1"), ("kb", "verify"), ("replay", "x"),
    ("commentary", "x"), ("runs",), ("quarantine",), ("quarantine", "--clear"), ("report",), ("forget", "x"), ("prune",), ("verify",),
    ("server", "status"), ("server", "stop"), ("scout",), ("run",), ("run", "--plan"),
]


@pytest.mark.parametrize("words", LOOKING, ids=" ".join)
def test_wrong_data_folder(call, tmp_path, words):
    """A wrong data folder is said to be one, and none is made of it: no folder, others' files, a file."""
    gone, others, file = tmp_path / "gone", tmp_path / "others", tmp_path / "match.csv"
    (others / "holidays").mkdir(parents=True)
    (others / "holidays" / "sea.jpg").write_text("blue")
    file.write_text("t,x\n")
    before = sorted(tmp_path.rglob("*"))
    otherwise = "Name the data folder with --data, or fill this one: `pitchlore import FILE`."
    for folder, said in (
        (gone, f"there is no such folder. {otherwise}"),
        (others, f"is not a data folder, or nothing has been imported into it. {otherwise}"),
        (file, "is not a folder. Name the data folder with --data."),
    ):
        assert call(*words, "--data", folder) == (1, "", f"pitchlore: {folder}: {said}\n")
    assert sorted(tmp_path.rglob("*")) == before


def in_a_file(folder):
    (folder / "match.csv").write_text("t,x\n")
    return folder / "match.csv" / "data"


def ring(folder):
    (folder / "one").symlink_to(folder / "two")
    (folder / "two").symlink_to(folder / "one")
    return folder / "one"


def dangling(folder):
    (folder / "link").symlink_to(folder / "nothing")
    return folder / "link"


@pytest.mark.parametrize(("path", "said"), [
    (lambda folder: folder / "a?mode=memory", "has a ? in its path, after which databases read options"),
    (lambda folder: folder / os.fsdecode(b"bad\xff"), "is not UTF-8"),
    (lambda folder: folder / ("x" * 300), "cannot be used (File name too long)"),
    (dangling, "is not a folder"),
    (in_a_file, "match.csv: is not a folder. Name the data folder with --data."),
    (ring, "cannot be used ("),
])
def test_unfit_data_folder(call, tmp_path, path, said):
    """A path that cannot be a data folder is refused in one line before any work, and nothing is made."""
    data = path(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    code, out, err = call("record", "--minutes", "0.01", "--data", data)
    assert (code, out) == (1, "")
    assert said in err
    assert err.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("words", [
    ("record", "--robots", "100000000"), ("record", "--minutes", "1e300"), ("record", "--seed", str(1 << 63)),
    ("evaluate", "--matches", str(10**12)), ("evaluate", "--on", "processes:10000"), ("evaluate", "--seed", str(1 << 63)),
    ("season", "--games", str(10**9)), ("paradigms", "--runs", str(10**9)), ("season", "--on", "everywhere"),
    ("replay", "x", "-o", ""), ("forget", ""), ("serve", "--cron", "* * * * * *"), ("serve", "--cron", "bad"),
], ids=" ".join)
def test_unfit_numbers_and_names(call, finished, words):
    """A number that is too large, or an empty name, is one line of error, and nothing is done."""
    code, out, err = call(*words, "--data", finished)
    assert (code, out) == (1, "")
    assert err.count("\n") == 1
    assert "Unexpected" not in err
    assert len(list(Store(finished).receipts("matches"))) == 2


@pytest.mark.parametrize("words", [("situations",), ("sql", "--tables")])
def test_no_data_needed(call, tmp_path, words):
    """A command that needs no data makes no folder."""
    code, out, err = call(*words, "--data", tmp_path / "gone")
    assert (code, err) == (0, "")
    assert len(out) > 1000
    assert not (tmp_path / "gone").exists()
