"""A look at a data folder: its files as the catalogue lists them, and those that are damaged or lost."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from pitchlore.pipeline.base.errors import CorruptFile, StorageFailed
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.store import Store, parts
from pitchlore.pipeline.store.catalog import RECORD, Glance, Listed, Listing, glance, listing
from pitchlore.pipeline.store.outputs import RECEIPT
from pitchlore.pipeline.store.parts import ClosedPart, Source
from pitchlore.pipeline.store.paths import listed
from pitchlore.pipeline.store.reading import remedy_for
from pitchlore.pipeline.store.receipts import FileRecord, Manifest, Receipt
from pitchlore.pipeline.store.sealed import Stamp, read_cache, sealed, settled, stamp_if_there, stamp_of

_log = logging.getLogger(__name__)
#: Disks tell times by at most so much, ns.
_COARSEST_NS = 3_000_000_000


class Vouched(NamedTuple):
    """A file that a receipt or manifest vouches for.

    Attributes:
        receipt: the receipt or manifest.
        path: path of the file, absolute and without links.
        record: its stored record.
    """

    receipt: Receipt
    path: str
    record: FileRecord

    @property
    def error(self) -> CorruptFile:
        """The error if it is damaged."""
        return CorruptFile("is lost or damaged", where=self.path, next_step=remedy_for(self.receipt))


class Named(NamedTuple):
    """A file that a receipt or manifest names: of a league's hundreds of thousands, what a look needs.

    Attributes:
        noun: the stage.
        name: the output.
        version: the version that a manifest is of, None for a receipt.
        current: whether the stage that made it has still the same version.
        folder: the folder that ``path`` is relative to, in the data folder: "" or that of a version.
        path, sha256, size, table, rows: as of :class:`pipeline.store.receipts.FileRecord`.
    """

    noun: str
    name: str
    version: int | None
    current: bool
    folder: str
    path: str
    sha256: str
    size: int
    table: str | None
    rows: int | None

    @property
    def record(self) -> FileRecord:
        """The file's stored record."""
        return FileRecord(
            path=self.path, sha256=self.sha256, size=self.size, table=self.table, rows=self.rows)


class Look(NamedTuple):
    """The files of a data folder as they are.

    Attributes:
        files: the whole files, as the catalogue lists them.
        damaged: the files that are damaged or lost.
        unread: errors of damaged receipts and manifests, whose files are in neither; and of whole tables that
            this version does not read.
    """

    files: Listing
    damaged: list[Vouched]
    unread: list[CorruptFile]


class Looked(Frozen):
    """A look that found all as the catalogue has it.

    Attributes:
        catalogue: the catalogue's stamp.
        folders: the stamps of the folders that receipts are in, by path; None where there is none.
    """

    catalogue: Stamp
    folders: dict[str, Stamp | None]


def look_over(store: Store, known: Listing, records: Mapping[str, Glance], *, join: bool = False) -> Look:
    """Look at all files. Those of closed parts that are as the catalogue has them are not read.

    The store suspects the damaged files from now on.

    Args:
        store: the data folder.
        known: the files of the catalogue that is there; none if none is.
        records: the receipts and their like (:func:`records_of`), looked at before: what has changed since is
            noticed by the next look.
        join: whether matches that are complete are closed.
    """
    there = [] if store.mirror is not None else list(parts.closed_parts(store))
    out, nouns = {(record.noun, record.name) for record in store.quarantined()}, STAGES.nouns(Per.MATCH)
    refused = {name for _, name in out}
    kept = {part.name: part for part in _untouched(known, there, records, refused, nouns)}
    closed = {match for part in kept.values() for match in part.matches}
    named, matches, unread = _named(store, closed)
    whole, damaged = _whole_and_damaged(store, named, known)
    table_of = _tables(out, matches | closed)
    sources = _sources(whole, table_of, refused | {file.receipt.name for file in damaged})
    files = {path: file for path, file in known.items() if file.part in kept}
    part_of: dict[str, str] = {}
    others = _standing(store, [part for part in there if part.name not in kept], sources, known, join=join)
    if join:
        parts.remove_unnamed(store, [*kept.values(), *others])
    for each in others:
        part_of |= dict.fromkeys(each.matches, each.name)
        files |= _listed(store, each)
    for path, (file, seen) in whole.items():
        part = part_of.get(file.name, "") if file.noun in nouns else ""
        table = table_of(file)
        if table and table not in parts.JOINED:
            unread += _strange(store, path, file)
        files[path] = Listed("" if part or table not in parts.JOINED else table, seen, part)
    if not damaged and not unread:
        files |= {path: Listed(RECORD, seen, part_of.get(_match_of(path, nouns), ""))
                  for path, seen in records.items() if path not in files}
    return Look(files, damaged, unread)


