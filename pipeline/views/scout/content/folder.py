"""A folder of pages that keeps what each page was made from, so that those that stand are not made again."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.system import whole
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.temporaries import sweep

#: What each page was made from, and its SHA-256, by its name.
_KEYS = ".pages.json"
#: Names of pages and of their data.
_PAGE = re.compile(r"(?:[a-z]+/)?[a-z0-9][a-z0-9-]*\.(?:html|js|css)")


class Folder:
    """A folder of pages.

    Args:
        store: store that writes the files.
        path: the folder.

    Attributes:
        new: number of pages that were written.
        kept: number of pages that stand.
    """

    def __init__(self, store: Store, path: Path) -> None:
        self._store, self.path = store, path
        self._before = self._read()
        self._now: dict[str, str] = {}
        self._facts: dict[str, Any] = {}
        self.new = self.kept = 0

    def _read(self) -> dict[str, Any]:
        try:
            found = json.loads((self.path / _KEYS).read_bytes())
        except (OSError, ValueError):
            return {}
        known = isinstance(found, dict) and isinstance(found.get("facts"), dict)
        return found if known else {}

    def missing(self, keys: Mapping[str, str]) -> list[str]:
        """The pages that have to be made, of some pages with the keys of what they are made from."""
        standing = {name for name, key in keys.items() if self._stands(name, key)}
        self.kept += len(standing)
        self._now |= {name: self._before[name] for name in standing}
        return [name for name in keys if name not in standing]

    def _stands(self, name: str, key: str) -> bool:
        """True if a page was made from this, and has the bytes that it had then."""
        before = self._before.get(name)
        try:
            return (isinstance(before, str) and before.startswith(f"{key} ")
                    and before == f"{key} {digest(whole(self.path / name))}")
        except OSError:
            return False

    def write(self, name: str, key: str, content: bytes) -> None:
        """Write a page."""
        self._now[name] = f"{key} {digest(content)}"
        self._store.write_bytes(self.path / name, content)
        self.new += 1

    def put(self, name: str, key: str, make: Callable[[], bytes]) -> None:
        """Write a page unless it stands."""
        if self.missing({name: key}):
            self.write(name, key, make())

    def known(self, name: str, key: str) -> dict[str, Any] | None:
        """Facts that were remembered with this key; None without."""
        before = self._before.get("facts", {}).get(name)
        facts = before.get("facts") if isinstance(before, dict) and before.get("key") == key else None
        return self.remember(name, key, facts) if isinstance(facts, dict) else None

    def remember(self, name: str, key: str, facts: dict[str, Any]) -> dict[str, Any]:
        """Keep facts that several pages need for the next time."""
        self._facts[name] = {"key": key, "facts": facts}
        return facts

    def close(self) -> None:
        """Remove the pages of what is gone, and keep what each page was made from."""
        for name in self._before.keys() - self._now.keys() - {"facts"}:
            if _PAGE.fullmatch(name):  # nobody's list of pages may have files elsewhere removed
                (self.path / name).unlink(missing_ok=True)
        sweep(self.path)
        said = json.dumps(self._now | {"facts": self._facts}, separators=(",", ":"), sort_keys=True)
        self._store.write_bytes(self.path / _KEYS, said.encode())
