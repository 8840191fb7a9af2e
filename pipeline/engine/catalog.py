"""The catalogue: views over the files that receipts and manifests name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path

from pitchlore.pipeline.base.errors import CorruptFile, PitchloreError
from pitchlore.pipeline.engine import freshness
from pitchlore.pipeline.engine.look import (
    Vouched,
    are_settled,
    folders_of,
    keep_look,
    look_over,
    receipts_of,
    records_of,
    stands,
    stands_at_a_glance,
)
from pitchlore.pipeline.engine.progress import RunReport, StageReport
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.store import Store, catalog
from pitchlore.pipeline.store.paths import SAFE_NAME
from pitchlore.pipeline.store.sealed import Stamp, stamp_if_there, stamp_of
from pitchlore.schemas import PUBLIC


def forget_match(store: Store, match: str) -> int:
    """Remove a match and the outputs made from it, the last stage first. Returns their number."""
    return forget_outputs(store, match, STAGES.nouns(Per.MATCH))


def forget_outputs(store: Store, name: str, nouns: Sequence[str]) -> int:
    """Remove the outputs of a name, that of the last noun first. Returns their number."""
    if not SAFE_NAME.match(name):  # no output can have it
        return 0
    with store.removing():
        return sum(store.forget(noun, name) for noun in reversed(nouns))


def catalog_path(store: Store) -> Path:
    """Path of the catalogue."""
    return store.root / "catalog.duckdb"


def check_files(store: Store) -> list[Vouched]:
    """The files that are damaged or lost (:func:`look_at_files`)."""
    return look_at_files(store)[1]


def look_at_files(store: Store) -> tuple[Stamp | None, list[Vouched]]:
    """Check the files that are new, or were touched since the catalogue was made, against their SHA-256.

    The store suspects the damaged files from now on: outputs that have one of them are not done, so that they
    are made again. A file whose bytes changed while its size and time did not is not noticed here, but by
    ``pitchlore verify``.

    Returns:
        The catalogue's stamp if it has every file as it is, else None; and the damaged or lost files.
    """
    with store.keeping():
        path = catalog_path(store)
        seen, known, records = stamp_if_there(str(path)), catalog.listing(path), records_of(store)
        if _stands(store, known, records):
            return seen, []
        return None, look_over(store, known or {}, records).damaged


def _stands(store: Store, known: catalog.Listing | None, records: Mapping[str, catalog.Glance]) -> bool:
    if known is None or not stands(known, records):
        return False
    store.suspect = frozenset()
    return True


def refresh_into(store: Store, report: StageReport) -> None:
    """Bring the catalogue up to date (:func:`renew`). If that fails, it is one more failure of a report."""
    try:
        renew(store)
    except PitchloreError as error:
        report.failed["catalog.duckdb"] = str(error)


def refresh_after(store: Store, report: RunReport) -> None:
    """Bring the catalogue up to date after a run. If that fails, it is one more failure of the run."""
    catalogue = StageReport(noun="catalogue")
    refresh_into(store, catalogue)
    if catalogue.failed:
        report.stages.append(catalogue)


def renew(store: Store) -> None:
    """Bring the catalogue up to date after a change, and close the matches that are complete.

    That of a bucket is a cache, which is made where somebody asks: it takes the files of all tables.
    """
    if store.mirror is None:
        refresh(store, join=True)


def refresh(store: Store, *, join: bool = False) -> tuple[Path, list[CorruptFile]]:
    """Build the catalogue and move it into place, unless it is up to date; in a closed folder, in memory.

    A catalogue that another version of Pitchlore made, with other tables, is not. Damaged files are left
    out, so that the others can be queried (:func:`check_files`).

    Args:
        store: the data folder.
        join: whether matches that are complete are closed (:mod:`pipeline.store.parts`).

    Returns:
        The catalogue's path, and the errors of the files that were left out.
    """
    path = catalog_path(store)
    with store.keeping():
        while not stands_at_a_glance(store, path, folders_of(store)):
            with suppress(_ReplacedMeanwhile):
                return path, _look(store, path, join=join)
    return path, []


class _ReplacedMeanwhile(Exception):
    """Another command, whose look may have begun later, has moved its catalogue into place."""


def _look(store: Store, path: Path, *, join: bool) -> list[CorruptFile]:
    """Bring the catalogue up to date, and note it; the errors of files that are left out."""
    now_ns, folders, seen = store.now_ns(), folders_of(store), stamp_if_there(str(path))
    known, records = catalog.listing(path), records_of(store)
    try:
        left_out, stamp = _bring_up_to_date(store, path, known, records, seen, join=join)
    except CorruptFile:  # the bytes of a file changed, while its size and time did not
        left_out, stamp = _bring_up_to_date(store, path, None, records, seen, join=join)
    if stamp is None or left_out or store.closed:
        return left_out
    if are_settled(folders, now_ns) or (
            # what changed since then without another stamp of its folder is seen now
            are_settled(folders, store.now_ns()) and records_of(store) == records):
        keep_look(store, stamp, folders)
    return left_out


def _bring_up_to_date(
    store: Store, path: Path, known: catalog.Listing | None, records: Mapping[str, catalog.Glance],
    seen: Stamp | None, *, join: bool,
) -> tuple[list[CorruptFile], Stamp | None]:
    """Build the catalogue unless it lists all files as they are.

    Args:
        store: the data folder.
        path: the catalogue's.
        known: its files.
        records: the receipts and their like, looked at since.
        seen: its stamp before its files were read; another catalogue is not replaced.
        join: whether matches that are complete are closed.

    Returns:
        The errors of files that are left out; the stamp of the catalogue, None if it is none on disk.

    Raises:
        _ReplacedMeanwhile: if the catalogue has another stamp in the end.
    """
    if known is not None and stands(known, records):
        return [], seen
    if store.mirror is not None:
        store.bring(receipts_of(store), PUBLIC)
    files, damaged, unread = look_over(store, known or {}, records, join=join)
    if files != known:
        of_groups = frozenset(
            schema.NAME for noun in STAGES.nouns(Per.GROUP) for schema in STAGES[noun].schemas
            if "match_id" in schema.columns())
        catalog.keep_in_memory(path, files if store.closed else None, of_groups)
        if not store.closed:
            with ExitStack() as held, store.aside(path) as temporary:
                catalog.build(temporary, files, of_groups)
                held.enter_context(store.snapshot())
                if stamp_if_there(str(path)) != seen:
                    raise _ReplacedMeanwhile
                seen = stamp_of(str(temporary))
                catalog.log_of(path).unlink(missing_ok=True)
    return unread + [file.error for file in damaged], seen


def files_of(store: Store, table: str) -> list[str]:
    """Paths of the files with rows of a public table, as the catalogue has them; absolute, sorted."""
    known = catalog.listing(catalog_path(store), open_only=True) or {}
    return sorted(path for path, file in known.items() if file.table == table)


def distrust(store: Store) -> None:
    """Forget which files were whole, and which outputs were done.

    What looks next reads every byte, and no notebook gets damaged rows.
    """
    with suppress(OSError):
        catalog_path(store).unlink(missing_ok=True)
    freshness.forget_freshness(store)
