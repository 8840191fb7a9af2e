"""Claims: who makes the next version in a bucket, of several machines."""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread

from pitchlore.pipeline.base.errors import BucketFailed
from pitchlore.pipeline.store.buckets import Entry
from pitchlore.pipeline.store.mirrors import Mirror
from pitchlore.pipeline.store.temporaries import alive, machine

#: A claim is renewed so often; one that is not for so long is of a machine that is gone; seconds.
RENEWED_S, GONE_S = 20.0, 120.0
#: Name of a claim's object, beside the versions.
CLAIM = "claim.json"
#: How often to look whether somebody else's claim is gone, seconds.
_POLL_S = 1.0

#: The tokens of this process's claims.
_held: set[str] = set()

_log = logging.getLogger(__name__)


@contextmanager
def claimed(mirror: Mirror, folder: Path) -> Iterator[None]:
    """No other machine makes a version in a folder of a bucket while the body runs.

    The claim is an object that is created if there is none, and renewed while the body runs. It says which
    process of which machine has it. That of a dead process is taken over at once on its machine, elsewhere
    when it was not renewed for :data:`GONE_S`, by the bucket's clock or while this waited. Who was slow for
    so long finds out when it commits: a manifest, too, is created only if there is none.

    Raises:
        BucketFailed: if the bucket cannot be reached.
    """
    own = _Claim(mirror, folder)
    _held.add(own.token)
    try:
        own.take()
        keeper = Thread(target=own.renew, name="claim", daemon=True)
        keeper.start()
        try:
            yield
        finally:
            own.ended.set()
            keeper.join()
            own.leave()
    finally:
        _held.discard(own.token)


def at_work(mirror: Mirror, folder: Path) -> bool:
    """True if somebody makes a version in a folder of a bucket, as far as the claim says.

    Raises:
        BucketFailed: if the bucket cannot be reached.
    """
    there = mirror.bucket.get(mirror.key(folder / CLAIM))
    return there is not None and not _gone(mirror, *there)


def _gone(mirror: Mirror, claim: bytes, entry: Entry) -> bool:
    """True if a claim is of a dead process, or was not renewed for :data:`GONE_S` by the bucket's clock."""
    return _dead(claim) or mirror.now() - entry.modified > GONE_S


class _Claim:
    """A claim of this process.

    Args:
        mirror: mirror of the bucket.
        folder: folder of the versions.

    Attributes:
        token: names it.
        ended: set when it is not renewed any more.
    """

    def __init__(self, mirror: Mirror, folder: Path) -> None:
        self._mirror, self._bucket, self._key = mirror, mirror.bucket, mirror.key(folder / CLAIM)
        self._where = mirror.where(folder)
        self._tag = ""
        self.token, self.ended = os.urandom(8).hex(), Event()

    def take(self) -> None:
        """Wait until nobody has a claim, and have one."""
        seen, since, told = "", time.monotonic(), False
        entry = self._bucket.create(self._key, self._words(0))
        while entry is None:
            there = self._bucket.get(self._key)
            if there is None:
                entry = self._bucket.create(self._key, self._words(0))
                continue
            data, theirs = there
            if theirs.tag != seen:
                seen, since = theirs.tag, time.monotonic()
            if _gone(self._mirror, data, theirs) or time.monotonic() - since > GONE_S:
                entry = self._bucket.replace(self._key, self._words(0), theirs.tag)
                continue
            if not told:
                _log.warning("%s: waiting until another command has made its version", self._where)
                told = True
            time.sleep(_POLL_S)
        self._tag = entry.tag

    def renew(self) -> None:
        """Renew it until it has ended, or somebody took it for gone."""
        renewed = 0
        while not self.ended.wait(RENEWED_S):
            renewed += 1
            with suppress(BucketFailed):  # the bucket may be reached the next time
                again = self._bucket.replace(self._key, self._words(renewed), self._tag)
                if again is None:
                    return
                self._tag = again.tag

    def leave(self) -> None:
        """Remove it, unless it is somebody else's; if the bucket cannot be reached, it is seen to be dead."""
        with suppress(BucketFailed):
            there = self._bucket.get(self._key)
            if there is not None and there[1].tag == self._tag:
                self._bucket.delete(self._key)

    def _words(self, renewed: int) -> bytes:
        return json.dumps({"machine": machine(), "process": os.getpid(), "token": self.token,
                           "renewed": renewed}).encode()


def _dead(claim: bytes) -> bool:
    """True if a claim is of a dead process of this machine, or of ended work of this process."""
    try:
        said = json.loads(claim)
        if said["machine"] != machine():
            return False
        pid = int(said["process"])
        return said["token"] not in _held if pid == os.getpid() else not alive(pid)
    except (ValueError, TypeError, KeyError):
        return False
