"""The local copy of a data folder that is in a bucket.

The bucket is the data folder. The copy is a cache in the user's own, which may be removed at any time: it has
all receipts and manifests, brought by :meth:`Mirror.sync`, and those other files that were made or read here.
So whatever reads a data folder reads the copy; whatever writes to it writes to the bucket first. Locks hold
on this machine only: between machines the conditions of :meth:`Mirror.swap` and :meth:`Mirror.create` decide.
"""

from __future__ import annotations

import atexit
import json
import logging
import os
import re
import shutil
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from datetime import datetime
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from pitchlore.pipeline.base.digests import Content
from pitchlore.pipeline.base.errors import (
    BadSettings,
    BucketFailed,
    CorruptFile,
    NotFound,
    not_readable,
)
from pitchlore.pipeline.base.system import whole
from pitchlore.pipeline.store.atomic import write_bytes
from pitchlore.pipeline.store.buckets import Bucket, ObjectStat, bucket_url
from pitchlore.pipeline.store.copy_index import CopyIndex
from pitchlore.pipeline.store.locks import holding
from pitchlore.pipeline.store.paths import named_path, remove

_log = logging.getLogger(__name__)

#: In the folder of a copy: the URL, and what is known of the bucket.
MARKER, INDEX = ".bucket.json", ".bucket.sqlite"
#: Objects that every copy has. Others may put objects of any name into a bucket: those are none of ours.
_NAME = r"[a-z0-9][a-z0-9.-]{0,95}"
_RECORD = re.compile(
    rf"(?:{_NAME}/){{1,4}}(?:{_NAME}\.receipt\.json|manifest\.json|confirmed\.json|thinned\.json)"
    rf"|(?:{_NAME}/){{0,3}}quarantine/{_NAME}\.{_NAME}\.json"
    rf"|runs/{_NAME}\.json")
#: A file of a version. Its key has the hash of its bytes in it: of two machines that make the same version
#: at once, neither writes over the other's files.
_OF_VERSION = re.compile(r"(.*/v\d{4,}/)((?!manifest\.json$)[^/]+)$")
#: How many folders below a data folder a store may be: that of a season.
_DEPTH = 2
#: So many files of a folder are asked for one by one; of more, the folder is listed.
_FEW = 2
#: Files that are fetched at once.
_AT_ONCE = 16


class ObjectChange(NamedTuple):
    """A change of the bucket that a process made.

    Attributes:
        entry: the written object; of a removed one only the key counts.
        data: its bytes, if every copy has it; None if it was removed.
        removed: whether it was.
    """

    entry: ObjectStat
    data: bytes | None
    removed: bool = False


#: The changes that are made in this context, where somebody keeps them.
_journal: ContextVar[list[ObjectChange] | None] = ContextVar("journal", default=None)


def key_of(place: str, sha: str | None) -> str:
    """The key of a file at a place in the data folder. That of a file of a version has its SHA-256."""
    found = _OF_VERSION.match(place) if sha else None
    return f"{found[1]}{sha[:12]}.{found[2]}" if found and sha else place


