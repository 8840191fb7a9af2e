"""Options that count as one, by a rule that was written down before any figure: they command the same wheels.

Two options are alike in a window if the mean speeds and turns that they command in it differ by less than a
twentieth of the top speed. They count as one if they are alike in two thirds of the windows in which either
is executed by dealt teams, and so does whatever is alike to one of them (single linkage).
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from harness import workers
from options.dealt import Job, known, played

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.settings import OptionSettings
from pitchlore.schemas.options import OPTIONS

MATCHES, _FIRST_SEED, _SECONDS = 20, 431_000, 120.0
_APART, _SHARE = 0.06, 2 / 3
FILE = Path(__file__).parent / "alike.csv"


def counted(seed: int, seconds: float) -> tuple[F64, F64]:
    """Windows in which each option was executed, [A], and those in which others were alike to it, [A, A]."""
    times, alike = np.zeros(len(OPTIONS)), np.zeros((len(OPTIONS), len(OPTIONS)))
    for own in known(played(Job(seed, noisy=False, every=1, seconds=seconds)), OptionSettings()):
        commands = own.windows.features[:, :, 6:8]  # mean speed and turn that the option commands
        mine = commands[np.arange(len(own.option)), own.option][:, None]
        np.add.at(times, own.option, 1)
        np.add.at(alike, own.option, np.abs(commands - mine).max(axis=2) < _APART)
    return times, alike


def main(path: Path = FILE, matches: int = MATCHES, seconds: float = _SECONDS) -> None:
    """Write each option's class and the options that it is alike to, with the share of windows."""
    with workers() as pool:
        parts = list(pool.map(counted, range(_FIRST_SEED, _FIRST_SEED + matches), [seconds] * matches))
    times, alike = (np.sum(each, axis=0) for each in zip(*parts, strict=True))
    share = alike / np.maximum(times, 1)[:, None]
    linked = (np.maximum(share, share.T) >= _SHARE) | np.eye(len(OPTIONS), dtype=np.bool_)
    group = np.arange(len(OPTIONS))
    for _ in OPTIONS:
        group = np.array([group[linked[option]].min() for option in range(len(OPTIONS))])
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["option", "counts_as", "windows", "alike"])
        for place, option in enumerate(OPTIONS):
            nearest = [k for k in np.argsort(-share[place]) if k != place]
            others = [f"{OPTIONS[k]:03d} {share[place, k]:.2f}" for k in nearest]
            out.writerow([option, OPTIONS[group[place]], int(times[place]), ", ".join(others[:4])])


def classes(path: Path = FILE) -> I64:
    """The class of each option, as an index in OPTIONS, int64 [A]."""
    with path.open(encoding="utf-8") as file:
        rows = {int(row["option"]): int(row["counts_as"]) for row in csv.DictReader(file)}
    return np.array([OPTIONS.index(rows[option]) for option in OPTIONS])


if __name__ == "__main__":
    main()
