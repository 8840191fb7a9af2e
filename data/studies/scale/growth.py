"""Growth with the number of matches: files, receipts, the catalogue, grams, the stages of all matches.

``growth.py`` (an hour; what was stopped goes on after the last size that had ended), or ``growth.py 10 40``
for other sizes. For each number of matches of one minute, in a data folder of its own: play them (`record`),
bring everything up to date (`run`), then once more with one match on top, and look at what is there.
``docs/explanation/scale.md`` is computed from the table.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import polars as pl
from harness import going_on
from scale.study import PLAYING, Bench, Cost

from pitchlore.pipeline.engine.stage import ALL
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Grams

SIZES = (10, 40, 160, 400)


class Growth(NamedTuple):
    """Size of a league.

    Attributes:
        matches: in the league.
        run_cpu_s, run_wall_s, run_peak_mib: costs of `run` from nothing (:class:`scale.study.Cost`).
        more_cpu_s, more_peak_mib: costs of `run` with one more match.
        more_read_mib: bytes that its stages read (`pitchlore runs`).
        behaviours_s, decisions_s, models_s, versions_s: seconds of its stages of all matches.
        files: in the data folder.
        data_mib: size of all of them.
        most_in_a_folder: files in the folder that has most.
        receipts: number of receipts.
        receipts_mib: size of all of them.
        largest_receipt_mib: size of the largest: it names the files of all matches.
        memo_mib: size of what a run has found done.
        catalogue_mib: size of the catalogue.
        catalogue_s: seconds of the clock in which a command makes the catalogue from nothing.
        question_s: the same of a question, when the catalogue stands.
        nothing_s: the same of `run` when nothing is new.
        distinct: distinct grams of all teams and lengths.
        grams_mib: size of their table, Parquet.
        decisions_mib: size of the table of all decisions, Parquet.
        knowledge_mib: size of the files of the newest version of the knowledge.
        manifest_mib: size of its manifest.
    """

    matches: int
    run_cpu_s: float
    run_wall_s: float
    run_peak_mib: float
    more_cpu_s: float
    more_peak_mib: float
    more_read_mib: float
    behaviours_s: float
    decisions_s: float
    models_s: float
    versions_s: float
    files: int
    data_mib: float
    most_in_a_folder: int
    receipts: int
    receipts_mib: float
    largest_receipt_mib: float
    memo_mib: float
    catalogue_mib: float
    catalogue_s: float
    question_s: float
    nothing_s: float
    distinct: int
    grams_mib: float
    decisions_mib: float
    knowledge_mib: float
    manifest_mib: float


def measure(matches: int) -> Growth:
    """The size of a league of so many matches."""
    with tempfile.TemporaryDirectory(prefix="pitchlore-growth-") as root:
        bench = Bench(Path(root) / "league", matches)
        bench.call(*PLAYING, bench.minutes, "--matches", matches - 1)
        begun = bench.cost(matches - 1, "run from nothing", "run")
        bench.play(1_000_001)
        more = bench.cost(matches, "one more", "run")
        return _look(bench, matches, begun, more)


def _look(bench: Bench, matches: int, begun: Cost, more: Cost) -> Growth:
    files = {path: path.stat().st_size for path in bench.data.rglob("*") if path.is_file()}
    receipts = {path: size for path, size in files.items() if path.name.endswith(".receipt.json")}
    folders = pl.Series([str(path.parent) for path in files]).value_counts()
    store = Store(bench.data)
    behaviours = store.receipt("behaviours", ALL)
    decisions = store.receipt("decisions", ALL)
    knowledge = store.latest("knowledge")
    assert behaviours is not None
    assert decisions is not None
    assert knowledge is not None
    (last,) = json.loads(bench.call("runs", "--last", 1, "--json").stdout)
    seconds = {stage["noun"]: round(stage["cost"]["seconds"], 3) for stage in last["stages"]}
    grams = store.read_table(behaviours, Grams.NAME, Grams)
    catalogue = bench.data / "catalog.duckdb"
    size = catalogue.stat().st_size
    catalogue.unlink()
    return Growth(
        matches=matches, run_cpu_s=begun.cpu_s, run_wall_s=begun.wall_s, run_peak_mib=begun.peak_mib,
        more_cpu_s=more.cpu_s, more_peak_mib=more.peak_mib, more_read_mib=_mib(last["cost"]["bytes_in"]),
        behaviours_s=seconds["behaviours"], decisions_s=seconds["decisions"], models_s=seconds["models"],
        versions_s=round(seconds["knowledge"] + seconds["policies"], 3),
        files=len(files), data_mib=_mib(sum(files.values())),
        most_in_a_folder=max(folders["count"].to_list()),
        receipts=len(receipts), receipts_mib=_mib(sum(receipts.values())),
        largest_receipt_mib=_mib(max(receipts.values())),
        memo_mib=_mib(files[bench.data / ".done.json"]), catalogue_mib=_mib(size),
        catalogue_s=_seconds(bench, "sql", "select 1"), question_s=_seconds(bench, "sql", "select 1"),
        nothing_s=_seconds(bench, "run"),
        distinct=grams.height, grams_mib=_mib(behaviours.files[Grams.NAME].size),
        decisions_mib=_mib(sum(record.size for record in decisions.files.values())),
        knowledge_mib=_mib(sum(record.size for record in knowledge.files.values())),
        manifest_mib=_mib(len(json.dumps(knowledge.model_dump(mode="json"), indent=1))))


def _seconds(bench: Bench, *words: str) -> float:
    begun = time.monotonic()
    bench.call(*words)
    return round(time.monotonic() - begun, 2)


def _mib(size: int) -> float:
    return round(size / (1 << 20), 3)


def main(out: Path, sizes: Sequence[int] = SIZES) -> None:
    """Measure, and write the table as it grows."""
    with going_on(out, __file__) as parts:
        for ended in range(1, len(sizes) + 1):
            rows = parts(sizes[:ended], measure)
            pl.DataFrame(rows, schema=list(Growth._fields), orient="row").write_csv(out / "growth.csv")
            print(rows[-1], flush=True)


if __name__ == "__main__":
    main(Path(__file__).parent, [int(word) for word in sys.argv[1:]] or SIZES)
