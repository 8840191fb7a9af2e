"""The command notebooks: copy the notebooks that come along and open them."""

from __future__ import annotations

import os
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from flows.commands.common import DEFAULTS, Common
from flows.commands.printing import console
from flows.shipped import shipped
from pipeline.errors import NotFound


def notebooks(
    folder: Path = Path("notebooks"),
    *,
    open_: Annotated[bool, Parameter(name="--open")] = True,
    common: Common = DEFAULTS,
) -> None:
    """Copy the notebooks that come along into a folder, and open them in JupyterLab.

    A notebook that is there already stays as it is.

    Args:
        folder: The folder they are copied to.
        open_: Whether to open them; needs pitchlore[notebooks].
        common: Options of every command.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for notebook in sorted(shipped("notebooks").glob("*.ipynb")):
        target = folder / notebook.name
        if not target.exists():
            shutil.copyfile(notebook, target)
            console().print(f"{target} copied")
    if not open_:
        return
    if find_spec("jupyterlab") is None:
        raise NotFound("JupyterLab is not installed",
                       next_step="Install pitchlore[notebooks], or say --no-open to copy the notebooks only")
    environment = os.environ | {"PITCHLORE_DATA": str(common.data.resolve())}
    command = [sys.executable, "-m", "jupyterlab", str(folder)]
    os.execve(sys.executable, command, environment)  # noqa: S606 (Jupyter takes over; Ctrl-C is its own)
