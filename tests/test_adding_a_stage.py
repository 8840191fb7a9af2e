"""Adding a stage costs its own files: docs/how-to/stage.md is followed in a copy of the tree."""

import shutil
import subprocess
import sys

import pytest
from conftest import ROOT
from support import sample_stage, trees

pytestmark = pytest.mark.slow

#: What a user of the new stage does: run, ask, look at its settings, forget.
USE = """
import runpy
import sys
from pathlib import Path
from golden import cases
from pitchlore.pipeline.engine.catalog import catalog_path, forget_match, refresh
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
name = "sprints/clip-120s.txt"
cases.CLIP = (0.0, 20.0)
path = cases.HERE / name
path.parent.mkdir()
path.write_text(str(cases.CASES[name]()))
store = Store(Path(cases._data().name))
question = "select count(*), max(top_speed) > 0.5 from sprints"
assert ask(refresh(store)[0], question).row(0) == (6, True)
assert Settings().sprints.over == 0.0
assert list(STAGES).index("sprints") == 5
match = next(store.receipts("matches")).name
forget_match(store, match)
assert not list(store.receipts("sprints"))
assert ask(refresh(store)[0], "select count(*) from sprints").item() == 0
sys.argv = ["reference", "site"]
runpy.run_path("docs/reference.py", run_name="__main__")
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the tree with the sample stage added."""
    copy = tmp_path_factory.mktemp("tree")
    environment = trees.copied(copy, "pitchlore", "pipeline", "flows", "schemas", "tests", "docs", "data/samples")
    shutil.copy(ROOT / "pyproject.toml", copy)
    return copy, sample_stage.add(copy), environment


def call(tree, environment, *words):
    done = subprocess.run([sys.executable, *words], cwd=tree, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def test_six_files(tree):
    """At most six files: schema, its import, the pure module, settings, the entry, the golden.

    The noun stands once in each list: one import of the schema's module, one field, one entry.
    """
    folder, touched, _ = tree
    assert len(touched | {sample_stage.GOLDEN}) <= 6
    assert (folder / "schemas/__init__.py").read_text().count("sprints") == 1
    assert (folder / "pipeline/settings.py").read_text().count("sprints:") == 1
    assert (folder / "pipeline/engine/stages.py").read_text().count('"sprints"') == 1


def test_it_is_a_stage_like_any_other(tree):
    """It runs, has its golden and its view, is forgotten with its match; the reference has its table and settings."""
    folder, _, environment = tree
    call(folder, environment, "-c", USE)
    assert "top_speed" in (folder / sample_stage.GOLDEN).read_text()
    assert "top_speed" in (folder / "site/tables.md").read_text()
    assert "### [sprints]" in (folder / "site/settings.md").read_text()
