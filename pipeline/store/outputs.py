"""Outputs of stages: content-addressed files, and the receipts that name the current ones."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from pitchlore.pipeline.base.digests import Content
from pitchlore.pipeline.base.errors import CorruptFile, NotFound, Overtaken
from pitchlore.pipeline.base.software import software
from pitchlore.pipeline.store.meter import count_written
from pitchlore.pipeline.store.paths import listed, safe
from pitchlore.pipeline.store.reading import Reading
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.pipeline.store.sealed import Stamp, remedy_of, sealed, settled, stamp_of
from pitchlore.pipeline.store.work import Made, Work, contents

#: How the names of receipts end.
RECEIPT = ".receipt.json"
#: A file in a bucket that no receipt names is another machine's, perhaps, until it is so old, seconds.
_OLD_S = 24 * 3600.0
#: How long ago receipts may have been read for :meth:`Outputs.prune`, seconds.
_MOMENT_S = 60.0
CONTENT_FILE = re.compile(r"-[0-9a-f]{12}\.(?!receipt\.)[a-z0-9_-]+\.[a-z]+$")


class Outputs(Reading):
    """Receipts and the files that they vouch for.

    Attributes:
        suspect: files that the last look at the folder found damaged or lost
            (:func:`pipeline.engine.catalog.check_files`).
    """

    suspect: frozenset[Path] = frozenset()

    def receipt(self, noun: str, name: str) -> Receipt | None:
        """The receipt of an output, None if there is none.

        Raises:
            CorruptFile: if it is damaged, or that of another output.
        """
        return self.receipt_at(self._receipt_path(noun, name))

    def remedy(self, receipt: Receipt) -> str:
        """As above; if the receipt was removed or replaced since it was read, nothing is damaged."""
        with suppress(CorruptFile):
            if not isinstance(receipt, Manifest) and self.receipt(receipt.noun, receipt.name) != receipt:
                return "The output was removed or made anew meanwhile: call the command again"
        return super().remedy(receipt)

    def receipt_at(self, path: str) -> Receipt | None:
        """The receipt in a file (:meth:`receipt`), which is of the output that the file is named for."""
        found = self.record(path, Receipt)
        if found is not None and path != f"{self.root}/{found.noun}/{found.name}{RECEIPT}":
            raise CorruptFile(f"is the receipt of {found.noun} {found.name}", where=path,
                              next_step=f"Remove it. {remedy_of(Path(path).parent.name)}")
        return found

    def receipts(self, noun: str, without: Container[str] = ()) -> Iterator[Receipt]:
        """All receipts of a noun, sorted by name, but those of some names.

        Raises:
            CorruptFile: if one is damaged, unless the store may leave it out.
        """
        for _, found in self.tried(noun, without):
            if isinstance(found, Receipt):
                yield found
            else:
                self.go_on_without(found)

    def tried(self, noun: str, without: Container[str] = ()) -> Iterator[tuple[str, Receipt | CorruptFile]]:
        """Names of the outputs of a noun, sorted, each with its receipt, or the error of a damaged one."""
        for name, path in self._named(noun, without):
            try:
                receipt = self.receipt_at(path)
            except CorruptFile as error:
                yield name, error
            else:
                if receipt is not None:  # else it was removed meanwhile
                    yield name, receipt

    def names(self, noun: str) -> list[str]:
        """Names of the outputs of a noun, sorted, whether their receipts can be read or not."""
        return [name for name, _ in self._named(noun)]

    def stamps(self, noun: str) -> dict[str, Stamp]:
        """The stamps of the receipts of a noun, by name, except of those that were written just now."""
        found, now_ns = {}, time.time_ns()
        for name, path in self._named(noun):
            with suppress(OSError):
                found[name] = stamp_of(path)
        return {name: stamp for name, stamp in found.items() if settled(stamp, now_ns)}

    def unreadable_receipts(self, noun: str) -> dict[str, CorruptFile]:
        """Errors of damaged receipts, by name of the output."""
        return {name: found for name, found in self.tried(noun) if isinstance(found, CorruptFile)}

    def holding(self, work: Work) -> Receipt | None:
        """The receipt of an output, if it is of exactly this work and its files exist, none suspect."""
        receipt = self.readable(work.noun, work.name)
        if receipt is None or receipt.key != work.key:
            return None
        for record in receipt.files.values():
            try:
                size: int | None = os.stat(f"{self.root}/{record.path}").st_size  # noqa: PTH116 (see sealed.read_model)
            except OSError:
                size = None if self.mirror is None else self.mirror.size(self.root / record.path)
            if size != record.size or (self.suspect and self.root / record.path in self.suspect):
                return None
        return receipt

    def commit(self, work: Work, made: Made, sources: Iterable[Receipt] = ()) -> Receipt:
        """Write an output's files, then its receipt: the commit is the receipt's rename, or conditional put.

        A file is named by the SHA-256 of its bytes. A whole file is not written again: if work is done again
        with the same outcome, no file changes and no later stage runs. A receipt of the same work and
        outcome stays as it is, with the software that made it first.

        Args:
            work: work that made it.
            made: its tables and other files.
            sources: the receipts of outputs that it was made from.

        Raises:
            SchemaMismatch: if a table breaks its schema; nothing is written then.
            StorageFailed: if the disk refuses; the old output stands.
            NotFound: if a source has been removed meanwhile; nothing is written then.
            Overtaken: if another machine has committed another outcome to the bucket meanwhile; that stands.
        """
        name = safe(work.name)
        written = contents(made, where=f"{work.noun} {name}")
        files = {role: record.model_copy(
            update={"path": f"{work.noun}/{name}-{record.sha256[:12]}.{record.path}"})
            for role, (record, _) in written.items()}
        receipt = Receipt(
            noun=work.noun, name=name, key=work.key, inputs=dict(work.inputs), settings=dict(work.settings),
            seed=work.seed, versions=work.versions, software=software(), files=files,
            details=dict(made.details),
        )
        with self.committing():
            for path in self._removed(sources):
                source = path.name.removesuffix(RECEIPT)
                raise NotFound(f"{path.parent.name} {source} has been removed meanwhile",
                               where=f"{work.noun} {name}", next_step="Run again")
            before = self.readable(work.noun, name)
            named = list(files.values())
            if self.mirror is not None:  # another machine may have removed what no receipt names
                named = list(before.files.values()) if before else []
            lacking = {self.root / files[role].path: data for role, (_, data) in written.items()
                       if files[role] not in named or not self.whole(files[role], self.root)}
            self._keep_all(lacking)
            if before is not None and _same(before, receipt):
                return before
            return self._keep_receipt(receipt)

    def mend(self, receipt: Receipt, made: Made) -> None:
        """Write the files of an output that are not whole, as far as an outcome has the same bytes."""
        for role, (record, data) in contents(made, where=f"{receipt.noun} {receipt.name}").items():
            held = receipt.files.get(role)
            if held is not None and held.sha256 == record.sha256 and not self.whole(held, self.root):
                self.keep(self.root / held.path, data)

    def readable(self, noun: str, name: str) -> Receipt | None:
        """The receipt of an output, None if there is none or a damaged one, for who makes it again."""
        try:
            return self.receipt(noun, name)
        except CorruptFile:
            return None

    def forget(self, noun: str, name: str) -> bool:
        """Remove an output, its receipt first. Returns whether it existed.

        Call it while :meth:`pipeline.store.Store.removing`, unless nobody else uses the folder.
        """
        path = Path(self._receipt_path(noun, name))
        if not path.exists():
            return False
        receipt = self.readable(noun, name)
        self.drop(path)
        for record in receipt.files.values() if receipt else ():
            self.drop(self.root / record.path)
        return True

    def prune(self, noun: str) -> list[Path]:
        """Remove the files of a noun that no receipt names any more. Returns their paths.

        In a bucket those of the last day stay: they may be of an output that another machine commits now.
        So receipts that were read a moment ago are new enough: who commits writes old files anew.
        """
        self.catch_up(_MOMENT_S)
        with self.removing():
            receipts = list(self.receipts(noun))
            if len(receipts) < len(self.names(noun)):  # a damaged one was left out: who knows what it names
                return []
            named = {self.root / record.path for receipt in receipts for record in receipt.files.values()}
            old = ([path for path in map(Path, listed(self.root / noun)) if path.is_file()]
                   if self.mirror is None else self.mirror.older(self.root / noun, _OLD_S))
            left = [path for path in old if CONTENT_FILE.search(path.name) and path not in named]
            for path in left:
                self.drop(path)
            return left

    def _removed(self, receipts: Iterable[Receipt]) -> list[Path]:
        """The paths of receipts that are there no more."""
        paths = [Path(self._receipt_path(receipt.noun, receipt.name)) for receipt in receipts]
        if self.mirror is not None:
            return self.mirror.lacking(paths)
        return [path for path in paths if not path.exists()]

    def _keep_all(self, files: Mapping[Path, Content]) -> None:
        if self.mirror is not None:
            self.mirror.put_all(files)
            count_written(sum(map(len, files.values())))
            return
        for path, data in files.items():
            self.write_bytes(path, data)

    def _keep_receipt(self, receipt: Receipt) -> Receipt:
        """Write a receipt. Of two machines that commit the same output to a bucket at once, one does.

        Returns:
            The receipt that stands.

        Raises:
            Overtaken: if it is another one.
        """
        path = Path(self._receipt_path(receipt.noun, receipt.name))
        if self.mirror is None:
            self.write_bytes(path, sealed(receipt))
            return receipt
        data = sealed(receipt)
        if self.mirror.swap(path, data):
            count_written(len(data))
            return receipt
        self.mirror.sync()
        standing = self.readable(receipt.noun, receipt.name)
        if standing is None or not _same(standing, receipt):
            raise Overtaken("has been written or removed by another machine meanwhile",
                            where=self.mirror.where(path), next_step="Run again: it goes on from what stands")
        return standing

    def _named(self, noun: str, without: Container[str] = ()) -> Iterator[tuple[str, str]]:
        """Name and path of each receipt of a noun, sorted, but those of some names."""
        for path in listed(self.root / noun, RECEIPT):
            name = path.rpartition("/")[2].removesuffix(RECEIPT)
            if name not in without:
                yield name, path

    def _receipt_path(self, noun: str, name: str) -> str:
        return f"{self.root}/{noun}/{safe(name)}{RECEIPT}"


def _same(one: Receipt, other: Receipt) -> bool:
    """True if two receipts are of the same work and outcome, whatever software made them."""
    return one.model_copy(update={"software": other.software}) == other
