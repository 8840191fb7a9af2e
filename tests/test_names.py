"""Every path and every dotted name that a page, a docstring or a comment gives is there.

A message has the file, the line and what is missing. Paths begin with one of :data:`ROOMS`. Dotted names begin with
``pipeline``, ``flows`` or ``schemas``, with or without ``pitchlore`` before them. A role such as ``:func:`` may
also give a name of its own module.
"""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import ROOT
from support.names import names, parsed, statements
from support.pages import tracked

#: Folders of the checkout that are looked at; ``data`` is a user's, but for two of its folders.
ROOMS = ("pipeline", "flows", "schemas", "tests", "docs", "notebooks", "data/samples", "data/studies",
         "pitchlore/pipeline", "pitchlore/flows", "pitchlore/schemas")

PATH = re.compile(rf"(?<![\w./*{{}}<>-])(?:{'|'.join(ROOMS)})/[\w./*{{}},<>-]*")
DOTTED = re.compile(r"(?<![\w./-])((?:pitchlore\.)?(?:pipeline|flows|schemas)(?:\.\w+)+)(?![\w/-])")
#: What follows a path in a list: names of files and folders beside it.
BESIDE = re.compile(r"(?:, \w+(?:\.(?:py|md)|/)(?![\w.]))+")
#: A name of ours after what may begin a comment: only files that have one are read token by token.
COMMENT = re.compile(rf"#.*(?:{PATH.pattern}|{DOTTED.pattern}|docs/)")
ROLE = re.compile(r":(?:mod|func|class|data|meth|attr|exc|obj):`~?\.?([\w.]+)`")
ENTRY = re.compile(r"(docs/decisions/\w+\.md)(?: \(|, )\"([^\"]+)\"")
PLACEHOLDER = re.compile(r"(?!README|INSTRUCTIONS)(?<![A-Za-z])(?:[A-Z]{2,}|N)(?![a-z])|<")


def texts(path: Path) -> Iterator[tuple[int, str]]:
    """A page as one text; of a module its docstrings and comments; each with the number of its first line."""
    source = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        yield 1, source
        return
    for node in statements(parsed(path)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.lineno, node.value.value
    if COMMENT.search(source):
        for token in tokenize.generate_tokens(io.StringIO(source).readline):
            if token.type == tokenize.COMMENT:
                yield token.start[0], token.string


def there(root: Path, path: str) -> bool:
    """True if a path is in the tree; with a wildcard, if it matches; with a placeholder, if the part before it is."""
    parts = path.strip("./").split("/")
    kept = parts[:next((i for i, part in enumerate(parts) if PLACEHOLDER.search(part)), len(parts))]
    kept = [part if "{" not in part else re.sub(r"\{.*", "*", part) for part in kept]
    return any(root.glob("/".join(kept)))


def missing(root: Path, path: Path) -> list[str]:
    """Paths, dotted names and headings of decisions that a file gives and the tree lacks."""
    known = names(root)
    module = known.name(root, path)
    out = []

    def where(start: int, text: str, position: int) -> str:
        line = start + text.count("\n", 0, position)
        return f"{path.relative_to(root).as_posix()}:{line}"

    for start, text in texts(path):
        for hit in PATH.finditer(text):
            name = hit.group().rstrip(".,-")
            parent = name.rstrip("/").rpartition("/")[0]
            beside = BESIDE.match(text, hit.start() + len(name))
            others = re.findall(r"[\w.]+/?", beside.group()) if beside else []
            out += [f"{where(start, text, hit.start())}: no {given}"
                    for given in [name, *(f"{parent}/{other}" for other in others)] if not there(root, given)]
        for hit in ENTRY.finditer(" ".join(text.split())):
            page, heading = hit.groups()
            if there(root, page) and f"\n## {heading}\n" not in (root / page).read_text(encoding="utf-8"):
                out.append(f"{where(start, text, 0)}: no heading {heading!r} in {page}")
        for hit in DOTTED.finditer(text):
            if not known.has(hit.group(1)):
                out.append(f"{where(start, text, hit.start())}: no {hit.group(1)}")
        for hit in ROLE.finditer(text) if path.suffix == ".py" else ():
            name = hit.group(1)
            if not DOTTED.fullmatch(name) and not known.has(name) and not known.local(module, name):
                out.append(f"{where(start, text, hit.start())}: no name {name}")
    return out


def test_names():
    """Every path and dotted name of every page, docstring and comment is in the checkout."""
    files = tracked("*.md", "*.py")
    assert len(files) > 500
    lost = [line for path in files for line in missing(ROOT, path)]
    assert not lost, "\n".join(["", *lost])


@pytest.mark.parametrize("wing", ["flows", "pipeline"])
def test_map(wing):
    """CONTRIBUTING's map has every module and room of a wing."""
    block = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("```")[1]
    named = {match for line in block.splitlines() if line.strip().startswith(f"{wing}/")
             for match in re.findall(r"(\w+)(?:/|\.py)", line)}
    rooms = {path.relative_to(ROOT).parts[1].removesuffix(".py") for path in tracked(f"{wing}/*.py")} - {"__init__"}
    assert rooms - named == set()
