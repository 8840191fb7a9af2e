"""Shared by all tests: Prefect that talks to nobody, and places of recordings."""

from __future__ import annotations

import atexit
import gc
import os
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import hypothesis
import polars as pl
import pytest
from support.sessions import FOLDER, QUIET, RELAY, keep_migrated, migrated, once

from pitchlore import pipeline  # noqa: F401 - before any test imports numba: it says where numba keeps its cache
from pitchlore.flows.server import Process
from pitchlore.pipeline.base.system import cores
from pitchlore.pipeline.engine.child import collect_rarely

if TYPE_CHECKING:
    from pitchlore.pipeline.engine.progress import RunReport

collect_rarely()
os.environ["PREFECT_SERVER_ANALYTICS_ENABLED"] = "false"
os.environ["PREFECT_LOGGING_LEVEL"] = "CRITICAL"
os.environ["DO_NOT_TRACK"] = "1"
os.environ.setdefault("PITCHLORE_ON", "threads:2")  # processes take a second to start: tests that want some say so
os.environ.pop("PYTHONUNBUFFERED", None)  # commands buffer their output, as a user's do

# a slow machine is no failure; CI repeats the same examples, a developer's runs try new ones each time
hypothesis.settings.register_profile(
    "pitchlore", deadline=None, derandomize=bool(os.environ.get("CI")), max_examples=30, print_blob=True)
hypothesis.settings.load_profile("pitchlore")

ROOT = Path(__file__).parent.parent
SAMPLE = ROOT / "data" / "samples" / "rsim-vss-3v3.parquet"
RECORDINGS = ROOT.parent / "shared" / "matches"


TIERS = ("prefect", "slow", "unit")
#: Fixtures that run every stage, or draw all pages.
WHOLE = {"finished", "pages"}

#: Files whose tests start many processes, play, or read whole recordings: as slow as those that say so.
LONG = {f"test_{name}.py" for name in (
    "catalog", "chances", "clock", "commands", "drive", "following", "groups", "hostile", "importers_ssl_fuzz",
    "importers_ssl_peer", "incremental", "paradigms", "query", "recovery", "schemas", "scout_maps", "scout_policies",
    "season_flow", "showing", "watch")}

#: A folder in memory, for the temporary files of all tests if it has so many bytes of room: they wait for no disk.
MEMORY, ROOM = "/dev/shm", 4 << 30


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put every test in its tier: slow where it says so or needs a whole run, prefect with a server, else unit.

    The files come in the order of their longest tier, so that no worker is left with a long one in the end.
    """
    of_file: dict[Path, int] = {}
    for item in items:
        needs = set(getattr(item, "fixturenames", ()))
        slow = (item.get_closest_marker("slow") or needs & WHOLE or item.path.name in LONG
                or item.path.parent.name == "studies")
        tier = "slow" if slow else "prefect" if "prefect_server" in needs else "unit"
        item.add_marker(tier)
        of_file[item.path] = min(TIERS.index(tier), of_file.get(item.path, len(TIERS)))
    items.sort(key=lambda item: of_file[item.path])


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """A file's tests share fixtures, so a worker takes whole files.

    One worker takes all files that need Prefect's server, and one all that need a browser.
    """
    from xdist.scheduler import LoadFileScheduling

    @cache
    def scope(path: str) -> str:
        text = (ROOT / path).read_text(encoding="utf-8")
        return next((word for word in ("prefect_server", "browser") if word in text), path)

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return scope(nodeid.partition("::")[0])

    return Scheduling(config, log)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One more worker than cores: often tests wait."""
    return cores() + 1


def pytest_configure(config: pytest.Config) -> None:
    """Give the session a folder that its processes share, and Prefect a home in it."""
    if not hasattr(config, "workerinput"):  # the session's first process: the others inherit its environment
        if Path(MEMORY).is_dir() and shutil.disk_usage(MEMORY).free >= ROOM:
            os.environ["TMPDIR"], tempfile.tempdir = MEMORY, None
        os.environ[FOLDER] = folder = tempfile.mkdtemp(prefix="pitchlore-tests-")
        os.environ["PREFECT_HOME"] = str(Path(folder) / "home")
        config.add_cleanup(lambda: shutil.rmtree(folder, ignore_errors=True))


def pytest_sessionfinish() -> None:
    """Collect once what the tests left; pytest would five times, in a heap of a million objects."""
    gc.collect()
    gc.freeze()
    atexit.register(gc.unfreeze)


