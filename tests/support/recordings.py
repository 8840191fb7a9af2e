"""Recordings for tests: read from bytes, and the recorded matches that nobody here simulated."""

from dataclasses import replace
from functools import cache
from hashlib import sha256
from itertools import pairwise
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from conftest import RECORDINGS, SAMPLE

from pitchlore.pipeline.importers import readers
from pitchlore.pipeline.importers.source import SourceFile, inflate
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import Frames, MatchLog
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import Commands, Decisions, Quality, Referee

RSIM = "rsim-vss-3v3.parquet"
SSL = "ssl-2025-robocin-tigers-345s.parquet"
RCSS = "rcssserver-3v3.rcg.gz"
INSPER = "insper-2d-2022-unfinished.rcg.gz"
ALL = [RSIM, SSL, RCSS, INSPER]


def beside(name: str) -> Path:
    """A file beside the recordings that nobody here simulated; skips where it is absent."""
    path = SAMPLE if name == RSIM else RECORDINGS / name
    if not path.exists():
        pytest.skip(f"{name} is not beside this checkout (it may not be copied into the project)")
    return path


def recording(name: str) -> bytes:
    """A recording's bytes."""
    return beside(name).read_bytes()


def read(
    data: bytes, name: str, mapping: TrackingMap = TrackingMap(), *, match_id: str | None = None
) -> MatchLog:
    """A recording's bytes as a match; ``match_id`` replaces the identity that the content gives it."""
    source = readers.open_source(data, name)
    return readers.read(source if match_id is None else replace(source, match_id=match_id), mapping)


def taken_for(data: bytes, name: str, form: str) -> SourceFile:
    """A source file of match ``game-0``, whatever the format of its content is told to be."""
    content, damage = inflate(data, name)
    return SourceFile(name, content, damage, form, sha256(content).hexdigest(), "game-0")


@cache
def imported(name: str) -> MatchLog:
    """A recording as a match."""
    return read(recording(name), name)


@cache
def bodies_of(name: str) -> pl.DataFrame:
    """The trajectories of a recording."""
    return trajectories(imported(name), TrajectorySettings())[0]


def same_frames(one: Frames, two: Frames) -> bool:
    """True if all samples are equal to the last bit."""
    parts = ("number", "t_ns", "ball", "offsets", "robots")
    return all(getattr(one, part).tobytes() == getattr(two, part).tobytes() for part in parts)


def same(one: MatchLog, two: MatchLog) -> bool:
    """True if two logs are equal to the last bit."""
    return (
        one.info == two.info
        and same_frames(one.frames, two.frames)
        and one.referee.equals(two.referee)
        and one.decisions.equals(two.decisions)
        and one.quality.equals(two.quality)
        and one.commands.equals(two.commands)
        and one.options.tobytes() == two.options.tobytes()
    )


def assert_sound(log: MatchLog) -> None:
    """Laws of every match that was imported, damaged or not."""
    frames = log.frames
    assert len(frames) > 0
    assert frames.t_ns.min() == 0
    assert (np.diff(frames.offsets) >= 0).all()
    tables = (log.referee, Referee), (log.quality, Quality), (log.decisions, Decisions), (log.commands, Commands)
    for table, schema in tables:
        schema.validate(table)
        assert set(table["match_id"]) <= {log.info.match_id}
    assert log.referee["t_ns"].is_sorted()
    periods = log.info.periods
    assert periods[0].start_ns == 0
    assert periods[-1].end_ns > frames.t_ns.max()
    assert all(a.end_ns == b.start_ns for a, b in pairwise(periods))
    theta = frames.robots["theta"]
    assert (np.isnan(theta) | (np.abs(theta) <= np.float32(np.pi))).all()