def receipts_of(store: Store) -> list[Receipt]:
    """Receipts and manifests that can be read, at one moment."""
    with store.snapshot():
        return [found for found in _tried(store, ()) if isinstance(found, Receipt)]


def _tried(store: Store, without: Collection[str]) -> Iterator[Receipt | CorruptFile]:
    """Receipts and manifests, but receipts of some names; and errors of damaged ones."""
    for noun in STAGES.receipted:
        yield from (found for _, found in store.tried(noun, without))
    for noun in STAGES.versioned:
        yield from (found for _, found in store.tried_versions(noun))


def _named(
    store: Store, without: Collection[str]
) -> tuple[list[Named], set[str], list[CorruptFile]]:
    """The files that receipts and manifests name at one moment, but receipts of some names.

    Returns:
        The files; the matches that are there; the errors of damaged receipts and manifests.
    """
    files, matches, errors = list[Named](), set[str](), list[CorruptFile]()
    with store.snapshot():
        for found in _tried(store, without):
            if isinstance(found, CorruptFile):
                errors.append(found)
                continue
            if found.noun == "matches":
                matches.add(found.name)
            version = found.version if isinstance(found, Manifest) else None
            folder = "" if version is None else str(store.folder(found).relative_to(store.root))
            current = found.versions.get(found.noun) == STAGES[found.noun].version
            files += [Named(found.noun, found.name, version, current, folder, record.path, record.sha256,
                            record.size, record.table, record.rows) for record in found.files.values()]
    return files, matches, errors


def records_of(store: Store) -> dict[str, Glance]:
    """The glance at each receipt, manifest and record of quarantine: what the catalogue is made by."""
    paths = [path for noun in STAGES.receipted for path in listed(store.root / noun, RECEIPT)]
    paths += [str(store.version_folder(noun, version) / "manifest.json")
              for noun in STAGES.versioned for version in store.versions(noun)]
    paths += listed(store.root / "quarantine", ".json")
    there, root = len(str(store.root)), str(store.root.resolve())
    return {root + path[there:]: glance(path) for path in paths}


def stands(known: Listing, records: Mapping[str, Glance]) -> bool:
    """True if nothing has changed since the catalogue was made of whole files. Nothing is read."""
    made_by = {path: file.seen for path, file in known.items() if file.table == RECORD}
    return made_by == records and all(
        glance(path) == file.seen for path, file in known.items() if file.table != RECORD)


def stands_at_a_glance(store: Store, catalogue: Path, folders: Mapping[str, Stamp | None]) -> bool:
    """True if a look found all as the catalogue has it (:func:`keep_look`), and no folder has changed since.

    The files of matches in closed parts are not looked at, because the part has their rows.

    Args:
        store: the data folder.
        catalogue: its catalogue.
        folders: the folders (:func:`folders_of`) as they are.
    """
    looked = read_cache(_looked_path(store), Looked)
    if looked is None or not catalogue.exists() or looked != Looked(
            catalogue=stamp_of(str(catalogue)), folders=dict(folders)):
        return False
    young = listing(catalogue, open_only=True)
    return young is not None and all(glance(path) == file.seen for path, file in young.items())


