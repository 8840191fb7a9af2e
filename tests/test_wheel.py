"""The wheel works away from the checkout: it has all its files, and runs in an empty folder."""

from __future__ import annotations

import json
import os
import pwd
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest
from conftest import ROOT, clip
from support import trees
from support.processes import COMMAND_LINE, COMMAND_LINES

import pitchlore
from pitchlore import pipeline

PACKAGES = ("pipeline", "flows", "schemas")  # of pitchlore
DATA = (".html", ".js", ".msg", ".toml", ".csv", ".typed")
#: A package of somebody else that has one of our folders' names; it notes that it was imported.
OTHER = """
import pathlib
OWNER = {owner!r}
pathlib.Path(__file__).with_name("imported").touch()
"""
#: Owners of the packages of our folders' names that Python finds.
OWNERS = "import flows, pipeline, schemas; print(flows.OWNER, pipeline.OWNER, schemas.OWNER)"
#: Every cell of the notebooks, where the command put them, but of the one that plays for long.
CELLS = """
import json, os, pathlib
os.chdir("notebooks")
for path in sorted(pathlib.Path().glob("[!3]*.ipynb")):
    names = {}
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    print(path)
"""
STUDIES = "import pitchlore; print(*sorted(pitchlore.studies().rglob('*.csv')))"
#: A season that takes seconds.
SEASON = 'base = "paper"\ngames = 1\n[referee]\nduration_s = 5\n'


@pytest.fixture(scope="session")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", folder],
                   cwd=ROOT, check=True, capture_output=True)
    (found,) = folder.glob("*.whl")
    return found


class Installed:
    """A fresh environment with the wheel in it, and a folder to work in; both have others' packages of our names."""

    def __init__(self, bin_: Path, folder: Path) -> None:
        self.bin, self.folder = bin_, folder

    def run(self, *command: str) -> str:
        """Standard output of a command; it must succeed."""
        environment = {name: value for name, value in os.environ.items()
                       if name not in ("PYTHONPATH", "PYTHONSAFEPATH", "PITCHLORE_DATA", "NUMBA_CACHE_DIR", "PREFECT_API_URL")}
        done = subprocess.run([self.bin / command[0], *command[1:]], cwd=self.folder, env=environment,
                              capture_output=True, text=True)
        assert done.returncode == 0, f"{command}:\n{done.stdout}\n{done.stderr}"
        return done.stdout


@pytest.fixture(scope="session")
def installed(wheel, tmp_path_factory) -> Installed:
    place, folder = tmp_path_factory.mktemp("fresh"), tmp_path_factory.mktemp("empty")
    venv.create(place, symlinks=True)
    (site,) = place.glob("lib/python*/site-packages")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    trees.lend(site)
    # the dependencies are those of this environment; a plain path does not bring its editable checkout along
    own = [path for path in sys.path if Path(path).name == "site-packages"]
    (site / "dependencies.pth").write_text("\n".join(own), encoding="utf-8")
    script = place / "bin" / "pitchlore"
    script.write_text(f"#!{place}/bin/python{COMMAND_LINE}\n", encoding="utf-8")
    script.chmod(0o755)
    for where, owner in ((site, "environment"), (folder, "folder")):
        for name in PACKAGES:
            (where / name).mkdir()
            (where / name / "__init__.py").write_text(OTHER.format(owner=owner), encoding="utf-8")
    return Installed(place / "bin", folder)


def imported(folder: Path) -> set[str]:
    """Names of others' packages under a folder that were imported."""
    return {path.parent.name for path in folder.rglob("imported")}


@pytest.mark.slow
def test_without_links(tmp_path):
    """A checkout without links, as Windows may make it, has files that name their targets: it runs all the same."""
    for folder in ("pitchlore", *PACKAGES):
        shutil.copytree(ROOT / folder, tmp_path / folder, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    for name in PACKAGES:
        link = tmp_path / "pitchlore" / name
        target = str(link.readlink())
        link.unlink()
        link.write_text(target, encoding="utf-8")
    code = "from pitchlore import pipeline, flows, schemas; print(pipeline.__file__)"
    for words, said in ((["-c", code], str(tmp_path / "pipeline" / "__init__.py")),
                        (["-c", COMMAND_LINE, "--version"], pitchlore.__version__)):
        done = subprocess.run([sys.executable, *words], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)},
                              capture_output=True, text=True, check=True)
        assert done.stdout.strip() == said


