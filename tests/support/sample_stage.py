"""A stage as docs/how-to/stage.md says to add one: robots' top speeds, in the noun sprints."""

from pathlib import Path

NEW = {
    "schemas/sprints.py": '''"""Sprints: how fast the robots were."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import SIDES, Table, match_id, unit


class Sprints(Table):
    """The top speed of one robot in a match."""

    NAME: ClassVar[str] = "sprints"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(min=0, description="number of the robot")
    top_speed = dy.Float64(min=0, description="greatest estimated speed", metadata=unit("m/s"))
''',
    "pipeline/stages/sprints.py": '''"""Top speeds from trajectories."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.settings import SprintSettings
from pitchlore.schemas.sprints import Sprints


def sprints(bodies: pl.DataFrame, settings: SprintSettings) -> pl.DataFrame:
    """Rows of schema Sprints, of the robots that were faster than the settings ask for.

    Args:
        bodies: rows of schema Trajectories, of one match.
        settings: of the stage.
    """
    speed = (pl.col("vx").cast(pl.Float64) ** 2 + pl.col("vy").cast(pl.Float64) ** 2).sqrt()
    robots = bodies.filter(pl.col("team") != "ball").group_by("match_id", "team", "robot").agg(top_speed=speed.max())
    fast = robots.filter(pl.col("top_speed") > settings.over).sort("team", "robot")
    return fast.with_columns(pl.col("team").cast(pl.String)).cast(Sprints.dtypes()).select(list(Sprints.dtypes()))
''',
}

#: File to what is put before which line.
EDITS = {
    "schemas/__init__.py": [("from pitchlore.schemas.table import BODIES as BODIES", "from pitchlore.schemas.sprints import Sprints as Sprints\n")],
    "pipeline/settings.py": [
        ("class Settings(Frozen):", '''class SprintSettings(Frozen):
    """Robots that have a row in the table of sprints.

    Attributes:
        over: least top speed, m/s, exclusive.
    """

    over: float = Field(default=0.0, ge=0)


'''),
        ("    goals: GoalSettings = GoalSettings()", "    sprints: SprintSettings = SprintSettings()\n"),
    ],
    "pipeline/engine/stages.py": [
        ("def _goals(", '''def _sprints(inputs: Inputs, settings: SprintSettings) -> Made:
    from pitchlore.pipeline.stages.sprints import sprints

    return Made([(sprints(inputs.table("trajectories", Trajectories), settings), Sprints)])


'''),
        ("from pitchlore.pipeline.store.work import Made", "from pitchlore.pipeline.settings import SprintSettings\n"),
        ("from pitchlore.schemas import (", "from pitchlore.schemas.sprints import Sprints\n"),
        ('    Stage("goals"', '    Stage("sprints", Per.MATCH, ("trajectories",), (Sprints,), 1, _sprints),\n'),
    ],
}
#: Written by `make golden`.
GOLDEN = "tests/golden/sprints/clip-120s.txt"


def add(tree: Path) -> set[str]:
    """Add the stage to a copy of the tree; the files that were made or edited by hand."""
    for name, text in NEW.items():
        (tree / name).write_text(text)
    for name, edits in EDITS.items():
        text = (tree / name).read_text()
        for before, inserted in edits:
            assert text.count(f"\n{before}") == 1, f"{name}: {before!r}"
            text = text.replace(f"\n{before}", f"\n{inserted}{before}")
        (tree / name).write_text(text)
    return {*NEW, *EDITS}
