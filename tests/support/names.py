"""Modules of the checkout and the names in them, read from their sources: nothing is imported."""

import ast
import builtins
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

#: Folders of the checkout with modules, and the folder from which these are imported.
ROOTS = {"pipeline": "", "flows": "", "schemas": "", "tests": "tests", "docs": "docs", "data/studies": "data/studies"}
WINGS = ("pitchlore.pipeline.", "pitchlore.flows.", "pitchlore.schemas.")


@dataclass
class Module:
    """Names that a module binds: its own, the members of its classes, and the targets of its imports."""

    names: set[str] = field(default_factory=set)
    classes: dict[str, set[str]] = field(default_factory=dict)
    bases: dict[str, set[str]] = field(default_factory=dict)
    imports: dict[str, str] = field(default_factory=dict)


def statements(node: ast.AST) -> Iterator[ast.stmt]:
    """All statements in a node, at any depth; expressions, where most of a tree's nodes are, are not visited."""
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        for child in getattr(node, name, ()):
            if isinstance(child, ast.stmt):
                yield child
            yield from statements(child)


@cache
def parsed(path: Path) -> ast.Module:
    """The tree of a module."""
    return ast.parse(path.read_text(encoding="utf-8"))


def _targets(node: ast.stmt) -> Iterator[str]:
    if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign):
        for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
            for part in ast.walk(target):
                if isinstance(part, ast.Name):
                    yield part.id
                elif isinstance(part, ast.Attribute):
                    yield part.attr
    elif isinstance(node, ast.ClassDef):
        yield node.name
    elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        yield node.name
        yield from (each.arg for each in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs))


def read(tree: ast.Module, package: str) -> Module:
    """Names of one module; ``package`` is the dotted name that its relative imports begin at."""
    found = Module()
    for node in statements(tree):
        found.names |= set(_targets(node))
        if isinstance(node, ast.ClassDef):
            found.classes[node.name] = {name for part in statements(node) for name in _targets(part)}
            found.bases[node.name] = {part.attr if isinstance(part, ast.Attribute) else part.id
                                      for base in node.bases for part in ast.walk(base)
                                      if isinstance(part, ast.Attribute | ast.Name)}
        elif isinstance(node, ast.ImportFrom):
            start = ".".join([*package.split(".")[:len(package.split(".")) - node.level + 1]]) if node.level else ""
            start = ".".join(part for part in (start, node.module) if part)
            for alias in node.names:
                found.imports[alias.asname or alias.name] = f"{start}.{alias.name}"
        elif isinstance(node, ast.Import):
            for alias in node.names:
                head = alias.name.split(".")[0]
                found.imports[alias.asname or head] = alias.name if alias.asname else head
    return found


class Names:
    """All modules of a tree, by the names under which they are imported."""

    def __init__(self, root: Path) -> None:
        self.modules: dict[str, Module] = {}
        for folder in ROOTS:
            for path in sorted((root / folder).rglob("*.py")):
                package = ".".join(self.name(root, path).split(".")[:None if path.stem == "__init__" else -1])
                self.modules[self.name(root, path)] = read(parsed(path), package)
        face = root / "pitchlore" / "__init__.py"
        self.modules["pitchlore"] = read(parsed(face), "pitchlore") if face.exists() else Module()
        ours = {name.split(".")[0] for name in self.modules} | {"pitchlore"}
        #: Packages of others that some module imports.
        self.libraries = {target.split(".")[0] for module in self.modules.values()
                          for target in module.imports.values()} - ours

    @staticmethod
    def name(root: Path, path: Path) -> str:
        """The name under which a module of the tree is imported, without ``pitchlore`` before it."""
        relative = path.relative_to(root)
        base = next((base for folder, base in ROOTS.items() if relative.is_relative_to(folder)), "")
        parts = relative.relative_to(base).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    def has(self, dotted: str) -> bool:
        """True if a dotted name is a module, a folder of modules, or a name in one."""
        if dotted.startswith("pitchlore.") and not dotted.startswith(WINGS):
            return self._within(self.modules["pitchlore"], dotted.split(".")[1:])
        dotted = dotted.removeprefix("pitchlore.")
        parts = dotted.split(".")
        if any(name == dotted or name.startswith(f"{dotted}.") for name in self.modules):
            return True
        for end in range(len(parts) - 1, 0, -1):
            if (module := self.modules.get(".".join(parts[:end]))) is not None:
                return self._within(module, parts[end:])
        return False

    def local(self, module: str, dotted: str) -> bool:
        """True if a name is one that a module binds or imports, or Python's own."""
        parts = dotted.split(".")
        own = self.modules.get(module, Module())
        folder = module.rpartition(".")[0]
        return (self._within(own, parts) or hasattr(builtins, parts[0]) or parts[0] in self.libraries
                or any(parts[0] in members for members in own.classes.values())
                or self.has(f"{module}.{dotted}") or self.has(f"{folder}.{dotted}"))

    def _within(self, module: Module, parts: list[str]) -> bool:
        first, *rest = parts
        if first in module.classes:
            return not rest or (len(rest) == 1 and rest[0] in self._members(module, first))
        if first in module.imports:
            target = module.imports[first].removeprefix("pitchlore.")
            if target.split(".")[0] not in {"pipeline", "flows", "schemas"}:
                return True
            return self.has(".".join([target, *rest]))
        return first in module.names

    def _members(self, module: Module, name: str, seen: frozenset[str] = frozenset()) -> set[str]:
        """Members of a class, and of all classes that have the name of one of its bases."""
        found = set(module.classes[name])
        for base in module.bases[name] - seen:
            for other in self.modules.values():
                if base in other.classes:
                    found |= self._members(other, base, seen | {name, base})
        return found


@cache
def names(root: Path) -> Names:
    """The names of a tree, read once."""
    return Names(root)
