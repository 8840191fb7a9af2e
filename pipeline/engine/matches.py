"""The noun matches: recordings in, one log a match out."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import polars as pl
from pydantic import BaseModel, field_serializer

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.errors import BadRecording, CorruptFile, DamagedLog, NoFrames, PitchloreError
from pitchlore.pipeline.base.text import printable
from pitchlore.pipeline.base.toml import fitted
from pitchlore.pipeline.engine.isolated import read_isolated
from pitchlore.pipeline.engine.recognised import warm, with_recognition
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.importers.packets.recording import PacketRecording
from pitchlore.pipeline.importers.packing import Octets
from pitchlore.pipeline.importers.readers import is_ours, judged, open_parts, read
from pitchlore.pipeline.importers.source import SourceFile, slug
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap, load_map
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.numbers.arrays import Content
from pitchlore.pipeline.settings import ImportSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import SIDES, Commands, Matches, Quality, Referee

if TYPE_CHECKING:
    from pitchlore.pipeline.importers.football.dataset import KloppyDataset

#: Where recordings are dropped for the next run, in the data folder.
INBOX = "inbox"
#: Folder of logs of matches in progress; a log that a killed process left there is imported.
PLAYING = "playing"
#: Folder of recordings of packets in progress; one that a killed process left there goes to the inbox.
WATCHING = "watching"


class Recording(BaseModel):
    """A file to import, or the files of one recording of football.

    Attributes:
        file: the recording, or its first file.
        mapping: a TOML file with its names, units, axes and teams; None for the map that its match has, or
            else the plain form.
        provider: provider of the files (``importers.football.providers``); None if the content tells.
        more: the other files of that provider's recording, in its order.
    """

    file: Path
    mapping: Path | None = None
    provider: str | None = None
    more: tuple[Path, ...] = ()

    @field_serializer("file", "mapping", when_used="json")
    def _printable(self, path: Path | None) -> str | None:
        """A path for Prefect's records; its bytes need not be UTF-8."""
        return None if path is None else printable(str(path))

    @field_serializer("more", when_used="json")
    def _all_printable(self, paths: tuple[Path, ...]) -> list[str]:
        return [printable(str(path)) for path in paths]

    def at(self, path: Callable[[Path], Path]) -> Recording:
        """The recording with its paths by a function of paths."""
        return self.model_copy(update={
            "file": path(self.file), "mapping": None if self.mapping is None else path(self.mapping),
            "more": tuple(map(path, self.more)),
        })

    def files(self) -> list[Path]:
        """All its files, in order."""
        return [self.file, *self.more]

    def label(self, store: Store) -> str:
        """The recording's path, or its URL in the store's bucket, for people."""
        return printable(store.named(self.file))


def inbox(store: Store) -> list[Recording]:
    """Recordings in the data folder's inbox with their maps, sorted by name, then abandoned logs.

    A log is abandoned if the process that played its match was killed. A recording of packets that was
    abandoned goes to the inbox. The copy of a bucket gets the files of its inbox first.

    Raises:
        StorageFailed: if the bucket cannot be reached.
    """
    if store.mirror is not None:
        store.mirror.pull(store.root / INBOX)
    for file in store.abandoned(WATCHING):
        with suppress(FileNotFoundError):  # another run has moved it
            store.moved(file, INBOX)
    left = [Recording(file=file) for file in store.abandoned(PLAYING)]
    return [recording for recording in _dropped(store) if _is_inside(recording, store)] + left


def strangers(store: Store) -> dict[str, str]:
    """All in the inbox that is never read, with the reason: pipes, devices, links that lead out."""
    why = "or its map is a link that leads out of the inbox, or no regular file; it is not read. Remove that."
    return {recording.label(store): why for recording in _dropped(store) if not _is_inside(recording, store)}


def _dropped(store: Store) -> list[Recording]:
    """All recordings in the inbox with their maps, sorted by name."""
    return [with_map(path) for path in _in_inbox(store) if path.suffix != ".toml"]


def _in_inbox(store: Store) -> list[Path]:
    """All in the inbox that is no folder and not hidden, sorted."""
    return sorted(path for path in (store.root / INBOX).rglob("*")
                  if not path.name.startswith(".") and (path.is_symlink() or not path.is_dir()))


