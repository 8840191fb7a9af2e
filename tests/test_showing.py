"""`watch --replay`: a window beside the recording, which never waits for it."""

from __future__ import annotations

import multiprocessing
import os
import queue
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread

import pytest
from test_packets import T0, VISION, listed, vsss_packets
from test_watch import in_a_process, send_to

from flows import showing
from flows.showing import Showing, show
from pipeline.errors import BadSettings, NotFound
from pipeline.live.following import prepare
from pipeline.packets.recorder import Packet
from pipeline.painting import Snapshot
from pipeline.pitch import PITCHES, Kind

pygame = pytest.importorskip("pygame", reason="pygame-ce is not installed (the extra `play`)")

from support.window import key  # noqa: E402

from pipeline.arena.window.screen import Board  # noqa: E402


@pytest.fixture
def no_screen(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    pygame.quit()


def shown(monkeypatch: pytest.MonkeyPatch, feed: Callable[[Callable[[list[Packet]], None]], None]) -> list[Snapshot]:
    """What the window shows of the packets that a thread puts; Esc closes it then."""
    pictures: list[Snapshot] = []
    paint = Board.show
    monkeypatch.setattr(Board, "show", lambda board, picture: (pictures.append(picture), paint(board, picture)))
    batches: queue.Queue[list[Packet]] = queue.Queue()
    prepare("vsss")

    def go() -> None:
        feed(batches.put)
        while not batches.empty():
            time.sleep(0.05)
        time.sleep(0.2)
        pygame.event.post(key(pygame.K_ESCAPE))

    with Board(PITCHES[Kind.VSSS], ("blue", "yellow"), 40.0, 3) as board:
        thread = Thread(target=go)
        thread.start()
        show(board, "vsss", batches)  # type: ignore[arg-type]
        thread.join()
        size = pygame.display.get_window_size()
        assert pygame.display.get_caption()[0] == "Pitchlore: blue - yellow"
        assert pygame.transform.average_color(pygame.display.get_surface())[1] > 20  # it is mostly grass
        assert min(size) > 400
    return pictures


@pytest.mark.usefixtures("no_screen")
def test_a_match_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """First that it waits, then bodies, situations, score and the referee's words, and how long ago that was."""
    def feed(put: Callable[[list[Packet]], None]) -> None:
        began = time.monotonic()
        for number, packet in enumerate(vsss_packets(2.5)):
            time.sleep(max(0.0, began + number / 60 - time.monotonic()))
            put([packet._replace(t_ns=time.time_ns())])

    first, *pictures = shown(monkeypatch, feed)
    assert (first.clock, first.score, first.robots) == ("waits for packets; Esc closes this window", (None, None), ())
    assert len(pictures) > 20
    last = pictures[-1]
    assert last.clock.startswith("gameon, half 1, 0:00   (up to ")
    assert last.notes == ("attacks »", "« attacks")
    assert [(robot.team, robot.number) for robot in last.robots] == [(side, i) for side in ("home", "away") for i in range(3)]
    assert {robot.doing for robot in last.robots if robot.team == "away"} == {"does not move"}
    assert last.trail


@pytest.mark.usefixtures("no_screen")
def test_silence_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """When packets fail to come, the last picture stays, with the time since then."""
    monkeypatch.setattr(showing, "_SILENT_S", 0.3)

    def feed(put: Callable[[list[Packet]], None]) -> None:
        put([packet for packet in vsss_packets(1.0) if packet.channel == VISION])
        time.sleep(1.5)

    last = shown(monkeypatch, feed)[-1]
    assert last.clock in ("no packets for 1 s", "no packets for 2 s")
    assert len(last.robots) == 6


def test_beside_a_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The recording has every packet that was sent, and ends at Ctrl-C with the window."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    process = in_a_process(tmp_path, "--replay")
    sent = vsss_packets(2.0)
    send_to(process, sent)
    time.sleep(0.5)
    process.send_signal(2)
    out, _ = process.communicate(timeout=30)
    assert (process.returncode, "Kept in" in out) == (0, True)
    (kept,) = (tmp_path / "inbox").iterdir()
    assert [packet.data for packet in listed(kept.read_bytes())[0]] == [packet.data for packet in sent]


@pytest.mark.usefixtures("no_screen")
def test_a_window_that_does_not_keep_up() -> None:
    """Packets that the window does not take are not shown; who hands them over does not wait."""
    said: list[str] = []
    with Showing("vsss", "watch", said.append) as window:
        os.kill(_only_child(), 19)  # it stands still
        began = time.monotonic()
        for _ in range(2_000):
            window.see([Packet(VISION, T0, b"x" * 1000)])
        assert time.monotonic() - began < 2
    assert said == []


@pytest.mark.usefixtures("no_screen")
def test_a_window_that_is_closed() -> None:
    """It is said once, and the recording goes on."""
    said: list[str] = []
    with Showing("vsss", "watch", said.append) as window:
        window.see([])
        os.kill(_only_child(), 9)
        for child in multiprocessing.active_children():
            child.join(5)
        for _ in range(3):
            window.see([Packet(VISION, T0, b"")])
    assert said == ["The window is closed; the recording goes on until Ctrl-C."]


def _only_child() -> int:
    (child,) = (child for child in multiprocessing.active_children() if "Spawn" in type(child).__name__)
    assert child.pid is not None
    return child.pid


def test_no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is no screen nothing is recorded without a word: the command says so and ends."""
    for name in ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(BadSettings) as refused, Showing("vsss", "watch", lambda _: None):
        pass
    assert str(refused.value) == (
        "screen: no window can be opened (there is no display). Watch where there is a screen, or without --replay.")


def test_without_pygame(tmp_path: Path) -> None:
    """The extra that the window needs is named, before anything is recorded."""
    done = subprocess.run(
        [sys.executable, "-c", "import sys; sys.modules['pygame'] = None; from flows.cli import main; main(sys.argv[1:])",
         "watch", "vsss", "--replay", "--data", str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.strip().endswith("Install the extra pitchlore[play].")
    assert NotFound.__name__ not in done.stderr
