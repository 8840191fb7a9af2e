"""Outputs that pages show: what the commands before them print now, on data that is made here.

A bare fence of a page has a line before it, which readers do not see:

- ``<!-- output: DATA -->``: all that the commands of the fence before it print, run on a folder of :data:`FOLDERS`.
  A fence of SQL is a question for ``pitchlore sql``.
- ``<!-- output: DATA 1-3 "knowledge version" "policy version"+1 -->``: the first three lines, the next line with
  the first text, and the next with the second text and the one after it. What is left out is a line of its own: …
- ``<!-- output: DATA `pitchlore kb show` … -->``: that command's, where no fence before it has it.
- ``<!-- not run: REASON -->``: nothing is compared. Before a block of Python: it is not run.

Blank lines and lines of a table's border are left out. ``python -m support.shown`` (``make pages``) writes all
outputs anew.
"""

from __future__ import annotations

import io
import os
import re
import shlex
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

from conftest import RECORDINGS, ROOT, SAMPLE

from pitchlore.pipeline.settings import HabitSettings, KnowledgeSettings, RunSettings, Settings

#: Folders that pages show outputs of: files that are copied there, and the commands that come first.
FOLDERS = {
    "demo": ({"data/samples/rsim-vss-3v3.parquet": SAMPLE}, ["pitchlore demo data/samples/rsim-vss-3v3.parquet"]),
    "derby": ({"derby.parquet": SAMPLE}, ["pitchlore import derby.parquet", "pitchlore run"]),
    "kickrun": ({"kickrun.rcg.gz": RECORDINGS / "rcssserver-3v3.rcg.gz"},
                ["pitchlore import kickrun.rcg.gz", "pitchlore run"]),
}
#: Width of the terminal, in characters.
WIDTH = 160

_MARK = re.compile(r"<!-- output: (\w+)(?: `([^`]+)`)?((?: \d+(?:-\d+)?| \"[^\"]+\"(?:\+\d+)?)*) -->")
_NOT_RUN = re.compile(r"<!-- not run: \S.* -->")
_PICK = re.compile(r"(\d+)(?:-(\d+))?|\"([^\"]+)\"(?:\+(\d+))?")
_BORDER = re.compile(r"[┏━┳┓┡╇┩└─┴┘├┼┤╞═╪╡ ]*")


class Shown(NamedTuple):
    """One output of a page.

    Attributes:
        page: the page's file.
        start, end: its lines in the page, counted from 0, end excluded.
        folder: name in :data:`FOLDERS`.
        commands: the commands that print it.
        picks: the lines of these that are shown; all if empty.
    """

    page: Path
    start: int
    end: int
    folder: str
    commands: tuple[tuple[str, ...], ...]
    picks: str

    @property
    def place(self) -> str:
        """Page and line, for people."""
        return f"{self.page.relative_to(ROOT)}:{self.start}"


class Fence(NamedTuple):
    """A fenced block: language, lines from ``start`` to ``end`` (excluded), indentation and the line before it."""

    language: str
    start: int
    end: int
    indent: str
    before: str


def fences(lines: list[str]) -> Iterator[Fence]:
    """All fenced blocks of a page."""
    opened: tuple[int, str, str] | None = None
    for number, line in enumerate(lines):
        if not line.lstrip().startswith("```"):
            continue
        if opened is None:
            opened = number, line.strip()[3:], line[:len(line) - len(line.lstrip())]
        else:
            start, language, indent = opened
            yield Fence(language, start + 1, number, indent, lines[start - 1].strip() if start else "")
            opened = None


def commands(language: str, text: str) -> tuple[tuple[str, ...], ...]:
    """The commands of a fence, each as its words; a question in SQL is one."""
    if language == "sql":
        return (("pitchlore", "sql", " ".join(text.split())),)
    found, kept = [], ""
    for line in text.splitlines():
        kept = f"{kept}\n{line}" if kept else line
        try:
            words = shlex.split(kept, comments=True)
        except ValueError:  # a quotation that ends on a later line
            continue
        if words:
            found.append(tuple(words))
        kept = ""
    return tuple(found)


def shown(page: Path) -> list[Shown]:
    """The outputs of a page that are compared.

    Raises:
        ValueError: if a bare fence does not say what prints it.
    """
    lines = page.read_text(encoding="utf-8").splitlines()
    out, last = [], ("", "")
    for fence in fences(lines):
        if fence.language not in ("", "text"):
            last = fence.language, "\n".join(line.removeprefix(fence.indent) for line in lines[fence.start:fence.end])
            continue
        if (mark := _MARK.fullmatch(fence.before)) is not None:
            folder, command, picks = mark.groups()
            words = commands("console", command) if command else commands(*last)
            out.append(Shown(page, fence.start, fence.end, folder, words, picks.strip()))
        elif not _NOT_RUN.fullmatch(fence.before):
            raise ValueError(f"{page.relative_to(ROOT)}:{fence.start}: an output without its command, "
                             "or with one that cannot be read (tests/support/shown.py)")
    return out


