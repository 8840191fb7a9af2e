"""Samples of a log's bodies: from its cameras, or from a tracker."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.ssl_logs import container, tracker, vision
from pitchlore.pipeline.importers.ssl_logs.cameras import CAMERAS, Limits, Merger
from pitchlore.pipeline.importers.ssl_logs.container import ORDER, Container, Span, within
from pitchlore.pipeline.importers.ssl_logs.home import HomeColour
from pitchlore.pipeline.importers.ssl_logs.kicks import KickLog
from pitchlore.pipeline.importers.ssl_logs.samples import Gathered, Gathering
from pitchlore.pipeline.importers.ssl_logs.senders import Senders
from pitchlore.pipeline.importers.ssl_logs.settings import SslMap
from pitchlore.pipeline.importers.ssl_logs.survey import VISION, FrameSpan, Survey
from pitchlore.pipeline.importers.ssl_logs.vision import CAMERA, CAPTURE, Unused
from pitchlore.pipeline.matches.quality import Flaw

#: A tracker is preferred if it was there for this share of the vision's time.
_MOST_OF_IT = 0.9
#: Most rows of robots, as a multiple of the limit on rows.
_ROWS = 8


class Chosen(NamedTuple):
    """The source of the bodies: the uuid and name of a tracker, "" for vision."""

    uuid: str
    name: str

    def settings(self) -> dict[str, object]:
        """Source as JSON values."""
        return {"tracker": self.uuid, "name": self.name} if self.uuid or self.name else {"vision": "cameras"}


def choose_source(found: Survey, mapping: SslMap, source: SourceFile) -> Chosen | None:
    """The source that a map asks for; None for vision.

    Raises:
        BadRecording: if the log does not have it, or has neither vision nor a tracker.
    """
    ranked = sorted(found.trackers, key=lambda tracker: -found.trackers[tracker].frames)
    known = ", ".join(f"{name or 'without a name'} ({uuid})" for uuid, name in ranked) or "none"
    wanted = mapping.source
    if wanted == "vision" and not found.vision.frames:
        raise BadRecording(f"has no vision frames; its trackers: {known}", where=source.name,
                           next_step='Leave out [ssl] source in the map, or give it a tracker\'s name')
    if wanted not in ("auto", "vision", "tracker"):
        named = [tracker for tracker in ranked if wanted in tracker]
        if not named:
            raise BadRecording(f"has no tracker {wanted!r}; its trackers: {known}", where=source.name,
                               next_step="Give [ssl] source in the map one of their names or uuids, or auto")
        return Chosen(*named[0])
    if wanted == "tracker" and not ranked:
        raise BadRecording("has no tracker's packets", where=source.name,
                           next_step="Leave out [ssl] source in the map: then vision is read")
    if not ranked and not found.vision.frames:
        there = [f"{count} {what}" for count, what in (
            (found.lost, "vision packets that cannot be decoded"),
            (found.referee_packets, "packets of a referee")) if count]
        only = f", only {' and '.join(there)}" if there else ""
        raise BadRecording(f"has no vision or tracker frames{only}", where=source.name,
                           next_step="Record SSL-Vision's or a tracker's packets, too")
    if wanted == "vision" or not ranked:
        return None
    best = found.trackers[ranked[0]]
    if wanted == "auto" and not _is_there(best, found.vision):
        return None
    return Chosen(*ranked[0])


def _is_there(tracked: FrameSpan, seen: FrameSpan) -> bool:
    """True if a tracker was there for most of the vision's time."""
    return not seen.frames or tracked.seconds >= _MOST_OF_IT * seen.seconds


