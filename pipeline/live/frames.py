"""Frames of a match from its packets, as they come; blue is home."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce
from typing import Protocol

import numpy as np
from pydantic import ValidationError

from pitchlore.pipeline.game.pitch import Kind, Pitch
from pitchlore.pipeline.importers.packets import vsss
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import LeagueName, channels
from pitchlore.pipeline.importers.rows import pack
from pitchlore.pipeline.importers.ssl_logs import geometry, tracker, vision
from pitchlore.pipeline.importers.ssl_logs.cameras import Limits, Merger
from pitchlore.pipeline.importers.ssl_logs.container import RECEIVED, TRACKER, VISION_2010, VISION_2014
from pitchlore.pipeline.importers.ssl_logs.samples import CapturedSamples, frames_of
from pitchlore.pipeline.importers.ssl_logs.settings import SslMap
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, CAMERA, Detections
from pitchlore.pipeline.importers.ssl_logs.wire import fields
from pitchlore.pipeline.live.bodies import ssl_batch
from pitchlore.pipeline.live.screening import laid_out
from pitchlore.pipeline.matches.frame import Frames
from pitchlore.schemas import AWAY, HOME

#: A tracker, or a camera, that was silent for so long is not waited for, ns.
_SILENT_NS = 500_000_000
#: A source's clock that is off from ours by more began anew, ns.
_OFF_NS = 500_000_000


#: No pitch reaches so far, metres, and no robot has so great a number.
_FURTHEST_M, _NUMBERS = 100.0, 32


class Framing(Protocol):
    """Makes frames of a league's packets."""

    def take(self, packets: Sequence[Packet]) -> Frames:
        """Frames that these sound packets complete; their times are Unix time in ns."""


def framing(league: LeagueName) -> Framing:
    """Maker of frames of a league's packets."""
    return _FRAMING[league]()


def pitch_of(league: LeagueName, packets: Sequence[Packet]) -> Pitch | None:
    """The pitch as these packets tell it; None if none does, or none that a pitch can be."""
    channel = channels(league)
    vision_of = {channel[name] for name in ("vision", "vision-2010") if name in channel}
    seen = [packet for packet in packets if packet.channel in vision_of]
    size = _SIZES[league](seen) if seen else None
    if size is None:
        return None
    try:
        return Pitch(kind=Kind(league), **size)
    except ValidationError:
        return None


def _vsss_size(seen: Sequence[Packet]) -> dict[str, float] | None:
    size = vsss.environments(*laid_out(seen)).frames[:, vsss.LENGTH:]
    size = size[(size > 0).all(axis=1)]
    names = ("length", "width", "goal_width", "goal_depth")
    return dict(zip(names, size[-1].tolist(), strict=True)) if len(size) else None


def _ssl_size(seen: Sequence[Packet]) -> dict[str, float] | None:
    batch = ssl_batch(seen)
    sizes = geometry.sizes(batch, fields(batch.data, batch.start, batch.end)[0])
    return max(sizes, key=lambda size: sizes[size]).metres() if sizes else None


class _Vsss:
    """A packet of FIRASim is a frame, at the time at which it arrived."""

    def __init__(self) -> None:
        self._vision = channels("vsss")["vision"]

    def take(self, packets: Sequence[Packet]) -> Frames:
        seen = [packet for packet in packets if packet.channel == self._vision]
        found = vsss.environments(*laid_out(seen))
        t_ns = np.array([packet.t_ns for packet in seen], np.int64)[found.sound]
        bodies, of = found.bodies, np.repeat(np.arange(len(t_ns)), np.diff(found.offsets))
        is_ball = bodies[:, vsss.TEAM] == vsss.BALL
        ball = np.full((2, len(t_ns)), np.nan)
        ball[:, of[is_ball]] = bodies[is_ball][:, [vsss.X, vsss.Y]].T
        robots, places = bodies[~is_ball], of[~is_ball]
        return _bounded(pack(
            np.nan_to_num(found.frames[:, vsss.STEP]).astype(np.uint32), t_ns,
            {"x": ball[0], "y": ball[1]}, places,
            {"team": np.where(robots[:, vsss.TEAM] == vsss.BLUE, HOME, AWAY).astype(np.uint8),
             "id": robots[:, vsss.ID].astype(np.uint16),
             "x": robots[:, vsss.X], "y": robots[:, vsss.Y], "theta": robots[:, vsss.THETA]},
        ))


