"""Tracking tables in text, and what a match made of one says."""

import io

import polars as pl
from support.recordings import taken_for

from pitchlore.pipeline.importers.tracking import csv_file, parquet_file
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog

HEADER = "frame,t,team,player,x,y,heading"
FRAME = """0,10.0,ball,,0.5,-0.25,
0,10.0,reds,1,-0.6,0.1,1.5
0,10.0,reds,2,-0.2,0.2,
0,10.0,greens,1,0.6,0.3,-3.0
"""


def read(data: bytes | str, mapping: TrackingMap | None = None) -> MatchLog:
    data = data.encode() if isinstance(data, str) else data
    parquet = parquet_file.detects(data[:8])
    source = taken_for(data, "game.csv", "tracking-parquet" if parquet else "tracking-csv")
    return (parquet_file if parquet else csv_file).read(source, mapping or TrackingMap())


def parquet(table: pl.DataFrame) -> bytes:
    out = io.BytesIO()
    table.write_parquet(out)
    return out.getvalue()


def robots(match: MatchLog) -> list[tuple[float, ...]]:
    columns = ("team", "id", "x", "y", "theta")
    return [tuple(round(float(row[name]), 5) for name in columns) for row in match.frames.robots]


def events(match: MatchLog) -> list[tuple[object, ...]]:
    text = pl.col("event", "team").cast(pl.String)
    return match.referee.select(pl.col("t_ns") // 1_000_000_000, text, "score_home", "score_away").rows()


def flaws(match: MatchLog) -> list[tuple[object, ...]]:
    columns = (pl.col("flaw").cast(pl.String), "count", pl.col("team").cast(pl.String), "robot")
    return [row for row in match.quality.select(*columns).rows() if not str(row[0]).startswith(("direction", "goals", "home"))]


def course(*states: tuple[object, ...], columns: str = "game_state,score_home,score_away") -> str:
    """A CSV with one frame a second: away 'blue' at -x, home 'amber' at +x."""
    lines = [f"frame,t,team,player,x,y,{columns}"]
    for second, state in enumerate(states):
        end = ",".join("" if value is None else str(value) for value in state)
        bodies = ("ball,,0.3,0", "amber,0,0.5,0", "blue,0,-0.5,0")
        lines += [f"{second},{second},{body},{end}" for body in bodies]
    return "\n".join(lines) + "\n"
