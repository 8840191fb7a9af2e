"""Match logs made by hand."""

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.matches.frame import BALL_DTYPE, ROBOT_DTYPE, Frames, MatchInfo, MatchLog, Period
from pitchlore.schemas import Referee


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
    frames = len(t_ns)
    ball = np.full(frames, np.nan, dtype=np.float32).repeat(4).view(BALL_DTYPE)
    robots, owner = [], []
    for key, path in bodies.items():
        path = np.asarray(path, dtype=np.float32)
        if key == "ball":
            ball["x"], ball["y"] = path[:, 0], path[:, 1]
            continue
        rows = np.zeros(frames, dtype=ROBOT_DTYPE)
        rows["team"], rows["id"] = key
        rows["x"], rows["y"] = path[:, 0], path[:, 1]
        rows["theta"] = path[:, 2] if path.shape[1] > 2 else np.nan
        seen = ~np.isnan(rows["x"])
        robots.append(rows[seen])
        owner.append(np.flatnonzero(seen))
    frame = np.concatenate([np.zeros(0, dtype=np.int64), *owner])
    robot = np.zeros(len(frame), dtype=ROBOT_DTYPE)
    np.concatenate([robot[:0], *robots], out=robot)  # without `out` the padding would be lost
    order = np.argsort(frame, kind="stable")
    info = MatchInfo(
        match_id="made-by-hand", source="none", format="tracking", home="us", away="them",
        pitch=PITCHES[kind], software="tests",
        periods=tuple(
            Period(start_ns=int(ns(a)), end_ns=int(ns(b)), home_attacks=sign, inferred=False)
            for a, b, sign in periods
        ),
    )
    offsets = np.concatenate(([0], np.cumsum(np.bincount(frame, minlength=frames)))).astype(np.int64)
    number = np.arange(frames, dtype=np.uint32)
    return MatchLog(info, Frames(number, t_ns, ball, offsets, robot[order]), referee_rows(*referee))
