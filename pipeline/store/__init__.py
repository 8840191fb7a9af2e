"""The only package that writes outputs to the data folder: atomic files, receipts, versions, quarantine.

A stage's output is content-addressed: the name of each file carries the SHA-256 of its bytes. A receipt
names the current files of one output and the key of the work that made them (:mod:`pipeline.store.work`).
It is written last and by one rename, so a killed run leaves either the whole old output or the whole new
one. Nothing here reads a clock: the same work gives the same bytes.
"""

from __future__ import annotations

from pitchlore.pipeline.store.outputs import Outputs
from pitchlore.pipeline.store.quarantine import Quarantine
from pitchlore.pipeline.store.versions import Versions


class Store(Outputs, Versions, Quarantine):
    """The data folder.

    Args:
        root: the folder; made when something is written.
    """
