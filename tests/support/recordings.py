"""The recorded matches that nobody here simulated, imported once a session."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest
from conftest import RECORDINGS, SAMPLE

from pipeline.importers import rcg, source, tracking
from pipeline.matches.frame import MatchLog

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


@cache
def imported(name: str) -> MatchLog:
    """A recording as a match."""
    data = recording(name)
    read: Callable[..., MatchLog] = rcg.read if source.detect(data, name) == "rcg" else tracking.read
    return read(data, name=name, match_id=source.match_id(name, data))
