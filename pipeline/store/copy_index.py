"""The index of a bucket's local copy: which objects the bucket has, and which of them are here."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pitchlore.pipeline.base.errors import CorruptFile, StorageFailed
from pitchlore.pipeline.store.buckets import ObjectStat

_SCHEMA = """
create table if not exists objects
    (key text primary key, size integer, tag text, here text, noted real) without rowid;
create table if not exists doubted (tag text primary key) without rowid;
create table if not exists state (name text primary key, value real) without rowid;
insert or ignore into state values ('tick', (select coalesce(max(noted), 0) from objects));
"""


class CopyIndex:
    """The objects of a bucket as a copy knows them, in a database of SQLite; for any thread.

    All methods raise StorageFailed where the disk refuses, and CorruptFile if the database is damaged.

    Args:
        file: the database's.
    """

    def __init__(self, file: Path) -> None:
        self._file, self._lock = file, threading.Lock()
        with self._open():
            self._database = sqlite3.connect(file, timeout=60, check_same_thread=False, isolation_level=None)
            for pragma in ("journal_mode=wal", "synchronous=off"):  # what a crash takes is asked for again
                self._database.execute(f"pragma {pragma}").fetchall()
            self._database.executescript(_SCHEMA)

    def synced(self) -> float | None:
        """When all was last compared with the bucket, seconds since 1970; None if never."""
        found = self._ask("select value from state where name = 'synced'")
        return found[0][0] if found else None

    def note_synced(self, at: float) -> None:
        """Note when all was compared with the bucket."""
        self._ask("insert or replace into state values ('synced', ?)", at)

    def tick(self) -> float:
        """The next number of this copy's count: a clock that is set back would hide what others changed."""
        ((tick,),) = self._ask("update state set value = value + 1 where name = 'tick' returning value")
        return float(tick)

    def objects(self) -> dict[str, tuple[str | None, float]]:
        """The tag of what is here of each object, None for nothing, and the tick at which it was noted."""
        return {key: (here, noted) for key, here, noted in self._ask("select key, here, noted from objects")}

    def size(self, key: str) -> int | None:
        """The size of an object; None if there is none, or its bytes are doubted."""
        found = self._ask(
            "select size from objects where key = ? and tag not in (select tag from doubted)", key)
        return int(found[0][0]) if found else None

    def here(self, key: str) -> str | None:
        """The tag of what is here of an object; None for nothing."""
        found = self._ask("select here from objects where key = ?", key)
        return found[0][0] if found else None

    def is_current(self, key: str) -> bool:
        """True if what is here of an object is what the bucket had when that was last noted."""
        return bool(self._ask("select 1 from objects where key = ? and here = tag", key))

    def note(self, entry: ObjectStat, here: str | None) -> None:
        """Note an object, and the tag of what is here of it; its bytes are doubted no more."""
        self._ask("delete from doubted where tag = ?", entry.tag)
        self.note_all([(entry, here, self.tick())])

    def note_all(self, entries: Iterable[tuple[ObjectStat, str | None, float]]) -> None:
        """Note objects at once, each with the tag of what is here of it, and a tick."""
        rows = [(entry.key, entry.size, entry.tag, here, noted) for entry, here, noted in entries]
        with self._open(), self._database:  # which ends the transaction
            self._database.execute("begin immediate")
            self._database.executemany("insert or replace into objects values (?, ?, ?, ?, ?)", rows)

    def doubt(self, tag: str) -> None:
        """Note that the bucket's object of a tag has other bytes than it should."""
        self._ask("insert or ignore into doubted values (?)", tag)

    def forget(self, key: str) -> None:
        """Note that the bucket has no such object."""
        self._ask("delete from objects where key = ?", key)

    def _ask(self, sql: str, *parameters: Any) -> list[tuple[Any, ...]]:
        """The rows of a statement; it ends, and the disk may refuse, only with the last of them."""
        with self._open():
            return self._database.execute(sql, parameters).fetchall()

    @contextmanager
    def _open(self) -> Iterator[None]:
        """One thread at a time; the database's errors in our words."""
        try:
            with self._lock:
                yield
        except sqlite3.OperationalError as error:
            raise StorageFailed(f"cannot be written ({error})", where=str(self._file), next_step=(
                "Free space or mend the folder, a cache, then run again; what was done is in the bucket"
            )) from error
        except sqlite3.DatabaseError as error:
            raise CorruptFile(f"is damaged ({error})", where=str(self._file),
                              next_step="Remove the folder: it is a cache") from error