def blocks(page: Path, language: str) -> list[tuple[int, str]]:
    """The blocks of a language in a page, each with its line, but for those that are marked as not run."""
    lines = page.read_text(encoding="utf-8").splitlines()
    return [(fence.start, "\n".join(lines[fence.start:fence.end])) for fence in fences(lines)
            if fence.language == language and not _NOT_RUN.fullmatch(fence.before)]


def picked(lines: list[str], picks: str) -> list[str]:
    """The lines that a mark picks, with … for those that are left out.

    Raises:
        ValueError: if there is no such line.
    """
    if not picks:
        return lines
    out, at = [], 0
    for first, last, text, more in _PICK.findall(picks):
        if text:
            start = next((n for n in range(at, len(lines)) if text in lines[n]), len(lines))
            end = start + 1 + int(more or 0)
        else:
            start, end = int(first) - 1, int(last or first)
        if not at <= start < end <= len(lines):
            raise ValueError(f"no such line: {text or first} of {picks}")
        out += ["…"] * (start > at) + lines[start:end]
        at = end
    return out + ["…"] * (at < len(lines))


#: Copies that are quickly fitted: pages show the recording, not what the copies play.
_FEW_TREES = KnowledgeSettings(habits=HabitSettings(rounds=1, trees=5, windows_at_most=1000))


def _few_trees(**named: Any) -> Settings:
    """Settings of the demo."""
    return Settings(**{"knowledge": _FEW_TREES, **named})


class FewTrees(RunSettings):
    """Settings of `pitchlore run`."""

    knowledge: KnowledgeSettings = _FEW_TREES


@dataclass
class Folder:
    """A folder in which commands are run, each once."""

    root: Path
    printed: dict[tuple[str, ...], list[str]] = field(default_factory=dict)

    @classmethod
    def made(cls, name: str, root: Path) -> Folder:
        """One of :data:`FOLDERS`, in an empty folder; see :func:`there`."""
        files, before = FOLDERS[name]
        for target, source in files.items():
            (root / target).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, root / target)
        made = cls(root)
        with patch.multiple("pitchlore.flows.commands.demo", _MINUTES=1.0, Settings=_few_trees):
            for words in commands("console", "\n".join(before)):
                made.run(words)
        return made

    def run(self, words: tuple[str, ...]) -> list[str]:
        """The lines that a command prints, without blank lines and borders.

        Raises:
            RuntimeError: if the command fails.
        """
        if words not in self.printed:
            from pitchlore.flows.cli import main

            with (chdir(self.root), patch.dict(os.environ, COLUMNS=str(WIDTH)), redirect_stdout(io.StringIO()) as said,
                  patch("pitchlore.flows.commands.common.RunSettings", FewTrees)):
                try:
                    main(list(words[1:]))
                except SystemExit as stop:
                    if stop.code:
                        raise RuntimeError(f"{shlex.join(words)} ended with {stop.code}") from stop
            lines = (line.rstrip() for line in said.getvalue().splitlines())
            self.printed[words] = [line for line in lines if not _BORDER.fullmatch(line)]
        return self.printed[words]

    def output(self, one: Shown) -> list[str]:
        """An output as its page should show it."""
        lines = [line for words in one.commands for line in self.run(words)]
        return picked(lines, one.picks)


def pages() -> list[Path]:
    """The pages whose outputs are compared."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def standing(one: Shown) -> list[str]:
    """An output as its page shows it."""
    return one.page.read_text(encoding="utf-8").splitlines()[one.start:one.end]


def there(folder: str) -> bool:
    """True if the recordings of a folder are on this machine; some may not be copied into the project."""
    return all(source.exists() for source in FOLDERS[folder][0].values())


def write() -> None:
    """Write all outputs anew, in all pages."""
    found = {page: shown(page) for page in pages()}
    made: dict[str, Folder] = {}
    with tempfile.TemporaryDirectory() as scratch:
        for name in filter(there, FOLDERS):
            (root := Path(scratch) / name).mkdir()
            made[name] = Folder.made(name, root)
        for page, outputs in found.items():
            lines = page.read_text(encoding="utf-8").splitlines()
            now = [(one, made[one.folder].output(one)) for one in outputs if one.folder in made]
            for one, output in reversed(now):
                lines[one.start:one.end] = output
            page.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    try:
        write()
    except ValueError as why:
        sys.exit(str(why))
