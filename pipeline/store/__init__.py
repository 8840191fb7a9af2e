"""The only room that touches the data folder: atomic files, receipts, versions, quarantine.

A stage's output is content-addressed: the name of each file carries the SHA-256 of its bytes. A receipt
names the current files of one output and the key of the work that made them (:mod:`pipeline.store.work`).
It is written last and by one rename, so whatever kills a run leaves either the old output or the new one,
whole. Nothing here reads a clock: the same work gives the same bytes.
"""

from __future__ import annotations

from pipeline.store.outputs import Outputs
from pipeline.store.quarantine import Quarantine
from pipeline.store.versions import Versions


class Store(Outputs, Versions, Quarantine):
    """The data folder.

    Args:
        root: the folder; made when something is written.
    """

    def unreadable(self, noun: str) -> dict[str, str]:
        """Receipts and manifests of a noun that cannot be read: name to what is wrong."""
        return self.unreadable_receipts(noun) | self.unreadable_versions(noun)
