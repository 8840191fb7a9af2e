"""The whole study of teams from their recordings, as one command: ``make from-recordings``.

``everything.py [PSIM [DATA]]`` says what it will run and how long that takes, and runs the parts in their
order, each of which goes on where it stopped; a part that has ended is not run again until all have. PSIM is
a Python with pSim 0.2.4, or ``-``: what is in pSim is left out, and said. DATA is the data folder.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from shutil import which
from typing import NamedTuple

from harness import ROOT, going_on

FOLDER = Path(__file__).parent


class Step(NamedTuple):
    """A part of the study: script under data/studies, arguments, hours on two free cores, tables."""

    script: str
    words: tuple[str, ...]
    hours: float
    tables: str


def steps(psim: str, data: Path) -> Iterator[Step]:
    """The parts in the order in which they need each other; ``psim`` as the module says."""
    own = (str(data),)
    yield Step("from_recordings/study.py", own, 1.5, "goals.csv, and seasons of two apprentices")
    yield Step("from_recordings/sets.py", own, 0.5, "sets.csv: copies from other recordings of a team")
    yield Step("options/motion.py", own, 0.2, "motion.csv: half a second ahead")
    if psim != "-":
        yield Step("from_recordings/psim.py", (psim, *own), 2.5, "psim.csv: five teams in pSim")
    yield Step("from_recordings/recovered.py", own, 0.1, "recovered.csv: kappa of options")
    yield Step("from_recordings/rebuilt.py", own, 1.0, "rebuilt*.csv, and seasons of two more apprentices")
    yield Step("from_recordings/gain.py", own, 1.2, "gain.csv: seasons that start as a copy")


def run(step: Step) -> float:
    """Run a part; hours that it took.

    Raises:
        SystemExit: if it fails. What has ended is kept.
    """
    begun = time.monotonic()
    print(f"{step.script} ...", flush=True)
    words = [sys.executable, str(ROOT / "data" / "studies" / step.script), *step.words]
    done = subprocess.run(words, check=False)  # noqa: S603 (our own)
    if done.returncode:
        raise SystemExit(f"{step.script} ended with {done.returncode}: mend what it says above, and run this "
                         "command again; it goes on there")
    return round((time.monotonic() - begun) / 3600, 2)


def main(psim: str, data: Path, out: Path = FOLDER) -> list[float]:
    """Say the hours, and run what has not ended; the hours that each part took.

    Raises:
        SystemExit: if ``psim`` is no Python that has pSim, before anything is run; or if a part fails.
    """
    asked = [psim, "-c", "import pSim"]
    if psim != "-" and (which(psim) is None or subprocess.run(asked, check=False).returncode):  # noqa: S603
        raise SystemExit(f"PSIM={psim} is no Python that has pSim: name one, or leave PSIM out")
    planned = list(steps(psim, data))
    for step in planned:
        print(f"{step.hours:4.1f} h  {step.script}: {step.tables}")
    print(f"{sum(step.hours for step in planned):4.1f} h on two free cores, less what {data} has already")
    if psim == "-":
        print("without pSim: psim.csv stays as it is (PSIM=PYTHON, two and a half hours more)")
    with going_on(out, __file__) as parts:
        return parts(planned, run)


if __name__ == "__main__":
    given = dict(enumerate(sys.argv))
    main(given.get(1, "-"), Path(given.get(2, ROOT / "data" / "from-recordings")))