class Mirror:
    """A bucket and its local copy.

    Args:
        folder: the copy's.
        url: the bucket's.
    """

    def __init__(self, folder: Path, url: str) -> None:
        self.folder = folder
        self.url = url
        self.bucket = Bucket(url)
        self._asking = threading.Lock()
        self._ahead: float | None = None
        self._index = CopyIndex(folder / INDEX)

    def __repr__(self) -> str:
        return f"Mirror({self.url!r})"

    def key(self, path: Path, sha: str | None = None) -> str:
        """The key of a file; of a file of a version with the SHA-256 of its bytes."""
        return key_of(path.relative_to(self.folder).as_posix(), sha)

    def local(self, path: Path) -> Path:
        """The path in the copy of a URL in the bucket; any other path as it is."""
        url = bucket_url(str(path))
        base = f"{self.url.rstrip('/')}/"
        return self.folder / url.removeprefix(base) if url is not None and url.startswith(base) else path

    def where(self, path: Path) -> str:
        """The URL of a file, for a message."""
        key = path.relative_to(self.folder).as_posix()
        return f"{self.url.rstrip('/')}/{key}" if key != "." else self.url

    # --- from the bucket ----------------------------------------------------------------------------

    def synced(self) -> float | None:
        """When the copy was last brought up to date, seconds since 1970; None if never."""
        return self._index.synced()

    def sync(self, within: float = 0.0) -> None:
        """Bring the copy up to date with the bucket.

        Args:
            within: not if that was done in the last so many seconds.

        Raises:
            BucketFailed: if the bucket cannot be reached; the copy is as it was, and may be read.
        """
        with holding(self.folder / ".sync", alone=True):
            last = self.synced()
            begun, tick = time.time(), self._index.tick()
            if last is not None and 0 <= begun - last < within:
                return
            listed = {entry.key: entry for entry in self.bucket.listing()}
            rows = self._index.objects()
            older = {key for key, (_, noted) in rows.items() if noted < tick}
            if older and not listed and self.bucket.has(min(older)):  # as a gateway's page
                raise BucketFailed("its listing lacks an object that is there", where=self.url, next_step=(
                    "Look at its address, and whether a proxy answers in its place"))
            wanted = [key for key, entry in listed.items()
                      if _RECORD.fullmatch(key) and (key not in rows or key in older)
                      and (rows.get(key, (None, 0.0))[0] != entry.tag or not (self.folder / key).exists())]
            fetched = dict(self.bucket.get_all(wanted))
            with holding(self.folder / ".commits", alone=False):  # those who want one moment wait
                # manifests last: their versions' folders are there with them
                for key in sorted(wanted, key=lambda key: key.endswith("/manifest.json")):
                    found = fetched[key]
                    if found is not None:
                        listed[key] = found[1]
                        write_bytes(self.folder / key, found[0])
                    else:
                        listed.pop(key)
                for key in older - listed.keys():
                    self._gone(key)
                self._index.note_all(
                    (entry, entry.tag if key in fetched else rows.get(key, (None, 0.0))[0], tick)
                    for key, entry in listed.items() if key not in rows or key in older)
            self._index.note_synced(begun)

    def sync_or_say(self) -> None:
        """Bring the copy up to date (:meth:`sync`); if the bucket cannot be reached, say how old the copy is.

        Raises:
            BucketFailed: if the bucket cannot be reached, and there is no copy.
        """
        try:
            self.sync()
        except BucketFailed as error:
            last = self.synced()
            if last is None:
                raise
            _log.warning("%s What follows is of the copy here.", error)

    def age(self) -> str:
        """Time of the copy, for people."""
        last = self.synced()
        if last is None:
            return "never read"
        return f"as of {datetime.fromtimestamp(last).astimezone():%Y-%m-%d %H:%M:%S}"

    def size(self, path: Path, sha: str | None = None) -> int | None:
        """The size of a file in the bucket, as far as is known; None if there is none."""
        found = self._index.size(self.key(path, sha))
        return self._index.size(self.key(path)) if found is None else found

    def fetch(self, path: Path, sha: str | None = None) -> bytes:
        """The bytes of a file, from the bucket; the copy has them then.

        Args:
            path: in the copy.
            sha: SHA-256 of its bytes, if known.

        Raises:
            NotFound: if the bucket has none, and its bytes are not known.
            CorruptFile: if the bucket has none, or other bytes; :meth:`size` knows none from now on.
            BucketFailed: if the bucket cannot be reached.
        """
        for key in dict.fromkeys((self.key(path, sha), self.key(path))):
            found = self.bucket.get(key)
            if found is not None and (sha is None or sha256(found[0]).hexdigest() == sha):
                write_bytes(path, found[0])
                self._index.note(found[1], found[1].tag)
                return found[0]
            if found is None:
                self._index.forget(key)
            else:
                self._index.doubt(found[1].tag)
        if sha is None:
            raise NotFound("is not in the bucket any more", where=self.where(path), next_step="Run again")
        raise CorruptFile("is lost or damaged in the bucket", where=self.where(path), next_step="Run again")

    def bytes_of(self, path: Path, sha: str, remedy: str, *, anew: bool = False) -> bytes:
        """The bytes of a file with a SHA-256, from the copy; from the bucket if they are not there.

        Args:
            path: in the copy.
            sha: SHA-256 of the bytes.
            remedy: the advice if the bucket has not got them either.
            anew: from the bucket in any case.

        Raises:
            CorruptFile, BucketFailed: as for :meth:`fetch`.
        """
        if not anew:
            with suppress(OSError):
                data = whole(path)
                if sha256(data).hexdigest() == sha:
                    return data
        try:
            return self.fetch(path, sha)
        except CorruptFile as error:
            raise CorruptFile(error.what, where=error.where, next_step=remedy) from error

    def bring(self, path: Path) -> None:
        """Bring a file, unless the copy has it as the last listing had it.

        Raises:
            NotFound, BucketFailed: as for :meth:`fetch`.
        """
        if not self._index.is_current(self.key(path)) or not path.exists():
            self.fetch(path)

    def fetch_all(self, files: Iterable[tuple[Path, str]]) -> None:
        """Bring files that the copy lacks, paths and SHA-256, many at a time; what is damaged is left.

        Raises:
            BucketFailed: if the bucket cannot be reached.
        """

        def fetch(wanted: tuple[Path, str]) -> None:
            with suppress(CorruptFile):
                self.bytes_of(*wanted, "")

        lacking = [(path, sha) for path, sha in files if not path.exists()]
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            list(pool.map(fetch, lacking))

    def pull(self, folder: Path) -> None:
        """Bring all files of a folder that are new or changed; what was pulled and is gone goes.

        Raises:
            BucketFailed: if the bucket cannot be reached.
        """
        listed = {entry.key: entry for entry in self.bucket.listing(self.key(folder) + "/")}
        known = self._index.objects()
        for key, entry in listed.items():
            path = self.folder / key
            if path.resolve().is_relative_to(self.folder.resolve()) and (
                    known.get(key, (None, 0.0))[0] != entry.tag or not path.exists()):
                with suppress(NotFound):  # it was removed just now
                    self.fetch(path)

    def older(self, folder: Path, seconds: float) -> list[Path]:
        """The files of a folder of the bucket that are so old, by the bucket's clock.

        Raises:
            BucketFailed: if the bucket cannot be reached.
        """
        return [self.folder / entry.key for entry in self.bucket.listing(self.key(folder) + "/")
                if self.now() - entry.modified > seconds]

    def now(self) -> float:
        """The time by the bucket's clock, seconds since 1970, up to a second late.

        The bucket's own, for this machine's may be wrong. It is asked for once: an object is written, looked
        at and removed.

        Raises:
            BucketFailed: if the bucket cannot be reached.
        """
        with self._asking:
            if self._ahead is None:
                key = f".clock-{os.urandom(8).hex()}"
                self.bucket.put(key, b"")
                begun = time.monotonic()
                found = self.bucket.get(key)
                self.bucket.delete(key)
                if found is None:
                    raise BucketFailed("an object that was written just now is not there", where=self.url,
                                       next_step="Run again")
                self._ahead = found[1].modified - begun
            return time.monotonic() + self._ahead

    def lacking(self, paths: Iterable[Path]) -> list[Path]:
        """Files of a list that the bucket has not got now; one request for many of a folder.

        Raises:
            BucketFailed: if the bucket cannot be reached.
        """
        of_folder = defaultdict[Path, list[Path]](list)
        for path in paths:
            of_folder[path.parent].append(path)
        found = []
        for folder, wanted in of_folder.items():
            if len(wanted) > _FEW:
                there = {entry.key for entry in self.bucket.listing(self.key(folder) + "/")}
                found += [path for path in wanted if self.key(path) not in there]
            else:
                found += [path for path in wanted if not self.bucket.has(self.key(path))]
        return found

    # --- to the bucket ------------------------------------------------------------------------------

    def put(self, path: Path, data: Content) -> None:
        """Write a file, whatever was there."""
        self.put_all({path: data})

    def put_all(self, files: Mapping[Path, Content], *, local: bool = True) -> None:
        """Write files whose names, or whose version's folder and bytes, say what they hold; many at a time.

        Args:
            files: paths in the copy, and bytes.
            local: whether they are written there, too.
        """

        def put(path: Path) -> None:
            data = files[path]
            entry = self.bucket.put(self.key(path, sha256(data).hexdigest()), data)
            if local:
                self._kept(path, data, entry)
            else:
                self._index.note(entry, None)
            changes.append(entry)

        changes: list[ObjectStat] = []
        if len(files) == 1:
            put(*files)
        else:
            with ThreadPoolExecutor(4) as pool:
                list(pool.map(put, files))
        for entry in changes:  # the threads have no journal
            ours = _RECORD.fullmatch(entry.key) is not None
            self._tell(ObjectChange(entry, bytes(files[self.folder / entry.key]) if ours else None))

    def create(self, path: Path, data: bytes, *, local: bool = True) -> bool:
        """Write a file that is not there. Returns False if there is one, with other bytes."""
        entry = self.bucket.create(self.key(path), data)
        if entry is not None:
            if local:
                self._kept(path, data, entry)
            else:
                self._index.note(entry, None)
            self._tell(ObjectChange(entry, data))
        return entry is not None

    def swap(self, path: Path, data: bytes) -> bool:
        """Write a file in place of the one that the copy has, or of none.

        Returns:
            False if the bucket has another one than the copy; nothing is written then.
        """
        key = self.key(path)
        before = self._index.here(key)
        entry = self.bucket.create(key, data) if before is None else self.bucket.replace(key, data, before)
        if entry is not None:
            self._kept(path, data, entry)
            self._tell(ObjectChange(entry, data))
        return entry is not None

    def remove(self, path: Path, sha: str | None = None) -> None:
        """Remove a file from the bucket and the copy, if it is there."""
        for key in dict.fromkeys((self.key(path, sha), self.key(path))):
            self.bucket.delete(key)
            self._tell(ObjectChange(ObjectStat(key, 0, "", 0.0), None, removed=True))
            self._gone(key)

    # --- what other processes did -------------------------------------------------------------------

    @contextmanager
    def journal(self) -> Iterator[list[ObjectChange]]:
        """The changes that the body makes, for :meth:`learn` of another machine's copy."""
        kept: list[ObjectChange] = []
        token = _journal.set(kept)
        try:
            yield kept
        finally:
            _journal.reset(token)

    def learn(self, changes: Collection[ObjectChange]) -> None:
        """Make the changes of another machine's process in this copy."""
        for entry, data, removed in changes:
            if removed:
                self._gone(entry.key)
            elif data is not None:
                write_bytes(self.folder / entry.key, data)
                self._index.note(entry, entry.tag)
            else:
                self._index.note(entry, None)

    def _tell(self, change: ObjectChange) -> None:
        journal = _journal.get()
        if journal is not None:
            journal.append(change)

    def _kept(self, path: Path, data: Content, entry: ObjectStat) -> None:
        """Write to the copy what the bucket has, then note it: what is noted is there."""
        write_bytes(path, data)
        self._index.note(entry, entry.tag)

    def _gone(self, key: str) -> None:
        path = self.folder / key
        remove(path)
        self._index.forget(key)
        if path.name == "manifest.json":
            shutil.rmtree(path.parent, ignore_errors=True)


