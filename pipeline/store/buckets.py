"""Buckets: objects of a store like S3, by URL. The only module that imports obstore.

No error of the library is passed on: it may hold what a server answered, or a signed address. Credentials
come from the environment, as each provider's own tools take them, and are never part of a URL here.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from datetime import timedelta
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar
from urllib.parse import urlsplit

from pitchlore.pipeline.base.digests import Content
from pitchlore.pipeline.base.errors import BadSettings, BucketFailed

if TYPE_CHECKING:
    from obstore.store import ObjectStore

T = TypeVar("T")

#: Schemes of URLs that name a bucket.
SCHEMES = ("s3", "s3a", "gs", "az", "memory")
#: A path object makes one slash of two.
_URL = re.compile(r"({}):(?:$|/{{1,3}})(.*)".format("|".join(SCHEMES)), re.DOTALL)
_FILE_URL = re.compile(r"file:/")
_OTHER_URL = re.compile(r"(?:https?|ftp|hdfs|abfss?|adl|azure|r2|oss):/")
#: What in a URL would be a secret or an option, and a bucket's name that is none.
_UNFIT = re.compile(r"[@?#\s\\]|//|(?:^|/)\.\.?(?:/|$)")

#: How long one request may take, and how long it is sent again when the bucket is busy, seconds.
REQUEST_S, AGAIN_S = 30.0, 20.0
#: Requests at once.
_AT_ONCE = 16
#: Variables that name a provider's address, and that say whether it may be one without encryption.
_ENDPOINTS = (
    "AWS_ENDPOINT_URL", "AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT", "AZURE_STORAGE_ENDPOINT", "AZURE_ENDPOINT")
_ALLOW = ("AWS_ALLOW_HTTP", "ALLOW_HTTP")
_STATUS = re.compile(r"status code: (\d{3})")
#: What the library says of an object whose key is no path to it, as `a//b` or `a/../b`.
_NO_PATH = re.compile(r"invalid path.*?\"([^\"]*)\"", re.DOTALL)
_WHY = {
    "401": "it refuses these credentials", "403": "it refuses these credentials",
    "404": "there is no such bucket", "429": "it is too busy", "503": "it is too busy",
}


class ObjectStat(NamedTuple):
    """Metadata of an object in a bucket.

    Attributes:
        key: key of the object, relative to the bucket's URL.
        size: in bytes.
        tag: changes with the object.
        modified: seconds since 1970, by the bucket's clock.
    """

    key: str
    size: int
    tag: str
    modified: float


def bucket_url(word: str) -> str | None:
    """The URL of a bucket, in one form; None if the word is none.

    Args:
        word: a URL, or the path that a URL was taken for (``s3:/league``).

    Raises:
        BadSettings: if the URL has credentials or options, names no bucket, or is of another kind.
    """
    found = _URL.fullmatch(word)
    scheme, rest = (found[1], found[2].strip("/")) if found else ("", "")
    if _OTHER_URL.match(word) or (found and (_UNFIT.search(rest) or (not rest and scheme != "memory"))):
        raise BadSettings(
            "this URL is not that of a bucket's folder", where="--data", next_step=(
                f"Name {scheme or 's3'}://BUCKET/FOLDER; credentials and options come from the environment"))
    if found is None:
        return None
    return f"{scheme}:///{rest}" if scheme == "memory" else f"{scheme}://{rest}"


def check_local(path: Path) -> None:
    """Check that a path is that of a file or folder of this machine, and no URL.

    Raises:
        BadSettings: if it is a URL, which would become a folder named ``s3:``. It is repeated only if it can
            hold no secret.
    """
    word = str(path)
    found = _URL.fullmatch(word)
    if found is None and not _FILE_URL.match(word) and not _OTHER_URL.match(word):
        return
    plain = found is not None and not _UNFIT.search(found[2])
    raise BadSettings("a URL is no path of this machine", where=word.replace(":/", "://", 1) if plain else "",
                      next_step="Name a path; of buckets only the data folder and its inbox are read")


class Bucket:
    """The objects under a URL.

    Args:
        url: from :func:`bucket_url`.

    Raises:
        BadSettings: if the environment does not say enough of how to reach it, or the extra is not installed.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self._store = _opened(url)

    def __repr__(self) -> str:
        return f"Bucket({self.url!r})"

    def listing(self, prefix: str = "") -> list[ObjectStat]:
        """All objects whose keys begin with a prefix, which is empty or a folder's; in order of their keys.

        A page that is another's, as a gateway's, ends a listing without a word. So it is asked for again from
        before the last key, until that comes alone.

        Raises:
            BucketFailed: as every method here does, if the bucket cannot be reached or refuses; or if the
                last key does not come again, and is there.
        """
        found: dict[str, ObjectStat] = {}
        while True:
            keys = sorted(found)[-2:]
            listed = self._listed(prefix, keys[0] if len(keys) > 1 else None)
            if keys and keys[-1] not in listed and self.has(keys[-1]):
                raise BucketFailed("its listing lacks an object that is there", where=self.url, next_step=(
                    "Look at its address, and whether a proxy answers in its place"))
            if found.keys() >= listed.keys() and (found or not self._listed(prefix, None)):
                return [found[key] for key in sorted(found)]
            found |= listed

    def _listed(self, prefix: str, after: str | None) -> dict[str, ObjectStat]:
        """The objects of one listing whose keys come after another, by their keys."""
        import obstore  # noqa: PLC0415 (an extra)

        def ask() -> dict[str, ObjectStat]:
            pages = obstore.list(self._store, prefix or None, offset=after, chunk_size=1_000)
            return {entry.key: entry for page in pages for entry in map(_entry, page)}

        return self._asked(ask, prefix)

    def get(self, key: str) -> tuple[bytes, ObjectStat] | None:
        """The bytes of an object, and what the bucket says of it; None if there is none."""
        import obstore  # noqa: PLC0415 (an extra)

        def ask() -> tuple[bytes, ObjectStat]:
            found = obstore.get(self._store, key)
            return bytes(found.bytes()), _entry({**found.meta, "path": key})

        try:
            return self._asked(ask, key)
        except FileNotFoundError:
            return None

    def has(self, key: str) -> bool:
        """True if there is an object."""
        import obstore  # noqa: PLC0415 (an extra)

        try:
            self._asked(lambda: obstore.head(self._store, key), key)
        except FileNotFoundError:
            return False
        return True

    def get_all(self, keys: Iterable[str]) -> Iterator[tuple[str, tuple[bytes, ObjectStat] | None]]:
        """Keys, and what :meth:`get` gives for them; many at a time."""
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            listed = list(keys)
            yield from zip(listed, pool.map(self.get, listed), strict=True)

    def put(self, key: str, data: Content) -> ObjectStat:
        """Write an object, whatever was there."""
        import obstore  # noqa: PLC0415 (an extra)

        return self._put(key, data, lambda: obstore.put(self._store, key, data))

    def create(self, key: str, data: bytes) -> ObjectStat | None:
        """Write an object if there is none of its key; None if there is, with other bytes."""
        import obstore  # noqa: PLC0415 (an extra)

        return self._conditionally(key, data, lambda: obstore.put(self._store, key, data, mode="create"))

    def replace(self, key: str, data: bytes, tag: str) -> ObjectStat | None:
        """Write an object in place of the one that has a tag; None if that is not there, but other bytes."""
        import obstore  # noqa: PLC0415 (an extra)
        from obstore.exceptions import PreconditionError  # noqa: PLC0415 (an extra)

        def write() -> Any:
            if not self.url.startswith("gs:"):
                return obstore.put(self._store, key, data, mode={"e_tag": tag})
            found = obstore.head(self._store, key)  # Google's condition is on a generation, not on a tag
            if found["e_tag"] != tag:
                raise PreconditionError
            return obstore.put(self._store, key, data, mode={"e_tag": tag, "version": found["version"]})

        return self._conditionally(key, data, write)

    def delete(self, key: str) -> None:
        """Remove an object, if it is there."""
        import obstore  # noqa: PLC0415 (an extra)

        with suppress(FileNotFoundError):
            self._asked(lambda: obstore.delete(self._store, key), key)

    def _put(
        self, key: str, data: Content, write: Callable[[], Any], *, conditional: bool = False
    ) -> ObjectStat:
        try:
            done = self._asked(write, key, conditional=conditional)
        except FileNotFoundError as error:
            raise self._failed("there is no such bucket", key) from error
        return ObjectStat(key, len(data), str(done["e_tag"]), 0.0)

    def _conditionally(self, key: str, data: bytes, write: Callable[[], Any]) -> ObjectStat | None:
        """Write under a condition. If an answer was lost and sent for again, the condition fails by our own.

        An answer that was lost for good is an error; then the object may be there.
        """
        from obstore.exceptions import AlreadyExistsError, PreconditionError  # noqa: PLC0415 (an extra)

        try:
            return self._put(key, data, write, conditional=True)
        except (AlreadyExistsError, PreconditionError):
            there = self.get(key)
            return there[1] if there is not None and there[0] == data else None

    def _asked(self, ask: Callable[[], T], key: str, *, conditional: bool = False) -> T:
        """The answer to a request.

        Raises:
            FileNotFoundError: if there is no such object.
            obstore.exceptions.AlreadyExistsError, obstore.exceptions.PreconditionError: if the request is
                ``conditional``, and its condition does not hold.
            BucketFailed: if the bucket cannot be reached or refuses.
        """
        from obstore.exceptions import (  # noqa: PLC0415 (an extra)
            AlreadyExistsError,
            BaseError,
            PreconditionError,
        )

        why = ""
        try:
            return ask()
        except FileNotFoundError:
            raise
        except (BaseError, OSError, ValueError) as error:
            if conditional and isinstance(error, AlreadyExistsError | PreconditionError):
                raise
            status, strange = _STATUS.search(str(error)), _NO_PATH.search(str(error))
            why = "it does not answer" if status is None else _WHY.get(status[1], f"it answers {status[1]}")
            if strange is not None:
                why = f"it has an object {strange[1]}, whose name is no path: remove or rename it"
        raise self._failed(why, key)  # outside, so that the library's error is not its context

    def _failed(self, why: str, key: str) -> BucketFailed:
        return BucketFailed(
            f"the bucket cannot be used ({why})", where=f"{self.url.rstrip('/')}/{key}".rstrip("/"),
            next_step="Look at its address, your credentials and the network, then run again; nothing that "
                      "was there is lost")