class _Ssl:
    """Frames as the reader of SSL logs makes them: of a tracker while one sends, else of the cameras.

    A round of cameras ends as soon as all that sent in the last half second are in it: the next frame would
    end it anyhow.
    """

    def __init__(self) -> None:
        usual = SslMap()
        self._merger = Merger(Limits(usual.robot_confidence, usual.ball_confidence, np.inf, np.inf))
        self._visibility = usual.visibility
        self._tracker: str | None = None
        self._heard_ns = 0
        self._ahead_ns = 0
        self._cameras: dict[float, int] = {}
        self._begun_ns = 0

    def take(self, packets: Sequence[Packet]) -> Frames:
        batch = ssl_batch(packets)
        seen, _ = vision.detections(batch.of(VISION_2010, VISION_2014))
        samples = [self._merger.add(seen)]
        if self._is_whole(seen):
            samples.append(self._merger.rest())
        tracked = batch.of(TRACKER)
        if len(tracked.kind):
            known, _ = tracker.trackers_of(tracked)
            if self._tracker is None:
                self._tracker = known[0][0]
            if any(uuid == self._tracker for uuid, _ in known):
                self._heard_ns = packets[-1].t_ns
        if self._tracker is not None:
            if packets and packets[-1].t_ns - self._heard_ns > _SILENT_NS:
                self._tracker = None
            else:
                samples = [tracker.tracker_samples(tracked, self._tracker, self._visibility)[0]]
        return self._timed(samples)

    def _is_whole(self, seen: Detections) -> bool:
        """True if the cameras' round waits for nobody, after these frames."""
        for camera, (_, received) in zip(seen.frames[:, CAMERA].tolist(), seen.packets.tolist(), strict=True):
            self._cameras[camera] = received
        latest = max(self._cameras.values(), default=0)
        self._begun_ns = self._begun_ns or latest
        sending = {camera for camera, last in self._cameras.items() if latest - last < _SILENT_NS}
        self._cameras = {camera: self._cameras[camera] for camera in sending}
        return latest - self._begun_ns >= _SILENT_NS and self._merger.waiting() >= sending

    def _timed(self, samples: Sequence[CapturedSamples]) -> Frames:
        """The samples at the times at which they were captured, by our clock."""
        frames = reduce(Frames.followed_by, (frames_of(part, BLUE) for part in samples))
        captured = np.rint(np.concatenate([part.captured for part in samples]) * 1e9).astype(np.int64)
        received = np.concatenate([part.packets[:, RECEIVED] for part in samples])
        ahead = np.full(len(captured), self._ahead_ns)
        while len(off := np.flatnonzero(np.abs(captured - ahead - received) > _OFF_NS)):
            ahead[off[0]:] = captured[off[0]] - received[off[0]]
        self._ahead_ns = int(ahead[-1]) if len(ahead) else self._ahead_ns
        return _bounded(replace(frames, t_ns=captured - ahead))


def _bounded(frames: Frames) -> Frames:
    """The frames without what is no body of a match: anybody may send packets."""
    ball, robots = frames.ball.copy(), frames.robots
    far = np.maximum(np.abs(ball["x"]), np.abs(ball["y"])) > _FURTHEST_M
    ball["x"][far] = ball["y"][far] = np.nan
    near = np.maximum(np.abs(robots["x"]), np.abs(robots["y"])) <= _FURTHEST_M
    near &= robots["id"] < _NUMBERS
    if near.all():
        return replace(frames, ball=ball)
    counts = np.bincount(frames.robot_frames()[near], minlength=len(frames))
    offsets = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    return replace(frames, ball=ball, offsets=offsets, robots=robots[near])


_SIZES: dict[LeagueName, Callable[[Sequence[Packet]], dict[str, float] | None]] = {
    "vsss": _vsss_size, "ssl": _ssl_size}
_FRAMING: dict[LeagueName, Callable[[], Framing]] = {"vsss": _Vsss, "ssl": _Ssl}
