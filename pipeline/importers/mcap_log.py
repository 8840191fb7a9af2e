"""Our own logs, from this or another machine: MCAP with the channels of ``pipeline.matches``."""

from __future__ import annotations

from dataclasses import replace

import polars as pl

from pitchlore.pipeline import matches
from pitchlore.pipeline.importers.packets.recording import is_recording
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.quality import Flaw, quality_table

_MAGIC = b"\x89MCAP0\r\n"


def detects(head: bytes) -> bool:
    """True if the content begins with MCAP's magic bytes, and is no recording of packets."""
    return head.startswith(_MAGIC) and not is_recording(head)


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a log that pitchlore wrote, as far as the log is whole.

    The match keeps the identity that the log gives it, not that of the file.

    Raises:
        DamagedLog, NoFrames: see ``pipeline.matches.read``.
    """
    log = matches.read(source.content, where=source.name)
    if source.damage is None:
        return log
    reasons = [reason for reason in (source.damage, log.info.incomplete_reason) if reason is not None]
    info = log.info.model_copy(update={"complete": False, "incomplete_reason": "; ".join(reasons)})
    flaw = Flaw("truncated", source.damage, start_ns=int(log.frames.t_ns.max()) if len(log.frames) else None)
    return replace(log, info=info, quality=pl.concat([log.quality, quality_table(info.match_id, [flaw])]))
