"""Everything at once for an hour: recordings, deletions, kills, a full disk, clock steps, questions.

``make soak``, or ``study.py SECONDS [SEED]`` with the tests on Python's path. The hour is one part: a soak
that was stopped begins anew, because nothing of it can be kept.

league          the data folder, its recordings, and what a quiet run makes of them
questions       what `sql` and a notebook ask without pause, and whether an answer can be true
processes       all processes of the soak: found, counted, killed
clock           a clock that can be stepped under processes that know nothing of it
actors          what happens to the data folder, each in a thread of its own
users           two users of the data folder
others          Dask workers, matches that are watched live, a league in a bucket
"""

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
from soak.actors import FORBIDDEN, Sample, Soak
from soak.clock import Clock
from soak.league import LIVE, League, contents
from soak.others import Bucket, Cluster, Live
from soak.processes import left
from soak.questions import Judge
from soak.users import let_in

#: More processes at once are a finding: all that the actors call, with their servers and readers.
MOST = 40
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
        trial = [unshare, *([] if os.geteuid() == 0 else ["--map-root-user"]), "--mount"]
        mount = [*trial, "mount", "-t", "tmpfs", "tmpfs", "/mnt"]
        if subprocess.run(mount, capture_output=True, check=False).returncode == 0:  # noqa: S603 (ours)
            os.environ[_OWN] = "shared" if os.geteuid() == 0 else "alone"
            os.execv(unshare, [*trial, sys.executable, *sys.argv])  # noqa: S606 (this process in a namespace)
    folder = Path(tempfile.mkdtemp(prefix="pitchlore-soak-"))
    if _OWN in os.environ:
        mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK_MIB}m", "tmpfs", str(folder)]
        subprocess.run(mount, check=True)  # noqa: S603 (ours)
        if os.environ[_OWN] == "shared":
            let_in()
    try:
        yield folder
    finally:
        if _OWN in os.environ:
            subprocess.run(["umount", "--lazy", str(folder)], check=True)  # noqa: S603, S607 (ours)
        shutil.rmtree(folder)


def growth(samples: pl.DataFrame) -> dict[str, list[float]]:
    """Mean of the first and of the last quarter, and the maximum, of what the processes took."""
    part = max(1, samples.height // 4)
    columns = {name: column.to_numpy() for name, column in samples.drop("second").to_dict().items()}
    return {name: [round(float(found), 1) for found in (of[:part].mean(), of[-part:].mean(), of.max())]
            for name, of in columns.items()}


def main(root: Path, out: Path, seconds: float, seed: int) -> int:
    """Soak a data folder below ``root``. Returns the number of findings."""
    clock = Clock(root)
    league = League(root, clock.environment, several=os.environ.get(_OWN) == "shared")
    if len(league.users) > 1:
        os.umask(0o002)
    quiet = root / "quiet"
    league.settle(quiet)
    truth, expected = league.ask(quiet), contents(quiet)

    stems = {path.stem for path in league.recordings if league.is_kept(path)}
    kept = frozenset(name for kind, name, _, _ in truth
                     if kind == "matches" and name.partition("-")[0] in stems)
    for words in (["import", *(path for path in league.recordings if league.is_kept(path))], ["run"]):
        league.call(*words)
    soak = Soak(league, clock, Judge(truth, kept, LIVE), seconds, seed, _OWN in os.environ, out / "log.txt")
    cluster, live, bucket = Cluster(soak), Live(soak), Bucket(soak, kept, truth)
    soak.actors += [cluster.keep, live.play, bucket.use]
    soak.on = lambda: cluster.on
    soak.run()
    cluster.end()
    for process in left(20.0):
        soak.find(f"left: {process}")
    begun = time.monotonic()
    bucket.end()
    for path in league.inbox.iterdir():
        if not path.name.startswith(LIVE):
            path.unlink()
    said = league.call("run")
    if live.look():
        soak.find(f"live matches are lost: {live.look()}: {said.stdout[-500:]} {said.stderr[-500:]}")
    for path in league.inbox.iterdir():
        path.unlink()
    for path in (league.data / "models").glob("*.receipt.json"):
        path.unlink()  # which matches V was fitted to depends on what came first: it is fitted anew, to all
    for noun in ("knowledge", "policies"):  # so do habits, which a policy copies
        shutil.rmtree(league.data / noun)
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
    most = max(sample.processes for sample in soak.samples)
    if most > MOST:
        soak.find(f"{most} processes at once")
    figures = {
        "seconds": seconds, "seed": seed, "own disk": _OWN in os.environ, "clock": bool(clock.environment),
        "users": len(league.users),
        "counts": dict(sorted(soak.counts.items())), "first quarter, last quarter, most": growth(samples),
        "files compared with a quiet run's": len(expected), "of these different": len(different),
        "verify": verified.stdout.strip().splitlines()[-1:],
        "settled in seconds": round(time.monotonic() - begun), "findings": soak.findings}
    (out / "figures.json").write_text(json.dumps(figures, indent=1, ensure_ascii=False) + "\n")
    print(json.dumps(figures, indent=1, ensure_ascii=False))
    return len(soak.findings)


if __name__ == "__main__":
    with own_disk() as disk:
        found = main(
            disk, Path(__file__).parent.resolve(), float(sys.argv[1]), int((sys.argv[2:] or ["1"])[0]))
    sys.exit(min(1, found))
