"""A window that shows the match that is recorded. It has a process of its own: no recording waits for it."""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import Empty, Full
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeAlias

from flows.child import belong
from pipeline.arena.window import board_class
from pipeline.errors import PitchloreError
from pipeline.live.following import Follower, Moment, prepare
from pipeline.live.status import Status
from pipeline.packets.recorder import Packet
from pipeline.packets.streams import LeagueName
from pipeline.painting import Snapshot
from pipeline.pitch import PITCHES, Kind
from schemas import SIDES

if TYPE_CHECKING:
    from multiprocessing.queues import Queue

    from pipeline.arena.window.screen import Board

#: Pictures a second, at most.
_HZ = 40.0
#: How long is waited for packets before the keys are looked at.
_WAIT_S = 0.1
#: Batches of packets that may wait for the window; more are not shown.
_WAITING = 512
#: Robots a side for whose situations there is room at first.
_ROBOTS = 3
#: For so long the greatest delay is shown, seconds; and a match without packets is one that goes on.
_SAID_S, _SILENT_S = 1.0, 1.0
_ENDS_S = 2.0

#: Batches on their way to the window.
_Batches: TypeAlias = "Queue[Sequence[Packet]]"


class Showing:
    """The window, as a context manager; it opens when it is entered.

    Args:
        league: whose packets are shown.
        where: who asks, for errors.
        say: gets a line when the window is closed.

    Raises:
        BadSettings: if there is no screen to open it on.
        NotFound: if pygame is not installed.
    """

    def __init__(self, league: LeagueName, where: str, say: Callable[[str], None]) -> None:
        board_class(where)
        context = multiprocessing.get_context("spawn")
        self._batches: _Batches = context.Queue(_WAITING)
        self._told, there = context.Pipe(duplex=False)
        self._process = context.Process(target=_run, args=(league, where, self._batches, there), daemon=True)
        self._there, self._say, self._open = there, say, True

    def __enter__(self) -> Self:
        self._process.start()
        self._there.close()
        try:
            error = self._told.recv()
        except EOFError:
            error = PitchloreError("the window failed", where="screen", next_step="Watch without --replay")
        if error is not None:
            self._end()
            raise error
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
                self._batches.put_nowait(packets)

    def _end(self) -> None:
        self._batches.cancel_join_thread()
        self._process.terminate()
        self._process.join(_ENDS_S)
        self._process.kill()  # a window that hangs
        self._process.join()


def _run(league: LeagueName, where: str, batches: _Batches, told: Connection) -> None:
    """Open the window, tell that it is open or why not, and show what comes until it is closed."""
    belong()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the recording's
    try:
        with board_class(where)(PITCHES[Kind(league)], ("blue", "yellow"), _HZ, _ROBOTS) as board:
            prepare(league)
            told.send(None)
            told.close()
            show(board, league, batches)
    except PitchloreError as error:
        told.send(error)


def show(board: Board, league: LeagueName, batches: _Batches) -> None:
    """Show what comes until the window is closed.

    Args:
        board: open.
        league: whose packets come.
        batches: sound packets, in order of time.
    """
    follower, status, delay = Follower(league), Status(league), _Delay()
    shown = Snapshot("waits for packets; Esc closes this window", (None, None), (), ())
    board.show(shown)
    painted = heard = time.monotonic()
    robots = _ROBOTS
    while not board.listen().leave:
        packets = _arrived(batches)
        follower.take(packets)
        status.see(packets)
        now = time.monotonic()
        heard = now if packets else heard
        if now - painted < 1 / _HZ:
            continue
        moment = follower.moment()
        if moment is not None:
            robots = max(robots, *(sum(robot.team == side for robot in moment.robots) for side in SIDES))
            board.match(moment.pitch, moment.names, robots)
            shown = snapshot(moment, status.state(), delay.said)
        elif shown.robots and now - heard > _SILENT_S:
            shown = shown._replace(clock=f"no packets for {now - heard:.0f} s")
        else:
            continue
        board.show(shown)
        painted = now
        if moment is not None:
            delay.add((time.time_ns() - moment.t_ns) / 1e9)


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


def _arrived(batches: _Batches) -> list[Packet]:
    """The packets that came since the last call; some time is waited for the first."""
    packets: list[Packet] = []
    try:
        packets += batches.get(timeout=_WAIT_S)
        while True:
            packets += batches.get_nowait()
    except Empty:
        return packets


def snapshot(moment: Moment, state: str, delay: float | None) -> Snapshot:
    """The moment as it is painted."""
    words = state or ("play" if moment.playing else "play is stopped")
    if delay is not None:
        words += f"   (up to {1000 * delay:.0f} ms ago)"
    aims = ("attacks »", "« attacks") if moment.blue_attacks > 0 else ("« attacks", "attacks »")
    return Snapshot(
        words, moment.score, moment.trail, moment.robots, home_attacks=moment.blue_attacks, notes=aims)
