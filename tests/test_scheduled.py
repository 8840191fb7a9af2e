"""The flow that a schedule runs: its line, its state, and the deployment that prefect.yaml names."""

from __future__ import annotations

import re

import httpx
import pytest
import yaml
from conftest import ROOT, clip
from support.terminal import terminal

from flows.server import Keeper
from pipeline.store import Store


@pytest.mark.usefixtures("prefect_server")
def test_run_states(tmp_path, capsys):
    """A run says in one line and in its state what it did.

    Completed with what was made, then with nothing new; Failed, named Quarantined, if something was refused.
    """
    from flows.scheduled import scheduled_run

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
def test_serve_alone(tmp_path, monkeypatch):
    """Without a server, serve starts one, does the runs that are due one by one, and takes the server with it."""
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    (tmp_path / "inbox").mkdir()
    clip(0.0, 5.0).write_csv(tmp_path / "inbox" / "derby.csv")
    often = {"COLUMNS": "400", "PREFECT_RUNNER_POLL_FREQUENCY": "1"}
    with terminal("serve", "--data", tmp_path, environment=often) as command:
        command.until("prefect deployment run run/pitchlore")
        api = re.search(r"PREFECT_API_URL=(\S+)", command.text)[1]
        assert Keeper(tmp_path).look().record.api == api
        while not (found := httpx.get(f"{api}/deployments/name/run/pitchlore")).is_success:
            assert command.process.poll() is None
        for _ in range(2):
            ask = f"{api}/deployments/{found.json()['id']}/create_flow_run"
            while not httpx.post(ask, json={}).is_success:  # while its database is busy, the server says 503
                assert command.process.poll() is None
        command.until("policy version 1 is new")
        while ": nothing new" not in command.text:
            assert sum("spawn_main" in line for line in command.left(0)) <= 1
            assert command.process.poll() is None
            command.read(0.1)
        command.press()
        assert command.end(20.0) in (0, 130)
        assert command.left(20.0) == []
    assert Keeper(tmp_path).look() == (False, None)


def test_deployment(monkeypatch):
    """A worker can load the flow that prefect.yaml names."""
    from prefect.flows import load_flow_from_entrypoint

    (deployment,) = yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]
    monkeypatch.chdir(ROOT)
    loaded = load_flow_from_entrypoint(deployment["entrypoint"])
    parameters = loaded.validate_parameters(deployment["parameters"] | {"settings": {"policies": {"sweeps": 2}}})
    assert parameters["settings"].policies.sweeps == 2
    assert deployment["work_pool"] == {"name": "pitchlore"}  # what docs and prefect.yaml say how to make
