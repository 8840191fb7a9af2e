"""Order of a match's samples, and its stretches of uninterrupted play."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.matches.frame import Period
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import I32, I64, U8
from pitchlore.pipeline.numbers.kernels import njit

#: Verdicts of :func:`_judge_clock` on a frame.
IN_ORDER, LATE, CLOCK_BACK, CLOCK_AHEAD = range(4)

#: Referee events that always begin a new stretch.
CUTTING = ("kick-off", "fault", "goal", "half", "end")
#: Referee events that conclude what came before; at equal times they precede the others.
CONCLUDING = ("goal", "half", "end")
#: Referee events after which play is stopped.
STOPPING = (*CONCLUDING, "stop")


class Stretches(NamedTuple):
    """Stretch and segment of each sample [F].

    Attributes:
        number: int32 [F], number of the stretch, consecutive from 0; it counts up at every cut.
        segment: int32 [F], consecutive from 0 over the stretches of play; -1 while play is stopped.
    """

    number: I32
    segment: I32


def order_samples(t_ns: I64, reorder_ns: int) -> tuple[I64, list[Flaw]]:
    """Indices of the frames to keep, in order of time, and the flaws of the clock.

    A frame that is late by at most ``reorder_ns`` is sorted back. Where the clock jumps back further,
    the frames not later than the latest time so far are left out. There is one exception: if the clock
    had leapt ahead before, and the frames since the leap are fewer than the frames that contradict
    them, the frames since the leap are left out. If several frames have one time, the first recorded is
    kept.

    Args:
        t_ns: int64 [F], times as recorded.
        reorder_ns: most that a frame may be late, ns.

    Returns:
        Indices of the kept frames, int64 [<= F], at strictly increasing times; and one flaw of each
        kind found, with the number of frames and their range of recorded times.
    """
    if bool(np.all(np.diff(t_ns) > 0)):
        return np.arange(len(t_ns), dtype=np.int64), []
    verdict = _judge_clock(t_ns, reorder_ns)
    kept = np.flatnonzero(verdict <= LATE)
    kept = kept[np.argsort(t_ns[kept], kind="stable")]
    repeated = np.zeros(len(kept), dtype=np.bool_)
    repeated[1:] = np.diff(t_ns[kept]) == 0
    found = (
        ("duplicate frame", t_ns[kept[repeated]], "same time as an earlier frame: the first is kept"),
        ("reordered frame", t_ns[verdict == LATE], "recorded late: sorted back"),
        ("clock jump back", t_ns[verdict == CLOCK_BACK], "not later than the latest time seen: left out"),
        ("clock leap ahead", t_ns[verdict == CLOCK_AHEAD], "the clock came back: left out"),
    )
    flaws = [
        Flaw(flaw, note, len(times), int(times.min()), int(times.max()) + 1)
        for flaw, times, note in found
        if len(times)
    ]
    return kept[~repeated], flaws


@njit(cache=True, nogil=True)
def _judge_clock(t_ns: I64, reorder_ns: int) -> U8:
    """Verdict on each frame, uint8 [F]; a frame at exactly the latest time is in order."""
    frames = len(t_ns)
    verdict = np.empty(frames, dtype=np.uint8)
    verdict[:] = IN_ORDER
    before = np.int64(-(2**62))  # latest time before the clock last leapt ahead,
    leap = 0  # and the frame at which it did: the first one comes from nowhere
    latest = t_ns[0]
    i = 1
    while i < frames:
        late = latest - t_ns[i]
        if late <= reorder_ns:
            if late < -reorder_ns:
                leap, before = i, latest
            if late > 0:
                verdict[i] = LATE
            latest = max(latest, t_ns[i])
            i += 1
            continue
        ahead = i - leap
        back = i
        while back < frames and t_ns[back] <= latest and back - i <= ahead:
            back += 1
        if leap >= 0 and back - i > ahead and t_ns[i] > before - reorder_ns:
            verdict[leap:i] = CLOCK_AHEAD
            latest, leap = before, -1
            if before < -(2**61):  # all so far is out: start afresh
                latest, leap = t_ns[i], i
            continue
        while back < frames and t_ns[back] <= latest:
            back += 1
        verdict[i:back] = CLOCK_BACK
        i = back
    return verdict


def cut_stretches(
    t_ns: I64, referee: pl.DataFrame, periods: tuple[Period, ...], gap_ns: int, moved: I64
) -> Stretches:
    """Cut the samples into stretches, and number the segments of play among them.

    A stretch ends at a time gap, at a change of period, at the referee events kick-off, fault,
    goal, half and end, where play stops or goes on, and where the ball was put elsewhere. The
    sample at the time of the event belongs to the new stretch, so a goal's stretch ends before the
    goal. After goal, half, end and stop, play is stopped until the next kick-off, fault or play. Of
    events at one time goal, half and end come first. Play is on before the first event, unless that
    event is a kick-off or play.

    Args:
        t_ns: int64 [F], strictly increasing.
        referee: rows of schema Referee in order of time.
        periods: periods of the match.
        gap_ns: a longer time between samples is a gap.
        moved: int64 [M], samples at which the ball was put elsewhere.
    """
    frames = len(t_ns)
    cut = np.zeros(frames + 1, dtype=np.bool_)  # one more for events after the last sample
    cut[0] = True
    cut[1:frames] = np.diff(t_ns) > gap_ns
    cut[moved] = True
    cut[np.searchsorted(t_ns, [period.start_ns for period in periods[1:]])] = True

    events = sorted(
        zip(referee["t_ns"].to_list(), referee["event"].to_list(), strict=True),
        key=lambda row: (row[0], row[1] not in CONCLUDING),
    )
    on = not events or events[0][1] not in ("kick-off", "play")
    playing = np.full(frames + 1, on, dtype=np.bool_)
    at = np.searchsorted(t_ns, [t for t, _ in events])
    for i, (_, event) in zip(at.tolist(), events, strict=True):
        still = event not in STOPPING
        if event in CUTTING or still != playing[i]:
            cut[i] = True
        playing[i:] = still
    cut, playing = cut[:frames], playing[:frames]

    number = np.cumsum(cut, dtype=np.int32) - np.int32(1)
    segment = np.cumsum(cut & playing, dtype=np.int32) - np.int32(1)
    segment[~playing] = -1
    return Stretches(number, segment)


def find_gaps(t_ns: I64, gap_ns: int) -> list[Flaw]:
    """Flaws of gaps: one per time between samples longer than ``gap_ns``; t_ns is int64 [F], increasing."""
    long = np.flatnonzero(np.diff(t_ns) > gap_ns)
    return [
        Flaw("gap", f"{(end - start) / 1e9:.3f} s without samples", start_ns=start, end_ns=end)
        for start, end in zip(t_ns[long].tolist(), t_ns[long + 1].tolist(), strict=True)
    ]
