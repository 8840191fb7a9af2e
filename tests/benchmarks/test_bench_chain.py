"""The whole chain of one match, Prefect aside: seconds of play per second, on one thread of stages."""

import io
import shutil
import subprocess
import sys
import textwrap
from itertools import takewhile
from pathlib import Path

import pytest
from conftest import SAMPLE
from support.receipts import put_receipt, receipt_at
from support.recordings import RSIM, bodies_of

from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stage import Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.store.tables import to_parquet
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import Trajectories

PLAY_S = 600.0
SETTINGS = Settings()
UP_TO_BEHAVIOURS = tuple(takewhile(lambda noun: noun != "decisions", STAGES.of_matches))


def chain(data: Path) -> None:
    """Recording to behaviours, every file written, checked and synced."""
    store = Store(data)
    receipt, *_ = take_in(store, Recording(file=SAMPLE))
    STAGES.make(store, SETTINGS, Scope(matches=(receipt.name,)), UP_TO_BEHAVIOURS)


@pytest.mark.benchmark(group="a match from recording to behaviours, files written and synced")
def test_ours(timed, tmp_path):
    chain(tmp_path / "warm")
    folders = iter(range(100))
    timed(PLAY_S, "seconds of play", lambda: chain(tmp_path / str(next(folders))), rounds=5)


@pytest.mark.benchmark(group="trajectories to Parquet")
@pytest.mark.parametrize("how", ["ours, checked against the schema", "polars, zstd 1, unchecked", "pyarrow defaults"])
def test_write(benchmark, how):
    import pyarrow.parquet

    table = bodies_of(RSIM)

    def plain() -> bytes:
        buffer = io.BytesIO()
        if how.startswith("polars"):
            table.write_parquet(buffer, compression="zstd", compression_level=1)
        else:
            pyarrow.parquet.write_table(table.to_arrow(), buffer)
        return buffer.getvalue()

    run = (lambda: to_parquet(table, Trajectories, where="x")) if how.startswith("ours") else plain
    benchmark.extra_info.update(units=table.height, unit="rows", megabytes=round(len(run()) / 1e6, 2))
    benchmark.pedantic(run, rounds=7)


MERGE = textwrap.dedent("""
    import resource, sys
    from pathlib import Path
    from pitchlore.pipeline.engine.stage import Output
    from pitchlore.pipeline.engine.stages import STAGES
    from pitchlore.pipeline.engine.update import scope_of
    from pitchlore.pipeline.settings import Settings
    from pitchlore.pipeline.store import Store
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    store, settings = Store(Path(sys.argv[1])), Settings()
    STAGES.perform(store, STAGES["behaviours"], Output("all"), settings.behaviours, scope_of(store))
    print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024)
""")


@pytest.mark.benchmark(group="behaviours of four over many matches")
@pytest.mark.parametrize("copies", [10, 100, 1000], ids=lambda n: f"ours, {n} matches")
def test_many(benchmark, tmp_path, copies):
    """Copies of one match under other ids: the same distinct grams, so memory must not grow with them."""
    store = Store(tmp_path)
    chain(tmp_path)
    (name,) = (receipt.name for receipt in store.receipts("matches"))
    for index in range(copies - 1):
        for noun in ("matches", "sides", "sequences"):
            said = receipt_at(tmp_path / noun / f"{name}.receipt.json")
            copy = f"copy{index}-{name}"
            put_receipt(tmp_path / noun / f"{copy}.receipt.json", said, name=copy)
    assert len(list(store.receipts("sequences"))) == copies

    def run() -> str:
        return subprocess.run([sys.executable, "-c", MERGE, str(tmp_path)], check=True, capture_output=True,
                              text=True).stdout

    benchmark.extra_info.update(units=copies, unit="matches")
    benchmark.extra_info["megabytes more"] = int(benchmark.pedantic(run, rounds=1))


@pytest.mark.benchmark(group="SQL over 100 matches")
def test_sql_ours(timed, tmp_path):
    from pitchlore.pipeline.engine.catalog import refresh

    store = Store(tmp_path)
    chain(tmp_path)
    receipt = next(iter(store.receipts("situations")))
    for index in range(99):
        path = tmp_path / "situations" / f"copy{index}-{receipt.name}.receipt.json"
        file = receipt.files["situations"]
        copy = tmp_path / "situations" / f"copy{index}.parquet"
        shutil.copy(tmp_path / file.path, copy)
        files = {"situations": file.model_copy(update={"path": f"situations/{copy.name}"})}
        store.commit(Work("matches", f"copy{index}", {}, version=1), Made())
        path.write_text(receipt.model_copy(update={"name": f"copy{index}", "files": files}).model_dump_json())
    catalog = refresh(store)[0]
    sql = ("select match_id, team, name, count(*) n, avg((end_ns-start_ns)/1e9) s from situations "
           "group by all order by n desc")
    assert timed(100, "matches", lambda: ask(catalog, sql), rounds=5).height > 0
