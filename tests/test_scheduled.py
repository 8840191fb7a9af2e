"""The flows that a schedule runs: their lines, their states, and the deployments that prefect.yaml names."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest
import yaml
from conftest import ROOT, clip
from support.processes import eventually
from support.sessions import QUIET, migrated
from support.sockets import listened
from support.terminal import terminal

from pitchlore.flows.server import Keeper, Process
from pitchlore.pipeline.engine.history import log
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import PolicySettings, Settings
from pitchlore.pipeline.store import Store


@pytest.mark.usefixtures("prefect_server")
def test_run_states(tmp_path, capsys, monkeypatch):
    """A run says in one line and in its state what it did.

    Completed with what was made, then with nothing new; Failed, named Quarantined, if something is refused for the
    first time. What was refused before is no new alert, unless its content or its reason is another. What is new is
    told as assets, once.
    """
    from pitchlore.flows.scheduled import scheduled_run

    (tmp_path / "inbox").mkdir()
    clip(0.0, 40.0).write_csv(tmp_path / "inbox" / "derby.csv")
    told: list[dict[str, Any]] = []
    monkeypatch.setattr("pitchlore.flows.runner.emit_event", lambda event, **named: told.append({"event": event, **named}))
    states = [scheduled_run(tmp_path, return_state=True) for _ in range(2)]
    (tmp_path / "inbox" / "notes.txt").write_text("dear diary")
    states += [scheduled_run(tmp_path, return_state=True) for _ in range(2)]
    (tmp_path / "inbox" / "notes.txt").write_text("dear diary, again")
    states.append(scheduled_run(tmp_path, return_state=True))
    (tmp_path / "inbox" / "link.csv").symlink_to("/nowhere")
    states += [scheduled_run(tmp_path, return_state=True) for _ in range(2)]
    completed, quarantined = ("COMPLETED", "Completed"), ("FAILED", "Quarantined")
    assert [(state.type.value, state.name) for state in states] == [
        completed, completed, quarantined, completed, quarantined, quarantined, completed]
    assert re.fullmatch(r"\d+ made, 0 kept, policy version 1 is new", states[0].message)
    assert states[1].message == "nothing new"
    assert re.fullmatch(rf"0 made, \d+ kept, 1 not made: matches {tmp_path}/inbox/notes.txt", states[2].message)
    assert states[3].message == f"{states[2].message} (as before)"
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(": ")[2] for line in lines] == [state.message for state in states]
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d run [a-z-]+: ", line) for line in lines)
    assert states[0].result()["policy"] == 1
    base = f"file://{tmp_path}"
    by_noun = {one["resource"]["prefect.resource.id"].removeprefix(f"{base}/"): one for one in told}
    assert [*by_noun] == ["matches", *(stage.noun for stage in STAGES.computed()), *STAGES.versioned]
    assert len(told) == len(by_noun)
    assert {one["event"] for one in told} == {"prefect.asset.materialization.succeeded"}
    assert (by_noun["goals"]["payload"], by_noun["policies"]["payload"]) == ({"made": 1}, {"version": 1})
    assert [each["prefect.resource.id"] for each in by_noun["goals"]["related"]] == [
        f"{base}/{noun}" for noun in STAGES["goals"].inputs]
    assert [record.noun for record in Store(tmp_path).quarantined()] == ["matches"] * 2


@pytest.mark.slow
def test_serve_alone(tmp_path, monkeypatch, prefect_server, relayed):
    """Without a server, serve starts one on loopback, does the runs that are due one by one, and takes it along in the end."""
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    (tmp_path / "inbox").mkdir()
    clip(0.0, 5.0).write_csv(tmp_path / "inbox" / "derby.csv")
    often = {"COLUMNS": "400", "PREFECT_RUNNER_POLL_FREQUENCY": "1", **relayed}
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
        assert {(kind, address) for kind, address, _ in listened(command.process.pid)} == {("tcp", "127.0.0.1")}
        while ": nothing new" not in command.text:
            # what a run starts looks like the run until it is another program
            eventually(lambda: sum("spawn_main" in line for line in command.left(0)) <= 1, seconds=0.5)
            assert command.process.poll() is None
            command.read(0.1)
        command.press()
        assert command.end(20.0) in (0, 130)
        assert command.left(20.0) == []
    assert Keeper(tmp_path).look() is None
    httpx.delete(f"{prefect_server}/deployments/{found.json()['id']}").raise_for_status()


@pytest.mark.usefixtures("prefect_server")
def test_training_states(tmp_path, copied, capsys):
    """A training says in one line and in its state what it did; without knowledge it has failed."""
    from pitchlore.flows.scheduled import scheduled_training

    longer = Settings(policies=PolicySettings(learner="sarsa", sweeps=2))
    states = [scheduled_training(tmp_path / "empty", return_state=True), scheduled_training(copied, return_state=True),
              scheduled_training(copied, longer, return_state=True)]
    assert [(state.type.value, state.name) for state in states] == [
        ("FAILED", "Failed"), ("COMPLETED", "Completed"), ("COMPLETED", "Completed")]
    assert states[0].message.startswith(f"{tmp_path}/empty: there is no knowledge to train on.")
    assert [state.message for state in states[1:]] == ["nothing new", "policy version 2 is new"]
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(": ")[2] for line in lines] == [state.message for state in states]
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d train [a-z-]+: ", line) for line in lines)


@pytest.mark.parametrize(("cron", "days", "hours"), [
    ("0 6 * * *", (2027, 3, 27), ["05:00", "04:00"]), ("0 6 * * *", (2027, 10, 30), ["04:00", "05:00"]),
    ("30 2 * * *", (2027, 3, 27), ["01:30", "00:30"]), ("30 2 * * *", (2027, 10, 30), ["00:30", "00:30"])])
def test_time_zone(tmp_path, monkeypatch, call, cron, days, hours):
    """The schedule that serve hands to Prefect follows its time zone through both changes of the clock.

    A time that the clock leaves out comes an hour early, one that it shows twice comes once. Hours are UTC.
    """
    from prefect.server.schemas.schedules import CronSchedule

    from pitchlore.flows import scheduled, serving

    given: dict[str, Any] = {}
    monkeypatch.setenv("PREFECT_API_URL", "http://127.0.0.1:1/api")
    monkeypatch.setattr(serving, "serving", lambda *_: nullcontext())
    monkeypatch.setattr(scheduled.scheduled_run, "serve", lambda **named: given.update(named))
    code, out, _ = call("serve", "--cron", cron, "--timezone", "Europe/Berlin", "--data", tmp_path)
    assert (code, f"at '{cron}', time zone Europe/Berlin;" in out) == (0, True)
    schedule = CronSchedule(cron=given["schedule"].cron, timezone=given["schedule"].timezone)
    dates = asyncio.run(schedule.get_dates(2, start=datetime(*days, tzinfo=UTC)))
    assert [f"{date.astimezone(UTC):%H:%M}" for date in dates] == hours
    assert call("serve", "--cron", cron, "--data", tmp_path)[0] == 0
    assert given["schedule"].timezone == "UTC"
    code, _, err = call("serve", "--timezone", "Berlin", "--data", tmp_path)
    assert (code, err) == (1, "pitchlore: --timezone: 'Berlin' is no time zone. Name one of the IANA database, as Europe/Berlin.\n")


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


#: Calls the command `prefect` for each line of words, one after the other: to load Prefect's takes seconds.
PREFECT = """
import json, sys
from prefect.cli import app
for line in sys.stdin:
    sys.argv = ["prefect", *json.loads(line)]
    try:
        code = app()
    except SystemExit as ended:
        code = ended.code
    print("ended with", code or 0, flush=True)
