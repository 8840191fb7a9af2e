"""Recordings for tests: read from bytes, and the recorded matches that nobody here simulated."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from hashlib import sha256

import pytest
from conftest import RECORDINGS, SAMPLE

from pitchlore.pipeline.importers import readers
from pitchlore.pipeline.importers.source import SourceFile, inflate
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog

RSIM = "rsim-vss-3v3.parquet"
SSL = "ssl-2025-robocin-tigers-345s.parquet"
RCSS = "rcssserver-3v3.rcg.gz"
INSPER = "insper-2d-2022-unfinished.rcg.gz"
ALL = [RSIM, SSL, RCSS, INSPER]


def recording(name: str) -> bytes:
    """A recording's bytes; skips where it is absent."""
    path = SAMPLE if name == RSIM else RECORDINGS / name
    if not path.exists():
        pytest.skip(f"{name} is not beside this checkout (it may not be copied into the project)")
    return path.read_bytes()


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


def same(one: MatchLog, two: MatchLog) -> bool:
    """True if two logs are equal to the last bit."""
    return (
        one.info == two.info
        and all(
            getattr(one.frames, part).tobytes() == getattr(two.frames, part).tobytes()
            for part in ("number", "t_ns", "ball", "offsets", "robots")
        )
        and one.referee.equals(two.referee)
        and one.decisions.equals(two.decisions)
        and one.quality.equals(two.quality)
        and one.commands.equals(two.commands)
    )
