"""A release says the same everywhere: Python versions, licence, version, lock."""

import ast
import re
import sys
import tomllib
from importlib.metadata import packages_distributions

import pytest
from conftest import ROOT

import pitchlore

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LOCKS = ("requirements.lock", "requirements-dev.lock")


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


def pins(lock: str) -> dict[str, list[str]]:
    """Package to its lines in a lock: the pin and its hashes."""
    found: dict[str, list[str]] = {}
    for block in re.split(r"\n(?=[a-z0-9])", text(lock).strip()):
        found.setdefault(re.match(r"[a-z0-9._-]+", block)[0], []).append(block)
    return found


def named(group: str) -> list[str]:
    """Names of the packages of the dependencies, an extra or a group."""
    wanted = {"dependencies": PROJECT["project"]["dependencies"], **PROJECT["project"]["optional-dependencies"],
              **PROJECT["dependency-groups"]}[group]
    return [re.match(r"[A-Za-z0-9._-]+", line)[0].lower() for line in wanted if isinstance(line, str)]


def version(blocks: list[str]) -> str:
    return re.match(r"[^=]*==(\S+)", blocks[0])[1]


@pytest.mark.parametrize("lock", LOCKS)
def test_lock_has_hashes_and_no_hosts(lock):
    """Every package has one version, for all Pythons, and hashes; no registry is named."""
    for name, blocks in pins(lock).items():
        assert len(blocks) == 1, f"{name} has several versions, so that Pythons may differ in bytes"
        assert re.match(rf"{re.escape(name)}(\[.*?\])?==\S+", blocks[0])
        assert "--hash=sha256:" in blocks[0]
    assert "://" not in text(lock)
    assert "index-url" not in text(lock)


def test_product_is_small():
    """`make demo` installs at most 140 packages, none of an extra or of the tests; their versions are the tests'."""
    product, everything = map(pins, LOCKS)
    assert len(product) <= 138  # beside Pitchlore and pip
    assert {name: version(found) for name, found in product.items()}.items() <= {
        name: version(found) for name, found in everything.items()}.items()
    extras = [*PROJECT["project"]["optional-dependencies"], "dev", "docs"]
    assert [name for group in extras for name in named(group) if name in product] == []


#: Dependencies that no file imports: bounds of what Prefect brings, and what scikit-fuzzy does not declare.
UNSEEN = {"fastapi", "packaging", "sqlalchemy"}


def imported() -> set[str]:
    """Names of the packages that the code imports, the standard library's and its own left out."""
    found = set()
    for path in (path for package in ("pipeline", "flows", "schemas") for path in (ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_bytes())):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else (
                [node.module] if isinstance(node, ast.ImportFrom) and node.level == 0 else [])
            found |= {module.split(".")[0] for module in modules}
    return found - sys.stdlib_module_names - {"pitchlore", "__future__"}


def test_dependencies_are_those_imported():
    """Imported packages are declared, as a dependency or an extra; declared ones are imported."""
    packages = {module: {name.lower().replace("_", "-") for name in names}
                for module, names in packages_distributions().items()}
    extras = {name for group in PROJECT["project"]["optional-dependencies"] for name in named(group)}
    assert {module for module in imported() if not packages[module] & {*named("dependencies"), *extras}} == set()
    used = set().union(*(packages[module] for module in imported()))
    assert set(named("dependencies")) - used == UNSEEN


@pytest.mark.parametrize(("name", "below"), [("fastapi", (0, 140)), ("sqlalchemy", (2, 1))])
def test_lock_holds_what_prefect_needs(name, below):
    """Prefect neither serves nor starts with later versions of these (docs/decisions/packages.md)."""
    assert tuple(map(int, version(pins("requirements.lock")[name]).split(".")[:2])) < below


@pytest.mark.parametrize("group", ["dependencies", "build", *PROJECT["project"]["optional-dependencies"], "dev", "docs"])
def test_lock_has_what_the_project_names(group):
    """Every dependency, extra and group is in its lock."""
    lock = pins("requirements.lock" if group in ("dependencies", "build") else "requirements-dev.lock")
    assert [name for name in named(group) if name not in lock] == []


def test_versions_agree():
    """The package, the citation and the project have one version and one licence."""
    citation = text("CITATION.cff")
    version = PROJECT["project"]["version"]
    assert pitchlore.__version__ == version
    assert f"\nversion: {version}\n" in citation
    assert f"\nlicense: {PROJECT['project']['license']}\n" in citation
    newest = re.search(r"^## (.*)$", text("CHANGELOG.md"), re.MULTILINE)[1]
    assert re.fullmatch(rf"{re.escape(version)} \(20\d\d-\d\d-\d\d\)", newest)
    assert "Apache License" in text("LICENSE")
    assert "Version 2.0, January 2004" in text("LICENSE")


def test_extras_are_in_the_page():
    """docs/how-to/install.md has every extra with its size."""
    page = text("docs/how-to/install.md")
    rows = dict(re.findall(r"^\| `(\w+)` \| [^|]+ \| (\d+) MB \|", page, re.MULTILINE))
    assert list(rows) == sorted(PROJECT["project"]["optional-dependencies"])


def test_ci_calls_make():
    """The workflow, the hooks and .ci/run call targets of the Makefile, which hold the commands."""
    targets = set(re.findall(r"^([a-z]+):", text("Makefile"), re.MULTILINE))
    workflows = (".github/workflows/ci.yml", ".github/workflows/release.yml")
    called = [target for name in (*workflows, ".pre-commit-config.yaml", ".ci/run")
              for words in re.findall(r"(?:run: |entry: |^)make ([a-z]+(?: [a-z]+)*)", text(name), re.MULTILINE)
              for target in words.split()]
    called += re.search(r"^ +target: \[(.*)\]$", text(workflows[0]), re.MULTILINE)[1].split(", ")
    assert set(called) == {"browser", "test", "docs", "pythons", "lint", "quick", "oldest", "newest", "dist"}
    assert set(called) <= targets


def test_release_is_published_without_a_password():
    """A tag builds the wheel, and publishes it by the workflow's own identity."""
    workflow = text(".github/workflows/release.yml")
    assert 'tags: ["v*"]' in workflow
    assert "TAG=${{ github.ref_name }}" in workflow
    assert "id-token: write" in workflow
    assert "password" not in workflow.split("name: Release")[1]
    assert "secrets." not in workflow
