"""The chain's bytes: SHA-256 of each file of a data folder that one Python makes (`make pythons`).

A clip of the sample recording is imported, two matches are played, every stage runs and a policy is
trained. Everything is hashed but the catalogue, which holds paths and times of files.

    PYTHONPATH=tests python -m support.chain FILE
"""

import hashlib
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from conftest import clip

from pitchlore.flows.cli import main

CATALOGUE = "catalog.duckdb"


def made(data: Path) -> list[str]:
    """Lines ``sha256  path`` of all files in a data folder after the chain, sorted by path."""
    recording = data.parent / "clip.parquet"
    clip(0.0, 60.0).write_parquet(recording)
    for arguments in (
        ["import", str(recording)],
        ["record", "--home", "static", "--away", "human-like", "--minutes", "0.5", "--matches", "2"],
        ["run"],
    ):
        with pytest.raises(SystemExit) as ended:
            main([*arguments, "--data", str(data)])
        assert ended.value.code in (0, None), arguments
    files = sorted(path for path in data.rglob("*") if path.is_file() and path.name != CATALOGUE)
    return [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(data)}" for path in files]


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        lines = made(Path(folder) / "data")
    Path(sys.argv[1]).write_text("\n".join(lines) + "\n", encoding="utf-8")
