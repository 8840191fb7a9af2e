"""Pages of the tree: every relative link leads somewhere, and the index of decisions has all of them."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from urllib.parse import unquote

import pytest
from conftest import ROOT
from cyclopts import CycloptsError, MissingArgumentError
from support.pages import reference, tracked
from support.shown import commands, fences

from pitchlore.flows.cli import command_line

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
def made_pages() -> dict[str, str]:
    """Pages of the reference, as ``make docs`` writes them: text by name."""
    return {name: page() for name, page in reference().PAGES.items()}


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


def broken(page: Path) -> list[str]:
    """Relative links of a page to no file, or to no heading; those of the reference are headings of the site's."""
    made = {ROOT / "docs" / "reference" / name: text for name, text in made_pages().items()}
    out = []
    for number, line in prose(page.read_text(encoding="utf-8")):
        for link in LINK.findall(line):
            path, _, anchor = unquote(link).partition("#")
            target = (page.parent / path).resolve() if path else page
            if not target.exists():
                out.append(f"{page.relative_to(ROOT)}:{number}: no file {link}")
            elif (anchor and target.suffix == ".md"
                  and anchor not in anchors(made.get(target) or target.read_text(encoding="utf-8"))):
                out.append(f"{page.relative_to(ROOT)}:{number}: no heading {link}")
    return out


def test_links():
    """Every relative link of every Markdown page leads to a file of the checkout, and to a heading of it."""
    pages = tracked("*.md")
    assert len(pages) > 60
    lost = [line for page in pages for line in broken(page)]
    assert not lost, "\n".join(["", *lost])


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


CODE = re.compile(r"(?<!`)`(pitchlore [^`]+)`(?!`)")
#: Words that stand for others.
STAND_IN = re.compile(r"[A-Z]{2,}|.*…|\[.*")


def command_lines(page: Path) -> Iterator[tuple[int, tuple[str, ...]]]:
    """Lines and words of all commands of ours that a page shows: in fences, indented, and in running text."""
    lines = page.read_text(encoding="utf-8").splitlines()
    outside = set(range(len(lines)))
    for fence in fences(lines):
        outside -= set(range(fence.start - 1, fence.end + 1))
        if fence.language == "console":
            yield from ((fence.start, words) for words in commands("console", "\n".join(lines[fence.start:fence.end])))
    for number in sorted(outside):
        given = [lines[number].strip()] if lines[number].startswith("    pitchlore ") else CODE.findall(lines[number])
        yield from ((number + 1, words) for one in given for words in commands("console", one))


def refused(page: Path) -> list[str]:
    """Command lines of a page that the command line refuses; a mention may leave out an argument."""
    app, out = command_line(), []
    for line, words in command_lines(page):
        given = [word for i, word in enumerate(words) if "=" not in word or "pitchlore" in words[:i]]
        if given[:1] != ["pitchlore"] or any(STAND_IN.fullmatch(word) for word in given):
            continue
        try:
            app.parse_args(given[1:], exit_on_error=False, print_error=False)
        except MissingArgumentError:
            continue
        except CycloptsError as why:
            out.append(f"{page.relative_to(ROOT)}:{line}: {' '.join(str(why).split())}")
    return out


@pytest.mark.slow
def test_command_lines():
    """The command line takes every command that a page shows."""
    pages = [page for page in tracked("*.md") if page.name != "CHANGELOG.md"]
    assert sum(1 for page in pages for _ in command_lines(page)) > 150
    lost = [line for page in pages for line in refused(page)]
    assert not lost, "\n".join(["", *lost])
