"""Files of the checkout, as git has them, and the generator of the reference."""

import importlib.util
import subprocess
from functools import cache
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parent.parent.parent


def tracked(*patterns: str, root: Path = ROOT) -> list[Path]:
    """Files that git keeps or would keep, if they match; in a tree without git, all that match."""
    done = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *patterns],
                          cwd=root, capture_output=True, text=True)
    if done.returncode:
        return sorted(path for pattern in patterns for path in root.rglob(pattern))
    return [root / name for name in sorted(set(done.stdout.split("\0")) - {""}) if (root / name).is_file()]


@cache
def reference() -> ModuleType:
    """The module that writes the pages of the reference."""
    spec = importlib.util.spec_from_file_location("reference", ROOT / "docs" / "reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