@pytest.mark.slow
def test_files(wheel):
    """Every page, script, message, table and settings file of the packages is in the wheel, and the licence."""
    held = set(zipfile.ZipFile(wheel).namelist())
    wanted = {f"pitchlore/{path.relative_to(ROOT).as_posix()}" for package in PACKAGES for path in (ROOT / package).rglob("*")
              if path.suffix in DATA } | {"pitchlore/py.typed"}
    assert {Path(name).suffix for name in wanted} == set(DATA)
    assert wanted <= held
    assert {f"pitchlore/shipped/notebooks/{path.name}" for path in (ROOT / "notebooks").glob("*.ipynb")} <= held
    assert {name.split("/")[0] for name in held} == {"pitchlore", f"pitchlore-{pitchlore.__version__}.dist-info"}
    licences = f"pitchlore-{pitchlore.__version__}.dist-info/licenses"
    assert {f"{licences}/LICENSE", f"{licences}/NOTICE"} <= held
    assert not [name for name in held if "__pycache__" in name or name.endswith((".png", ".jsonl"))]
    assert {Path(name).suffix for name in held if name.startswith("pitchlore/shipped/studies/")} == {".csv"}


@pytest.mark.slow
def test_away_from_the_checkout(installed):
    """Run, sql, replay, season and the notebooks work from the wheel, beside others' packages of our folders' names."""
    where = installed.run("python", "-c", "import pitchlore; print(pitchlore.__file__)")
    assert not Path(where).is_relative_to(ROOT)
    assert Path(where).is_relative_to(installed.bin.parent)
    (installed.folder / "data" / "inbox").mkdir(parents=True)
    clip(0.0, 40.0).write_parquet(installed.folder / "data" / "inbox" / "derby.parquet")
    (installed.folder / "tiny.toml").write_text(SEASON, encoding="utf-8")

    assert installed.run("pitchlore", "--version").strip() == pitchlore.__version__
    report, asked, _, played, _, rest = installed.run("python", "-c", COMMAND_LINES + CELLS + STUDIES, json.dumps([
        ["run", "--json"], ["sql", "--json", "select count(*) as n from situations"], ["replay", "derby"],
        ["season", "--settings", "tiny.toml", "--opponent", "static", "--json"], ["notebooks", "--no-open"]])).split("\0")
    assert json.loads(report)["knowledge"] == 1
    assert json.loads(asked)[0]["n"] > 50
    (page,) = (installed.folder / "data" / "replays").glob("*.html")
    assert "<script" in page.read_text(encoding="utf-8")
    assert [row["games"] for row in json.loads(played)["seasons"]] == [1]

    copied = {path.name for path in (installed.folder / "notebooks").glob("*.ipynb")}
    assert copied == {path.name for path in (ROOT / "notebooks").glob("*.ipynb")}
    *executed, found = (line.split() for line in rest.splitlines())
    assert executed == [[name] for name in sorted(copied) if name[0] != "3"]
    assert len(found) > 15
    assert all(Path(path).is_relative_to(installed.bin.parent) for path in found)

    assert imported(installed.folder) == imported(installed.bin.parent) == set()
    assert installed.run("python", "-c", OWNERS).split() == ["folder"] * 3
    assert installed.run("python", "-I", "-c", OWNERS).split() == ["environment"] * 3
    assert imported(installed.folder) == imported(installed.bin.parent) == set(PACKAGES)


def test_numba_cache(monkeypatch, tmp_path):
    """numba's cache lies beside the code, or in the user's cache where the code is read-only."""
    code = Path(pipeline.__file__).parent
    assert pipeline._cache() == code / "__pycache__"
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert pipeline._cache() == tmp_path / "pitchlore"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert pipeline._cache() == tmp_path / ".cache" / "pitchlore"
    monkeypatch.delenv("HOME")
    monkeypatch.setattr(pwd, "getpwuid", {}.__getitem__)  # a user without a home, as of a container
    assert pipeline._cache() == code / "__pycache__"
