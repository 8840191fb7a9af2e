"""The study of labels as a command.

    PYTHONPATH=tests python -m studies.labels data/studies/labels [RECORDINGS]
    PYTHONPATH=tests python -m studies.labels sheets FOLDER [RECORDINGS]

The first writes answers.csv, agreement.csv, codes.csv, kicks.csv and shares.csv into the folder of moments.csv
and the labels. The second draws the pictures for a new labeller: sheets/NNN.png, one a moment, and dials/NNN.png.
RECORDINGS is the folder of the recordings that are not part of the project.
"""

from __future__ import annotations

import sys
from pathlib import Path

from conftest import RECORDINGS, ROOT
from studies.labels.moments import recordings
from studies.labels.sheets import pictures
from studies.labels.study import study
from support.recordings import ALL

FOLDER = ROOT / "data" / "studies" / "labels"


def main(arguments: list[str]) -> None:
    """Do as the command line says."""
    draws = arguments[0] == "sheets"
    folder, *rest = arguments[draws:]
    elsewhere = Path(rest[0]) if rest else RECORDINGS
    recorded = recordings(elsewhere)
    for name in ALL:
        if name not in recorded:
            print(f"{name} is not in {elsewhere}: {'not drawn' if draws else 'its rows are kept'}")
    if draws:
        pictures(Path(folder), FOLDER, recorded)
    else:
        study(Path(folder), recorded)


if __name__ == "__main__":
    main(sys.argv[1:])
