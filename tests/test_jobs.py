"""Pieces of work in tasks: each fails by itself, and only what may succeed later is tried again."""

import threading

import pytest
from support.deeds import die_of_two

from pitchlore.pipeline.base.errors import NotFound, StorageFailed
from pitchlore.pipeline.engine.costs import Spent
from pitchlore.pipeline.engine.making import Outcome
from pitchlore.pipeline.engine.placement import pieces as parts
from pitchlore.pipeline.engine.placement.executors import Here, executors
from pitchlore.pipeline.engine.placement.pieces import Failure, Part, TryAgain, parted
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.placement.processes import Processes
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.tasks import run_pieces


@pytest.fixture(params=["engine", pytest.param("flow", marks=pytest.mark.slow)])
def done(request):
    """The report on some pieces of work: the engine's by itself, or a flow's."""
    def report(function, pieces, on="threads:1", **options) -> StageReport:
        def work() -> StageReport:
            with placed(on, "."):
                return run_pieces(function, "things", pieces, **options)

        if request.param == "engine":
            return work()
        request.getfixturevalue("prefect_server")
        from pitchlore.flows.flow import our_flow

        return StageReport.model_validate(our_flow(name="pieces")(work)())

    return report


def numbered(count):
    return {f"p{n}": {"number": n} for n in range(count)}


@pytest.fixture
def few(monkeypatch):
    """Two tasks for one thread."""
    monkeypatch.setattr(parts, "_PARTS_EACH", 2)


@pytest.mark.usefixtures("few")
def test_failures(done):
    """A piece that fails is reported, and those of its task and of the others are done."""
    def work(number: int) -> None:
        if number == 4:
            raise NotFound("is not here", where="four")
        if number == 5:
            raise ZeroDivisionError

    report = done(work, numbered(8))
    assert report.made == ["p0", "p1", "p2", "p3", "p6", "p7"]
    assert report.failed == {"p4": "four: is not here.", "p5": "ZeroDivisionError: "}


@pytest.mark.usefixtures("few")
def test_tried_again(done):
    """A piece that may succeed later is tried again, and no other piece is done twice."""
    calls: list[int] = []

    def work(number: int) -> None:
        calls.append(number)
        if number == 1 and calls.count(1) < 3:
            raise StorageFailed("cannot be written")

    report = done(work, numbered(6))
    assert (report.made, report.failed) == ([f"p{n}" for n in range(6)], {})
    assert [calls.count(n) for n in range(6)] == [1, 3, 1, 1, 1, 1]


def test_what_an_earlier_try_made():
    """Outputs that an earlier try made count as made, although they are there in the next; costs add up."""
    tries = iter([
        Outcome({"a": True, "b": False}, {"c": "full"}, transient=True,
                costs={"a": Spent(1.0, 10, 100), "b": Spent(2.0, 20, 200), "c": Spent(3.0, 30, 0)}),
        Outcome({"a": None, "b": None, "c": True}, costs={"c": Spent(0.5, 30, 300)}),
    ])
    part = Part(Here(1), lambda: next(tries), {"match": {}})
    with pytest.raises(TryAgain):
        part.do()
    part.do()
    assert part.results == {"match": Outcome({"a": True, "b": False, "c": True}, costs={
        "a": Spent(1.0, 10, 100), "b": Spent(2.0, 20, 200), "c": Spent(3.5, 60, 300)})}


def test_all_at_once(done):
    """As many pieces are done at once as the executors can do."""
    met = threading.Barrier(3, timeout=60)

    def work(number: int) -> None:
        met.wait()

    assert done(work, numbered(6), "threads:3").failed == {}
    assert done(work, {}) == StageReport(noun="things")


def test_parts():
    """Where there is little work each piece has a task, so that all workers work and progress is seen."""
    few = list(parted(numbered(8), 32, 2))
    assert [len(part) for part in few] == [1] * 8
    many = list(parted(numbered(10_000), 32, 2))
    assert {len(part) for part in many[:-1]} == {32}
    assert [label for part in many for label in part] == list(numbered(10_000))


@pytest.mark.slow
def test_lost_worker():
    """A piece that brings its worker down is lost alone: those that it shared the worker with are done."""
    with Processes(2) as both:
        part = Part(both, die_of_two, numbered(4))
        part.do()
    lost = part.results.pop("p2")
    assert part.results == {"p0": 0, "p1": 1, "p3": 3}
    assert isinstance(lost, Failure)
    assert not lost.transient
    assert lost.line.startswith("a process that worked for this command was killed")


def test_default_executors():
    """Outside of a run pieces are done here."""
    assert isinstance(executors.get(), Here)
