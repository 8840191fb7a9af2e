"""Two users of one data folder: uids of their own, one group, a umask of 002 (docs/how-to/machines.md)."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from harness import ROOT

#: The users' numbers, their group's, and that of a user who is not in it; no such names need to be there.
UIDS, GROUP, STRANGER = (12_345, 12_346), 23_456, 12_347
#: Matches of a closed part: parts are closed and taken apart in a league of twenty matches.
MATCHES = 4
_SMALL_PARTS = f"""
import importlib.util, sys
class SmallParts:
    def find_spec(self, name, path=None, target=None):
        if name != "pitchlore.pipeline.store.parts":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        execute = spec.loader.exec_module
        def exec_module(module):
            execute(module)
            module.MATCHES = {MATCHES}
        spec.loader.exec_module = exec_module
        return spec
sys.meta_path.insert(0, SmallParts())
"""


class User(NamedTuple):
    """Somebody who calls commands.

    Attributes:
        name: the user in the log.
        uid: number; None for the user of this process.
        environment: environment of the processes of the user.
    """

    name: str
    uid: int | None
    environment: dict[str, str]

    @property
    def popen(self) -> dict[str, Any]:
        """Options with which a process of the user is started."""
        own: dict[str, Any] = {"user": self.uid, "group": GROUP, "extra_groups": [], "umask": 0o002}
        return {"env": self.environment, **(own if self.uid is not None else {})}

    @property
    def before(self) -> str:
        """Python by which a process of this process's user becomes one of the user's."""
        return "" if self.uid is None else (
            f"import os; os.umask(0o002); os.setgroups([]); os.setgid({GROUP}); os.setuid({self.uid})\n")


def users(root: Path, environment: Mapping[str, str], several: bool) -> list[User]:
    """The users, each with a home below ``root``; one who is the user of this process unless ``several``."""
    (patch := root / "patch").mkdir()
    (patch / "sitecustomize.py").write_text(_SMALL_PARTS)
    path = os.pathsep.join(filter(None, (str(patch), os.environ.get("PYTHONPATH"))))
    found = []
    for number, uid in enumerate(UIDS if several else (None,)):
        (home := root / f"home-{number}").mkdir()
        there = {**environment, "PYTHONPATH": path, "PREFECT_HOME": str(home / "prefect")}
        if uid is not None:
            there |= {"HOME": str(home)}
            there.pop("XDG_CACHE_HOME", None)
            kept = Path(there.pop("NUMBA_CACHE_DIR"))
            shutil.copytree(kept, home / ".cache" / "pitchlore" / kept.name)  # nobody compiles for minutes
            for each in (home, *home.rglob("*")):
                os.chown(each, uid, GROUP)
        found.append(User("ab"[number], uid, there))
    return found


def share(folder: Path) -> None:
    """Give a folder to the group, as the page says."""
    for path in (folder, *folder.rglob("*")):
        os.chown(path, -1, GROUP)
        path.chmod(path.stat().st_mode | (0o2070 if path.is_dir() else 0o060))


def let_in() -> None:
    """Let other users reach this Python and this checkout, in a mount namespace of this process's own."""
    for path in (Path(sys.base_prefix).resolve(), ROOT):
        for parent in reversed(path.parents):
            if not parent.stat().st_mode & 0o001:
                kept = tempfile.mkdtemp()
                over = ["-t", "tmpfs", "-o", "mode=755", "none", str(parent)]
                for where in (["--bind", str(path), kept], over):
                    subprocess.run(["mount", *where], check=True)  # noqa: S603, S607 (ours)
                path.mkdir(parents=True)
                subprocess.run(["mount", "--move", kept, path], check=True)  # noqa: S603, S607 (ours)
                Path(kept).rmdir()
                break
