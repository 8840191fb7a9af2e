"""A release says the same everywhere: Python versions, licence, version, lock."""

from __future__ import annotations

import re
import tomllib

import pytest
from conftest import ROOT

from pitchlore import pipeline

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def pythons() -> list[str]:
    """Minor versions that the Makefile accepts."""
    return re.findall(r"python(3\.\d+)", re.search(r"^PYTHONS := (.*)$", text("Makefile"), re.MULTILINE)[1])


def test_pythons():
    """pyproject.toml, the Makefile, the workflow and the lock name the same versions of Python."""
    versions = pythons()
    last = int(versions[-1].split(".")[1])
    project = PROJECT["project"]
    assert versions == [f"3.{minor}" for minor in range(11, last + 1)]
    assert project["requires-python"] == f">={versions[0]},<3.{last + 1}"
    named = [c.rsplit(" ", 1)[1] for c in project["classifiers"] if re.search(r"Python :: 3\.\d", c)]
    assert named == versions
    matrix = re.search(r"^ +python: \[(.*)\]$", text(".github/workflows/ci.yml"), re.MULTILINE)[1]
    assert re.findall(r'"(.*?)"', matrix) == versions
    assert re.findall(r"^ +(3\.\d+)$", text(".github/workflows/ci.yml"), re.MULTILINE) == versions
    assert f"python_version < '3.{last + 1}'" in PROJECT["tool"]["uv"]["environments"][0]


def pins() -> dict[str, list[str]]:
    """Package to its lines in the lock: the pin and its hashes."""
    found: dict[str, list[str]] = {}
    for block in re.split(r"\n(?=[a-z0-9])", LOCK.strip()):
        found.setdefault(re.match(r"[a-z0-9._-]+", block)[0], []).append(block)
    return found


def test_lock_has_hashes_and_no_hosts():
    """Every package has one version, for all Pythons, and hashes; no registry is named."""
    assert len(pins()) > 100
    for name, blocks in pins().items():
        assert len(blocks) == 1, f"{name} has several versions, so that Pythons may differ in bytes"
        assert re.match(rf"{re.escape(name)}(\[.*?\])?==\S+", blocks[0])
        assert "--hash=sha256:" in blocks[0]
    assert "://" not in LOCK
    assert "index-url" not in LOCK


@pytest.mark.parametrize(("name", "below"), [("fastapi", (0, 140)), ("sqlalchemy", (2, 1))])
def test_lock_holds_what_prefect_needs(name, below):
    """Prefect neither serves nor starts with later versions of these (docs/decisions/packages.md)."""
    version = re.match(r"[^=]*==(\d+)\.(\d+)", pins()[name][0])
    assert tuple(map(int, version.groups())) < below


@pytest.mark.parametrize("group", ["dependencies", "notebooks", "play", "dev", "docs"])
def test_lock_has_what_the_project_names(group):
    """Every dependency, extra and group is in the lock."""
    project = PROJECT["project"]
    wanted = {"dependencies": project["dependencies"], **project["optional-dependencies"],
              **PROJECT["dependency-groups"]}[group]
    names = [re.match(r"[A-Za-z0-9._-]+", line)[0].lower() for line in wanted]
    assert [name for name in names if name not in pins()] == []


def test_versions_agree():
    """The package, the citation and the project have one version and one licence."""
    citation = text("CITATION.cff")
    version = PROJECT["project"]["version"]
    assert pipeline.__version__ == version
    assert f"\nversion: {version}\n" in citation
    assert f"\nlicense: {PROJECT['project']['license']}\n" in citation
    assert "Apache License" in text("LICENSE")
    assert "Version 2.0, January 2004" in text("LICENSE")


def test_ci_calls_make():
    """The workflow, the hooks and .ci/run call targets of the Makefile, which hold the commands."""
    targets = set(re.findall(r"^([a-z]+):", text("Makefile"), re.MULTILINE))
    called = [target for name in (".github/workflows/ci.yml", ".pre-commit-config.yaml", ".ci/run")
              for words in re.findall(r"(?:run: |entry: |^)make ([a-z]+(?: [a-z]+)*)", text(name), re.MULTILINE)
              for target in words.split()]
    assert set(called) == {"browser", "test", "docs", "pythons", "lint", "quick"}
    assert set(called) <= targets
