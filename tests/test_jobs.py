"""Pieces of work in tasks: each fails by itself, and only what may succeed later is tried again."""

from __future__ import annotations

import pickle

import pytest

from flows import jobs
from flows.jobs import SomeFailed, pieces_task, run_pieces
from flows.progress import StageReport
from flows.tasks import our_flow
from pipeline.errors import NotFound, StorageFailed


def done(job, pieces) -> StageReport:
    """The report on some pieces of work, as a flow's."""
    @our_flow(name="pieces")
    def flow() -> dict[str, object]:
        return run_pieces(job, "things", pieces).model_dump()

    return StageReport.model_validate(flow())


@pytest.fixture
def few(monkeypatch):
    """Two tasks, whatever the machine."""
    monkeypatch.setattr(jobs, "cores", lambda: 1)
    monkeypatch.setattr(jobs, "_TASKS_A_CORE", 2)


@pytest.mark.usefixtures("prefect_server", "few")
def test_failures():
    """A piece that fails is reported, and those of its task and of the others are done."""
    def work(number: int) -> bool:
        if number == 4:
            raise NotFound("is not here", where="four")
        if number == 5:
            raise ZeroDivisionError
        return number % 2 == 1

    report = done(pieces_task(name="thing")(work), {f"p{n}": {"number": n} for n in range(8)})
    assert (report.made, report.same) == (["p1", "p3", "p7"], ["p0", "p2", "p6"])
    assert report.failed == {"p4": "four: is not here.", "p5": "ZeroDivisionError: "}


@pytest.mark.usefixtures("prefect_server", "few")
def test_tried_again():
    """A task with a piece that may succeed later is tried again; the others of its pieces, too, and find their work done."""
    calls: list[int] = []

    def work(number: int) -> bool:
        calls.append(number)
        if number == 1 and calls.count(1) < 3:
            raise StorageFailed("cannot be written")
        return True

    report = done(pieces_task(name="thing")(work), {f"p{n}": {"number": n} for n in range(6)})
    assert (report.made, report.failed) == ([f"p{n}" for n in range(6)], {})
    assert [calls.count(n) for n in range(6)] == [3, 3, 3, 1, 1, 1]


@pytest.mark.usefixtures("prefect_server")
def test_few_pieces():
    """Where there is little work each piece has a task, so that all cores work and progress is seen."""
    parts = list(jobs._parts([str(n) for n in range(8)], 32))
    assert [len(part) for part in parts] == [1] * 8
    many = list(jobs._parts([str(n) for n in range(10_000)], 32))
    assert {len(part) for part in many[:-1]} == {32}
    assert [label for part in many for label in part] == [str(n) for n in range(10_000)]
    assert done(pieces_task(name="thing")(bool), {}) == StageReport(noun="things")


def test_failures_cross_processes():
    """Failures of pieces come from another process as they are."""
    error = SomeFailed({"a": 1}, {"b": "no."}, transient=True)
    again = pickle.loads(pickle.dumps(error))
    assert (again.done, again.failed, again.transient, str(again)) == ({"a": 1}, {"b": "no."}, True, "b: no.")