"""


class Operated:
    """A Prefect server as docs/how-to/schedule.md says, with the deployments of prefect.yaml for another data folder.

    Args:
        folder: an empty folder.
        client: asks the server's API.
    """

    def __init__(self, folder: Path, client: httpx.Client) -> None:
        self.data, self._client = folder / "league", client
        self._file = folder / "prefect.yaml"
        said = yaml.safe_load((ROOT / "prefect.yaml").read_text())
        for deployment in said["deployments"]:
            deployment["parameters"]["data"] = str(self.data)
        self._file.write_text(yaml.safe_dump(said))
        automation = (ROOT / "prefect-automations.yaml").read_text()
        (folder / "prefect-automations.yaml").write_text(automation.replace("within: 600", "within: 35"))
        self.process = self._started()

    def _started(self) -> subprocess.Popen[str]:
        environment = {**os.environ, "PREFECT_API_URL": str(self._client.base_url).rstrip("/"), "PREFECT_WORKER_QUERY_SECONDS": "1", "COLUMNS": "250",
                       "PITCHLORE_ON": "threads:1", "PREFECT_LOGGING_LEVEL": "INFO", "PREFECT_FLOWS_HEARTBEAT_FREQUENCY": "30"}
        return subprocess.Popen(
            [sys.executable, "-c", PREFECT], env=environment, cwd=ROOT, text=True, start_new_session=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def begin(self, command: str) -> None:
        """Begin a command of Prefect's."""
        words = ["--no-prompt", *command.split()[1:], *(["--prefect-file", str(self._file)] if " deploy " in command else [])]
        if "--from-file" in words:
            words[-1] = str(self._file.with_name(words[-1]))
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(words) + "\n")
        self.process.stdin.flush()

    def call(self, command: str) -> None:
        """Call one, and wait for its end."""
        self.begin(command)
        assert self.process.stdout is not None
        said = list(iter(self.process.stdout.readline, "ended with 0\n"))
        assert not [line for line in said if line.startswith("ended with")], said

    def kill(self) -> None:
        """Kill the command that was begun last, with all that it started, and be ready for another."""
        for process in (*psutil.Process(self.process.pid).children(recursive=True), self.process):
            process.kill()
        self.process.communicate()
        self.process = self._started()

    def stop(self) -> str:
        """End the command that was begun last; what it said."""
        os.killpg(self.process.pid, signal.SIGTERM)
        return self.process.communicate(timeout=60)[0]

    def ask(self, method: str, path: str, body: Any = None, **params: str) -> Any:
        """The server's answer; while its database is written to it says 503, and on a loaded machine it is slow."""
        while True:
            answer = self._client.request(method, path, json=body, params=params)
            if answer.status_code != httpx.codes.SERVICE_UNAVAILABLE:
                return answer.raise_for_status().json() if answer.content else None
            time.sleep(0.2)

    def fire(self, deployment: str) -> datetime:
        """Give a deployment a schedule that fires once, and never again. The moment.

        On a loaded machine the scheduler may see a schedule when its moment has passed: then there is another.
        """
        identity = self.ask("GET", f"/deployments/name/{deployment}")["id"]
        while True:
            moment = datetime.now(UTC).replace(microsecond=0) + timedelta(seconds=3)
            schedule = {"rrule": f"DTSTART:{moment:%Y%m%dT%H%M%S}Z\nRRULE:FREQ=SECONDLY;COUNT=1", "timezone": "UTC"}
            self.ask("POST", f"/deployments/{identity}/schedules", [{"active": True, "schedule": schedule}])
            while datetime.now(UTC) < moment + timedelta(seconds=5):
                if self.runs_at(deployment, moment):
                    return moment
                time.sleep(0.2)

    def runs_at(self, deployment: str, moment: datetime) -> list[dict[str, Any]]:
        """The flow runs of a deployment that were due at a moment."""
        flow, name = deployment.split("/")
        return self.ask("POST", "/flow_runs/filter", {
            "flows": {"name": {"any_": [flow]}}, "deployments": {"name": {"any_": [name]}},
            "flow_runs": {"expected_start_time": {"after_": moment.isoformat(), "before_": moment.isoformat()}}})

    def ended(self, deployment: str, moment: datetime) -> dict[str, Any]:
        """The only run that was due at a moment, when it has ended."""
        def look() -> dict[str, Any] | None:
            runs = self.runs_at(deployment, moment)
            assert len(runs) <= 1
            return runs[0] if runs and runs[0]["end_time"] else None

        return eventually(look, 120.0, every=0.5)


