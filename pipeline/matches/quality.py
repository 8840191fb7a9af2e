"""Flaws of a recording: one flaw, and the table of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import polars as pl

from pitchlore.schemas import Quality


@dataclass(frozen=True, slots=True)
class Flaw:
    """One row of schema Quality without its ``match_id``; see there for the fields."""

    flaw: str
    note: str | None = None
    count: int = 1
    start_ns: int | None = None
    end_ns: int | None = None
    team: str | None = None
    robot: int | None = None


def quality_table(match_id: str, flaws: Sequence[Flaw]) -> pl.DataFrame:
    """Rows of schema Quality, in the order given."""
    rows = [{"match_id": match_id, **asdict(flaw)} for flaw in flaws]
    return Quality.of(rows) if rows else Quality.empty()
