"""The command notebooks: copy Pitchlore's notebooks and open them."""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, UserPath
from pitchlore.flows.commands.printing import console
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.face.shipped import notebooks as shipped
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.paths import check_folder


def notebooks(
    folder: UserPath = Path("notebooks"),
    *,
    open_: Annotated[bool, Parameter(name="--open")] = True,
    common: Common = DEFAULTS,
) -> None:
    """Copy Pitchlore's notebooks into a folder, and open them in JupyterLab.

    A notebook that is already there is not overwritten.

    Args:
        folder: Folder that receives the notebooks.
        open_: Open the notebooks in JupyterLab; needs pitchlore[notebooks].
        common: Options of every command.
    """
    check_folder(folder, "Name the folder for the notebooks")
    for notebook in sorted(shipped().glob("*.ipynb")):
        target = folder / notebook.name
        if not target.exists():
            Files(folder).write_bytes(target, notebook.read_bytes())
            console().print(f"{target} copied")
    if not open_:
        return
    if find_spec("jupyterlab") is None:
        raise NotFound("JupyterLab is not installed",
                       next_step="Install pitchlore[notebooks], or add --no-open to copy the notebooks only")
    own = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    store = Store(common.data)
    data = str(store.root.resolve()) if store.mirror is None else store.where
    environment = own | {"PITCHLORE_DATA": data}
    command = [sys.executable, "-P", "-m", "jupyterlab", str(folder)]
    os.execve(sys.executable, command, environment)  # noqa: S606 (Jupyter takes over; Ctrl-C is its own)
