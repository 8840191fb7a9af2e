"""A match as files of Second Spectrum, the form that both kloppy and floodlight read without loss.

kloppy: ``kloppy.secondspectrum.load(meta_data, raw_data)``. floodlight:
``floodlight.io.secondspectrum.read_position_data_jsonl(raw_data, meta_data)``. Fields and units are those
that these two read (kloppy 3.19, floodlight 1.2); lengths are metres from the centre, y up.
"""

from __future__ import annotations

import json
from collections import defaultdict
from datetime import UTC, datetime
from typing import Any

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.matches.frame import Period
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.views.exports.content import BALL, ExportedMatch
from pitchlore.schemas import SIDES

#: Numbers of the teams; a player's is its team's plus its number on the shirt.
_TEAMS = {"home": 100_000, "away": 200_000}
#: kloppy takes the teams' names apart at the first hyphen and colon.
_NAMES = str.maketrans({"-": "\u2011", ":": "\u2236"})


def second_spectrum_files(content: ExportedMatch) -> tuple[bytes, bytes]:
    """Metadata (JSON) and samples (JSON, one a line, in order of time).

    A sample's number is that of the nearest sample on a regular grid of the whole sampling rate, as
    floodlight needs it; its clock is exact, from the period's beginning, as kloppy reads it. Who touched last
    is the team of the last possession begun, before the first one its team. A player has a height of 0,
    and so has a ball whose height is not known. Where the recording does not say when it began, the date is
    1970-01-01.

    Raises:
        BadRecording: if nobody ever had the ball, because the form has to say who did.
    """
    fps = max(1, round(content.hz()))
    times, periods = content.times(), content.periods()
    of = np.searchsorted([p.start_ns for p in periods], times, side="right") - 1
    of = np.clip(of, 0, None)
    number = np.rint(times * fps / 1e9).astype(np.int64)
    live, touched = content.in_play().to_list(), _last_touch(content, times)
    speeds = _speeds(content)
    seen: dict[int, dict[str, list[dict[str, Any]]]] = defaultdict(lambda: defaultdict(list))
    for row in content.bodies().drop_nulls(["x", "y"]).iter_rows(named=True):
        key = (row["t_ns"], row["team"], row["player"])
        body = {"xyz": [row["x"], row["y"], row["z"] or 0.0], "speed": speeds.get(key, 0.0)}
        if row["team"] != BALL:
            body |= {"playerId": str(_TEAMS[row["team"]] + row["player"]), "number": row["player"]}
        seen[row["sample"]][row["team"]].append(body)
    lines = []
    for sample, t_ns in enumerate(times.tolist()):
        bodies, period = seen[sample], int(of[sample])
        lines.append(json.dumps({
            "period": period + 1, "frameIdx": int(number[sample]),
            "gameClock": (t_ns - periods[period].start_ns) / 1e9, "wallClock": t_ns // 1_000_000,
            "homePlayers": bodies["home"], "awayPlayers": bodies["away"],
            "ball": bodies[BALL][0] if bodies[BALL] else {"xyz": None, "speed": None},
            "live": live[sample], "lastTouch": touched[sample],
        }, separators=(",", ":")))
    meta = _metadata(content, periods, times, fps)
    return json.dumps(meta, indent=1).encode(), ("\n".join(lines) + "\n").encode()


def _metadata(content: ExportedMatch, periods: tuple[Period, ...], times: I64, fps: int) -> dict[str, Any]:
    info = content.log.info
    began = info.started_at or datetime(1970, 1, 1, tzinfo=UTC)
    home, away = content.score()
    robots = content.log.frames.robots
    spans = []
    for number, period in enumerate(periods, 1):
        inside = times[(times >= period.start_ns) & (times < period.end_ns)]
        first, last = (inside[0], inside[-1]) if len(inside) else (period.start_ns, period.end_ns - 1)
        spans.append({
            "number": number, "startFrameIdx": round(int(min(first, period.start_ns)) * fps / 1e9),
            "endFrameIdx": round(int(last) * fps / 1e9), "homeAttPositive": period.home_attacks > 0,
        })
    reported = info.settings.get("players")
    squads = reported if isinstance(reported, dict) else {}
    players = {
        f"{side}Players": [
            {
                "name": squads.get(side, {}).get(str(shirt), f"{side} {shirt}"), "number": shirt,
                "position": "", "ssiId": f"{info.match_id}-{side}-{shirt}",
                "optaId": str(_TEAMS[side] + shirt), "optaUuid": f"{side}-{shirt}",
            }
            for shirt in np.unique(robots["id"][robots["team"] == code]).tolist()
        ]
        for code, side in enumerate(SIDES)
    }
    names = [name.translate(_NAMES) for name in (info.home, info.away)]
    return {
        "ssiId": info.match_id, "description": f"{names[0]} - {names[1]} : {home} {away}",
        "fps": fps, "pitchLength": info.pitch.length, "pitchWidth": info.pitch.width, "periods": spans,
        "homeOptaId": str(_TEAMS["home"]), "awayOptaId": str(_TEAMS["away"]),
        "homeScore": home, "awayScore": away, "year": began.year, "month": began.month, "day": began.day,
        **players,
    }


def _last_touch(content: ExportedMatch, times: I64) -> list[str]:
    """Team that had the ball last, at each time."""
    owned = content.match.possession.sort("start_ns")
    if owned.is_empty():
        raise BadRecording(
            "nobody ever had the ball, and this form has to say who did", where=content.log.info.match_id,
            next_step="Export it as csv or parquet",
        )
    at = np.searchsorted(owned["start_ns"].to_numpy(), times, side="right") - 1
    teams = np.array(owned["team"].cast(pl.String).to_list())
    return [str(team) for team in teams[np.clip(at, 0, None)]]


def _speeds(content: ExportedMatch) -> dict[tuple[int, str, int | None], float]:
    """Speed of each body by time, team and number, m/s, where it can be estimated."""
    moving = content.match.trajectories.drop_nulls(["vx", "vy"]).select(
        "t_ns", pl.col("team").cast(pl.String), "robot",
        speed=(pl.col("vx").cast(pl.Float64) ** 2 + pl.col("vy").cast(pl.Float64) ** 2).sqrt().round(3))
    return {(t_ns, team, robot): speed for t_ns, team, robot, speed in moving.iter_rows()}
