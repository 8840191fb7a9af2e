"""Geometry packets: the size of the pitch."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.importers.ssl_logs import fields as f
from pitchlore.pipeline.importers.ssl_logs.container import Batch
from pitchlore.pipeline.importers.ssl_logs.wire import VARINT, Fields, fields

#: No line is as wide as this and no pitch as short, millimetres: so the first field tells the two forms
#: apart.
_LINE_OR_LENGTH = 300
#: A pitch is at least and at most so long and wide, millimetres; a goal is shorter.
_SHORTEST, _LONGEST = 500, 500_000
#: A goal is at least so wide, and at most so deep, millimetres.
_NARROWEST, _DEEPEST = 10, 100_000
_LEGACY = (f.LEGACY_LENGTH, f.LEGACY_WIDTH, f.LEGACY_GOAL_WIDTH, f.LEGACY_GOAL_DEPTH)
_SINCE = (f.SIZE_LENGTH, f.SIZE_WIDTH, f.SIZE_GOAL_WIDTH, f.SIZE_GOAL_DEPTH)
#: Numbers of a size's fields are less than this.
_FIELDS = 8


class Size(NamedTuple):
    """Size of a pitch as the log gives it, millimetres."""

    length: int
    width: int
    goal_width: int
    goal_depth: int

    def metres(self) -> dict[str, float]:
        """The same lengths by their names in ``Pitch``, metres."""
        return {name: length / 1000 for name, length in self._asdict().items()}


def sizes(batch: Batch, packets: Fields) -> Counter[Size]:
    """The sizes that a batch of vision packets gives, and how often; those that no pitch has are left out.

    Args:
        batch: vision packets.
        packets: their fields.
    """
    geometry = packets.spans(f.WRAPPER_GEOMETRY)
    inside, _ = fields(batch.data, geometry.value, geometry.end)
    field = inside.spans(f.GEOMETRY_FIELD)
    reported, damaged = fields(batch.data, field.value, field.end)
    reported = reported.at(np.flatnonzero((reported.kind == VARINT) & (reported.number < _FIELDS)))
    given = np.zeros((len(field.of), _FIELDS), np.int64)
    given[reported.of, reported.number] = reported.value
    legacy = given[:, f.LEGACY_LINE] < _LINE_OR_LENGTH
    found = np.where(legacy[:, None], given[:, _LEGACY], given[:, _SINCE])[~damaged]
    rows, times = np.unique(found, axis=0, return_counts=True)
    return Counter({
        Size(*row): int(count) for row, count in zip(rows.tolist(), times, strict=True)
        if all(_SHORTEST <= side <= _LONGEST for side in row[:2])
        and _NARROWEST <= row[2] <= row[1] and 0 <= row[3] <= min(row[0], _DEEPEST)
    })
