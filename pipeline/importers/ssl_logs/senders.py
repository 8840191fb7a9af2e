"""Several senders that use the same number for a camera, distinguished by their counts of frames.

Two programs may send vision at once, a simulator and SSL-Vision for example, or two fields beside each other.
Each counts its frames by itself. Joined to one camera, every robot would be at two places in turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pitchlore.pipeline.importers.ssl_logs.vision import CAMERA, CAPTURE, NUMBER
from pitchlore.pipeline.numbers.arrays import F64, I64

#: The next frame of a sender has at most so many more than the last one, or so many less if packets overtook
#: each other.
_AHEAD, _BEHIND = 1_000, 20
#: Senders of one camera that are distinguished; a count that starts anew is another one.
_SENDERS = 64
#: Cameras whose senders are distinguished; more than ``cameras.CAMERAS`` are not read.
_CAMERAS = 64
#: A clock goes on if its step is less than this, seconds.
_JUMP_S = 1.0
#: Fewer frames than this make no sender: they overtook each other by more.
_FEW = 10


@dataclass(slots=True)
class _Sender:
    """A sender of a camera: number and time of its last frame, frames, and its first and last packet."""

    last: float
    captured: float
    frames: int
    first: int
    end: int


class Senders:
    """Tells the senders of each camera apart, frame by frame, in the order of the log; the same each time."""

    def __init__(self) -> None:
        self._of: dict[float, list[_Sender]] = {}

    def add(self, frames: F64, packets: I64) -> I64:
        """The sender of each frame, from 0 for each camera, int64 [F].

        Args:
            frames: float64 [F, 4], as in ``vision.Detections``.
            packets: int64 [F], the number of each frame's packet.
        """
        which = np.zeros(len(frames), np.int64)
        for camera in np.unique(frames[:, CAMERA]).tolist():
            if camera not in self._of and len(self._of) == _CAMERAS:
                continue
            rows = np.flatnonzero(frames[:, CAMERA] == camera)
            numbers = np.nan_to_num(frames[rows, NUMBER])
            senders = self._of.setdefault(camera, [])
            if len(senders) <= 1:  # as nearly always
                last = senders[0].last if senders else numbers[0] - 1
                steps = np.diff(numbers, prepend=last)
                if ((steps > -_BEHIND) & (steps <= _AHEAD)).all():
                    _add(senders, 0, frames[rows], packets[rows])
                    continue
            for row, number in zip(rows.tolist(), numbers.tolist(), strict=True):
                which[row] = at = _sender(senders, number, float(frames[row, CAPTURE]))
                _add(senders, at, frames[[row]], packets[[row]])
        return which

    def frames(self) -> dict[tuple[float, int], int]:
        """Frames of each camera and sender."""
        return {(camera, at): sender.frames
                for camera, senders in self._of.items() for at, sender in enumerate(senders)}

    def left_out(self) -> set[tuple[float, int]]:
        """Camera and sender of those that are left out: others sent more meanwhile."""
        found = set()
        for camera, senders in self._of.items():
            kept: list[_Sender] = []
            for at, sender in sorted(enumerate(senders), key=lambda item: -item[1].frames):
                meanwhile = any(sender.first < other.end and other.first < sender.end for other in kept)
                if meanwhile and sender.frames >= _FEW:
                    found.add((camera, at))
                else:
                    kept.append(sender)
        return found


def _sender(senders: list[_Sender], number: float, captured: float) -> int:
    """The sender whose count a frame goes on with; a new one if there is none.

    Of several, one whose clock goes on is likely, then the nearest one, then the one that sent last.
    """
    near = []
    for at, sender in enumerate(senders):
        step = number - sender.last
        if -_BEHIND < step <= _AHEAD:
            jumps = abs(captured - sender.captured) > _JUMP_S
            near.append((jumps, step if step > 0 else _BEHIND - step, -sender.end, at))
    return min(near)[-1] if near else min(len(senders), _SENDERS - 1)


def _add(senders: list[_Sender], at: int, frames: F64, packets: I64) -> None:
    """Count frames to a sender, which may be a new one."""
    if at == len(senders):
        senders.append(_Sender(0.0, 0.0, 0, int(packets[0]), 0))
    sender = senders[at]
    sender.last, sender.captured = np.nan_to_num(frames[-1, [NUMBER, CAPTURE]]).tolist()
    sender.frames, sender.end = sender.frames + len(frames), int(packets[-1])
