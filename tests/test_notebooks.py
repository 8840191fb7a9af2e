"""The notebooks run from top to bottom, and show what they are committed with."""

import errno
import re
import shutil
import sys

import polars as pl
import pytest
from conftest import SAMPLE, run
from matplotlib import pyplot
from support.notebooks import NOTEBOOKS, executed, read, shown
from support.recordings import RCSS, beside


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """A data folder after a run on the sample recording."""
    data = tmp_path_factory.mktemp("sample") / "data"
    (data / "inbox").mkdir(parents=True)
    shutil.copy(SAMPLE, data / "inbox")
    assert run(data).failures == {}
    return data


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_not_stale(path, sample):
    """Run again, every text is the committed one, and every picture is there."""
    assert shown(executed(path, sample)) == shown(read(path)), "run `make notebooks` and review the diff"


@pytest.mark.slow
def test_notebooks_of_another_league(tmp_path, monkeypatch):
    """The cells of the notebooks run on a match of 2D, too, whose policy copies no team; here without a kernel."""
    (tmp_path / "inbox").mkdir()
    shutil.copy(beside(RCSS), tmp_path / "inbox")
    assert run(tmp_path).failures == {}
    monkeypatch.setenv("PITCHLORE_DATA", str(tmp_path))
    for path in NOTEBOOKS[:-1]:  # the last one reads no data folder
        names: dict[str, object] = {}
        with pl.Config():
            for cell in read(path).cells:
                if cell.cell_type == "code":
                    exec(cell.source, names)
        assert pyplot.get_fignums(), path
        pyplot.close("all")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_committed_with_outputs(path):
    """Every notebook was run from top to bottom, shows tables and a picture, no warning, and is small."""
    notebook = read(path)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    outputs = [output for cell in shown(notebook) for output in cell]
    assert len(outputs) > 5
    assert "image" in outputs
    assert all(output.get("name") != "stderr" for cell in code for output in cell.outputs)
    assert path.stat().st_size < 400_000


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_uses_the_face(path):
    """A notebook imports pitchlore, and nothing behind it."""
    source = "\n".join(cell.source for cell in read(path).cells if cell.cell_type == "code")
    assert "import pitchlore\n" in source
    assert not re.search(r"(from|import) pitchlore\.", source)


def test_copies(tmp_path, call):
    """The command copies the notebooks that are not there and leaves those that are."""
    kept = tmp_path / NOTEBOOKS[0].name
    kept.write_text("mine", encoding="utf-8")
    code, out, _ = call("notebooks", tmp_path, "--no-open")
    assert code == 0
    assert kept.read_text(encoding="utf-8") == "mine"
    for path in NOTEBOOKS[1:]:
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()
    assert kept.name not in out


def test_half_a_copy(tmp_path, monkeypatch, call):
    """A notebook that could not be copied is not there, and the next call copies it."""

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("os.replace", full)
        code, _, err = call("notebooks", tmp_path, "--no-open")
    assert (code, "cannot be written (No space left on device)" in err) == (1, True)
    assert list(tmp_path.iterdir()) == []
    assert call("notebooks", tmp_path, "--no-open")[0] == 0
    assert len(list(tmp_path.iterdir())) == len(NOTEBOOKS)


def test_file_as_folder(tmp_path, call):
    (tmp_path / "file").touch()
    code, _, err = call("notebooks", tmp_path / "file", "--no-open")
    assert (code, "is not a folder" in err) == (1, True)


def test_opens(tmp_path, monkeypatch, call):
    """The command hands over to JupyterLab, with the data folder in the environment."""
    asked = {}
    monkeypatch.setattr("pitchlore.flows.commands.notebooks.find_spec", lambda name: name)
    monkeypatch.setattr("os.execve", lambda program, command, environment: asked.update(
        program=program, command=command, data=environment["PITCHLORE_DATA"]))
    call("notebooks", tmp_path / "nb", "--data", tmp_path / "league")
    assert asked == {"program": sys.executable, "data": str(tmp_path / "league"),
                     "command": [sys.executable, "-P", "-m", "jupyterlab", str(tmp_path / "nb")]}


def test_without_jupyterlab(tmp_path, monkeypatch, call):
    """Without JupyterLab the command says in one line what to install."""
    monkeypatch.setattr("pitchlore.flows.commands.notebooks.find_spec", lambda name: None)
    code, _, err = call("notebooks", tmp_path, "--data", tmp_path)
    assert (code, "Install pitchlore[notebooks]" in err) == (1, True)
