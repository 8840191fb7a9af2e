"""Fast to the hand: a command loads only what it needs, and one that only looks leaves no trace."""

from __future__ import annotations

import subprocess
import sys

import pytest

from flows.cli import COMMANDS, GROUPS, command_line

#: Prints which of these packages a command has loaded.
LOADED = """
import sys
from flows.cli import main
*words, packages = sys.argv[1:]
try:
    main(words)
except SystemExit:
    pass
print("loaded:", *sorted(set(packages.split()) & set(sys.modules)))
"""
#: What takes long to load and no command that looks needs.
HEAVY = "prefect numba matplotlib pymunk scipy skfuzzy minisom sqlalchemy pygame PIL"
TABLES = "polars pyarrow duckdb dataframely numpy"


@pytest.mark.parametrize(("words", "packages"), [
    (("--help",), f"{HEAVY} {TABLES} pydantic"),
    (("kb", "--help"), f"{HEAVY} {TABLES} pydantic"),
    # its help names the formats that the readers tell, and they load numba
    (("import", "--help"), "prefect matplotlib pymunk minisom skfuzzy sqlalchemy pygame PIL"),
    (("run", "--help"), HEAVY),
    (("kb", "list"), HEAVY),
    (("kb", "show"), HEAVY),
    (("kb", "verify"), HEAVY),
    (("sql", "select count(*) from situations"), HEAVY),
    (("quarantine",), HEAVY),
    (("commentary", "early"), HEAVY),
    (("replay", "early", "--output", "page.html"), "prefect numba matplotlib pymunk scipy"),
    (("server", "status"), HEAVY),
])
def test_loaded_packages(finished, tmp_path, monkeypatch, words, packages):
    """A command loads none of the packages that it does not need."""
    monkeypatch.setenv("PITCHLORE_DATA", str(finished))
    told = subprocess.run([sys.executable, "-c", LOADED, *words, packages], cwd=tmp_path, text=True, check=True,
                          capture_output=True).stdout
    assert told.splitlines()[-1] == "loaded:"


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
    ("commentary", "x"), ("quarantine",), ("quarantine", "--clear"), ("report",), ("forget", "x"), ("prune",), ("verify",),
    ("server", "status"), ("server", "stop"),
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


@pytest.mark.parametrize("words", [("situations",), ("sql", "--tables")])
def test_no_data_needed(call, tmp_path, words):
    """A command that needs no data makes no folder."""
    code, out, err = call(*words, "--data", tmp_path / "gone")
    assert (code, err) == (0, "")
    assert len(out) > 1000
    assert not (tmp_path / "gone").exists()