def located(path: Path) -> Path:
    """The local folder of a data folder: the path itself, or that of the copy if it is a bucket's URL.

    Raises:
        BadSettings: if the URL is not that of a bucket, or the environment does not say how to reach it; or
            as for :func:`pipeline.store.paths.named_path`.
    """
    word = str(path)
    if word.startswith("file:/"):
        return Path("/" + word.removeprefix("file:").lstrip("/"))
    url = bucket_url(word)
    if url is None:
        return named_path(path)
    for known, folder in _copies.items():
        if url.startswith(known.rstrip("/") + "/"):
            return folder / url.removeprefix(known.rstrip("/") + "/")
    if url not in _copies:
        _copies[url] = _copy(url)
    return _copies[url]


#: The copies of this process, by URL.
_copies: dict[str, Path] = {}


def _copy(url: str) -> Path:
    Bucket(url)  # what is wrong with the URL or the environment is said before anything is made
    if url.startswith("memory:"):
        folder = Path(tempfile.mkdtemp(prefix="pitchlore-memory-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    else:
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder = home / "pitchlore" / "buckets" / _name_of_copy(url)
    if not (folder / MARKER).exists():
        write_bytes(folder / MARKER, json.dumps({"url": url, "process": os.getpid()}).encode())
    return folder


def _name_of_copy(url: str) -> str:
    """The name of a copy's folder: another endpoint's bucket of the same name is another bucket."""
    full = f"{url}\n{os.environ.get('AWS_ENDPOINT_URL', '')}"
    slug = re.sub(r"[^a-z0-9]+", "-", url.lower()).strip("-")[-40:]
    return f"{slug}-{sha256(full.encode()).hexdigest()[:8]}"


def mirror_of(root: Path) -> Mirror | None:
    """The mirror that a local folder, or a folder above it, is the copy of; None if it is none.

    Raises:
        BadSettings: if it is that of a bucket in the memory of another process, or at another endpoint than
            the environment's; or if the environment does not say how to reach the bucket.
        NotFound, CorruptFile, ReadFailed: if its marker is damaged, or cannot be read.
    """
    for folder in (root, *root.parents[:_DEPTH]):
        try:
            said = whole(folder / MARKER)
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError as error:  # what is written here would never reach the bucket
            raise not_readable(folder / MARKER, error, "Remove the folder: it is a cache") from error
        return _mirror(folder, said)
    return None


@cache
def _mirror(folder: Path, said: bytes) -> Mirror:
    try:
        marker = json.loads(said)
        url, process = str(marker["url"]), int(marker["process"])
    except (ValueError, TypeError, KeyError) as error:
        raise NotFound("does not say of which bucket this folder is the copy", where=str(folder / MARKER),
                       next_step="Remove the folder: it is a cache") from error
    if url.startswith("memory:") and process != os.getpid():
        raise BadSettings("a bucket in memory is that of one process", where=url,
                          next_step="Work on threads: --on threads")
    if not url.startswith("memory:") and folder.name != _name_of_copy(url):  # a wrong bit names another
        raise BadSettings("is the copy of another bucket, or of one at another AWS_ENDPOINT_URL",
                          where=str(folder), next_step="Remove the folder: it is a cache")
    return Mirror(folder, url)