def seen_by_cameras(
    source: SourceFile, found: Survey, mapping: SslMap, pitch: Pitch | None, home: HomeColour, span: Span
) -> tuple[Gathered, list[Flaw]]:
    """Samples by the cameras of a log, and flaws of what could not be used.

    Args:
        source: the log.
        found: its survey.
        mapping: settings.
        pitch: the pitch; None where the log does not give it: balls are anywhere then.
        home: the colour that is home.
        span: messages of the match.
    """
    beyond = mapping.beyond
    reach = (np.inf, np.inf) if pitch is None else (pitch.length / 2 + beyond, pitch.width / 2 + beyond)
    merger = Merger(Limits(mapping.robot_confidence, mapping.ball_confidence, *reach))
    senders = Senders()
    unused = np.zeros(3, np.int64)
    with Gathering(home) as gathering:
        for batch in within(Container(source.pieces()).batches(), span):
            seen, lost = vision.detections(batch.of(*VISION))
            unused += lost
            sender = senders.add(seen.frames, seen.packets[:, ORDER])
            kept = np.ones(len(sender), np.bool_)
            for (camera, which), by in found.ahead.items():
                seen.frames[(seen.frames[:, CAMERA] == camera) & (sender == which), CAPTURE] -= by
            for camera, which in found.left_out:
                kept &= ~((seen.frames[:, CAMERA] == camera) & (sender == which))
            seen = seen if kept.all() else seen.where(kept)
            gathering.add(merger.add(seen))
            _check(gathering, source)
        gathering.add(merger.rest())
        joined = gathering.joined()
    flaws = _unused(Unused(*unused.tolist()), "vision")
    flaws += [Flaw("skipped", what, count) for what, count in (
        ("robots that were seen at two places at once: the place near the last one was kept", merger.doubles),
        ("balls that were seen beside the ball, or for less than it", merger.false_balls),
        (f"balls farther than {beyond:g} m beyond the lines", merger.outside),
        (f"frames of more than {CAMERAS} cameras", merger.unknown_cameras),
    ) if count]
    flaws += [
        Flaw("clock leap ahead" if by > 0 else "clock jump back",
             f"the clock of camera {camera:g} is {by:+.3f} s ahead of the others': moved by as much",
             count)
        for (camera, which), by in found.ahead.items()
        if (count := found.senders[camera, which])
    ]
    flaws += [
        Flaw("skipped", f"frames of another sender of camera {camera:g}: who sent the most is read",
             found.senders[camera, which])
        for camera, which in sorted(found.left_out)
    ]
    return joined, flaws


def seen_by_tracker(
    source: SourceFile, mapping: SslMap, chosen: Chosen, home: HomeColour, span: Span, kicks: KickLog
) -> tuple[Gathered, list[Flaw]]:
    """Samples by one tracker of a log, and flaws of what could not be used; ``kicks`` takes up its kicks."""
    unused = np.zeros(3, np.int64)
    with Gathering(home) as gathering:
        for batch in within(Container(source.pieces()).batches(), span):
            seen, lost = tracker.tracker_samples(
                batch.of(container.TRACKER), chosen.uuid, mapping.visibility, kicks)
            unused += lost
            gathering.add(seen)
            _check(gathering, source)
        joined = gathering.joined()
    return joined, _unused(Unused(*unused.tolist()), "tracker")


def kicks_of(source: SourceFile, found: Survey, chosen: Chosen | None, span: Span) -> KickLog:
    """Empty log of the kicks of the tracker that is read, or those of the one with the most frames."""
    if chosen is not None:
        return KickLog(chosen.name or chosen.uuid)
    best = max(found.trackers, key=lambda tracker: found.trackers[tracker].frames, default=None)
    if best is None:
        return KickLog("")
    kicks = KickLog(best[1] or best[0])
    for batch in within(Container(source.pieces()).batches(), span):
        tracker.tracker_samples(batch.of(container.TRACKER), best[0], 0.0, kicks)
    return kicks


def _check(gathering: Gathering, source: SourceFile) -> None:
    """Check the number of rows of robots so far."""
    if gathering.robots > _ROWS * source.limits.rows:
        raise source.too_much(f"more than {_ROWS * source.limits.rows} places of robots", "rows")


def _unused(unused: Unused, what: str) -> list[Flaw]:
    return [Flaw(flaw, note, count) for flaw, note, count in (
        ("damaged record", f"{what} packets that cannot be decoded", unused.damaged),
        ("skipped", "robots without a number that a robot can have", unused.unnumbered),
        ("not a number", "places of bodies: taken for not seen", unused.nowhere),
    ) if count]
