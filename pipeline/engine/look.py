"""A look at a data folder: its files as the catalogue lists them, and those that are damaged or lost."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Collection, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
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
from pitchlore.pipeline.store.receipts import FileRecord, Receipt
from pitchlore.pipeline.store.sealed import Stamp, read_cache, sealed, settled, stamp_of

_log = logging.getLogger(__name__)


class Vouched(NamedTuple):
    """A file that a receipt or manifest vouches for.

    Attributes:
        receipt: the receipt or manifest.
        path: path of the file, absolute and without links.
        record: its stored record.
        seen: its size and time of change when it was looked at.
    """

    receipt: Receipt
    path: str
    record: FileRecord
    seen: Glance

    @property
    def error(self) -> CorruptFile:
        """The error if it is damaged."""
        return CorruptFile("is lost or damaged", where=self.path, next_step=remedy_for(self.receipt))


class Look(NamedTuple):
    """The files of a data folder as they are.

    Attributes:
        files: the whole files, as the catalogue lists them.
        damaged: the files that are damaged or lost.
        unread: errors of damaged receipts and manifests; what they name is in neither.
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
    receipts, unread = receipts_of(store, closed)
    whole, damaged = _whole_and_damaged(store, receipts, known)
    table_of = _tables(out, receipts, closed)
    sources = _sources(whole, table_of, refused | {file.receipt.name for file in damaged})
    files = {path: file for path, file in known.items() if file.part in kept}
    part_of: dict[str, str] = {}
    others = _standing(store, [part for part in there if part.name not in kept], sources, known, join=join)
    if join:
        parts.remove_unnamed(store, [*kept.values(), *others])
    for each in others:
        part_of |= dict.fromkeys(each.matches, each.name)
        files |= _listed(store, each)
    for file in whole:
        part = part_of.get(file.receipt.name, "") if file.receipt.noun in nouns else ""
        files[file.path] = Listed("" if part else table_of(file), file.seen, part)
    if not damaged and not unread:
        files |= {path: Listed(RECORD, seen, part_of.get(_match_of(path, nouns), ""))
                  for path, seen in records.items() if path not in files}
    return Look(files, damaged, unread)


def receipts_of(store: Store, without: Collection[str] = ()) -> tuple[list[Receipt], list[CorruptFile]]:
    """Receipts and manifests at one moment, but receipts of some names; and errors of damaged ones."""
    with store.snapshot():
        every = [found for noun in STAGES.receipted for _, found in store.tried(noun, without)]
        every += [found for noun in STAGES.versioned for _, found in store.tried_versions(noun)]
    return ([found for found in every if isinstance(found, Receipt)],
            [found for found in every if isinstance(found, CorruptFile)])


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


def keep_look(store: Store, catalogue: Path, folders: Mapping[str, Stamp | None]) -> None:
    """Note that a catalogue is up to date with folders, as they were before the look began.

    It is not noted of folders that may yet change without another stamp, nor where nothing can be written.
    """
    if all(stamp is None or settled(stamp) for stamp in folders.values()):
        looked = Looked(catalogue=stamp_of(str(catalogue)), folders=dict(folders))
        with suppress(StorageFailed):  # it only saves time
            store.write_bytes(_looked_path(store), sealed(looked))


def folders_of(store: Store) -> dict[str, Stamp | None]:
    """The stamps of the folders in which receipts, manifests, records of quarantine and parts are."""
    found: dict[str, Stamp | None] = {}
    for name in (*STAGES, "quarantine", parts.FOLDER):
        path = f"{store.root}/{name}"
        try:
            found[path] = stamp_of(path)
        except FileNotFoundError:
            found[path] = None
    return found


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
    store: Store, receipts: Iterable[Receipt], known: Listing
) -> tuple[list[Vouched], list[Vouched]]:
    """The files of receipts and manifests, checked unless the catalogue has them as they are."""
    found: tuple[list[Vouched], list[Vouched]] = [], []
    root = store.root.resolve()
    for receipt in receipts:
        folder = store.folder(receipt)
        resolved = root / folder.relative_to(store.root) if folder != store.root else root
        for record in receipt.files.values():
            path = f"{resolved}/{record.path}"
            seen = glance(path)
            whole = _is_whole(store, record, folder, known.get(path), seen)
            found[0 if whole else 1].append(Vouched(receipt, path, record, seen))
    store.suspect = frozenset(store.folder(file.receipt) / file.record.path for file in found[1])
    return found


def _is_whole(store: Store, record: FileRecord, folder: Path, known: Listed | None, seen: Glance) -> bool:
    """True if a file is as the catalogue has it, or byte for byte what was written."""
    return (known is not None and seen is not None and known.seen == seen) or store.whole(record, folder)


def _tables(
    out: Collection[tuple[str, str]], receipts: Iterable[Receipt], closed: Collection[str]
) -> Callable[[Vouched], str]:
    """The table whose rows a file has, "" for none.

    A removed match has no rows. A match or group in quarantine has no rows of the stage that refused it or of
    later stages: such rows would come from other settings than those of the other matches.
    """
    names = {tag: name for name, schema in parts.JOINED.items() for tag in schema.readable()}
    there = {receipt.name for receipt in receipts if receipt.noun == "matches"}.union(closed)
    standing: dict[str, set[str]] = {}
    refused: dict[str, set[str]] = {}
    gone = set[str]()
    for noun in STAGES.of_matches:
        gone = gone | {name for stage, name in out if stage == noun and noun != "matches"}
        if STAGES[noun].per is Per.MATCH:
            standing[noun] = there - gone
        else:
            refused[noun] = gone

    def table_of(file: Vouched) -> str:
        receipt, record = file.receipt, file.record
        noun, name = receipt.noun, receipt.name
        shown = record.rows and name in standing.get(noun, {name}) and name not in refused.get(noun, ())
        if noun in refused and name in there and receipt.versions.get(noun) != STAGES[noun].version:
            shown = False  # once, decisions had an output for each match
        return names.get(record.table or "", "") if shown else ""

    return table_of


def _sources(
    whole: Iterable[Vouched], table_of: Callable[[Vouched], str], without: Collection[str]
) -> dict[str, list[Source]]:
    """The files with rows of each match that has been through all its stages, in the order of the stages."""
    nouns = STAGES.nouns(Per.MATCH)
    found: dict[str, list[Source]] = {}
    complete = set[str]()
    for file in whole:
        receipt = file.receipt
        if receipt.noun in nouns and receipt.name not in without:
            if receipt.noun == nouns[-1]:
                complete.add(receipt.name)
            if table := table_of(file):
                found.setdefault(receipt.name, []).append(Source(table, receipt))
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
            with ThreadPoolExecutor(os.cpu_count()) as pool:  # compressing releases the GIL
                found.extend(pool.map(partial(parts.join_matches, store), together))
        except StorageFailed as error:  # questions take longer without
            _log.warning("Matches could not be joined: %s", error)
    return found


def _listed(store: Store, part: ClosedPart) -> Listing:
    """The files of a part's own."""
    root = store.root.resolve()
    own = {part.index: "", **{record.path: table for table, record in part.files.items()}}
    return {f"{root}/{path}": Listed(table, glance(f"{root}/{path}"), part.name)
            for path, table in own.items()}
