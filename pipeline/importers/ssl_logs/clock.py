"""Times of samples: the cameras' clock, with its jumps bridged by when packets were received."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

import numpy as np

from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import F64, I64

#: The two clocks of one step differ by more than this where one of them jumps, seconds.
_JUMP_S = 1.0
#: Clocks of two cameras that differ by less are one clock, seconds: a packet takes milliseconds.
_ONE_CLOCK_S = 0.02
#: Cameras and senders whose clocks are looked at.
_CLOCKS = 64
#: Jumps of one kind from which on they are told together.
_SEVERAL = 4
#: What a step is taken for if neither clock tells, seconds.
_STEP_S = 1 / 75


def times(captured: F64, received: I64) -> tuple[I64, list[Flaw]]:
    """Times of samples since the earliest one, and flaws of the clocks.

    A step of the capture clock counts as it is, unless the receive clock makes another one, by more than
    ``_JUMP_S``. Then the receive clock's step counts, if the capture clock's cannot be: it goes back, or
    ahead by more than that. If both jump, the capture clock's step counts if it is ahead. A capture clock
    that stands, at 0 or elsewhere, tells nothing, and the receive clock counts throughout.

    Args:
        captured: float64 [F], when each sample was captured, seconds of the source's clock, in the log's
            order.
        received: int64 [F], when its first packet was received, ns.

    Returns:
        int64 [F], ns, as recorded but for the bridged jumps, the least is 0; and one flaw per jump, or per
        kind of jump if there are many.
    """
    if not len(captured):
        return np.empty(0, np.int64), []
    if np.ptp(captured) == 0 < np.ptp(received):
        note = (f"the source's clock stands at {captured[0]:g} s in all samples: times are when packets were "
                "received")
        t_ns = received - received.min()
        return t_ns, [Flaw("clock jump back", note, len(t_ns), 0, int(t_ns.max()) + 1)]
    step, other = np.diff(captured), np.diff(received) / 1e9
    jumps = np.flatnonzero(~(np.abs(step - other) <= _JUMP_S))
    bridged = {}
    for i in jumps.tolist():
        if 0 <= step[i] <= _JUMP_S:
            continue  # the receive clock jumped
        if 0 <= other[i] <= _JUMP_S:
            bridged[i] = other[i]
        elif step[i] < 0:
            bridged[i] = _STEP_S
    shift = np.zeros(len(captured))
    for i, real in bridged.items():
        shift[i + 1] = real - step[i]
    moved = (captured - captured[0]) + np.cumsum(shift)
    t_ns = np.round((moved - moved.min()) * 1e9).astype(np.int64)
    flaws = []
    for kind, sign in (("clock jump back", -1), ("clock leap ahead", 1)):
        places = [i for i in bridged if np.sign(step[i]) == sign]
        told = [f"by {step[i]:+.3f} s: taken for {bridged[i]:.3f} s" for i in places]
        spans = [(int(t_ns[i]), int(t_ns[i + 1]) + 1) for i in places]
        if len(places) >= _SEVERAL:
            told = [f"{len(places)} times, first {told[0]}"]
            spans = [(spans[0][0], spans[-1][1])]
        flaws += [
            Flaw(kind, f"the source's clock jumps {jump}, as packets were received",
                 len(places) // len(told), start, end)
            for jump, (start, end) in zip(told, spans, strict=True)
        ]
    return t_ns, sorted(flaws, key=lambda flaw: flaw.start_ns or 0)


class Lags:
    """How far the clock of each camera and sender is behind the receive clock, learned from its frames."""

    def __init__(self) -> None:
        self._least: dict[tuple[float, int], list[float]] = {}
        self._frames: Counter[tuple[float, int]] = Counter()

    def add(self, cameras: F64, senders: I64, captured: F64, received: I64) -> None:
        """Take up frames: camera, sender, capture time in seconds, receive time in ns, each [F]."""
        lag = received / 1e9 - captured
        for camera in np.unique(cameras).tolist():
            if (camera, 0) not in self._least and len(self._least) == _CLOCKS:
                continue
            for sender in np.unique(senders[cameras == camera]).tolist():
                clock = (camera, sender)
                if clock not in self._least and len(self._least) == _CLOCKS:
                    continue
                mine = lag[(cameras == camera) & (senders == sender)]
                self._least.setdefault(clock, []).append(float(mine.min()))
                self._frames[clock] += len(mine)

    def ahead(self, left_out: Collection[tuple[float, int]]) -> dict[tuple[float, int], float]:
        """Seconds by which clocks are ahead of that with the most frames, of those that are not the same.

        Args:
            left_out: cameras and senders that do not count.
        """
        frames = {clock: count for clock, count in self._frames.items() if clock not in left_out}
        if not frames:
            return {}
        first = max(frames, key=lambda clock: (frames[clock], -clock[0], -clock[1]))
        lags = {clock: float(np.median(self._least[clock])) for clock in frames}
        ahead = {clock: lags[first] - lag for clock, lag in lags.items()}
        return {clock: by for clock, by in ahead.items() if abs(by) > _ONE_CLOCK_S}
