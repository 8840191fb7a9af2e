"""Moments of recorded matches, drawn at random, for the labels.

A moment is one sample of a recording in play. It has a label for each robot that is on the pitch then.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from harness import INSPER, RCSS, RSIM, SSL, read
from harness import recordings as there

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.derive import trajectories

SEED = 13
#: Moments of one recording are at least this far apart.
APART_NS = 500_000_000


class Part(NamedTuple):
    """A part of a recording from which moments are drawn.

    Attributes:
        league: kind of pitch.
        recording: file name.
        half: the half of its samples in play, 0 or 1; None for all.
        use: "mend" if rules may be changed by its labels, "report" if its labels are looked at once.
        moments: how many.
    """

    league: str
    recording: str
    half: int | None
    use: str
    moments: int


#: The recordings of each league. Where a league has one match, its halves are two matches' stand-ins.
PARTS = (
    Part("vsss", RSIM, 0, "mend", 33), Part("vsss", RSIM, 1, "report", 33), Part("ssl", SSL, 0, "mend", 33),
    Part("ssl", SSL, 1, "report", 33), Part("2d", RCSS, None, "mend", 34),
    Part("2d", INSPER, None, "report", 34))


class Recording(NamedTuple):
    """A recording as trajectories, with the referee's events and its counted commands (none but in 2D)."""

    table: pl.DataFrame
    referee: pl.DataFrame
    commands: pl.DataFrame
    pitch: Pitch


def recording(path: Path) -> Recording:
    """The trajectories of a recording."""
    log = read(path)
    table, _ = trajectories(log, TrajectorySettings())
    return Recording(table, log.referee, log.commands, log.info.pitch)


def recordings(folder: Path) -> dict[str, Recording]:
    """The recordings of the study that are there, by file name; the sample is part of the project."""
    return {name: recording(path) for name, path in there(folder).items()}


def draw(recorded: dict[str, Recording]) -> pl.DataFrame:
    """Moments of all parts, in order of league and time, numbered from 1.

    Args:
        recorded: all recordings of the study, from :func:`recordings`.

    Returns:
        Columns moment, league, recording, use, t_ns.
    """
    rng = np.random.default_rng(SEED)
    rows = []
    for part in PARTS:
        table = recorded[part.recording].table
        ball = table.filter(pl.col("team") == "ball", pl.col("segment").is_not_null(), ~pl.col("suspect"))
        t_ns = ball["t_ns"].sort().to_numpy()
        if part.half is not None:
            t_ns = np.array_split(t_ns, 2)[part.half]
        drawn: list[int] = []
        for place in rng.permutation(len(t_ns)):
            t = int(t_ns[place])
            if all(abs(t - other) >= APART_NS for other in drawn):
                drawn.append(t)
            if len(drawn) == part.moments:
                break
        rows += [(part.league, part.recording, part.use, t) for t in sorted(drawn)]
    columns = {"league": pl.String, "recording": pl.String, "use": pl.String, "t_ns": pl.Int64}
    return pl.DataFrame(rows, schema=columns, orient="row").with_row_index("moment", offset=1)
