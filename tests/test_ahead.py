"""Work that is begun before its turn: the same bytes, and whatever becomes of it is no harm."""

from concurrent.futures import CancelledError
from threading import Event, current_thread, main_thread

import pytest
from conftest import fill, run

from pitchlore.pipeline.engine import habits, update
from pitchlore.pipeline.engine.ahead import ahead, go_on, looking_ahead
from pitchlore.pipeline.settings import HabitSettings, KnowledgeSettings, Settings


def test_taken():
    """Work that was begun is taken by its key, and by no other; its cost is known once it was taken."""
    with looking_ahead() as early:
        assert ahead.get() is early
        assert early.take("a") is None
        early.begin(lambda: ("a", lambda: "done"))
        assert early.take("b") is None
        assert early.cost.seconds == 0
        assert early.take("a") == "done"
        assert early.cost.seconds > 0
        assert early.cost.pieces == 0


def fails():
    raise ZeroDivisionError


@pytest.mark.parametrize("prepare", [lambda: None, fails, lambda: ("a", fails)], ids=["none", "unplanned", "failed"])
def test_not_taken(prepare):
    """Work that cannot be begun, or fails, is left to its turn."""
    with looking_ahead() as early:
        early.begin(prepare)
        assert early.take("a") is None


@pytest.mark.parametrize("error", [None, KeyboardInterrupt])
def test_given_up(error):
    """Work that nobody takes stops at its next step. A run that has ended waits for it; one that was stopped does not."""
    begun, go, stopped = Event(), Event(), []

    def work():
        begun.set()
        go.wait()
        try:
            go_on()
        except CancelledError:
            stopped.append(True)
            raise

    with pytest.raises(KeyboardInterrupt) if error else looking_ahead(), looking_ahead() as early:
        early.begin(lambda: ("a", work))
        begun.wait()
        if error:
            raise error
        go.set()
    assert stopped == ([] if error else [True])
    go.set()


@pytest.mark.slow
def test_habits_begun_early(clips, tmp_path, monkeypatch):
    """In a run on many new matches habits are learned beside the stages of matches, once; knowledge and policy are the same bytes."""
    settings = Settings(knowledge=KnowledgeSettings(habits=HabitSettings(rounds=1, trees=5)))
    learned, threads = habits._learned, []
    monkeypatch.setattr(habits, "_learned", lambda *given: threads.append(current_thread()) or learned(*given))
    outputs = []
    for many in (3, 2):
        monkeypatch.setattr(update, "MANY", many)
        data = tmp_path / f"{many}"
        fill(data, clips)
        report = run(data, settings=settings, on="threads:2")
        assert report.failures == {}
        outputs.append({path.relative_to(data): path.read_bytes() for noun in ("knowledge", "policies")
                        for path in (data / noun).rglob("*") if path.suffix in {".parquet", ".npz"}})
        assert report.versions["knowledge"].pieces == 1
    assert len(outputs[0]) > 5
    assert outputs[0] == outputs[1]
    assert len(threads) == 2
    assert [thread is main_thread() for thread in threads] == [True, False]
