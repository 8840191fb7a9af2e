"""A window that shows the match that is recorded. It has a process of its own: no recording waits for it."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import Full, Queue
from threading import Thread
from types import TracebackType
from typing import TYPE_CHECKING, Self

from pitchlore.pipeline.arena.window import board_class
from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.base.system import undisturbed
from pitchlore.pipeline.drawing.painting import Snapshot
from pitchlore.pipeline.engine.child import belong
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import LeagueName, channels
from pitchlore.pipeline.live.following import Follower, LiveSnapshot, prepare
from pitchlore.pipeline.live.status import Status
from pitchlore.schemas import SIDES

if TYPE_CHECKING:
    from pitchlore.pipeline.arena.window.screen import Board

#: Pictures a second, at most; and seconds after which the words are painted anew where nothing moves.
_HZ, _AGAIN_S = 40.0, 0.5
#: How long is waited for packets before the keys are looked at, seconds.
_WAIT_S = 0.1
#: Batches of packets that may wait for the window; more are not shown.
_WAITING = 512
#: Robots a side for whose situations there is room at first.
_ROBOTS = 3
#: The greatest delay of so long is shown, seconds.
_SAID_S = 1.0
#: Without anything to show for so long, the picture says since when, seconds.
_SILENT_S = 1.0
#: A window that has not closed by then is killed, seconds: it has nothing to save.
_ENDS_S = 0.5
_NAMES = ("blue", "yellow")


class Showing:
    """The window, as a context manager; it opens when it is entered.

    Args:
        league: league of the shown packets.
        where: asker, for errors.
        say: gets a line when the window opens, and when it is closed.

    Raises:
        BadSettings: if there is no screen to open it on.
        NotFound: if pygame is not installed.
    """

    def __init__(self, league: LeagueName, where: str, say: Callable[[str], None]) -> None:
        board_class(where)
        context = multiprocessing.get_context("spawn")
        self._waiting: Queue[Sequence[Packet]] = Queue(_WAITING)
        self._inlet, self._outlet = context.Pipe(duplex=False)
        self._reported, self._tells = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_run, args=(league, where, self._inlet, self._tells), daemon=True)
        self._say, self._open = say, True

    def __enter__(self) -> Self:
        self._say("Opening the window …")
        # Ctrl-C is the recording's; the process inherits that it does not hear of it
        with undisturbed():
            self._process.start()
        self._inlet.close()
        self._tells.close()
        try:
            error = self._reported.recv()
        except EOFError:
            error = PitchloreError("the window failed", where="screen", next_step="Watch without --replay")
        if error is not None:
            self._end()
            raise error
        Thread(target=self._hand_over, name="window", daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
    ) -> None:
        self._end()

    def see(self, packets: Sequence[Packet]) -> None:
        """Show sound packets; what the window cannot keep up with is not shown."""
        if not self._open:
            return
        if not self._process.is_alive():
            self._open = False
            self._say("The window is closed; the recording goes on until Ctrl-C.")
        elif packets:
            with suppress(Full):
                self._waiting.put_nowait(packets)

    def _hand_over(self) -> None:
        """Hand the packets that wait to the window, until it is closed."""
        with suppress(OSError):
            while True:
                self._outlet.send(self._waiting.get())

    def _end(self) -> None:
        self._process.terminate()
        self._process.join(_ENDS_S)
        self._process.kill()
        self._process.join()


def _run(league: LeagueName, where: str, inlet: Connection, tells: Connection) -> None:
    """Open the window, tell that it is open or why not, and show what comes until it is closed."""
    belong()
    try:
        with board_class(where)(PITCHES[Kind(league)], _NAMES, _ROBOTS) as board:
            tells.send(None)
            show(board, league, lambda: _arrived(inlet))
    except PitchloreError as error:
        tells.send(error)


def show(board: Board, league: LeagueName, arrived: Callable[[], list[Packet]]) -> None:
    """Show what comes until the window is closed.

    Args:
        board: open.
        league: league of the packets.
        arrived: the sound packets that came since its last call, in order of time; it waits a little.
    """
    board.show(Snapshot("waits for packets; Esc closes this window", (None, None), (), ()))
    prepare(league)
    follower, status, delay = Follower(league), Status(league), _Delay()
    said = channels(league)["referee"]
    latest: LiveSnapshot | None = None
    packets: list[Packet] = []
    robots, painted, seen = _ROBOTS, 0.0, 0.0
    while not board.listen().leave:
        packets += arrived()
        now = time.monotonic()
        if now - painted < 1 / _HZ:
            continue
        follower.take(packets)
        status.see([packet for packet in packets if packet.channel == said])  # the rest is decoded once above
        packets = []
        new = follower.snapshot()
        if new is not None:
            latest, seen = new, now
        elif latest is None or now - painted < _AGAIN_S:
            continue
        robots = max(robots, *(sum(each.team == side for each in latest.robots) for side in SIDES))
        state = follower.referee
        latest = latest._replace(
            names=state.names, score=state.score or (None, None), playing=state.playing)
        board.match(latest.pitch, latest.names, robots)
        board.show(picture_of(latest, status.state(), delay.said, now - seen))
        painted = now
        if new is not None:
            delay.add((time.time_ns() - new.t_ns) / 1e9)


class _Delay:
    """How long ago what is shown happened.

    Attributes:
        said: the greatest delay of the second before this one, seconds; None in the first.
    """

    def __init__(self) -> None:
        self.said: float | None = None
        self._most, self._since = 0.0, time.monotonic()

    def add(self, seconds: float) -> None:
        """Take up the delay of a picture."""
        self._most = max(self._most, seconds)
        if time.monotonic() - self._since >= _SAID_S:
            self.said, self._most, self._since = self._most, 0.0, time.monotonic()


def _arrived(inlet: Connection) -> list[Packet]:
    """The packets that came since the last call; some time is waited for the first."""
    packets: list[Packet] = []
    wait_s = _WAIT_S
    while inlet.poll(wait_s):
        packets += inlet.recv()
        wait_s = 0.0
    return packets


def picture_of(live: LiveSnapshot, state: str, delay: float | None, silent: float) -> Snapshot:
    """The picture of a snapshot.

    Args:
        live: picture to show.
        state: the referee's words.
        delay: how long ago what is shown happened at most, seconds; None where that is not known yet.
        silent: how long nothing new was seen, seconds.
    """
    words = state or ("play" if live.playing else "play is stopped")
    if silent > _SILENT_S:
        words += f"   (nothing new seen for {silent:.0f} s)"
    elif delay is not None:
        words += f"   (up to {1000 * delay:.0f} ms ago)"
    aims = ("attacks »", "« attacks") if live.blue_attacks > 0 else ("« attacks", "attacks »")
    return Snapshot(
        words, live.score, live.trail, live.robots, home_attacks=live.blue_attacks, notes=aims)
