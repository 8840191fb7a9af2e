"""The noun matches: recordings in, one log a match out."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import polars as pl

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.base.digests import Content, digest
from pitchlore.pipeline.base.errors import BadRecording, CorruptFile, DamagedLog, PitchloreError
from pitchlore.pipeline.base.toml import fitted
from pitchlore.pipeline.engine.isolated import read_isolated
from pitchlore.pipeline.engine.recognised import warm, with_recognition
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.importers.forms.presets import text_of
from pitchlore.pipeline.importers.packing import Octets
from pitchlore.pipeline.importers.readers import is_ours, judged, open_parts, read
from pitchlore.pipeline.importers.source import SourceFile, part_sha256, slug
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap, load_map
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import ImportSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.paths import listed
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import SIDES, Commands, GameEvents, Kicks, Matches, Quality, Referee, Stamina, Table

if TYPE_CHECKING:
    from pitchlore.pipeline.importers.football.dataset import KloppyDataset

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
    mapping = _mapping(files, recording) or TrackingMap()
    with _opened(files, recording, limits) as parts:
        source = open_parts(parts, recording.provider, limits)
        match, _ = read_match(source, mapping, recording.files())
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
    given = _mapping(store, recording)
    name = slug(recording.file.name)  # until its content is known
    source: SourceFile | None = None
    stays: Receipt | None = None  # the match, where only its map is another now

    def taken(number: int) -> Imported:
        nonlocal name, source, stays
        if source is None:
            source = open_parts(parts, recording.provider, limits)
        asked = source.numbered(number)
        store.release("matches", name)
        name = asked.match_id
        there = _same_recording(store, asked.sha256)
        mapping = _kept(there) if given is None else given
        settings = mapping.settings()
        if there is not None and _stands(store, there, asked.sha256, settings):
            store.release("matches", name)
            return Imported(there, False, asked.sha256)
        asked = asked if there is None else asked.named(there.name)
        stays = there if there and _stands(store, there, asked.sha256, dict(there.settings)) else None
        match, data = read_match(asked, mapping, recording.files())
        check()
        data = log.packed(match) if data is None else data
        with store.locked("matches"):
            receipt, new = _commit(store, match, data, asked.sha256, settings)
        store.release("matches", name)
        return Imported(receipt, new, asked.sha256)

    try:
        first = taken(1)
        for number in _further(first.receipt, first.sha256):
            taken(number)
    except Exception as error:
        if not getattr(error, "transient", False):
            check()
            store.offer(name, error)
            if stays is None:
                store.quarantine("matches", name, error)
            elif isinstance(error, PitchloreError):
                error.next_step = ". ".join(filter(None, (error.next_step, f"{stays.name} stays as it was")))
        raise
    return first


def _further(receipt: Receipt, sha256: str) -> range:
    """Numbers of the further matches of a recording whose first match this is; none for a log of ours."""
    there = receipt.details.get("match", {}).get("of", 1) if receipt.details.get("recording") == sha256 else 1
    return range(2, there + 1)


def read_match(
    source: SourceFile, mapping: TrackingMap, files: Sequence[Path] = ()
) -> tuple[MatchLog, Content | None]:
    """The match of a recording, with the flaws that its plausibility checks and the recogniser find.

    Args:
        source: the recording, opened.
        mapping: how to read a tracking table.
        files: the recording's files, read in a process of its own if its limits say so, or if it is a
            provider's: strangers' files and a library that others wrote.

    Returns:
        The match, and the bytes of its log if reading gave them.

    Raises:
        BadRecording, DamagedLog: if the recording gives no match.
    """
    if not is_ours(source):
        warm()
    if files and (source.limits.isolate or source.provider is not None):
        match, data = read_isolated(files, source, mapping)
    else:
        match, data = read(source, mapping), None
    judged = match if is_ours(source, match) else with_recognition(match)
    return judged, data if judged is match else None


def _same_recording(store: Store, *hashes: str | None) -> Receipt | None:
    """Receipt of the match that was made from content with one of these SHA-256, or is it; else None."""
    for _, receipt in store.tried("matches"):
        if not isinstance(receipt, Receipt):  # the run that follows makes it again, or names it
            continue
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


def _mapping(store: Files, recording: Recording) -> TrackingMap | None:
    """Map of a recording; None if it has none."""
    if recording.form is not None:
        return load_map(text_of(recording.form), where=f"--as {recording.form}")
    path = recording.mapping
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

    If a match of the same id was made from another recording, the complete one of the two stays; of two that
    are incomplete, the one with more frames. The noun is locked meanwhile: if two threads import the same
    content, the second finds the match of the first.

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
        is_more = not there.details["complete"] and len(match.frames) > there.details.get("frames", 0)
        if not same_source and not match.info.complete and not is_more:
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


def remake_receipt(store: Store, name: str) -> bool:
    """Write the damaged receipt of a match anew from its log, if there is one log of it, and that is whole.

    Returns:
        Whether it was; not of a match that was played here. Which version of the importer made the log is not
        known, so that the match is imported again when its recording comes again.
    """
    ours = re.compile(rf"/{re.escape(name)}-([0-9a-f]{{12}})\.log\.mcap$")
    logs = [(path, found[1]) for path in listed(store.root / "matches") if (found := ours.search(path))]
    if len(logs) != 1 or not Path(logs[0][0]).is_file():
        return False
    data = store.foreign(Path(logs[0][0]), megabytes=log.MAX_LOG_BYTES >> 20)
    if digest(data)[:12] != logs[0][1]:
        return False
    match = log.read(data, where=name)
    if match.info.match_id != name or match.info.recording is None:
        return False
    settings: Any = match.info.settings.get("map", {})
    keep(store, match, data, replace(_work(name, match.info.recording, settings), version=0))
    return True


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
            *_told(match),
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
            **({"started_at": row["started_at"][0].isoformat()} if row["started_at"][0] else {}),
            **({"match": match.info.settings["match"]} if "match" in match.info.settings else {}),
            **({"heights": len(match.heights.t_ns)} if len(match.heights.t_ns) else {}),
            **({"options": len(match.options)} if len(match.options) else {}),
        },
    )


def _told(match: MatchLog) -> list[tuple[pl.DataFrame, type[Table]]]:
    """Tables of what SSL's game controller and trackers and 2D's server tell; the log's settings have it."""
    told, own = match.info.settings.get("told", {}), {"match_id": match.info.match_id}
    return [(schema.of([own | row for row in _rows(told[schema.NAME])]), schema)
            for schema in (GameEvents, Kicks, Stamina) if isinstance(told, dict) and told.get(schema.NAME)]


def _rows(told: list[dict[str, Any]] | dict[str, list[Any]]) -> list[dict[str, Any]]:
    """Rows of a table that is told as rows, or as columns."""
    return told if isinstance(told, list) else pl.DataFrame(told).rows(named=True)


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
        mapping = _mapping(store, recording)
    except PitchloreError:
        return None
    there = _same_recording(store, sha256)
    if there is None:
        return None
    settings = there.settings if mapping is None else mapping.settings()
    for part in (part_sha256(sha256, number) for number in _further(there, sha256)):
        other = _same_recording(store, part)
        if other is None or not _stands(store, other, part, dict(settings)):
            return None
    own = there.files["log"].sha256 == sha256 and store.intact(there)  # it is the log that we made ourselves
    return there if own or _stands(store, there, sha256, dict(settings)) else None
