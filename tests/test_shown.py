"""Outputs in README and in docs are those that their commands print now; `make pages` writes them anew."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import chdir

import pytest
from support.shown import FOLDERS, Folder, blocks, commands, pages, shown, standing, there


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Callable[[str], Folder]:
    """The folders that pages show outputs of, each made once."""
    made: dict[str, Folder] = {}

    def of(name: str) -> Folder:
        if not there(name):
            pytest.skip("its recording is not beside this checkout (it may not be copied into the project)")
        if name not in made:
            made[name] = Folder.made(name, tmp_path_factory.mktemp(name))
        return made[name]

    return of


@pytest.mark.slow
@pytest.mark.parametrize("name", FOLDERS)
def test_shown(name, folder):
    """Every output of README and of docs that names this folder is the output of its commands."""
    outputs = [one for page in pages() for one in shown(page) if one.folder == name]
    assert outputs
    for one in outputs:
        assert standing(one) == folder(name).output(one), f"{one.place}: `make pages`, and review the diff"


PYTHON = {page.name: page for page in pages() if blocks(page, "python")}


@pytest.mark.slow
@pytest.mark.parametrize("name", PYTHON)
def test_python(name, folder):
    """The Python of a page runs, one block after the other, beside the tutorial's data folder."""
    known: dict[str, object] = {}
    with chdir(folder("derby").root):
        for line, text in blocks(PYTHON[name], "python"):
            exec(compile("\n" * line + text, PYTHON[name], "exec"), known)


@pytest.mark.slow
def test_questions(folder):
    """Every question in SQL that a page shows has an answer, if only an empty one."""
    questions = [text for page in pages() for _, text in blocks(page, "sql")]
    assert len(questions) > 4
    for question in questions:
        assert folder("derby").run(*commands("sql", question))
