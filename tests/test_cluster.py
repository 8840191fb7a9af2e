"""Dask: workers of a cluster do the same work with the same bytes, whoever of them is killed."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest
from conftest import ROOT, clip, run
from support.buckets import Served, files, served
from support.deeds import die, refuse
from support.processes import eventually, pitchlore
from support.sockets import listened
from test_costs import kept

pytest.importorskip("distributed", reason="the extra dask is not installed")

import dask
from distributed.comm.core import CommClosedError

from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.base.errors import BadSettings, ClusterFailed, StorageFailed, WorkerLost
from pitchlore.pipeline.engine.evaluations import evaluate
from pitchlore.pipeline.engine.placement import cluster
from pitchlore.pipeline.engine.placement.identity import first_difference, identity
from pitchlore.pipeline.engine.placement.places import executors_at, place_of
from pitchlore.pipeline.engine.record import record_match
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.run import import_recordings
from pitchlore.pipeline.engine.season import play_seasons
from pitchlore.pipeline.engine.tasks import spread
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.stages.evaluations import Entrant, Evaluation
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store, mirrors

pytestmark = [pytest.mark.slow]

#: A season of seconds.
STATIC = TeamSettings(kind="static")
SEASON = 'base = "paper"\ngames = {games}\nlead_from = {games}\n[referee]\nduration_s = 5'


class Cluster:
    """A scheduler and workers, each in a folder of its own with another HOME and another PATH."""

    def __init__(self, root: Path, names: tuple[str, ...], **environment: str) -> None:
        self.root = root
        self.environment = environment
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.begin("scheduler", "dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
                   "--scheduler-file", str(root / "scheduler.json"))
        said = json.loads(eventually(lambda: (root / "scheduler.json").exists() and (root / "scheduler.json").read_text()))
        self.port = int(said["address"].rpartition(":")[2])
        for name in names:
            self.work(name)

    @property
    def on(self) -> str:
        return f"dask://127.0.0.1:{self.port}"

    def work(self, name: str, **environment: str) -> None:
        """Start a worker."""
        self.begin(name, "dask_worker", f"tcp://127.0.0.1:{self.port}", "--nthreads", "1", "--no-nanny",
                   "--no-dashboard", "--local-directory", str(self.root / f"{name}-space"), **environment)

    @contextmanager
    def joined(self, name: str, **environment: str) -> Iterator[None]:
        """One more worker, while the body runs."""
        self.work(name, **environment)
        try:
            yield
        finally:
            self.kill(name)
            with executors_at(self.on, self.root / "data") as executors:
                eventually(lambda: executors.width == 2)

    def begin(self, name: str, program: str, *words: str, **environment: str) -> None:
        home = self.root / name
        home.mkdir(exist_ok=True)
        there = {"HOME": str(home), "PATH": f"{home}:/usr/bin:/bin", "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False", **self.environment, **environment}
        with (home / "log").open("ab") as log:
            self.processes[name] = subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{program}", *words], cwd=home, env=there,
                stdout=log, stderr=subprocess.STDOUT)

    def kill(self, name: str) -> None:
        """Kill a process."""
        process = self.processes.pop(name)
        process.kill()
        process.wait()

    def stop(self) -> None:
        for name in list(self.processes):
            self.kill(name)


@contextmanager
def started(root: Path, *names: str, **environment: str) -> Iterator[Cluster]:
    own = Cluster(root, names, **environment)
    try:
        with executors_at(own.on, root / "data") as executors:
            eventually(lambda: executors.width == len(names))
        yield own
    finally:
        own.stop()


@pytest.fixture(scope="module")
def buckets() -> Iterator[Served]:
    with served() as own:
        yield own


@pytest.fixture(scope="module")
def workers(tmp_path_factory, buckets) -> Iterator[Cluster]:
    with started(tmp_path_factory.mktemp("cluster"), "one", "two", **buckets.environment) as own:
        yield own


def running(cluster: Cluster, folder: Path) -> subprocess.Popen[str]:
    """A command that runs the league of a folder on a cluster."""
    return subprocess.Popen(pitchlore("run", "--on", cluster.on, "--data", "league"), cwd=folder, text=True,
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def league(folder: Path, matches: int = 2) -> Path:
    """A folder with a data folder named league, and recordings in its inbox."""
    inbox = folder / "league" / "inbox"
    inbox.mkdir(parents=True)
    for number in range(matches):
        clip(60.0 * number, 60.0 * number + 6.0).write_csv(inbox / f"part-{number}.csv")
    return folder


def brought(folder: Path, on: str, work: Callable[[Path, str], None]) -> dict[str, bytes]:
    """All files of a data folder, named by a relative path, after some work."""
    data, before = Path("league"), Path.cwd()
    os.chdir(folder)
    try:
        work(data, on)
        return products(data)
    finally:
        os.chdir(before)


def everything(data: Path, on: str) -> None:
    """A run, two seasons of one game and of two, an evaluation and two matches."""
    assert run(data, on=on).failures == {}
    seasons = [Season(name="short", opponent="static", seed=games, settings=parse_season(SEASON.format(games=games), where="short.toml"))
               for games in (1, 2)]
    assert play_seasons(data, seasons, on=on).failed == {}
    played(data, on)


def played(data: Path, on: str) -> None:
    """An evaluation and two matches."""
    with executors_at(on, Store(data).root) as executors:
        pairs = Evaluation(team=scripted("static"), opponent=scripted("random"), referee=RefereeSettings(duration_s=2.0))
        evaluate(Store(data), pairs, range(2), {}, executors)
        recipes = [Recipe(home=STATIC, away=STATIC, referee=RefereeSettings(duration_s=2.0), seed=seed) for seed in (1, 2)]
        list(spread(executors, record_match, ((recipe.match_id, {"data": executors.path(Store(data).root), "recipe": recipe, "policies": {}})
                                              for recipe in recipes), 2))


def scripted(kind: str) -> Entrant:
    return Entrant(name=kind, settings=TeamSettings(kind=kind))


def products(data: Path) -> dict[str, bytes]:
    return {name: content for name, content in files(data).items() if not name.endswith(".csv")}


def same(made: dict[str, bytes], wanted: dict[str, bytes]) -> bool:
    """True if the same files have the same bytes; the names of those that have not are shown."""
    assert sorted(made) == sorted(wanted)
    assert [name for name in made if made[name] != wanted[name]] == []
    return bool(made)


@pytest.fixture(scope="module")
def alone(tmp_path_factory) -> dict[str, bytes]:
    """Outputs that one process makes."""
    return brought(league(tmp_path_factory.mktemp("alone")), "threads:1", everything)


def test_same_bytes(workers, alone, tmp_path):
    """Two workers in other folders, with another HOME and PATH, make the bytes of one process."""
    assert same(brought(league(tmp_path), workers.on, everything), alone)


def test_bucket(workers, buckets, alone, tmp_path, monkeypatch, call):
    """So do workers that share nothing but a bucket, each with a copy of its own; that of the command knows all."""
    for name, value in {**buckets.environment, "XDG_CACHE_HOME": str(tmp_path / "cache")}.items():
        monkeypatch.setenv(name, value)
    url, recordings = buckets.new(), league(tmp_path) / "league" / "inbox"
    for file in recordings.iterdir():
        buckets.put(url, f"inbox/{file.name}", file.read_bytes())
    everything(Path(url), workers.on)
    made = {re.sub(r"(/v\d{4,}/)[0-9a-f]{12}\.", r"\1", key): data for key, data in buckets.objects(url).items()
            if not key.endswith(".csv") and not key.startswith("runs/")}
    assert same(made, alone)
    store = Store(Path(url))
    with monkeypatch.context() as elsewhere:  # a machine that has no copy yet knows of the run, too
        elsewhere.setenv("XDG_CACHE_HOME", str(tmp_path / "another"))
        elsewhere.setattr(mirrors, "_copies", {})
        assert [(entry["what"], entry["failed"]) for entry in json.loads(call("runs", "--json", "--data", url)[1])] == [("run", 0)]
    known = {path.name for path in store.root.rglob("*.receipt.json")}
    assert known == {Path(key).name for key in made if key.endswith(".receipt.json")}
    assert verify_all(store).problems == []
    assert len(list(workers.root.rglob(".bucket.json"))) == 2


def test_processes(alone, tmp_path):
    """So do two processes of the command, of matches. (test_costs.py has a run, test_season_flow.py seasons.)"""
    made = brought(tmp_path, "processes:2", played)
    assert same(made, {name: data for name, data in alone.items() if name in made})
    assert {name.partition("/")[0] for name in made} == {"matches", "evaluations"}


def test_costs(workers, tmp_path):
    """The cost of a piece that a worker did comes back with its result."""
    recording = next((league(tmp_path) / "league" / "inbox").iterdir())
    report = import_recordings(tmp_path / "data", [Recording(file=recording)], on=workers.on)
    assert report.failed == {}
    cost = report.cost
    assert (cost.pieces, cost.bytes_in, cost.bytes_out) == (
        1, recording.stat().st_size, kept(tmp_path / "data", "matches"))
    assert cost.slowest_s == cost.seconds > 0


def test_local_cluster(tmp_path):
    """A cluster of processes for one command, on loopback. Work that kills all who try it is given up; other work is done."""
    before = listened(os.getpid())
    with cluster.dask.config.set({"distributed.scheduler.allowed-failures": 1}), executors_at("dask:local:2", tmp_path) as executors:
        assert executors.width == 2
        assert executors.run(os.getpid) != os.getpid()
        sockets = listened(os.getpid()) - before
        assert len(sockets) >= 3
        assert {address for _, address, _ in sockets} == {"127.0.0.1"}
        with pytest.raises(StorageFailed) as refused:
            executors.run(refuse)
        with pytest.raises(WorkerLost, match="2 workers that did this were killed"):
            executors.run(die)
        assert executors.run(int, "7") == 7
    assert str(refused.value) == "m.parquet: cannot be written. Free space."


def test_killed_at_the_start(tmp_path):
    """A worker of a command's own that is killed before it has begun is said in a line."""
    deadly = tmp_path / "deadly.py"
    deadly.write_text("import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    with dask.config.set({"distributed.worker.preload": [str(deadly)]}), \
         pytest.raises(ClusterFailed, match=r"^dask:local: the Dask workers of this command did not start\. Run the command again\.$"), \
         cluster.open_cluster("", 1, tmp_path):
        pass


def test_other_code(workers, call, tmp_path):
    """A worker of other code is refused in one line before it works."""
    copy = tmp_path / "copy"
    for package in ("pitchlore", "flows", "pipeline", "schemas"):
        shutil.copytree(ROOT / package, copy / package, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    with (copy / "pipeline" / "game" / "pitch.py").open("a") as file:
        file.write("# other code\n")
    data = league(tmp_path, 1) / "league"
    with executors_at(workers.on, tmp_path / "data") as executors, workers.joined("other", PYTHONPATH=str(copy)):
        eventually(lambda: executors.width == 3)
        code, out, err = call("run", "--on", workers.on, "--data", data)
    assert (code, out) == (1, "")
    assert "has other code (pitchlore 0.1.0+" in err.splitlines()[-1]
    assert not list(data.glob("*/*.receipt.json"))


def test_killed(workers, alone, tmp_path):
    """A worker that is killed loses nothing: another does its work, and finds what is done.

    If the scheduler ends the command says so in one line; run again, it goes on with what is left. (This
    test is the last of the cluster: nothing is left of it.)
    """
    folder = league(tmp_path / "one")
    with running(workers, folder) as command:
        eventually(lambda: list((folder / "league").glob("trajectories/*.receipt.json")))
        workers.kill("one")
        assert command.poll() is None
        _, said = command.communicate(timeout=60)
    assert command.returncode == 0, said
    made = products(folder / "league")
    assert same(made, {name: data for name, data in alone.items() if name in made})
    folder = league(tmp_path / "two")
    with running(workers, folder) as command:
        eventually(lambda: list((folder / "league").glob("matches/*.receipt.json")))
        workers.kill("scheduler")
        _, said = command.communicate(timeout=60)
    assert command.returncode == 1
    assert "the Dask scheduler has ended" in said
    assert "Traceback" not in said
    assert run(folder / "league").failures == {}
    made = products(folder / "league")
    assert same(made, {name: data for name, data in alone.items() if name in made})


def answering(*answers):
    """A client whose workers give these answers."""
    return SimpleNamespace(run=lambda *_, **__: {f"tcp://w{n}": answer for n, answer in enumerate(answers)})


@pytest.mark.parametrize(("answer", "says"), [
    (ModuleNotFoundError("No module named 'pitchlore'"), "cannot work (ModuleNotFoundError: No module named 'pitchlore')"),
    (({"pitchlore": "0.0.1"}, b"", True), "has other code (pitchlore 0.0.1, here 0.1.0+"),
    ((None, None, True), "does not see the data folder"),
    ((None, "seen", False), "does not respect the locks of"),
])
def test_unfit_worker(tmp_path, monkeypatch, answer, says):
    """A worker without Pitchlore, with another, without the disk or without its locks is refused in one line."""
    monkeypatch.setattr(os, "urandom", lambda n: b"t" * n)
    if isinstance(answer, tuple):
        answer = (answer[0] or identity(), b"t" * 16 if answer[1] == "seen" else answer[1], answer[2])
    with pytest.raises(ClusterFailed) as refused:
        cluster._check(answering((identity(), b"t" * 16, True), answer), tmp_path, "tcp://s:8786")
    said = str(refused.value)
    assert said.startswith("worker tcp://w1 of tcp://s:8786: ")
    assert says in said
    assert "\n" not in said
    assert list(tmp_path.iterdir()) == []


def test_ending_worker(tmp_path, monkeypatch):
    """A worker that ends while it is asked is no reason to refuse the others; one that never answers is."""
    monkeypatch.setattr(os, "urandom", lambda n: b"t" * n)
    monkeypatch.setattr(cluster, "_POLL_S", 0.01)
    fit = identity(), b"t" * 16, True
    answers = iter([{"tcp://w0": fit, "tcp://w1": CommClosedError("closed")}, {"tcp://w0": fit}])
    cluster._check(SimpleNamespace(run=lambda *_, **__: next(answers)), tmp_path, "tcp://s:8786")
    monkeypatch.setattr(cluster, "GONE_S", 0.1)
    with pytest.raises(ClusterFailed, match=r"worker tcp://w1 of tcp://s:8786: cannot work \(CommClosedError"):
        cluster._check(answering(fit, CommClosedError("closed")), tmp_path, "tcp://s:8786")


def test_a_checkout_that_is_not_installed(monkeypatch):
    """Code without the metadata of an installation has the same identity; a package that is not there is named."""
    installed, requires = identity(), metadata.requires("pitchlore")

    def absent(name: str) -> None:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "requires", absent)
    assert identity.__wrapped__() == installed
    monkeypatch.setattr(metadata, "requires", lambda _: [*requires, "no-such-package>=1"])
    assert identity.__wrapped__() == installed
    monkeypatch.setattr(metadata, "version", absent)
    assert first_difference(identity.__wrapped__(), installed)[1] == "none"


def test_late_worker():
    """A worker that comes after the check checks itself."""
    with pytest.raises(ClusterFailed, match=r"a worker has other code than the command \(pitchlore .*, there 0\.0\.1\)"):
        cluster._call({**identity(), "pitchlore": "0.0.1"}, None, int, (), {})


@pytest.mark.parametrize("words", [("run",), ("record", "--matches", "2")])
def test_nobody_there(tmp_path, call, monkeypatch, words):
    """Nobody at the address is one line, before anything is done."""
    monkeypatch.setattr(cluster, "ANSWER_S", 1)
    code, _, err = call(*words, "--on", "dask://127.0.0.1:9", "--data", league(tmp_path, 1) / "league")
    assert code == 1
    assert err.splitlines()[-1] == (
        "pitchlore: tcp://127.0.0.1:9: no Dask scheduler answers. Start one (dask scheduler), and its workers (dask worker).")


def test_words():
    """Words for places."""
    assert place_of("threads:3")[:2] == ("threads", 3)
    assert place_of("dask:local:2")[:2] == ("dask:local", 2)
    assert place_of("dask://host:8786").address == "tcp://host:8786"
    for word in ("threads:0", "thread:1", "dask://host", "dask:3", "processes:", "threads:10000", ""):
        with pytest.raises(BadSettings, match="is no place to work"):
            place_of(word or " ")
