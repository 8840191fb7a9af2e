"""Files of the checkout, as git has them."""

from __future__ import annotations

import subprocess
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent


def tracked(*patterns: str, root: Path = ROOT) -> list[Path]:
    """Files that git keeps or would keep, if they match; in a tree without git, all that match."""
    done = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *patterns],
                          cwd=root, capture_output=True, text=True)
    if done.returncode:
        return sorted(path for pattern in patterns for path in root.rglob(pattern))
    return [root / name for name in sorted(set(done.stdout.split("\0")) - {""}) if (root / name).is_file()]
