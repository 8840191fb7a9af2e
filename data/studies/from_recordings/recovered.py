"""Kappa of recovered and executed options, in recordings of demonstrators that log their options.

``recovered.py DATA``, after ``study.py`` and ``psim.py``, takes the first eight recordings of each that DATA
has, from our arena and from pSim, and writes ``recovered.csv``: Cohen's kappa between what was executed, each
0.2 s, and what the table ``options`` says (:mod:`options.study`). Options are recovered with our robots'
limits, and with robots as the recordings show them; in pSim also with the limits of its own.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import polars as pl
from from_recordings.executed import decisions_beside
from from_recordings.psim import MEASURED, ROBOTS
from from_recordings.study import FOLDER, LOGS_OPTIONS
from options.study import Seen, rows_of, seen

from pitchlore.pipeline import matches
from pitchlore.pipeline.settings import OptionSettings

#: Recordings that are looked at; by where they were made and how our executors drive: the end of the folder's
#: name, and settings.
MATCHES = 8
WAYS = {("our arena", "as ours"): ("", OptionSettings()), ("our arena", "as measured"): ("", MEASURED),
        ("pSim", "as ours"): ("-psim", OptionSettings()), ("pSim", "as pSim's"): ("-psim", ROBOTS),
        ("pSim", "as measured"): ("-psim", MEASURED)}
#: Columns of :func:`options.study.rows_of` that the table has.
SAID = ("options", "decisions", "recovered", "recognised", "shuffled")


def looked(path: Path, settings: OptionSettings) -> Seen:
    """A recording, beside the decisions that lie by it."""
    log = matches.read(path.read_bytes(), where=path.name)
    return seen(replace(log, decisions=pl.read_parquet(decisions_beside(path))), settings)


def main(data: Path, out: Path = FOLDER, count: int = MATCHES) -> pl.DataFrame:
    """Look at the recordings that are there, and write the table."""
    rows = []
    for team in LOGS_OPTIONS:
        for (where, drive), (end, settings) in WAYS.items():
            found = sorted((data / "recordings" / f"{team}{end}").glob("*.mcap"))[:count]
            if len(found) == count:
                parts = [looked(path, settings) for path in found]
                rows += [{"demonstrator": team, "recorded in": where, "executors drive": drive,
                          **{name: row[name] for name in SAID}} for row in rows_of(team, False, 1, parts)]
                print(rows[-2:], flush=True)
    table = pl.DataFrame(rows)
    table.write_csv(out / "recovered.csv")
    return table


if __name__ == "__main__":
    main(Path(sys.argv[1]))
