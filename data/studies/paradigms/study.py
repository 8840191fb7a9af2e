"""Section 5 of the paper in full: the paper's runs, many runs, and every reading of its text.

``study.py [DATA]`` plays the curves that the data folder lacks, and writes points, verdicts, settings and
plots into this folder. The data folder keeps each learner's curves, so a study that was stopped goes on.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from harness import ROOT, command

#: Options of ``pitchlore paradigms``, one command each.
PLAN: tuple[Sequence[object], ...] = (
    (),
    ("--figure", 4, "--figure", 5, "--runs", 2000, "--sensitivity", "--comparison"),
    ("--figure", 6, "--runs", 200, "--sensitivity"),
)


def main(out: Path, data: Path, plan: Iterable[Sequence[object]] = PLAN) -> None:
    """Play the curves, and write the study into a folder."""
    for words in plan:
        print("pitchlore paradigms", *words, flush=True)
        command("paradigms", *words, "--export", out, "--data", data)


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "data"))
