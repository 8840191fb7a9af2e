"""Pages of the tree: every relative link leads somewhere, and the index of decisions has all of them."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from urllib.parse import unquote

import pytest
from conftest import ROOT
from support.pages import tracked

LINK = re.compile(r"\[[^\]]*\]\((?!https?:|mailto:)([^)\s]*)\)")
HEADING = re.compile(r"^(#+) (.+?)(?: \{ #([\w-]+) \})?$")


def prose(text: str) -> Iterator[tuple[int, str]]:
    """Lines outside of fenced blocks, with their numbers from 1."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, line


@cache
def reference() -> dict[str, str]:
    """Pages of the reference, as ``make docs`` writes them: text by name."""
    spec = importlib.util.spec_from_file_location("reference", ROOT / "docs" / "reference.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return {name: page() for name, page in module.PAGES.items()}


def anchors(text: str) -> set[str]:
    """Anchors of a page's headings, as GitHub and the site make them."""
    found = set()
    for _, line in prose(text):
        if heading := HEADING.match(line):
            _, title, own = heading.groups()
            plain = re.sub(r"[^\w\s-]", "", title.lower(), flags=re.ASCII).strip()
            found.add(own or re.sub(r"\s", "-", plain))
            found.add(re.sub(r"[-\s]+", "-", plain))
    return found


def broken(root: Path, page: Path) -> list[str]:
    """Relative links of a page to no file, or to no heading; those of the reference are headings of the site's."""
    made = {root / "docs" / "reference" / name: text for name, text in reference().items()}
    out = []
    for number, line in prose(page.read_text(encoding="utf-8")):
        for link in LINK.findall(line):
            path, _, anchor = unquote(link).partition("#")
            target = (page.parent / path).resolve() if path else page
            if not target.exists():
                out.append(f"{page.relative_to(root)}:{number}: no file {link}")
            elif (anchor and target.suffix == ".md"
                  and anchor not in anchors(made.get(target) or target.read_text(encoding="utf-8"))):
                out.append(f"{page.relative_to(root)}:{number}: no heading {link}")
    return out


def test_links():
    """Every relative link of every Markdown page leads to a file of the checkout, and to a heading of it."""
    pages = tracked("*.md")
    assert len(pages) > 60
    lost = [line for page in pages for line in broken(ROOT, page)]
    assert not lost, "\n".join(["", *lost])


def test_links_notice(tmp_path):
    """A lost file, a lost heading: each is named with page and line."""
    (tmp_path / "a.md").write_text("# A\n\n## One: two\n\n[b](b.md) [one](#one-two)\n[c](a.md#three)\n", encoding="utf-8")
    assert broken(tmp_path, tmp_path / "a.md") == ["a.md:5: no file b.md", "a.md:6: no heading a.md#three"]


SUBJECTS = sorted((ROOT / "docs" / "decisions").glob("*.md"))
ENTRY = re.compile(r"\| \[(.+)\]\(docs/decisions/(\w+)\.md#[\w-]+\) \| (\d{4}-\d\d-\d\d) \| \S.* \|.*\|")


def entries(page: Path) -> list[tuple[str, str, str]]:
    """Headings of a page's decisions that stand, with the page's name and the day each was decided first."""
    current = re.split(r"^## Superseded$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)[0]
    out = []
    for part in re.split(r"^## ", current, flags=re.MULTILINE)[1:]:
        title, body = part.split("\n", 1)
        day = re.search(r"\*\*(?:Decided|Not reached)\*\* \((\d{4}-\d\d-\d\d)", body)
        assert day, f"docs/decisions/{page.name}: {title}: no day"
        out.append((title, page.stem, day.group(1)))
    return out


@pytest.mark.parametrize("page", SUBJECTS, ids=lambda page: page.stem)
def test_decisions_index(page):
    """DECISIONS.md has a line for each decision that stands: its heading, page and day, in the page's order."""
    lines = (ROOT / "DECISIONS.md").read_text(encoding="utf-8").splitlines()
    rows = [row for line in lines if f"(docs/decisions/{page.name}#" in line for row in ENTRY.findall(line)]
    assert [(title, name, day) for title, name, day in rows] == entries(page)


def test_decisions_subjects():
    """Every page of decisions is a subject of the index, and of the site."""
    index = (ROOT / "DECISIONS.md").read_text(encoding="utf-8")
    site = (ROOT / "zensical.toml").read_text(encoding="utf-8")
    assert [page.name for page in SUBJECTS if f"](docs/decisions/{page.name})\n" not in index] == []
    assert [page.name for page in SUBJECTS if f'"decisions/{page.name}"' not in site] == []