@contextmanager
def operating(folder: Path, api: str) -> Iterator[Operated]:
    """A server, and a recording of five seconds; of the deployments nothing is left."""
    with httpx.Client(base_url=api, timeout=180) as client:
        here = Operated(folder, client)
        (here.data / "inbox").mkdir(parents=True)
        clip(0.0, 5.0).write_csv(here.data / "inbox" / "derby.csv")
        try:
            yield here
        finally:
            if here.process.poll() is None:
                here.stop()
        for left in here.ask("POST", "/deployments/filter", {}):
            here.ask("DELETE", f"/deployments/{left['id']}")


@pytest.mark.slow
def test_missed_killed_and_fired(tmp_path, monkeypatch):
    """A run that is due while no worker is there is late, and begun when one comes; the league's runs wait in line.

    The worker and this run are killed: it becomes Crashed, its queue goes on, and those that wait are done once, in
    time, one after the other. The commands are those of prefect.yaml.
    """
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    server = Process({**os.environ, **QUIET, "PREFECT_HOME": str(migrated(tmp_path / "home")), "PREFECT_UI_ENABLED": "false",
                      "PREFECT_SERVER_SERVICES_TRIGGERS_ENABLED": "true"})
    try:
        server.wait()
        with operating(tmp_path, server.record.api) as here:
            _missed_killed_and_fired(here)
    finally:
        server.stop()


def _missed_killed_and_fired(here: Operated) -> None:
    *setting_up, work = commands()
    for command in setting_up:
        here.call(command)
    store, nightly, weekly = Store(here.data), "run/nightly", "train/weekly"

    def becomes(deployment: str, moment: datetime, state: str) -> None:
        eventually(lambda: [run["state_name"] for run in here.runs_at(deployment, moment)] == [state], seconds=180, every=0.5)

    becomes(nightly, lost := here.fire(nightly), "Late")
    with store.removing():  # the run waits for it
        here.begin(work)
        becomes(nightly, lost, "Running")
        waiting = [(name, here.fire(name)) for name in (nightly, weekly)]
        for each in waiting:
            becomes(*each, "Late")  # the limit of the league's queue
        here.kill()
    here.begin(work)
    runs = [here.ended(*each) for each in ((nightly, lost), *waiting)]
    assert [(run["state_type"], run["run_count"]) for run in runs] == [("CRASHED", 1), ("COMPLETED", 1), ("COMPLETED", 1)]
    assert runs[0]["state"]["message"].startswith("Nothing was heard of this run for ten minutes.")
    crashed, first, second = ([datetime.fromisoformat(run[name]) for name in ("start_time", "end_time")] for run in runs)
    assert crashed[1] <= first[0] <= crashed[1] + timedelta(seconds=60)
    assert first[1] <= second[0] <= first[1] + timedelta(seconds=60)
    entries, said = log(store).entries, here.stop()
    assert [(entry.what, entry.knowledge, entry.policy) for entry in entries] == [("run", 1, None), ("train", None, 1)], said
    assert all(entry.made for entry in entries)
    assert [entry.failed for entry in entries] == [0, 0]
