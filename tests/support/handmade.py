"""A match of hand-made tables, as views take one."""

from collections.abc import Iterator, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import polars as pl

from pitchlore.pipeline.engine.inputs import Inputs
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.table import row
from pitchlore.pipeline.settings import EventSettings, GoalSettings, SituationSettings, TrajectorySettings
from pitchlore.pipeline.stages.events.derive import events
from pitchlore.pipeline.stages.goals import attribute
from pitchlore.pipeline.stages.situations.recognise import recognise
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import Table


class Handmade(Inputs):
    """Hand-made tables by name; those that are not given are empty."""

    def __init__(
        self, tables: Mapping[str, pl.DataFrame], details: Mapping[str, Any],
        settings: Mapping[str, Mapping[str, Any]], log: MatchLog | None,
    ) -> None:
        self._tables, self._details, self._settings, self._log = tables, details, settings, log

    def __getitem__(self, noun: str) -> Sequence[Any]:
        files = dict.fromkeys(schema.NAME for schema in STAGES[noun].schemas)
        return [SimpleNamespace(name="m-1", settings=self._settings.get(noun, {}), details=self._details, files=files)]

    def tables(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        yield self._tables.get(schema.NAME, schema.empty())

    def batches(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        return self.tables(noun, schema)

    def blobs(self, noun: str, role: str) -> Iterator[bytes | None]:
        yield None

    def log(self) -> MatchLog:
        assert self._log is not None
        return self._log


def handmade(
    pitch: Pitch | None = None, *, gap_s: float | None = None, log: MatchLog | None = None, **tables: pl.DataFrame | None
) -> MatchTables:
    """A match with these tables; None stands for an empty one."""
    details = {"pitch": pitch.model_dump()} if pitch is not None else {}
    settings = {"sequences": {"gap_s": gap_s}} if gap_s is not None else {}
    return MatchTables(Handmade({name: table for name, table in tables.items() if table is not None}, details, settings, log))


def derived(log: MatchLog) -> dict[str, pl.DataFrame]:
    """The tables that stages make of a log: bodies, situations, goals and events, beside its row and the referee's."""
    pitch, (bodies, _) = log.info.pitch, trajectories(log, TrajectorySettings())
    done = recognise(bodies, pitch, SituationSettings())
    return {
        "matches": row(log), "referee": log.referee, "trajectories": bodies, "situations": done,
        "goals": attribute(log.referee, bodies, done, pitch, GoalSettings()),
        **events(bodies, log.referee, pitch, EventSettings())._asdict(),
    }