def keep_look(store: Store, catalogue: Stamp, folders: Mapping[str, Stamp | None]) -> None:
    """Note that a catalogue is up to date with folders, as they were before the look began.

    Args:
        store: the data folder.
        catalogue: the stamp of the catalogue that was made, or found up to date.
        folders: the folders (:func:`folders_of`).
    """
    now_ns = store.now_ns()
    with suppress(StorageFailed):  # it only saves time
        store.write_bytes(_looked_path(store), sealed(Looked(catalogue=catalogue, folders=dict(folders))))
        if now_ns - stamp_of(str(store.root))[2] > _COARSEST_NS:  # no file changes a folder's time
            store.drop(_looked_path(store))


def are_settled(folders: Mapping[str, Stamp | None], now_ns: int) -> bool:
    """True if folders get another stamp by any change, by the time of their disk before the look."""
    return all(stamp is None or settled(stamp, now_ns) for stamp in folders.values())


def folders_of(store: Store) -> dict[str, Stamp | None]:
    """The stamps of the folders in which receipts, manifests, records of quarantine and parts are."""
    paths = (f"{store.root}/{name}" for name in (*STAGES, "quarantine", parts.FOLDER))
    return {path: stamp_if_there(path) for path in paths}


def _looked_path(store: Store) -> Path:
    return store.root / ".looked.json"


def _untouched(
    known: Listing, there: Iterable[ClosedPart], records: Mapping[str, Glance], refused: Collection[str],
    nouns: Collection[str],
) -> list[ClosedPart]:
    """The parts of which the catalogue has every file as it is, and no other file is there."""
    of_match = {match: part.name for part in there for match in part.matches}
    touched = {of_match[match] for match in refused if match in of_match}
    touched |= {of_match.get(_match_of(path, nouns), "") for path in records.keys() - known.keys()}
    touched |= {file.part for path, file in known.items() if file.part
                and (records.get(path) if file.table == RECORD else glance(path)) != file.seen}
    listed_parts = {file.part for file in known.values() if file.table == RECORD}
    return [part for part in there if part.name in listed_parts - touched]


def _match_of(path: str, nouns: Collection[str]) -> str:
    """The match of a receipt, if it is that of an output of a match, whose nouns are these; else ""."""
    folder, _, name = path.rpartition("/")
    return name.removesuffix(RECEIPT) if folder.rpartition("/")[2] in nouns else ""


def _whole_and_damaged(
    store: Store, named: Iterable[Named], known: Listing
) -> tuple[dict[str, tuple[Named, Glance]], list[Vouched]]:
    """The whole files, by path, each with the glance at it, and the damaged or lost ones.

    They are checked unless the catalogue has them as they are.
    """
    whole: dict[str, tuple[Named, Glance]] = {}
    damaged, root = list[Vouched](), store.root.resolve()
    for file in named:
        path = f"{root / file.folder}/{file.path}"
        seen = glance(path)
        if _is_whole(store, file, store.root / file.folder, known.get(path), seen):
            whole[path] = file, seen
        elif (receipt := _receipt_of(store, file)) is not None:
            damaged.append(Vouched(receipt, path, file.record))
    store.suspect = frozenset(store.folder(file.receipt) / file.record.path for file in damaged)
    return whole, damaged


def _receipt_of(store: Store, file: Named) -> Receipt | None:
    """The receipt or manifest that names a file, None if it is no longer there."""
    if file.version is None:
        return store.receipt(file.noun, file.name)
    return store.manifest(file.noun, file.version)


def _is_whole(
    store: Store, file: Named | FileRecord, folder: Path, known: Listed | None, seen: Glance
) -> bool:
    """True if a file is as the catalogue has it, or byte for byte what was written."""
    if known is not None and seen is not None and known.seen == seen:
        return True
    return store.whole(file.record if isinstance(file, Named) else file, folder)


