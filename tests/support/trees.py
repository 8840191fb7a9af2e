"""Copies of the tree, for tests of what an edit or an installation does."""

import os
import shutil
from pathlib import Path

from numba.core.caching import _CacheLocator

ROOT = Path(__file__).parents[2]
PACKAGE = Path("pitchlore", "pipeline")
_COMPILED = Path(os.environ["NUMBA_CACHE_DIR"])


def copied(tree: Path, *folders: str) -> dict[str, str]:
    """Copy folders of this tree into another; the environment of a process that runs the copy's code."""
    for folder in folders:
        shutil.copytree(ROOT / folder, tree / folder, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    lend(tree)
    return {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"} | {
        "PYTHONPATH": os.pathsep.join([str(tree), str(tree / "tests")])}


def lend(tree: Path) -> None:
    """Give a tree of the same code what is compiled of this one, which takes half a minute to compile.

    numba keeps compiled functions by the folder, time and size of their file.
    """
    cache = tree / PACKAGE / "__pycache__" / _COMPILED.name
    folders = set()
    for file in (ROOT / PACKAGE).rglob("*.py"):
        copy, seen = tree / file.relative_to(ROOT), file.stat()
        os.utime(copy, ns=(seen.st_atime_ns, seen.st_mtime_ns))
        folders.add((file.parent, copy.parent))
    for ours, theirs in folders:
        if (_COMPILED / _place(ours)).exists():
            shutil.copytree(_COMPILED / _place(ours), cache / _place(theirs))


def _place(folder: Path) -> str:
    return str(_CacheLocator.get_suitable_cache_subpath(str(folder / "module.py")))
