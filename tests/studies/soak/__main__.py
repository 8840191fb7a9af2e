"""The soak as a command: ``python -m studies.soak FOLDER SECONDS [SEED]``."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import polars as pl
from studies.soak.actors import FORBIDDEN, Sample, Soak
from studies.soak.clock import Clock
from studies.soak.league import League, contents
from studies.soak.processes import left
from studies.soak.questions import Judge

#: More processes at once are a finding: all that the actors call, with their servers and readers.
MOST = 25
#: Size of the disk, MiB; set when this process has one of its own.
DISK_MIB = 2_000
_OWN = "SOAK_DISK"


@contextmanager
def own_disk() -> Iterator[Path]:
    """A folder on a small disk, in a namespace of this process's own; without that, one on the usual disk.

    The process begins again in the namespace. In the end the folder is removed.
    """
    unshare = shutil.which("unshare")
    if _OWN not in os.environ and unshare:
        trial = [unshare, "--map-root-user", "--mount"]
        if subprocess.run([*trial, "mount", "-t", "tmpfs", "tmpfs", "/mnt"], capture_output=True, check=False).returncode == 0:
            os.environ[_OWN] = "1"
            os.execv(unshare, [*trial, sys.executable, "-m", "studies.soak", *sys.argv[1:]])
    folder = Path(tempfile.mkdtemp(prefix="pitchlore-soak-"))
    if _OWN in os.environ:
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK_MIB}m", "tmpfs", str(folder)], check=True)
    try:
        yield folder
    finally:
        if _OWN in os.environ:
            subprocess.run(["umount", "--lazy", str(folder)], check=True)
        shutil.rmtree(folder)


def growth(samples: pl.DataFrame) -> dict[str, list[float]]:
    """Mean of the first and of the last quarter, and the maximum, of what the processes took."""
    part = max(1, samples.height // 4)
    return {name: [round(float(found), 1) for found in (column[:part].mean(), column[-part:].mean(), column.max())]
            for name, column in samples.drop("second").to_dict().items()}


def main(root: Path, out: Path, seconds: float, seed: int) -> int:
    """Soak a data folder below ``root``. Returns the number of findings."""
    out.mkdir(parents=True, exist_ok=True)
    clock = Clock(root)
    league = League(root, clock.environment)
    quiet = root / "quiet"
    league.settle(quiet)
    truth, expected = league.ask(quiet), contents(quiet)

    soak = Soak(league, clock, Judge(truth), seconds, seed, _OWN in os.environ, out / "log.txt")
    soak.run()
    for process in left(20.0):
        soak.find(f"left: {process}")
    begun = time.monotonic()
    for path in league.inbox.iterdir():
        path.unlink()
    for path in (league.data / "models").glob("*.receipt.json"):
        path.unlink()  # which matches V was fitted to depends on what came first: it is fitted anew, to all
    league.settle()
    verified = league.call("verify")
    if verified.returncode:
        soak.find(f"verify: {verified.stdout} {verified.stderr}")
    last = contents(league.data)
    different = sorted(key for key in expected.keys() | last.keys() if expected.get(key) != last.get(key))
    for key in different:
        soak.find(f"other bytes than those of a quiet run: {key}")
    shutil.copyfile(root / "serve.txt", out / "serve.txt")
    for line in (out / "serve.txt").read_text(errors="replace").splitlines():
        if any(word in line for word in FORBIDDEN):
            soak.find(f"serve says: {line[:300]!r}")

    samples = pl.DataFrame(soak.samples, schema=list(Sample._fields), orient="row")
    samples.write_csv(out / "samples.csv")
    most = int(samples["processes"].max())
    if most > MOST:
        soak.find(f"{most} processes at once")
    figures = {
        "seconds": seconds, "seed": seed, "own disk": _OWN in os.environ, "clock": bool(clock.environment),
        "counts": dict(sorted(soak.counts.items())),
        "first quarter, last quarter, most": growth(samples),
        "files compared with a quiet run's": len(expected), "of these different": len(different),
        "verify": verified.stdout.strip().splitlines()[-1:], "settled in seconds": round(time.monotonic() - begun),
        "findings": soak.findings,
    }
    (out / "figures.json").write_text(json.dumps(figures, indent=1, ensure_ascii=False) + "\n")
    print(json.dumps(figures, indent=1, ensure_ascii=False))
    return len(soak.findings)


if __name__ == "__main__":
    with own_disk() as disk:
        found = main(disk, Path(sys.argv[1]).resolve(), float(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 1)
    sys.exit(min(1, found))
