"""The chain's bytes: SHA-256 of each file of a data folder that one Python makes (`make pythons`).

A clip of the sample recording is imported, two matches are played, every stage runs and a policy is
trained. Everything is hashed but the catalogue and the reports of runs, which hold paths and times.

    PYTHONPATH=tests python -m support.chain FILE
"""

import hashlib
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from conftest import clip

from pitchlore.flows.cli import main

#: What is not hashed: a file, and a folder.
TIMED = ("catalog.duckdb", "runs")


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
    paths = sorted(path.relative_to(data) for path in data.rglob("*") if path.is_file())
    return [f"{hashlib.sha256((data / path).read_bytes()).hexdigest()}  {path}"
            for path in paths if path.parts[0] not in TIMED]


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        lines = made(Path(folder) / "data")
    Path(sys.argv[1]).write_text("\n".join(lines) + "\n", encoding="utf-8")
