"""Row of a match in the table Matches."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.base.text import date_in
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.schemas import AWAY, HOME, Matches


def row(log: MatchLog) -> pl.DataFrame:
    """Match as one row of schema Matches.

    The sampling rate is 1 / median of the positive intervals between consecutive samples. The score is the
    last one that the referee reported, null if a goal of an unknown team followed.
    """
    info, frames = log.info, log.frames
    steps = np.diff(frames.t_ns)
    steps = steps[steps > 0]
    most = max(
        (int(np.bincount(part.robot_frames()[part.robots["team"] == team], minlength=1).max())
         for part in frames.parts() for team in (HOME, AWAY)), default=0)
    reported = log.referee.sort("t_ns", maintain_order=True)
    unsettling = (pl.col("event") == "goal") & pl.col("team").is_null()
    scores = {
        score: reported.filter(pl.col(score).is_not_null() | unsettling)[score].to_list()
        for score in ("score_home", "score_away")
    }
    told = info.settings.get("shoot_out")
    shot = told if isinstance(told, dict) else {}
    values = {
        "match_id": info.match_id,
        "source": info.source,
        "home": info.home,
        "away": info.away,
        # polars turns it into UTC, and takes a naive one for UTC
        "started_at": info.started_at or date_in(info.source),
        "duration_s": int(frames.t_ns.max() - frames.t_ns.min()) / 1e9 if len(frames) else 0.0,
        "hz": 1e9 / float(np.median(steps)) if len(steps) else None,
        "robots_per_team": most,
        **{score: known[-1] if known else None for score, known in scores.items()},
        "shoot_out_home": shot.get("home"),
        "shoot_out_away": shot.get("away"),
        "complete": info.complete,
        "incomplete_reason": info.incomplete_reason,
        "kind": info.pitch.kind.value,
        "pitch_length": info.pitch.length,
        "pitch_width": info.pitch.width,
        "goal_width": info.pitch.goal_width,
        "frames": len(frames),
        "format": info.format,
        "direction_inferred": any(period.inferred for period in info.periods),
    }
    return pl.DataFrame([values], schema=Matches.dtypes())
