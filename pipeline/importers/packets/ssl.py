"""Recordings of SSL packets: read as the log that the league's own recorder would have written."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, fields

from pitchlore.pipeline.importers.packets.recording import PacketRecording
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.ssl_logs import reading
from pitchlore.pipeline.importers.ssl_logs.container import MAGIC
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog

_HEADER = MAGIC + struct.pack(">i", 1)
_HEAD = struct.Struct(">qii")


@dataclass(frozen=True, slots=True)
class _AsLog(SourceFile):
    """A recording whose content is given as an SSL game log, anew each time."""

    def pieces(self) -> Iterator[bytes]:
        """The log in pieces, one for each chunk of the recording."""
        yield _HEADER
        for packets in PacketRecording(self.content, self.name).packets():
            whole = packets.data.tobytes()
            columns = (packets.channel, packets.t_ns, packets.start, packets.end)
            yield b"".join(
                _HEAD.pack(t_ns, channel, end - start) + whole[start:end]
                for channel, t_ns, start, end in zip(*(column.tolist() for column in columns), strict=True))


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a recording of SSL packets; see :func:`pipeline.importers.ssl_logs.reading.read`.

    Raises:
        BadRecording: as for a log.
        DamagedLog: if the recording does not say whose packets it has.
    """
    as_log = _AsLog(**{field.name: getattr(source, field.name) for field in fields(source)})
    return reading.read(as_log, mapping)