def _strange(store: Store, path: str, file: Named) -> Iterator[CorruptFile]:
    """The error of a table that another version of Pitchlore wrote, unless its receipt is no longer there."""
    receipt, (name, _, version) = _receipt_of(store, file), str(file.table).partition("/")
    newer = int(version) > parts.JOINED[name].VERSION
    if receipt is not None and (newer or file.version is None):  # versions are history, whoever wrote them
        yield CorruptFile(
            f"is a table {file.table}, which this version does not read ({receipt.software} wrote it)",
            where=path, next_step="Update Pitchlore" if newer else remedy_for(receipt))


def _tables(out: Collection[tuple[str, str]], there: set[str]) -> Callable[[Named], str]:
    """The table whose rows a file has, "" for none; the tag of one that this version does not read.

    A removed match has no rows. A match or group in quarantine has no rows of the stage that refused it or of
    later stages: such rows would come from other settings than those of the other matches.

    Args:
        out: nouns and names in quarantine.
        there: the matches that are there.
    """
    names = {tag: name for name, schema in parts.JOINED.items() for tag in schema.readable()}
    standing: dict[str, set[str]] = {}
    refused: dict[str, set[str]] = {}
    gone = set[str]()
    for noun in STAGES.of_matches:
        gone = gone | {name for stage, name in out if stage == noun and noun != "matches"}
        if STAGES[noun].per is Per.MATCH:
            standing[noun] = there - gone
        else:
            refused[noun] = gone

    def table_of(file: Named) -> str:
        noun, name = file.noun, file.name
        shown = file.rows and name in standing.get(noun, {name}) and name not in refused.get(noun, ())
        if noun in refused and name in there and not file.current:
            shown = False  # once, decisions had an output for each match
        if not shown or file.table is None or file.table in names:
            return names[file.table] if shown and file.table else ""
        strange = re.fullmatch(r"([a-z_]+)/[0-9]+", file.table)
        return file.table if strange and strange[1] in parts.JOINED else ""

    return table_of


def _sources(
    whole: Mapping[str, tuple[Named, Glance]], table_of: Callable[[Named], str], without: Collection[str]
) -> dict[str, list[Source]]:
    """The files with rows of each match that has been through all its stages, in the order of the stages."""
    nouns = STAGES.nouns(Per.MATCH)
    found: dict[str, list[Source]] = {}
    complete = set[str]()
    for file, _ in whole.values():
        if file.noun in nouns and file.name not in without:
            if file.noun == nouns[-1]:
                complete.add(file.name)
            if (table := table_of(file)) in parts.JOINED:
                found.setdefault(file.name, []).append(
                    Source(table, file.noun, file.name, file.path, file.sha256, file.size))
    return {match: found[match] for match in sorted(complete & found.keys())}


def _standing(
    store: Store, there: Iterable[ClosedPart], sources: Mapping[str, list[Source]], known: Listing, *,
    join: bool,
) -> list[ClosedPart]:
    """The parts that stand, by the files that are there. The others are dropped; new ones may be made."""
    found, root = list[ClosedPart](), store.root.resolve()
    for part in there:
        joined = ((record, f"{root}/{record.path}") for record in part.files.values())
        whole = (_is_whole(store, record, root, known.get(path), glance(path)) for record, path in joined)
        if parts.is_current(part, sources) and all(whole):
            found.append(part)
        elif not store.closed:
            parts.drop_part(store, part)
    closed = {match for part in found for match in part.matches}
    young = [match for match in sources if match not in closed]
    if join:
        together = [{match: sources[match] for match in young[i:i + parts.MATCHES]}
                    for i in range(0, len(young) - parts.MATCHES + 1, parts.MATCHES)]
        try:
            found.extend(parts.join_matches(store, some) for some in together)
        except StorageFailed as error:  # questions take longer without
            _log.warning("Matches could not be joined: %s", error)
    return found


def _listed(store: Store, part: ClosedPart) -> Listing:
    """The files of a part's own."""
    root = store.root.resolve()
    own = {part.index: "", **{record.path: table for table, record in part.files.items()}}
    return {f"{root}/{path}": Listed(table, glance(f"{root}/{path}"), part.name)
            for path, table in own.items()}