def _is_inside(recording: Recording, store: Store) -> bool:
    """True if the recording and its map are regular files in the inbox, or links to such."""
    try:
        real = [path.resolve(strict=True) for path in (recording.file, recording.mapping) if path is not None]
    except (OSError, RuntimeError):  # a link to nothing, or to itself
        return False
    return all(path.is_file() and path.is_relative_to((store.root / INBOX).resolve()) for path in real)


def with_map(file: Path) -> Recording:
    """Recording with the map beside it, if there is one.

    The map of ``x.csv`` is ``x.csv.toml``, else ``map.toml`` in its folder.
    """
    maps = (file.with_name(f"{file.name}.toml"), file.with_name("map.toml"))
    return Recording(file=file, mapping=next((m for m in maps if os.path.lexists(m)), None))


class Imported(NamedTuple):
    """Outcome of the import of a recording.

    Attributes:
        receipt: receipt of its match.
        new: whether the match was made now.
        sha256: SHA-256 of the recording's content.
    """

    receipt: Receipt
    new: bool
    sha256: str


def import_recording(
    store: Store, recording: Recording, limits: ImportSettings = ImportSettings()
) -> tuple[Receipt, bool]:
    """Receipt of a recording's match, and whether it is new; as for :func:`take_in`."""
    receipt, new, _ = take_in(store, recording, limits)
    return receipt, new


def take_in(store: Store, recording: Recording, limits: ImportSettings = ImportSettings()) -> Imported:
    """The match of a recording, imported if need be. The recording is opened and hashed once.

    The same content is the same match: under another name, gzipped or not, or as the log that we made from
    it. A match is imported again only if its files are damaged or lost, if its stage has another version,
    or if the map is another. A recording without a map has the one that its match was imported with.

    Args:
        store: receives the match.
        recording: the file and its map.
        limits: bounds of reading's cost, and whether it is done in a process of its own.

    Raises:
        BadRecording, DamagedLog: if the recording gives no match. It goes into quarantine under its match
            id, or under the slug of its name if it cannot be opened.
        BadSettings: if the map cannot be used.
        NotFound: if the file or the map cannot be read.
        StillWritten: if the file changes meanwhile. It does not go into quarantine.
    """
    recording = recording.at(store.here)
    checks = [store.unchanged(file) for file in recording.files()]

    def check() -> None:
        for unchanged in checks:
            unchanged()

    with _opened(store, recording, limits) as parts:
        return _import(store, recording, parts, limits, check)


def read_recording(
    recording: Recording, limits: ImportSettings = ImportSettings()
) -> tuple[MatchLog, dict[str, object]]:
    """The match of a recording that is imported nowhere, and the settings of its map.

    Args:
        recording: the file and its map; without one a tracking table has the plain form.
        limits: bounds of reading's cost, and whether it is done in a process of its own.

    Raises:
        BadRecording, DamagedLog: if the recording gives no match.
        BadSettings: if the map cannot be used.
        NotFound: if the file or the map cannot be read.
        StillWritten: if the file changes meanwhile.
    """
    files = Files(Path())
    checks = [files.unchanged(file) for file in recording.files()]
    mapping = _mapping(files, recording.mapping) or TrackingMap()
    with _opened(files, recording, limits) as parts:
        source = open_parts(parts, recording.provider, limits)
        match, _ = read_match(source, mapping, recording.files() if limits.isolate else None)
    for unchanged in checks:
        unchanged()
    return match, mapping.settings()


def read_dataset(dataset: KloppyDataset) -> MatchLog:
    """The match of a kloppy dataset, however it was loaded, with its flaws.

    Raises:
        BadRecording: if it gives no match.
    """
    from pitchlore.pipeline.importers.football.dataset import match_of_dataset  # noqa: PLC0415 (football alone needs it)

    return with_recognition(judged(match_of_dataset(dataset)))


@contextmanager
def _opened(
    store: Files, recording: Recording, limits: ImportSettings
) -> Iterator[list[tuple[str, Octets]]]:
    """Name and content of each of a recording's files."""
    with ExitStack() as stack:
        yield [
            (file.name, stack.enter_context(store.opened(file, megabytes=limits.megabytes)))
            for file in recording.files()
        ]


