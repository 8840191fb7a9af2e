"""`watch --replay`: a window beside the recording, which never waits for it."""

import multiprocessing
import os
import queue
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread

import pytest
from support import vsss_messages
from support.processes import eventually
from test_packets import REFEREE, T0, VISION, vsss_packets
from test_watch import Call, ended, in_a_process, send_to

from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.drawing.painting import Robot, Snapshot
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.live.following import prepare
from pitchlore.pipeline.sessions import showing
from pitchlore.pipeline.sessions.showing import Showing, show

pygame = pytest.importorskip("pygame", reason="pygame-ce is not installed (the extra `play`)")

from support.window import key, without_pygame  # noqa: E402

from pitchlore.pipeline.arena.window.screen import Board  # noqa: E402


@pytest.fixture
def no_screen(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    pygame.quit()


def shown(
    monkeypatch: pytest.MonkeyPatch, feed: Callable[[Callable[[list[Packet]], None], list[Snapshot]], None],
) -> list[Snapshot]:
    """Pictures of the window for the packets that a thread puts; Esc closes it then."""
    pictures: list[Snapshot] = []
    paint = Board.show
    monkeypatch.setattr(Board, "show", lambda board, picture: (pictures.append(picture), paint(board, picture)))
    batches: queue.Queue[list[Packet]] = queue.Queue()
    prepare("vsss")

    def go() -> None:
        feed(batches.put, pictures)
        while not batches.empty():
            time.sleep(0.05)
        time.sleep(0.2)
        pygame.event.post(key(pygame.K_ESCAPE))

    with Board(PITCHES[Kind.VSSS], ("blue", "yellow"), 3) as board:
        thread = Thread(target=go)
        thread.start()
        show(board, "vsss", lambda: arrived(batches))
        thread.join()
        size = pygame.display.get_window_size()
        assert pygame.display.get_caption()[0] == "Pitchlore: blue - yellow"
        assert pygame.transform.average_color(pygame.display.get_surface())[1] > 20  # it is mostly grass
        assert min(size) > 400
    return pictures


def arrived(batches: queue.Queue[list[Packet]]) -> list[Packet]:
    """Messages put since the last call, as the window's process gets them."""
    packets: list[Packet] = []
    try:
        packets += batches.get(timeout=0.1)
        while True:
            packets += batches.get_nowait()
    except queue.Empty:
        return packets


@pytest.mark.usefixtures("no_screen")
def test_a_match_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """First that it waits, then bodies, situations, score and the referee's words, and how long ago that was."""
    def feed(put: Callable[[list[Packet]], None], _: object) -> None:
        began = time.monotonic()
        for number, packet in enumerate(vsss_packets(1.8)):
            time.sleep(max(0.0, began + number / 60 - time.monotonic()))
            put([packet._replace(t_ns=time.time_ns())])

    first, *pictures = shown(monkeypatch, feed)
    assert (first.clock, first.score, first.robots) == ("waits for packets; Esc closes this window", (None, None), ())
    assert len(pictures) > 1  # how many depends on the machine
    last = pictures[-1]
    assert last.clock.startswith("gameon, half 1, 0:00   (up to ")
    assert last.notes == ("attacks »", "« attacks")
    assert [(robot.team, robot.number) for robot in last.robots] == [(side, i) for side in ("home", "away") for i in range(3)]
    assert {robot.doing for robot in last.robots if robot.team == "away"} == {"does not move"}
    assert last.trail


@pytest.mark.usefixtures("no_screen")
@pytest.mark.parametrize("bodies", [6, 0])
def test_silence_is_said(monkeypatch: pytest.MonkeyPatch, bodies: int) -> None:
    """When vision fails the last picture stays, with the time since then; the referee's words and score go on."""
    monkeypatch.setattr(showing, "_SILENT_S", 0.1)
    monkeypatch.setattr(showing, "_AGAIN_S", 0.1)

    def feed(put: Callable[[list[Packet]], None], pictures: list[Snapshot]) -> None:
        put([packet for packet in vsss_packets(1.0) if packet.channel == VISION])
        eventually(lambda: len(pictures) > 1)
        for step in range(3):
            time.sleep(0.25)
            put([Packet(REFEREE, T0 + 2 * 10**9, vsss_messages.command(vsss_messages.HALT, clock=7.0)),
                 *([] if bodies else [Packet(VISION, T0 + 2 * 10**9, vsss_messages.environment(90 + step, None, goals=(0, 3)))])])

    last = shown(monkeypatch, feed)[-1]
    assert last.clock.startswith("halt, half 1, 0:07   (nothing new seen for ")
    assert len(last.robots) == 6
    assert last.score == ((None, None) if bodies else (0, 3))


@pytest.mark.usefixtures("no_screen")
@pytest.mark.parametrize("size", [(480, 460), (980, 860)])
def test_many_robots_in_a_small_window(monkeypatch: pytest.MonkeyPatch, size: tuple[int, int]) -> None:
    """The list takes at most two fifths of the height; the pitch stays, and who has no line is not listed."""
    monkeypatch.setattr("pitchlore.pipeline.arena.window.screen.SIZE", size)
    robots = [Robot(side, i, (0.02 * i, 0.1), None, "moves randomly") for side in ("home", "away") for i in range(32)]
    with Board(PITCHES[Kind.VSSS], ("blue", "yellow"), 32) as board:
        board.show(Snapshot("play", (0, 0), (), robots))
        assert pygame.transform.average_color(pygame.display.get_surface())[1] > 15


def test_beside_a_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The recording has every packet that was sent, and ends at Ctrl-C with the window."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    process = in_a_process(tmp_path, "--replay")
    assert process.stderr is not None
    assert process.stderr.readline() == "Opening the window …\n"
    sent = vsss_packets(1.0)
    send_to(process, sent)
    assert ended(process, signal.SIGINT, tmp_path) == [packet.data for packet in sent]


@pytest.mark.usefixtures("no_screen")
def test_a_window_that_stands_still_or_is_closed() -> None:
    """Packets that the window does not take are not shown, and nobody waits for it; that it is closed is said once."""
    said: list[str] = []
    with Showing("vsss", "watch", said.append) as window:
        os.kill(_only_child(), signal.SIGSTOP)
        began = time.monotonic()
        for _ in range(2_000):  # some go into the pipe, some wait
            window.see([Packet(VISION, T0, b"x" * 1000)])
        assert time.monotonic() - began < 2
        assert said == ["Opening the window …"]
        os.kill(_only_child(), signal.SIGKILL)
        for child in multiprocessing.active_children():
            child.join(5)
        for _ in range(3):
            window.see([Packet(VISION, T0, b"")])
    assert said == ["Opening the window …", "The window is closed; the recording goes on until Ctrl-C."]


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


def test_without_pygame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Call) -> None:
    """The extra that the window needs is named, before anything is recorded."""
    without_pygame(monkeypatch)
    code, _, said = call("watch", "vsss", "--replay", "--data", tmp_path)
    assert (code, said.strip().endswith("Install the extra pitchlore[play].")) == (1, True)
    assert NotFound.__name__ not in said
    assert not (tmp_path / "watching").exists()