def _entry(meta: Any) -> ObjectStat:
    return ObjectStat(meta["path"], meta["size"], str(meta["e_tag"]), meta["last_modified"].timestamp())


@cache
def _opened(url: str) -> ObjectStore:
    """The store of a URL: one for a process, whose connections are used again; memory has no other."""
    try:
        from obstore.store import from_url  # noqa: PLC0415 (an extra)
    except ImportError:
        raise BadSettings("buckets need the extra bucket", where=url,
                          next_step="Install the extra pitchlore[bucket]") from None
    if url.startswith("memory:"):
        return from_url("memory:///")
    for name in filter(os.environ.get, _ENDPOINTS):
        _check_address(name)
    said = [os.environ[name].lower() for name in _ALLOW if os.environ.get(name)]
    named = any(os.environ.get(name, "").startswith("http://") for name in _ENDPOINTS)
    plain = "true" in said or (named and not said)  # as the tools of these providers take it
    if named and not plain:
        raise BadSettings("its address is plain http, which AWS_ALLOW_HTTP forbids", where=url,
                          next_step="Set AWS_ALLOW_HTTP=true, or name an address with https")
    reason = ""
    try:
        return from_url(
            url,
            client_options={"timeout": timedelta(seconds=REQUEST_S), "connect_timeout": timedelta(seconds=5),
                            "allow_http": plain},
            retry_config={"max_retries": 8, "retry_timeout": timedelta(seconds=AGAIN_S), "backoff": {
                "init_backoff": timedelta(milliseconds=100), "max_backoff": timedelta(seconds=5), "base": 2}},
        )
    except Exception as error:  # many classes; its text may hold what the environment says
        reason = type(error).__name__
    raise BadSettings(f"the environment does not say how to reach it ({reason})", where=url,
                      next_step="Set its provider's variables, as AWS_REGION or AZURE_STORAGE_ACCOUNT_NAME")


def _check_address(name: str) -> None:
    """Refuse an address that is none: the library would panic. It is not shown, for it may hold a password.

    Raises:
        BadSettings: if a variable of the environment holds no address.
    """
    try:
        said = os.environ[name]
        found = urlsplit(said)
        fits = said.isascii() and said.isprintable() and " " not in said and found.port != 0
        fits = fits and found.scheme in ("http", "https") and bool(found.hostname)
    except ValueError:
        fits = False
    if not fits:
        raise BadSettings("is no address", where=name, next_step="Set it to https://HOST or https://HOST:PORT")
