"""The formats that can be imported: one table, ``READERS``.

Detection, reading, the error messages, the help of ``pitchlore import`` and the table of formats in docs
all come from it. A new format is a module with two functions, ``detects`` and ``read``, and one entry here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256

import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.base.text import NAME_CHARACTERS, printable
from pitchlore.pipeline.importers import mcap_log
from pitchlore.pipeline.importers.football import dataset as football
from pitchlore.pipeline.importers.football.providers import dataset_of, open_files
from pitchlore.pipeline.importers.forms.together import one_table
from pitchlore.pipeline.importers.forms.unread import unread
from pitchlore.pipeline.importers.packets import reading as packets
from pitchlore.pipeline.importers.packing import Octets, Unpacking
from pitchlore.pipeline.importers.plausibility import plausibility_checks
from pitchlore.pipeline.importers.rcg import reading as rcg
from pitchlore.pipeline.importers.source import SourceFile, inflate, slug, streamed_megabytes
from pitchlore.pipeline.importers.ssl_logs import reading as ssl_log
from pitchlore.pipeline.importers.tracking import csv_file, parquet_file
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.quality import quality_table
from pitchlore.pipeline.settings import ImportSettings

#: Bytes of the content that ``detects`` is given, at most.
HEAD_BYTES = 1 << 16


@dataclass(frozen=True, slots=True)
class Reader:
    """A format and how to read it.

    Attributes:
        name: name of the format, unique; also the folder of its synthetic recordings in ``tests/recordings``.
        title: name of such a file for users.
        about: content that is read, for docs/how-to/import.md; Markdown, one line.
        detects: whether content is of the format, by its first ``HEAD_BYTES``, inflated and never empty.
        read: match of a recording that ``detects`` has recognised: time from the first sample, our axes and
            units, the file's ``match_id`` unless the format states one of its own. What is damaged in parts
            is read as far as it is whole and flagged in ``quality``. If no match can be made of it, it raises
            BadRecording, one line that begins with the file's name. A format that describes itself does not
            use the map.
        ours: whether the format is our own log, which carries its quality rows: it is not checked again.
        text: whether the format is text, whose lines have a greatest length.
        streamed: whether it is read in pieces, so that its content need not be in memory.
    """

    name: str
    title: str
    about: str
    detects: Callable[[bytes], bool]
    read: Callable[[SourceFile, TrackingMap], MatchLog]
    ours: bool = False
    text: bool = False
    streamed: bool = False


#: All formats. No two recognise the same file, so that their order is only that of the help.
READERS: tuple[Reader, ...] = (
    Reader(
        "tracking-parquet", "tracking table in Parquet",
        "one row per body and sample: `frame, t, team, player, x, y`, optionally `heading, option, segment, "
        "score_home, score_away, game_state`, or one row per sample: `frame, t, x_ball, y_ball, x_blue0, "
        "y_blue0, …`; a map allows other names, units, axes and teams",
        parquet_file.detects, parquet_file.read,
    ),
    Reader(
        "tracking-csv", "tracking table in CSV",
        "the same columns, separated by commas, semicolons or tabs, in UTF-8, UTF-16 or latin-1; without a "
        "header a map numbers them",
        csv_file.detects, csv_file.read, text=True,
    ),
    Reader(
        "rcg", "RoboCup 2D log (.rcg: ULG4 to ULG6, JSON)",
        "ball, players, playmodes and the players' counted commands of every cycle; the left team is home",
        rcg.detects, rcg.read, text=True,
    ),
    Reader(
        "ssl-log", "RoboCup SSL game log (.log)",
        "vision of several cameras or a tracker's packets, geometry, and the referee's commands, score and "
        "names; versions 0 and 1; blue is home unless a map says otherwise",
        ssl_log.detects, ssl_log.read, streamed=True,
    ),
    Reader(
        "packets", "recording of packets (.mcap)",
        "what `pitchlore watch` received from the cameras, trackers and referee of SSL and VSSS; the whole "
        "parts of a truncated or damaged one",
        packets.detects, packets.read,
    ),
    Reader(
        "mcap", "MCAP log (.mcap)",
        "Pitchlore's own logs (ROS 2 CDR, `schemas/*.msg`) from any machine; the whole parts of a truncated "
        "or damaged log; with a map other topics of ROS 2, JSON and protobuf (extra `ros`)",
        mcap_log.detects, mcap_log.read, ours=True,
    ),
)

#: The formats' titles, for people.
FORMATS = ", ".join(reader.title for reader in READERS)

#: How much of a file is looked at for how it begins, bytes.
_BEGIN = 64
#: Further hint to a user if it may be a provider's.
_WHOSE = "If it is football data, say whose, as with --from kloppy:skillcorner. "
#: Hint to a user if a file is of none of the formats.
SUPPORTED = f"Give one of these, plain or packed with gzip or Zstandard: {FORMATS}"


def open_source(data: Octets, name: str, limits: ImportSettings = ImportSettings()) -> SourceFile:
    """A recording: unpacked, hashed, its format detected from its content and never from its name.

    Args:
        data: the file's bytes, packed or not; of a streamed format they are read anew each time.
        name: the file's name; the hash in the match's identity does not depend on it. What cannot be printed
            is escaped here, once.
        limits: bounds of its cost.

    Raises:
        BadRecording: if the file unpacks to too much, or not at all.
    """
    match_id = slug(name)
    name = printable(name, NAME_CHARACTERS)
    unpacking = Unpacking(data, name, limits.megabytes)
    kept: list[bytes] = []
    for piece in unpacking:
        kept.append(piece)
        if sum(map(len, kept)) >= HEAD_BYTES:
            break
    head = b"".join(kept)
    found = next((reader for reader in READERS if reader.detects(head[:HEAD_BYTES])), None) if head else None
    if found is not None and found.streamed:
        unpacking.allow(streamed_megabytes(limits))
        digest = sha256(head)
        for piece in unpacking:
            digest.update(piece)
        content, packed = b"", data
    else:
        content, packed = data[:] if unpacking.bare else head + b"".join(unpacking), None
        digest = sha256(content)
    sha = digest.hexdigest()
    form = None if found is None else found.name
    return SourceFile(name, content, unpacking.damage, form, sha, f"{match_id}-{sha[:12]}", limits, packed)


def open_parts(
    parts: Sequence[tuple[str, Octets]], provider: str | None = None,
    limits: ImportSettings = ImportSettings(),
) -> SourceFile:
    """A recording of one file, whose content tells its format, of tables of one match, or of a provider.

    Args:
        parts: name and bytes of each file; one, tables of one match, or those of the provider in its order.
        provider: a key of ``football.providers.PROVIDERS``; None for a format of ``READERS``.
        limits: bounds of its cost.

    Raises:
        BadRecording: as ``open_source`` or ``football.providers.open_files``.
    """
    if provider is not None:
        return open_files(parts, provider, limits)
    name, data = parts[0]
    if len(parts) > 1:
        data = one_table([(name, inflate(part[:], name, limits.megabytes)[0]) for name, part in parts])
    return open_source(data, name, limits)


def is_ours(source: SourceFile, log: MatchLog | None = None) -> bool:
    """True if a recording seems to be a log of our own; by its match, if it is, whose flaws it carries."""
    if log is not None and log.info.recording == source.sha256:
        return False
    return any(reader.ours for reader in READERS if reader.name == source.format)


def read(source: SourceFile, mapping: TrackingMap = TrackingMap()) -> MatchLog:
    """Match of a recording, checked for plausibility.

    Args:
        source: the file, opened.
        mapping: how to read a tracking table; the default is the plain form.

    Raises:
        NotFound: if a provider's files need kloppy, which is not there.
        BadRecording: if the file is empty, of no known format, or cannot be read, or exceeds a limit.
        DamagedLog, NoFrames: if it is a log of ours of which nothing can be read.
    """
    if source.provider is not None:
        return _checked(football.match_of_dataset(dataset_of(source), source), source)
    if source.format is None:
        known = unread(source.content[:HEAD_BYTES])
        if known is not None:
            raise BadRecording(known.what, where=source.name, next_step=known.next_step)
        what = "is not a recording of a known format" if source.content else "is empty"
        theirs = csv_file.is_markup(source.content[:_BEGIN])
        raise BadRecording(what, where=source.name, next_step=f"{_WHOSE if theirs else ''}{SUPPORTED}")
    reader = next(reader for reader in READERS if reader.name == source.format)
    if reader.text:
        source.check_text()
    log = reader.read(source, mapping)
    return _checked(log, source)


def _checked(log: MatchLog, source: SourceFile) -> MatchLog:
    """The match within its limits, with the flaws of its plausibility checks; a log of ours has its own."""
    most = log.frames.most_robots()
    if most > source.limits.robots:
        raise source.too_much(f"{most} robots of a team", "robots")
    if is_ours(source, log):
        return log
    return judged(replace(log, info=log.info.model_copy(update={"recording": source.sha256})))


def judged(log: MatchLog) -> MatchLog:
    """The match with the flaws that its plausibility checks find."""
    found = quality_table(log.info.match_id, plausibility_checks(log))
    return replace(log, quality=pl.concat([log.quality, found]))
