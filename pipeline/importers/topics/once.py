"""Messages that a recording has twice, as of one topic on two channels: each counts once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.matches.frame import Frames, MatchLog
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.numbers.arrays import U8, Bools

#: Time within which a message is the same as one before, ns.
_AGAIN_NS = 1_000_000_000


def recorded_once(log: MatchLog) -> MatchLog:
    """A match without frames and events that are there again within a second, to the last bit, and a flaw."""
    frames = log.frames
    if len(np.unique(frames.number)) == len(frames):
        return log
    new = _new(frames)
    again = int((~new).sum())
    if not again:
        return log
    robots = np.repeat(new, frames.counts())
    offsets = np.concatenate(([0], np.cumsum(frames.counts()[new]))).astype(np.int64)
    once = Frames(frames.number[new], frames.t_ns[new], frames.ball[new], offsets, frames.robots[robots])
    same = [column for column in log.referee.columns if column != "t_ns"]
    referee = log.referee.filter(
        (pl.col("t_ns") - pl.col("t_ns").shift(1).over(same) > _AGAIN_NS).fill_null(True))
    flaw = Flaw("skipped", "frames that are recorded twice, as of a topic on two channels", again)
    return replace(
        log, frames=once, referee=referee, decisions=log.decisions.unique(maintain_order=True),
        commands=log.commands.unique(maintain_order=True), options=np.unique(log.options),
        quality=pl.concat([log.quality, quality_table(log.info.match_id, [flaw])]))


def _new(frames: Frames) -> Bools:
    """Mask of the frames that were not there within the second before them, bool [N]."""
    balls, robots = (_bare(bodies) for bodies in (frames.ball, frames.robots))
    last: dict[tuple[int, bytes, bytes], int] = {}
    new = np.ones(len(frames), np.bool_)
    ends = zip(frames.offsets[:-1].tolist(), frames.offsets[1:].tolist(), strict=True)
    for i, (number, t_ns, (begin, end)) in enumerate(
            zip(frames.number.tolist(), frames.t_ns.tolist(), ends, strict=True)):
        key = number, balls[i].tobytes(), robots[begin:end].tobytes()
        new[i] = abs(t_ns - last.get(key, -(1 << 62))) > _AGAIN_NS
        last.setdefault(key, t_ns)
    return new


def _bare(bodies: npt.NDArray[np.void]) -> U8:
    """Bytes of each body without those that pad it, uint8 [N, B]."""
    names = bodies.dtype.names or ()
    return np.concatenate([np.ascontiguousarray(bodies[name]).view(np.uint8).reshape(len(bodies), -1)
                           for name in names], axis=1)
