"""Plain English: docstrings, help texts and headings name their subject first."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import ROOT

from pitchlore.flows.cli import ABOUT, COMMANDS, GROUPS

#: First words that leave the reader to guess the subject.
TURNED = re.compile(r"[^\w]*(What|Whose|Whom|Who|Which|That|Those|Of|Whether)\b")
#: Likewise of an argument, but for flags: "reset: whether …" is the custom.
ARGUMENT = re.compile(r" {8,}\*{0,2}[A-Za-z_]\w*(?:, \w+)*: (what|whose|whom|who|which|that|those|of)\b", re.IGNORECASE)
#: Names that more than one module of the package defines, each with the reason. A class has one meaning always.
REPEATED = {
    "adapt": "a learning rule's, by RULES", "error": "a learning rule's, by RULES",
    "values": "a learning rule's, by RULES; and the noun's own function",
    "new_memory": "a team's, by TEAMS", "play": "a team's, by TEAMS; and the face's",
    "decide": "a learned team's, by states or by observations",
    "carry_on": "a learned team's, by states or by observations",
    "detects": "a format's, by READERS",
    "read": "a format's, by READERS, the log's own, the face's; and a league's packets",
    "recording": "a viewer's, by FORMATS",
    "observe": "an environment's, by bodies or by sights", "scales": "an environment's, by bodies or by sights",
    "plan": "a version's, of the knowledge or of a policy", "compute": "a version's, likewise",
    "describe": "a version's, likewise",
}
#: A text without a match has no docstring that could begin so: to parse all of them takes ten seconds.
SUSPECT = re.compile(rf"[\"']{TURNED.pattern}"), re.compile(f"^{ARGUMENT.pattern}", re.IGNORECASE | re.MULTILINE)
FOLDERS = ("pipeline", "flows", "schemas", "tests", "docs", "data/studies")


def sources(suffix: str) -> list[Path]:
    """Files of the project with a suffix, at the top and in its folders."""
    inside = (path for folder in (*FOLDERS, "notebooks") for path in (ROOT / folder).rglob(f"*{suffix}"))
    return sorted({*ROOT.glob(f"*{suffix}"), *inside})


def docstrings(path: Path) -> Iterator[tuple[int, str]]:
    """Line and text of each docstring of a module, its classes and functions."""
    text = path.read_text()
    for node in ast.walk(ast.parse(text)) if any(each.search(text) for each in SUSPECT) else ():
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node, clean=False)
            if text:
                yield node.body[0].lineno, text


def headings(path: Path) -> Iterator[tuple[int, str]]:
    """Line and text of each heading of a Markdown file, outside of code."""
    code = False
    for number, line in enumerate(path.read_text().splitlines(), 1):
        code ^= line.lstrip().startswith("```")
        if not code and re.match(r"#+ ", line):
            yield number, line.lstrip("# ")


def turned(path: Path) -> list[str]:
    """Places of a file where a docstring, an argument's line or a heading begins with a word of TURNED."""
    name = path.relative_to(ROOT)
    if path.suffix == ".md":
        return [f"{name}:{line} {text}" for line, text in headings(path) if TURNED.match(text)]
    return [f"{name}:{first + after} {line.strip()}" for first, text in docstrings(path)
            for after, line in enumerate(text.splitlines()) if (ARGUMENT if after else TURNED).match(line)]


@pytest.mark.parametrize("suffix", [".py", ".md"])
def test_subject_first(suffix):
    """No docstring, argument's line or heading of the project begins with a word of TURNED."""
    assert [place for path in sources(suffix) for place in turned(path)] == []


def definitions() -> Iterator[tuple[str, str, bool]]:
    """Name of each public class and function at the top of a module, the module, and whether it is a class.

    A flow and a command are named by the word that is typed, which may be that of the work that they start.
    """
    for folder in ("pipeline", "schemas", "flows"):
        for path in (ROOT / folder).rglob("*.py"):
            for kind, name in re.findall(r"^(class|def) ([A-Za-z]\w*)", path.read_text(), re.MULTILINE):
                if kind == "class" or folder != "flows":
                    yield name, str(path.relative_to(ROOT)), kind == "class"


def test_one_meaning():
    """A public class is defined once; so is a function, but for the verbs of REPEATED, which all are repeated."""
    modules: dict[str, set[str]] = {}
    classes = set()
    for name, module, is_class in definitions():
        modules.setdefault(name, set()).add(module)
        classes |= {name} if is_class else set()
    repeated = {name for name, places in modules.items() if len(places) > 1}
    assert {name: modules[name] for name in repeated - REPEATED.keys()} == {}
    assert REPEATED.keys() - repeated == set()
    assert repeated & classes == set()


def test_one_sentence():
    """README, the site, the package and its citation say in the same sentence what Pitchlore is."""
    said = {name: " ".join((ROOT / name).read_text().split()) for name in (
        "README.md", "docs/index.md", "zensical.toml", "pyproject.toml", "CITATION.cff", "pitchlore/__init__.py")}
    assert [name for name, text in said.items() if ABOUT not in text] == []


def test_help():
    """No command's help begins with such a word; the arguments of commands are in their docstrings."""
    texts = [command.help for command in COMMANDS] + list(GROUPS.values())
    assert [text for text in texts if TURNED.match(text)] == []