def _import(
    store: Store, recording: Recording, parts: list[tuple[str, Octets]], limits: ImportSettings,
    check: Callable[[], None],
) -> Imported:
    """Import an open recording; ``check`` raises StillWritten if it has changed."""
    given = _mapping(store, recording.mapping)
    name = slug(recording.file.name)  # until its content is known
    try:
        source = open_parts(parts, recording.provider, limits)
        store.release("matches", name)
        name = source.match_id
        there = _same_recording(store, source.sha256)
        mapping = _kept(there) if given is None else given
        settings = mapping.settings()
        if there is not None and _stands(store, there, source.sha256, settings):
            store.release("matches", name)
            return Imported(there, False, source.sha256)
        source = source if there is None else source.named(there.name)
        match, data = read_match(source, mapping, recording.files() if limits.isolate else None)
        check()
        data = log.packed(match) if data is None else data
        with store.locked("matches"):
            receipt, new = _commit(store, match, data, source.sha256, settings)
    except Exception as error:
        if not getattr(error, "transient", False):
            check()
            store.quarantine("matches", name, error)
        raise
    store.release("matches", name)
    return Imported(receipt, new, source.sha256)


def read_match(
    source: SourceFile, mapping: TrackingMap, isolated: Sequence[Path] | None = None
) -> tuple[MatchLog, Content | None]:
    """The match of a recording, with the flaws that its plausibility checks and the recogniser find.

    Args:
        source: the recording, opened.
        mapping: how to read a tracking table.
        isolated: the recording's files, to be read in a process of its own; None: it is read in this one.

    Returns:
        The match, and the bytes of its log if reading gave them.

    Raises:
        BadRecording, DamagedLog: if the recording gives no match.
    """
    if not is_ours(source):
        warm()
    if isolated is None:
        match, data = read(source, mapping), None
    else:
        match, data = read_isolated(isolated, source, mapping)
    judged = match if is_ours(source) else with_recognition(match)
    return judged, data if judged is match else None


def _same_recording(store: Store, *hashes: str | None) -> Receipt | None:
    """Receipt of the match that was made from content with one of these SHA-256, or is it; else None."""
    for receipt in store.receipts("matches"):
        own = (receipt.inputs.get("source"), receipt.details.get("recording"), receipt.files["log"].sha256)
        if any(sha256 is not None and sha256 in own for sha256 in hashes):
            return receipt
    return None


def _work(name: str, sha256: str, settings: dict[str, object]) -> Work:
    stage = STAGES["matches"]
    return Work(noun=stage.noun, name=name, settings=settings, version=stage.version,
                inputs={"source": sha256}, schemas=stage.schemas)


def _stands(store: Store, receipt: Receipt, sha256: str, settings: dict[str, object]) -> bool:
    """True if the stored match of this content is up to date."""
    return receipt.key == _work(receipt.name, sha256, settings).key and store.intact(receipt)


def _mapping(store: Files, path: Path | None) -> TrackingMap | None:
    """Map at a path; None if there is none."""
    if path is None:
        return None
    return load_map(store.foreign(path).decode(errors="replace"), where=str(path))


def _kept(receipt: Receipt | None) -> TrackingMap:
    """Map that a match was imported with; the plain form without a match, or if it was played here.

    Raises:
        BadSettings: if it was one of another version of pitchlore, which has other keys.
    """
    if receipt is None or "source" not in receipt.inputs:
        return TrackingMap()
    return fitted(TrackingMap, dict(receipt.settings), f"the map of {receipt.name}", "Give one: --map FILE")


def _commit(
    store: Store, match: MatchLog, data: Content, sha256: str, settings: dict[str, object]
) -> tuple[Receipt, bool]:
    """Commit a match, ``data`` as a log, unless the store has it. Returns its receipt, and whether it is new.

    If a match of the same id was made from another recording, the complete one of the two stays. The noun
    is locked meanwhile: if two threads import the same content, the second finds the match of the first.

    Raises:
        BadRecording: if both are complete and differ.
    """
    there = _same_recording(store, sha256, match.info.recording)
    if there is not None and there.name != match.info.match_id:
        return there, False
    name = match.info.match_id
    there = store.readable("matches", name)
    if there is not None and store.intact(there):
        same_source = there.inputs["source"] == sha256
        stands = not same_source or there.key == _work(name, sha256, settings).key
        if there.files["log"].sha256 == digest(data) and stands:
            return there, False
        if not same_source and not match.info.complete:
            return there, False
        if not same_source and there.details["complete"]:
            raise BadRecording(
                f"another match is here, with the same id {name}", where=match.info.source,
                next_step="Give one of the two logs another match id",
            )
    return keep(store, match, data, _work(name, sha256, settings)), True


