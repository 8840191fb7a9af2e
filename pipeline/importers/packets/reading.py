"""Matches of recordings of packets, damaged ones included."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import polars as pl

from pitchlore.pipeline.importers.packets import ssl, vsss
from pitchlore.pipeline.importers.packets.recording import PacketRecording, is_recording
from pitchlore.pipeline.importers.packets.streams import LeagueName
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.quality import Flaw, quality_table

#: How the packets of each league are read.
_READ: dict[LeagueName, Callable[[SourceFile, TrackingMap], MatchLog]] = {"ssl": ssl.read, "vsss": vsss.read}
_REASONS = 3  # in ``incomplete_reason``; ``quality`` has all of them


def detects(head: bytes) -> bool:
    """True if the content begins like a recording of packets."""
    return is_recording(head)


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a recording of packets; what is damaged is left out and flagged.

    Raises:
        BadRecording: if its packets give no match.
        DamagedLog: if the recording does not say whose packets it has, or declares more than is read.
    """
    match = _READ[PacketRecording(source.content, source.name).league](source, mapping)
    flaws, reasons = _damage(source)
    if not reasons:
        return match
    known = [match.info.incomplete_reason] if match.info.incomplete_reason else []
    info = match.info.model_copy(update={
        "complete": False, "incomplete_reason": "; ".join([*known, *reasons[:_REASONS]])})
    quality = pl.concat([match.quality, quality_table(info.match_id, flaws)])
    return replace(match, info=info, quality=quality)


def _damage(source: SourceFile) -> tuple[list[Flaw], list[str]]:
    """Flaws of the file, by times from its first packet on, and the reason why it is not whole."""
    recording, first = PacketRecording(source.content, source.name), None
    for packets in recording.packets():
        first = int(packets.t_ns[0]) if first is None else first
    origin = first or 0

    def since(ns: int | None) -> int | None:
        return None if ns is None else max(ns - origin, 0)

    flaws = [replace(flaw, start_ns=since(flaw.start_ns), end_ns=since(flaw.end_ns))
             for flaw in recording.flaws()]
    return flaws, recording.reasons()
