"""Paths that a user names: homes, and folders whose names libraries would take for something else."""

from importlib import import_module
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
from cyclopts import Parameter
from support.outputs import put_goal

import pitchlore
from pitchlore.flows.cli import COMMANDS
from pitchlore.flows.commands.common import UserPath
from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.atomic import aside
from pitchlore.pipeline.store.paths import named_path

ASKED = "select robot from goals"


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A home with a league, and a working directory that has a folder `~` with another, and one named like a URL."""
    home, here = tmp_path / "home", tmp_path / "here"
    monkeypatch.setenv("HOME", str(home))
    here.mkdir()
    monkeypatch.chdir(here)
    for robot, folder in enumerate((home / "league", here / "~" / "league", Path("sqlite:y/league")), 1):
        put_goal(Store(folder), "m-1", robot)
    return here


@pytest.mark.parametrize(("word", "robot"), [
    ("~/league", 1), ("./~/league", 2), ("../here/~/league", 2), ("sqlite:y/league", 3),
])
def test_homes(here, call, monkeypatch, word, robot):
    """A home is a home in options, in variables and in Python; nothing is written anywhere else."""
    assert call("sql", ASKED, "--csv", f"--data={word}")[:2] == (0, f"robot\n{robot}\n")
    monkeypatch.setenv("PITCHLORE_DATA", word)
    assert call("sql", ASKED, "--csv")[:2] == (0, f"robot\n{robot}\n")
    if not word.startswith("."):  # a path of Python's own is the same with it and without
        assert pitchlore.open(word).sql(ASKED).fetchall() == [(robot,)]
        assert refresh(Store(Path(word)))[0].exists()
    assert {str(path.relative_to(here.parent)) for path in here.parent.glob("*/*")} == {
        "home/league", "here/~", "here/sqlite:y"}


def test_no_such_home(here, call):
    """A home that there is not is one line, and a file of that name can be named."""
    assert call("import", "x.csv", "--data=~no-such-user/league") == (1, "", (
        "pitchlore: ~no-such-user/league: there is no such user's home. Write ./~no-such-user/league, if it is here.\n"))
    assert "no-such-user" not in str([*here.parent.rglob("*")])


@pytest.mark.parametrize(("path", "said"), [
    ("a\0b.html", "has a NUL in its path"), ("x" * 300, "File name too long"), ("", "a path is empty")])
def test_no_such_path(here, path, said):
    """A path that no system takes is an error of ours, whoever reads or writes it."""
    with pytest.raises(PitchloreError, match=said):
        aside(named_path(path)).__enter__()


@pytest.mark.parametrize("words", [("demo", ""), ("import", ""), ("export", "w", "--to", "csv", "-o", ""), ("run", "--settings", "")])
def test_empty_path(here, call, words):
    """An empty word, as of a variable that is not set, is no path: it would be the working directory."""
    assert call(*words) == (1, "", "pitchlore: '': a path is empty. Write . for this folder, or set the variable.\n")


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="Linux has it")
def test_file_without_a_beginning(here, call):
    """A file of the system that refuses to be read at its start is no file to import, or of settings."""
    for words in (("run", "--settings", "/proc/self/mem"), ("import", "/proc/self/mem")):
        code, out, said = call(*words)
        assert (code, "is not a regular file" in out + said, "Unexpected" in out + said) == (1, True, False)


def test_every_path_of_the_command_line():
    """Each argument and option that is a path is read as one of the user's."""
    def bare(hint):
        if hint is UserPath or any(isinstance(each, Parameter) and each.converter for each in get_args(hint)[1:]):
            return []
        if isinstance(hint, type) and hasattr(hint, "__dataclass_fields__"):
            return [path for name, each in get_type_hints(hint, include_extras=True).items() for path in bare(each)]
        return [hint] if hint is Path else [path for part in get_args(hint) for path in bare(part)]

    for command in COMMANDS:
        module, _, function = command.target.partition(":")
        hints = get_type_hints(getattr(import_module(f"pitchlore.flows.commands.{module}"), function), include_extras=True)
        assert not [name for name, hint in hints.items() if bare(hint)], command.name