@pytest.fixture(scope="session")
def prefect_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Flows of this process talk to a Prefect server with a database of its own. Its address."""
    from prefect.settings import PREFECT_API_URL, PREFECT_FLOWS_HEARTBEAT_FREQUENCY, temporary_settings

    from pitchlore.flows import serving

    home = tmp_path_factory.mktemp("prefect")
    server = Process({**os.environ, **QUIET, "PREFECT_HOME": str(migrated(home)), "PREFECT_UI_ENABLED": "false"})
    try:
        server.wait()
        keep_migrated(home)
        # a server that is slow on a busy machine ends a command; here it would end the worker with all its tests
        serving.SILENT, serving.ANSWER_S = 30, 120.0
        with temporary_settings({PREFECT_API_URL: server.record.api, PREFECT_FLOWS_HEARTBEAT_FREQUENCY: None}):
            yield server.record.api
    finally:
        server.stop()


@pytest.fixture(scope="session")
def relayed(prefect_server: str, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment of a command that starts a server of its own, which asks that one: Prefect's takes seconds to load."""
    folder = tmp_path_factory.mktemp("relay")
    port = prefect_server.removesuffix("/api").rpartition(":")[2]
    (folder / "uvicorn.py").write_text(RELAY.replace("{port}", port))
    return {"PYTHONPATH": str(folder)}


@pytest.fixture(scope="session")
def store(tmp_path_factory):
    """A league of two matches; all processes of a session read the same one."""
    from support.league import shared

    return shared(tmp_path_factory)


@pytest.fixture(scope="session")
def pages(store):
    """The scout's pages of that league."""
    from pitchlore.pipeline.views.scout.content.write import write_pages

    return write_pages(store)


@pytest.fixture(scope="session")
def browser():
    """A browser, headless; skips where there is none."""
    from support.league import BROWSER

    if BROWSER is None:
        pytest.skip("there is no chromium on this machine")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as player:
        opened = player.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture
def timed(benchmark):
    """Time so many units of work, as pytest-benchmark's pedantic takes it; the result of the work."""
    def run(units, unit, *work, **options):
        benchmark.extra_info.update(units=units, unit=unit)
        return benchmark.pedantic(*work, **options)

    return run


@pytest.fixture
def page(browser):
    """A page whose errors fail the test."""
    errors: list[str] = []
    opened = browser.new_page(viewport={"width": 1366, "height": 768})
    opened.on("console", lambda said: errors.append(said.text) if said.type == "error" else None)
    opened.on("pageerror", lambda error: errors.append(str(error)))
    # what is still under way when the page is left is no failure
    opened.on("requestfailed", lambda request: (
        None if request.failure == "net::ERR_ABORTED" else errors.append(request.url)))
    yield opened
    opened.close()
    assert errors == []


@pytest.fixture
def call(capsys, monkeypatch, request):
    """Call `pitchlore …`; exit code, standard output, standard error. What it says on errors is in the report."""
    monkeypatch.setenv("COLUMNS", "250")

    from pitchlore.flows.cli import main

    def run(*words: str) -> tuple[int, str, str]:
        try:
            main([str(word) for word in words])
            code = 0
        except SystemExit as stop:
            code = int(stop.code or 0)
        said = capsys.readouterr()
        request.node.add_report_section("call", f"standard error of {words[0]}, which ended with {code}", said.err)
        return code, said.out, said.err

    return run


def clip(start_s: float, end_s: float) -> pl.DataFrame:
    """A stretch of the sample recording, in its own form (a tracking table)."""
    table = pl.read_parquet(SAMPLE)
    return table.filter(pl.col("t").is_between(start_s, end_s, closed="left"))


@pytest.fixture
def derby(tmp_path) -> Path:
    """A recording of five seconds."""
    clip(0.0, 5.0).write_csv(tmp_path / "derby.csv")
    return tmp_path / "derby.csv"


@pytest.fixture(scope="session")
def clips(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("clips")
    for name, (start, end) in {"early": (0.0, 60.0), "late": (290.0, 350.0)}.items():
        clip(start, end).write_parquet(folder / f"{name}.parquet")
    return folder


def fill(data: Path, clips: Path) -> None:
    shutil.copytree(clips, data / "inbox")


def run(data: Path, **options) -> RunReport:
    """One run of all stages."""
    from pitchlore.flows import work

    return work.run(data, **options)


@pytest.fixture(scope="session")
def finished(tmp_path_factory, clips) -> Path:
    """A data folder after one whole run, which one process of the session does for all; a copy for this one."""
    def make(data: Path) -> None:
        fill(data, clips)
        assert run(data).failures == {}

    data = tmp_path_factory.mktemp("finished") / "data"
    return shutil.copytree(once(tmp_path_factory, "finished-run", make), data)


@pytest.fixture
def copied(finished, tmp_path) -> Path:
    """A copy of that folder, for a test that changes it."""
    return shutil.copytree(finished, tmp_path / "data")