def keep(store: Store, match: MatchLog, data: Content, work: Work) -> Receipt:
    """Commit a match: its log, its row, the referee's events, its flaws, and its commands.

    Args:
        store: the store that receives it.
        match: the content of the log.
        data: the log's bytes.
        work: work that made it.
    """
    return store.commit(work, made(match, data))


def mend_match(store: Store, receipt: Receipt) -> None:
    """Write a match's damaged tables anew from its log, if the log is whole and gives the same bytes."""
    try:
        data = store.read(receipt, "log")
        store.mend(receipt, made(log.read(data, where=receipt.name), data))
    except (CorruptFile, DamagedLog):
        return  # it is reported: the recording has to be imported again


def made(match: MatchLog, data: Content | None = None) -> Made:
    """The noun matches of a match: its row, the referee's events, its flaws, its commands, and its log.

    Args:
        match: the content of the log.
        data: the log's bytes; None: the log is left out.
    """
    row = log.row(match)
    flaws = match.quality.group_by("flaw").agg(pl.col("count").sum()).sort("flaw")
    return Made(
        tables=[
            (row, Matches), (match.referee, Referee), (match.quality, Quality), (match.commands, Commands),
        ],
        blobs={} if data is None else {"log": ("mcap", data)},
        details={
            "pitch": match.info.pitch.model_dump(mode="json"), "complete": match.info.complete,
            "source": match.info.source, "recording": match.info.recording,
            "home": match.info.home, "away": match.info.away,
            "duration_s": float(row["duration_s"][0]), "frames": int(row["frames"][0]),
            "decisions": match.decisions.height,
            **_bodies(match), "goals": _goals(match),
            "score": {side: row[f"score_{side}"][0] for side in SIDES},
            "flaws": dict(flaws.cast({"flaw": pl.String}).iter_rows()),
            **({"heights": len(match.heights.t_ns)} if len(match.heights.t_ns) else {}),
        },
    )


def _bodies(match: MatchLog) -> dict[str, object]:
    """Where bodies come from, in words, if the recording has several sources of them."""
    match match.info.settings.get("source"):  # of SSL logs
        case {"tracker": uuid, "name": name}:
            return {"bodies": f"the tracker {name or 'without a name'}, uuid {uuid}"}
        case {"vision": cameras}:
            return {"bodies": f"vision, {cameras}"}
    return {}


def _goals(match: MatchLog) -> object:
    """Origin of the goals of a match, and how sure they are; all formats but tables have a referee."""
    told_by = None if match.info.format == "tracking" else "referee"
    return match.info.settings.get("goals", {"from": told_by})


def standing(store: Store, recording: Recording, sha256: str) -> Receipt | None:
    """The stored match of a recording of known content, None if it has to be imported.

    Args:
        store: holds the match.
        recording: its map counts, its files are not opened.
        sha256: SHA-256 of its content.
    """
    try:
        mapping = _mapping(store, recording.mapping)
    except PitchloreError:
        return None
    there = _same_recording(store, sha256)
    if there is None:
        return None
    settings = there.settings if mapping is None else mapping.settings()
    own = there.files["log"].sha256 == sha256 and store.intact(there)  # it is the log that we made ourselves
    return there if own or _stands(store, there, sha256, dict(settings)) else None


def useless(store: Store) -> list[Path]:
    """Remove and return the logs and recordings that were killed before anything was in them."""
    return [file for folder, empty in ((PLAYING, _nothing_logged), (WATCHING, _nothing_recorded))
            for file in store.abandoned(folder) if store.discard(file, empty)]


def _nothing_recorded(data: bytes) -> bool:
    """True if a recording has no packet."""
    try:
        return not any(True for _ in PacketRecording(data, "").packets())
    except DamagedLog:
        return True


def _nothing_logged(data: bytes) -> bool:
    """True if a log has no frame."""
    try:
        log.read(data, where="")
    except NoFrames:
        return True
    except PitchloreError:
        return not data
    return False
