"""Notebooks are run as a reader runs them, and what they show is compared with what is committed.

``make notebooks`` runs this module: it writes the outputs anew.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from conftest import ROOT, SAMPLE
from nbclient import NotebookClient
from nbformat import NotebookNode

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


def read(path: Path) -> NotebookNode:
    """A notebook as it is on disk."""
    return nbformat.read(path, as_version=4)


def executed(path: Path, data: Path) -> NotebookNode:
    """The notebook with the outputs that it has on a data folder; an error in a cell raises.

    Neither times nor the version of Python are kept: the same outputs are the same bytes.
    """
    notebook = read(path)
    metadata = dict(notebook.metadata)
    environment = os.environ | {"PITCHLORE_DATA": str(data)}
    client = NotebookClient(notebook, timeout=300, record_timing=False,
                            resources={"metadata": {"path": str(path.parent)}})
    client.execute(env=environment)
    notebook.metadata = nbformat.from_dict(metadata)
    return notebook


def shown(notebook: NotebookNode) -> list[list[str]]:
    """The outputs of each code cell: text as it stands, a picture as the word ``image``.

    Standard error is left out: there a library speaks of the machine, as of a cache of fonts that it builds.
    """
    return [[_shown(output) for output in cell.outputs if output.get("name") != "stderr"]
            for cell in notebook.cells if cell.cell_type == "code"]


def _shown(output: NotebookNode) -> str:
    if output.output_type == "stream":
        return str(output.text)
    return "image" if "image/png" in output.data else str(output.data["text/plain"])


def sample_data(data: Path) -> Path:
    """A data folder after one run of all stages on the sample recording, as the command line makes it."""
    pitchlore = Path(sys.executable).with_name("pitchlore")
    (data / "inbox").mkdir(parents=True)
    shutil.copy(SAMPLE, data / "inbox")
    subprocess.run([pitchlore, "run", "--data", str(data)], check=True, stdout=subprocess.DEVNULL)
    return data


def main() -> None:
    """Run all notebooks on the sample recording and write them with their outputs."""
    with TemporaryDirectory() as folder:
        data = sample_data(Path(folder) / "data")
        for path in NOTEBOOKS:
            nbformat.write(executed(path, data), path)


if __name__ == "__main__":
    main()
