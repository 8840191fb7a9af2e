"""Match logs made by hand, of still and moving bodies, and their trajectories."""

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.rows import pack
from pitchlore.pipeline.matches.frame import MatchInfo, MatchLog, Period
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import Quality, Referee, Trajectories


def ns(seconds):
    """Seconds to the nearest nanosecond, int64 for arrays."""
    return np.rint(np.asarray(seconds, dtype=np.float64) * 1e9).astype(np.int64)


def referee_rows(*events):
    """Rows of schema Referee from (seconds, event, team or None)."""
    return pl.DataFrame([{"match_id": "made-by-hand", "t_ns": int(ns(t)), "event": e, "team": team} for t, e, team in events],
                        schema=Referee.dtypes())


def swapped(table):
    """The table with its teams exchanged."""
    team = pl.col("team").cast(pl.String).replace({"home": "away", "away": "home"})
    return table.with_columns(team.cast(table.schema["team"]))


def make_log(t_s, bodies, *, referee=(), periods=(), kind=Kind.VSSS, t_ns=None):
    """A match log.

    Args:
        t_s: seconds [F], as recorded (or t_ns, nanoseconds).
        bodies: 'ball' or (team, number) to an array [F, 2 or 3] of x, y and theta; a row with NaN in x
            is a robot that is not in the frame.
        referee: (seconds, event, team) each.
        periods: (start, end, direction of home) each, in seconds.
        kind: kind of the pitch.
    """
    t_ns = ns(t_s) if t_ns is None else np.asarray(t_ns, dtype=np.int64)
    ball, robots = {}, {name: [] for name in ("frame", "team", "id", "x", "y", "theta")}
    for key, path in bodies.items():
        x, y, *theta = np.asarray(path, dtype=np.float32).T
        if key == "ball":
            ball = {"x": x, "y": y}
            continue
        seen = np.flatnonzero(~np.isnan(x))
        columns = (seen, seen * 0 + key[0], seen * 0 + key[1], x[seen], y[seen], theta[0][seen] if theta else seen * np.nan)
        for column, values in zip(robots.values(), columns, strict=True):
            column.append(values)
    robots = {name: np.concatenate([np.zeros(0, dtype=np.int64), *parts]) for name, parts in robots.items()}
    frames = pack(np.arange(len(t_ns), dtype=np.uint32), t_ns, ball, robots.pop("frame"), robots)
    info = MatchInfo(
        match_id="made-by-hand", source="none", format="tracking", home="us", away="them",
        pitch=PITCHES[kind], software="tests",
        periods=tuple(
            Period(start_ns=int(ns(a)), end_ns=int(ns(b)), home_attacks=sign, inferred=False)
            for a, b, sign in periods
        ),
    )
    return MatchLog(info, frames, referee_rows(*referee))


def run(log, **changes):
    table, quality = trajectories(log, TrajectorySettings(**changes))
    return Trajectories.validate(table), Quality.validate(quality)


def of(table, team="ball", robot=None):
    rows = table.filter(pl.col("team") == team)
    return rows if robot is None else rows.filter(pl.col("robot") == robot)


def still(frames, x=0.0, y=0.0, theta=0.0):
    return np.tile([x, y, theta], (frames, 1))


def at_60hz(seconds):
    return np.arange(round(seconds * 60)) / 60
