"""Verification of a data folder: every byte that a receipt or manifest vouches for."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.errors import CorruptFile, NotFound, ReadFailed
from pitchlore.pipeline.store import Store, parts
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.mirrors import key_of
from pitchlore.pipeline.store.outputs import RECEIPT
from pitchlore.pipeline.store.paths import listed
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.pipeline.store.sealed import REMEDY, parsed, read_anew

#: Files that are checked together.
_AT_ONCE = 1024
#: Greatest size of a file that is restored, MiB: that of any.
_WHOLE_MB = 1 << 20


@dataclass(frozen=True, slots=True)
class Damage:
    """A file that is not what was written, or that nobody knows about, because the system refuses to read it.

    Attributes:
        path: path of the file.
        error: the flaw and its cure.
        sha256: SHA-256 of what was written, None if only the file itself said that (a receipt or manifest).
    """

    path: Path
    error: CorruptFile | ReadFailed
    sha256: str | None = None


@dataclass(slots=True)
class Verification:
    """Outcome of a verification.

    Attributes:
        files: number of files that were read, receipts and manifests included.
        size: their bytes.
        unsealed: receipts and manifests without a checksum of themselves, by an earlier version.
        damages: the damaged and lost files.
        others: other problems, a line each.
    """

    files: int = 0
    size: int = 0
    unsealed: int = 0
    damages: list[Damage] = field(default_factory=list)
    others: list[str] = field(default_factory=list)

    @property
    def problems(self) -> list[str]:
        """All problems, a line each."""
        return [*(str(damage.error) for damage in self.damages), *self.others]


def verify(store: Store, nouns: Iterable[str], versions: Iterable[tuple[str, int]]) -> Verification:
    """Check receipts and manifests, and the bytes of all files that they name, against their SHA-256.

    Args:
        store: the data folder.
        nouns: the nouns whose outputs are checked.
        versions: the versions that are checked, noun and number.
    """
    found = Verification()
    read_anew()
    store.catch_up()
    vouched = ((receipt, role) for receipt in _read(store, nouns, versions, found) for role in receipt.files)
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # hashing releases the GIL
        while some := list(islice(vouched, _AT_ONCE)):
            read_anew()  # receipts that are kept would fill the memory
            for damage, size in pool.map(lambda each: _check(store, *each), some):
                found.files += 1
                found.size += size
                if damage is not None:
                    found.damages.append(damage)
    return found


def verify_parts(store: Store, found: Verification) -> None:
    """Check the bytes of closed parts against their SHA-256, and add to what was found."""
    for part in parts.closed_parts(store):
        for record in part.files.values():
            found.files += 1
            found.size += record.size
            try:
                whole = store.whole(record, store.root)
            except ReadFailed as error:
                found.damages.append(Damage(store.root / record.path, error))
                continue
            if not whole:
                found.damages.append(Damage(store.root / record.path, CorruptFile(
                    "is not what was written (SHA-256 differs)", where=str(store.root / record.path),
                    next_step=REMEDY)))


def restore(damage: Damage, store: Files, backup: Files) -> bool:
    """Copy a damaged file from a backup of the data folder, if the backup has it whole.

    Args:
        damage: says which file, and what it was.
        store: the data folder.
        backup: a copy of it. Each may be in a bucket, or have the names that files of versions have there.

    Returns:
        Whether the file was restored; never one that the system refuses to read, for it may be whole.

    Raises:
        StorageFailed: if the disk or the bucket refuses.
    """
    if isinstance(damage.error, ReadFailed):
        return False
    place = damage.path.relative_to(store.root).as_posix()
    for name in dict.fromkeys((place, key_of(place, damage.sha256))):
        source = backup.root / name
        try:
            data = _whole(backup, source, damage.sha256)
            whole = _belongs(data, source) if damage.sha256 is None else digest(data) == damage.sha256
        except (NotFound, CorruptFile):
            continue
        if whole:
            store.keep(damage.path, data)
            return True
    return False


def _whole(backup: Files, path: Path, sha: str | None) -> bytes:
    """The bytes of a file of a backup."""
    if backup.mirror is not None:
        return backup.mirror.fetch(path, sha)
    return backup.foreign(path, megabytes=_WHOLE_MB)


def _belongs(data: bytes, path: Path) -> bool:
    """True if a receipt or manifest is that of its place in a data folder, which may be that of a season.

    Args:
        data: its bytes.
        path: its place.

    Raises:
        CorruptFile: if it is not readable.
    """
    if path.name == "manifest.json":
        manifest = parsed(data, path, Manifest)
        place = Store(Path()).version_folder(manifest.noun, manifest.version) / path.name
    else:
        receipt = parsed(data, path, Receipt)
        place = Path(receipt.noun) / f"{receipt.name}{RECEIPT}"
    return path.parts[-len(place.parts):] == place.parts


def _read(
    store: Store, nouns: Iterable[str], versions: Iterable[tuple[str, int]], found: Verification
) -> Iterator[Receipt]:
    """The readable receipts and manifests; the others go to what was found."""
    for noun in nouns:
        for path in map(Path, listed(store.root / noun, RECEIPT)):
            try:
                receipt = store.receipt_at(str(path))
            except (CorruptFile, ReadFailed) as error:
                found.damages.append(Damage(path, error))
                continue
            if receipt is not None:
                _count(path, found)
                yield receipt
    for noun, version in versions:
        folder = store.version_folder(noun, version)
        try:
            manifest = store.manifest(noun, version)
        except (CorruptFile, ReadFailed) as error:
            found.damages.append(Damage(folder / "manifest.json", error))
            continue
        _count(folder / "manifest.json", found)
        known = {record.path for record in manifest.files.values()} | {"manifest.json"}
        # a temporary file is another command's, or is swept when that is dead
        found.others += [f"{path}: is not in the manifest. Remove it." for path in sorted(folder.iterdir())
                         if path.name not in known and not path.name.endswith(".tmp")]
        yield manifest


def _count(path: Path, found: Verification) -> None:
    data = path.read_bytes()
    found.files += 1
    found.size += len(data)
    found.unsealed += b'"checksum": "' not in data[:20]


def _check(store: Store, receipt: Receipt, role: str) -> tuple[Damage | None, int]:
    """The damage of a file, None if it is whole; and its size."""
    record = receipt.files[role]
    try:
        return None, len(store.read(receipt, role, anew=True))
    except (CorruptFile, ReadFailed) as error:
        return Damage(store.folder(receipt) / record.path, error, record.sha256), record.size
