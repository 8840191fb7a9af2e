"""The reference says all that the code has, and the site holds together."""

import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from conftest import ROOT
from pydantic import BaseModel
from support.pages import reference

import pitchlore
from pitchlore.flows.cli import COMMANDS
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.schemas import PUBLIC

#: Settings that no file fills: of a team in a recipe, of the commentary, of an environment.
IN_NO_FILE = {"TeamSettings", "CommentarySettings", "LearnerSettings", "EnvSettings"}


REFERENCE = reference()
TABLES = REFERENCE.tables()


def section(page: str, heading: str) -> str:
    """Text under a heading, up to the next of its level or above."""
    level = heading.split(maxsplit=1)[0]
    lines = page.splitlines()
    start = next(i for i, line in enumerate(lines) if line == heading or line.startswith(f"{heading} {{"))
    ends = (i for i, line in enumerate(lines[start + 1:], start + 1)
            if line.startswith("#") and len(line.split()[0]) <= len(level))
    return "\n".join(lines[start:next(ends, len(lines))])


@pytest.mark.parametrize("name", PUBLIC)
def test_reference_tables(name):
    """Every column of every public table stands in the reference with its meaning and unit."""
    text = section(TABLES, f"## {name}")
    for column, definition in PUBLIC[name].columns().items():
        (row,) = [line for line in text.splitlines() if line.startswith(f"| `{column}` |")]
        assert " ".join(definition.description.replace("|", r"\|").split()) in row
        if definition.metadata:
            assert f"| {definition.metadata['unit']} |" in row
        assert ("or null" in row.split(" | ")[1]) == definition.nullable


def keys(model: type[BaseModel]) -> list[tuple[type[BaseModel], str]]:
    """The keys of a model and of the models in it, found by the text of its JSON schema."""
    schema = model.model_json_schema()
    definitions = {**schema.get("$defs", {}), model.__name__: schema}
    return [(name, key) for name, part in definitions.items() for key in part.get("properties", ())]


def test_reference_settings():
    """Every key of every settings file stands in the reference."""
    page = REFERENCE.settings()
    found = {option: keys(model) for option, model in REFERENCE.FILES.items()}
    assert sum(map(len, found.values())) > 150
    for option, pairs in found.items():
        for model, key in pairs:
            assert f"| `{key}` |" in page or f"[{key}]" in page or f".{key}]" in page, (option, model, key)


def test_reference_settings_models():
    """Every model of settings stands in the reference, if a file fills it."""
    def below(model: type[BaseModel]) -> set[type[BaseModel]]:
        return {model}.union(*(below(child) for child in model.__subclasses__()))

    page = REFERENCE.settings()
    names = {model.__name__ for model in below(Frozen) if model.__name__.endswith("Settings")} - IN_NO_FILE
    assert len(names) > 10
    assert [name for name in sorted(names) if f"{{ #{name.lower()} }}" not in page] == []


def test_reference_bounds_and_defaults():
    """A row has type, default, bounds and meaning: two of them, spelt out."""
    page = REFERENCE.settings()
    assert "| `fire_at` | `float` | `0.5` | > 0, ≤ 1 | a fuzzy condition holds from this degree on. |" in page
    assert '| `kind` | `"vsss"` or `"ssl"` or `"2d"` or `"human"` | `"vsss"` |' in section(page, "### [pitch]")


def test_reference_commands():
    """Every command stands in the reference with its help and its example, every option with its meaning."""
    page = REFERENCE.commands()
    for command in COMMANDS:
        level = "###" if " " in command.name else "##"
        text = section(page, f"{level} pitchlore {command.name}")
        assert f"Example: `{command.example}`" in text
    for option in ("--map", "--cron", "--settings", "--json", "--data"):
        assert f"`{option} " in page or f"`{option}`" in page


def test_reference_of_python():
    """Every public name stands in the reference, each method with its signature, arguments and errors."""
    page = REFERENCE.api()
    for name in set(pitchlore.__all__) - {"__version__"}:
        assert f"\n## {name}\n" in page
    read = section(page, "## read")
    assert "pitchlore.read(path: str | Path | KloppyDataset, *more: str | Path, map: str | Path | None = None" in read
    assert "settings: Settings = Settings()) -> Match" in read
    assert "| `map` | TOML file" in read
    assert "| `BadRecording` |" in read
    assert '>>> m = pitchlore.read("derby.csv")' in read
    assert "[`situations`](tables.md#situations)" in section(page, "## Match")
    assert 'pitchlore.play(home: str | LearnedTeam = "static"' in page
    assert "### Match.replay\n" in page
    assert "None" not in [line.strip() for line in page.splitlines()]


class Links(HTMLParser):
    """Where a page points to."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.found += [value for name, value in attrs if name in ("href", "src") and value]


def missing(site: Path) -> list[str]:
    """Links of all pages, and sources of their pictures and scripts, that lead to no file of the site."""
    out = []
    for page in site.rglob("*.html"):
        if page.name == "404.html":  # its links start at the server's root
            continue
        links = Links()
        links.feed(page.read_text(encoding="utf-8"))
        for link in links.found:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or not parts.path:
                continue
            target = (page.parent / unquote(parts.path)).resolve()
            if not (target / "index.html" if target.is_dir() else target).is_file():
                out.append(f"{page.relative_to(site)}: {link}")
    return out


@pytest.mark.slow
def test_site(tmp_path):
    """The site builds strictly, and every link, picture and script of every page is there."""
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("reference.py"))
    shutil.copy(ROOT / "zensical.toml", tmp_path)
    REFERENCE.write(tmp_path / "docs" / "reference")
    zensical = Path(sys.executable).with_name("zensical")
    done = subprocess.run([zensical, "build", "--clean", "--strict"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    site = tmp_path / "site"
    assert len(list(site.rglob("index.html"))) >= 18
    assert missing(site) == []
    (site / "images" / "replay.png").unlink()
    assert missing(site) != []
