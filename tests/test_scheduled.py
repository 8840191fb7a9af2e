"""The flows that a schedule runs: their lines, their states, and the deployments that prefect.yaml names."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml
from conftest import ROOT, clip
from support.processes import eventually
from support.sessions import QUIET, migrated
from support.terminal import terminal

from pitchlore.flows.server import Keeper, Process, database
from pitchlore.pipeline.engine.history import log
from pitchlore.pipeline.settings import PolicySettings, Settings
from pitchlore.pipeline.store import Store


@pytest.mark.usefixtures("prefect_server")
def test_run_states(tmp_path, capsys):
    """A run says in one line and in its state what it did.

    Completed with what was made, then with nothing new; Failed, named Quarantined, if something was refused.
    """
    from pitchlore.flows.scheduled import scheduled_run

    (tmp_path / "inbox").mkdir()
    clip(0.0, 40.0).write_csv(tmp_path / "inbox" / "derby.csv")
    states = [scheduled_run(tmp_path, return_state=True) for _ in range(2)]
    (tmp_path / "inbox" / "notes.txt").write_text("dear diary")
    states.append(scheduled_run(tmp_path, return_state=True))
    assert [(state.type.value, state.name) for state in states] == [
        ("COMPLETED", "Completed"), ("COMPLETED", "Completed"), ("FAILED", "Quarantined")]
    assert re.fullmatch(r"\d+ made, 0 kept, policy version 1 is new", states[0].message)
    assert states[1].message == "nothing new"
    assert re.fullmatch(rf"0 made, \d+ kept, 1 not made: matches {tmp_path}/inbox/notes.txt", states[2].message)
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(": ")[2] for line in lines] == [state.message for state in states]
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d run [a-z-]+: ", line) for line in lines)
    assert states[0].result()["policy"] == 1
    assert [record.noun for record in Store(tmp_path).quarantined()] == ["matches"]


@pytest.mark.slow
@pytest.mark.usefixtures("prefect_server")
def test_serve_alone(tmp_path, monkeypatch):
    """Without a server, serve starts one, does the runs that are due one by one, and takes the server with it."""
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    migrated(Keeper(tmp_path).folder, database())
    (tmp_path / "inbox").mkdir()
    clip(0.0, 5.0).write_csv(tmp_path / "inbox" / "derby.csv")
    often = {"COLUMNS": "400", "PREFECT_RUNNER_POLL_FREQUENCY": "1"}
    with terminal("serve", "--data", tmp_path, environment=often) as command:
        command.until("prefect deployment run run/pitchlore")
        api = re.search(r"PREFECT_API_URL=(\S+)", command.text)[1]
        assert Keeper(tmp_path).look().api == api
        while not (found := httpx.get(f"{api}/deployments/name/run/pitchlore")).is_success:
            assert command.process.poll() is None
        for _ in range(2):
            ask = f"{api}/deployments/{found.json()['id']}/create_flow_run"
            while not httpx.post(ask, json={}).is_success:  # while its database is busy, the server says 503
                assert command.process.poll() is None
        command.until("policy version 1 is new")
        while ": nothing new" not in command.text:
            # what a run starts looks like the run until it is another program
            eventually(lambda: sum("spawn_main" in line for line in command.left(0)) <= 1, seconds=0.5)
            assert command.process.poll() is None
            command.read(0.1)
        command.press()
        assert command.end(20.0) in (0, 130)
        assert command.left(20.0) == []
    assert Keeper(tmp_path).look() is None


@pytest.mark.usefixtures("prefect_server")
def test_training_states(tmp_path, finished, capsys):
    """A training says in one line and in its state what it did; without knowledge it has failed."""
    from pitchlore.flows.scheduled import scheduled_training

    data = tmp_path / "data"
    shutil.copytree(finished, data)
    longer = Settings(policies=PolicySettings(sweeps=2))
    states = [scheduled_training(tmp_path / "empty", return_state=True), scheduled_training(data, return_state=True),
              scheduled_training(data, longer, return_state=True)]
    assert [(state.type.value, state.name) for state in states] == [
        ("FAILED", "Failed"), ("COMPLETED", "Completed"), ("COMPLETED", "Completed")]
    assert states[0].message.startswith(f"{tmp_path}/empty: there is no knowledge to train on.")
    assert [state.message for state in states[1:]] == ["nothing new", "policy version 2 is new"]
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(": ")[2] for line in lines] == [state.message for state in states]
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d train [a-z-]+: ", line) for line in lines)


def deployments() -> dict[str, dict[str, Any]]:
    """The deployments of prefect.yaml, by name."""
    return {found["name"]: found for found in yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]}


@pytest.mark.parametrize("name", deployments())
def test_deployment(monkeypatch, name):
    """A worker can load the flows that prefect.yaml names, with their parameters; all share the league's queue."""
    from prefect.client.schemas.schedules import CronSchedule
    from prefect.flows import load_flow_from_entrypoint

    deployment = deployments()[name]
    monkeypatch.chdir(ROOT)
    loaded = load_flow_from_entrypoint(deployment["entrypoint"])
    parameters = loaded.validate_parameters(deployment["parameters"] | {"settings": {"policies": {"sweeps": 2}}})
    assert parameters["settings"].policies.sweeps == 2
    assert deployment["work_pool"] == {"name": "pitchlore", "work_queue_name": "league"}
    assert [CronSchedule(**schedule).cron for schedule in deployment["schedules"]]


