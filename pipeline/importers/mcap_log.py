"""Logs with our messages, from this or another machine: MCAP with the channels of ``pipeline.matches``."""

from __future__ import annotations

from dataclasses import replace

import polars as pl

from pitchlore.pipeline import matches
from pitchlore.pipeline.base.errors import NoFrames
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.directions import infer_periods
from pitchlore.pipeline.importers.packets.recording import is_recording
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.topics import reading as topics
from pitchlore.pipeline.importers.topics.once import recorded_once
from pitchlore.pipeline.importers.tracking.guesses import guess_pitch
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchInfo, MatchLog
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.schemas import SIDES

_MAGIC = b"\x89MCAP0\r\n"


def detects(head: bytes) -> bool:
    """True if the content begins with MCAP's magic bytes, and is no recording of packets."""
    return head.startswith(_MAGIC) and not is_recording(head)


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a log with our messages, as far as the log is whole; of others' topics if the map names them.

    The match keeps the identity that the log gives it. One without our metadata has that of the file; teams
    and pitch are then the map's, and what the map does not say is guessed as for a table.

    Raises:
        DamagedLog, NoFrames: see ``pipeline.matches.read``.
        BadRecording: if it has other topics only, and the map does not say what they are.
    """
    if mapping.topics:
        return topics.read(source, mapping)
    home, away = (mapping.teams.named(side) for side in SIDES)
    default = MatchInfo(
        match_id=source.match_id, source=source.name, format="mcap", recording=source.sha256, home=home,
        away=away, pitch=PITCHES[Kind.VSSS], software=RELEASE,
    )
    try:
        log = matches.read(source.content, where=source.name, default_info=default)
    except NoFrames as error:
        raise topics.unnamed(source) or error from error
    if log.info.recording == source.sha256:
        log = _placed(recorded_once(log), mapping)
    if source.damage is None:
        return log
    reasons = [reason for reason in (source.damage, log.info.incomplete_reason) if reason is not None]
    info = log.info.model_copy(update={"complete": False, "incomplete_reason": "; ".join(reasons)})
    flaw = Flaw("truncated", source.damage, start_ns=int(log.frames.t_ns.max()) if len(log.frames) else None)
    return replace(log, info=info, quality=pl.concat([log.quality, quality_table(info.match_id, [flaw])]))


def _placed(log: MatchLog, mapping: TrackingMap) -> MatchLog:
    """The match of a log that does not describe it, with its pitch and the directions of attack."""
    pitch, _ = guess_pitch(log.frames.robots["x"], mapping.pitch, corner=False)
    attacks, halves = mapping.teams.home_attacks, log.referee.filter(event="half")["t_ns"].to_list()
    periods, flaws = infer_periods(
        log.frames, halves, None if attacks is None else (1 if attacks == "right" else -1))
    return replace(
        log, info=log.info.model_copy(update={"pitch": pitch, "periods": periods}),
        quality=pl.concat([log.quality, quality_table(log.info.match_id, flaws)]),
    )