def commands() -> list[str]:
    """The commands that prefect.yaml says in its head."""
    lines = (ROOT / "prefect.yaml").read_text().splitlines()
    return [line.removeprefix("#   ") for line in lines if line.startswith("#   prefect ")]


#: The command `prefect`, called for each list of words; the first that fails ends it.
PREFECT = """
import json, sys
from prefect.cli import app
for words in json.loads(sys.argv[1]):
    sys.argv = ["prefect", *words]
    try:
        code = app()
    except SystemExit as ended:
        code = ended.code
    if code:
        sys.exit(f"{words}: {code}")
"""


class Operated:
    """A Prefect server as docs/how-to/schedule.md says, with the deployments of prefect.yaml for another data folder.

    Args:
        folder: an empty folder.
        environment: environment of the server, and of the commands.
    """

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self.data, self._environment = folder / "league", environment
        self._file = folder / "prefect.yaml"
        said = yaml.safe_load((ROOT / "prefect.yaml").read_text())
        for deployment in said["deployments"]:
            deployment["parameters"]["data"] = str(self.data)
        self._file.write_text(yaml.safe_dump(said))

    def begin(self, *commands: str) -> subprocess.Popen[str]:
        """Begin a process that does commands one after the other: to load Prefect's takes seconds."""
        lines = [["--no-prompt", *command.split()[1:]] for command in commands]
        for words in lines:
            if "deploy" in words:
                words += ["--prefect-file", str(self._file)]
        return subprocess.Popen([sys.executable, "-c", PREFECT, json.dumps(lines)], env=self._environment, cwd=ROOT,
                                text=True, start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def call(self, *commands: str) -> None:
        with self.begin(*commands) as process:
            said, _ = process.communicate(timeout=120)
        assert process.returncode == 0, f"{commands}: {said}"

    def ask(self, method: str, path: str, body: Any = None, **params: str) -> Any:
        """The server's answer; while its database is written to it says 503, and on a loaded machine it is slow."""
        url = f"{self._environment['PREFECT_API_URL']}{path}"
        while True:
            answer = httpx.request(method, url, json=body, params=params, timeout=180)
            if answer.status_code != httpx.codes.SERVICE_UNAVAILABLE:
                return answer.raise_for_status().json() if answer.content else None
            time.sleep(0.2)

    def fire(self, deployment: str, after: int) -> datetime:
        """Give a deployment a schedule that fires once, and never again. The moment.

        Args:
            deployment: its flow and its name.
            after: seconds until then; more than the scheduler needs to see it on a loaded machine.
        """
        moment = datetime.now(UTC).replace(microsecond=0) + timedelta(seconds=after)
        schedule = {"rrule": f"DTSTART:{moment:%Y%m%dT%H%M%S}Z\nRRULE:FREQ=SECONDLY;COUNT=1", "timezone": "UTC"}
        identity = self.ask("GET", f"/deployments/name/{deployment}")["id"]
        self.ask("POST", f"/deployments/{identity}/schedules", [{"active": True, "schedule": schedule}])
        return moment

    def runs_at(self, deployment: str, moment: datetime) -> list[dict[str, Any]]:
        """The flow runs of a deployment that were due at a moment."""
        flow, name = deployment.split("/")
        found = self.ask("POST", "/flow_runs/filter", {
            "flows": {"name": {"any_": [flow]}}, "deployments": {"name": {"any_": [name]}}})
        return [run for run in found if datetime.fromisoformat(run["expected_start_time"]) == moment]

    def states_of(self, run: dict[str, Any]) -> list[str]:
        """The names of all states that a run was in, in order."""
        found = self.ask("GET", "/flow_run_states/", flow_run_id=run["id"])
        return [state["name"] for state in sorted(found, key=lambda state: state["timestamp"])]

    def ended(self, deployment: str, moment: datetime) -> dict[str, Any]:
        """The only run that was due at a moment, when it has ended."""
        def look() -> dict[str, Any] | None:
            runs = self.runs_at(deployment, moment)
            assert len(runs) <= 1
            return runs[0] if runs and runs[0]["end_time"] else None

        return eventually(look, 300.0, every=1)


@pytest.fixture
def operated(tmp_path, monkeypatch, prefect_server):
    """The server, with pool, queue and deployments, and a recording of five seconds."""
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    environment = {
        **os.environ, **QUIET, "PREFECT_HOME": str(migrated(tmp_path / "home")), "PREFECT_UI_ENABLED": "false", "COLUMNS": "250",
        "PREFECT_SERVER_SERVICES_SCHEDULER_LOOP_SECONDS": "3",
        "PREFECT_SERVER_SERVICES_LATE_RUNS_AFTER_SECONDS": "2", "PREFECT_SERVER_SERVICES_LATE_RUNS_LOOP_SECONDS": "2",
        "PREFECT_WORKER_QUERY_SECONDS": "2", "PITCHLORE_ON": "threads:1", "PREFECT_LOGGING_LEVEL": "INFO",
    }
    server = Process(environment)
    try:
        server.wait()
        here = Operated(tmp_path, environment | {"PREFECT_API_URL": server.record.api})
        (here.data / "inbox").mkdir(parents=True)
        clip(0.0, 5.0).write_csv(here.data / "inbox" / "derby.csv")
        yield here
    finally:
        server.stop()


@pytest.mark.slow
def test_missed_and_fired(operated):
    """Runs that are due while no worker is there are late, and each is done once when one comes, one after the other.

    A run that is due while a worker is there is done in time. The commands are those of prefect.yaml.
    """
    *setting_up, work = commands()
    operated.call(*setting_up)
    missed = [("run/nightly", operated.fire("run/nightly", 8)), ("train/weekly", operated.fire("train/weekly", 9))]
    for deployment, moment in missed:
        eventually(lambda d=deployment, m=moment: [run["state_name"] for run in operated.runs_at(d, m)] == ["Late"],
                   seconds=180, every=1)
    worker = operated.begin(work)
    try:
        done = [operated.ended(deployment, moment) for deployment, moment in missed]
        assert [(run["state_type"], run["run_count"]) for run in done] == [("COMPLETED", 1)] * 2
        assert all("Late" in operated.states_of(run) for run in done)
        assert done[0]["end_time"] <= done[1]["start_time"]  # the limit of the league's queue
        moment = operated.fire("run/nightly", 8)
        fired = operated.ended("run/nightly", moment)
        assert (fired["state_type"], fired["run_count"]) == ("COMPLETED", 1)
        assert datetime.fromisoformat(fired["start_time"]) <= moment + timedelta(seconds=60)
        # Prefect's worker prepares a run before it is due, and may begin it some tenths of a second early
        assert datetime.fromisoformat(fired["start_time"]) >= moment - timedelta(seconds=1)
    finally:
        os.killpg(worker.pid, signal.SIGTERM)
        said, _ = worker.communicate(timeout=60)
    entries = log(Store(operated.data)).entries
    assert [(entry.what, entry.knowledge, entry.policy) for entry in entries] == [
        ("run", 1, None), ("train", None, 1), ("run", 1, 1)], said
    assert [bool(entry.made) for entry in entries] == [True, True, False]
    assert [entry.failed for entry in entries] == [0, 0, 0]
