"""The table sights: what robots saw when they decided, and what V did after it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import polars as pl

from pitchlore.pipeline.game.bodies import BALL, COLUMNS, see
from pitchlore.pipeline.matches.frame import Frames, MatchLog, home_attacks
from pitchlore.pipeline.numbers.arrays import F32, F64, I8, I64
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.state.observation import see_from
from pitchlore.schemas import SIDES, Sights
from pitchlore.schemas.sights import SIGHT

#: Times of frames are rounded to nanoseconds.
_ROUNDED_NS = 1_000
_PLACE, _BALL = ("x", "y", "theta", "vx", "vy", "omega"), ("x", "y", "vx", "vy")


def sights(
    log: MatchLog, values: pl.DataFrame, settings: GramSettings, sequences: pl.DataFrame | None = None
) -> pl.DataFrame:
    """Observations of a match's robots at the decisions that its log holds, and the change of V after each.

    With ``watched_s`` also what robots of teams that log no decisions saw while they were in situations: at
    the first sample of each such time. Bodies are those of the log's sample at the moment: a robot that the
    sample has not is unknown. A team that predicts (``predict_s`` in the recipe) acts on bodies as a late
    camera shows them so much later: those are taken as its sight, and V from then on.

    Args:
        log: log of the match.
        values: rows of schema Values of the same match; none if V is not known.
        settings: ``ahead_s`` and ``watched_s``.
        sequences: rows of schema Sequences of the same match; None: nobody is watched.

    Returns:
        Rows of schema Sights.
    """
    found = [_decided(log.decisions)]
    if sequences is not None and settings.watched_s is not None and len(log.frames):
        deciding = log.decisions["team"].unique().to_list()
        watched = sequences.filter(~pl.col("team").is_in(deciding))
        found.append(_watched(watched, log.frames.t_ns, round(settings.watched_s * 1e9)))
    moments = pl.concat(found).sort("team", "robot", "t_ns")
    if moments.is_empty():
        return Sights.empty()
    t_ns = moments["t_ns"].to_numpy()
    team = moments["team"].to_physical().to_numpy().astype(np.int64)
    ahead_ns = np.array([_predicts_ns(log.info.settings, side) for side in SIDES])
    last = len(log.frames) - 1
    there = log.frames.t_ns[np.minimum(np.searchsorted(log.frames.t_ns, t_ns), last)] == t_ns
    frame = np.searchsorted(log.frames.t_ns, t_ns + np.maximum(ahead_ns[team] - _ROUNDED_NS, 0))
    bodies, row = _bodies(log.frames, np.where(there, np.minimum(frame, last), -1))
    number = np.array([row.get(who, 0) for who in zip(team, moments["robot"], strict=True)], dtype=np.int64)
    seen = np.full((len(t_ns), len(SIGHT)), np.nan, dtype=np.float32)
    _see_all(bodies, team, home_attacks(log.info.periods, t_ns), number, log.info.pitch.goal_x, seen)
    change = _changes(moments, values, ahead_ns, round(settings.ahead_s * 1e9))
    return moments.select(
        "match_id", "team", "robot", "t_ns", "role", "code",
        pl.Series("sight", seen).arr.eval(pl.element().fill_nan(None)),
        pl.Series("change", change).fill_nan(None),
    ).cast(pl.Schema(Sights.dtypes()))


def _decided(decisions: pl.DataFrame) -> pl.DataFrame:
    """The moments of decisions: who, when, and how their episodes ended."""
    return decisions.select(
        "match_id", "team", "robot", "role", "t_ns", pl.lit(None, dtype=pl.Int16).alias("code"),
        over_ns=pl.col("end_ns").max().over("team", "episode"),
        goal=pl.col("reward").sum().sign().over("team", "episode"),
    )


def _watched(sequences: pl.DataFrame, t_ns: I64, step_ns: int) -> pl.DataFrame:
    """The moments at which robots are watched: the first sample of each step, in situations.

    Args:
        sequences: rows of schema Sequences.
        t_ns: int64 [F], times of samples, sorted.
        step_ns: time between moments.

    Returns:
        Columns as those of :func:`_decided`.
    """
    step = t_ns // step_ns
    moments = t_ns[np.flatnonzero(np.diff(step, prepend=step[0] - 1))]
    first, last = (np.searchsorted(moments, sequences[name].to_numpy()) for name in ("start_ns", "end_ns"))
    return sequences.select(
        "match_id", "team", "robot", "role", "code", "start_ns",
        over_ns=pl.col("over_ns").fill_null(pl.col("end_ns").max().over("team", "episode")),
        goal=pl.col("reward").sign(),
        moment=pl.int_ranges(pl.Series(first), pl.Series(last)),
    ).explode("moment").drop_nulls("moment").select(
        "match_id", "team", "robot", "role", pl.lit(pl.Series(moments)).gather("moment").alias("t_ns"),
        "code", "over_ns", "goal",
    )


def _predicts_ns(settings: Mapping[str, Any], side: str) -> int:
    """How far ahead a team acts, by the recipe of the match; 0 if it does not say."""
    team = settings.get(side)
    return round(team.get("predict_s", 0.0) * 1e9) if isinstance(team, dict) else 0


def _bodies(frames: Frames, chosen: I64) -> tuple[F64, dict[tuple[int, int], int]]:
    """The bodies of some frames as :mod:`pipeline.game.bodies` has them; of frame -1 all are unknown.

    Returns:
        float64 [K, 1 + 2 N, 6] in the pitch frame, NaN where a body was not seen; and the row of each robot
        in its own team's view, 1 to N, by team and number.
    """
    owners = {team: np.unique(frames.robots["id"][frames.robots["team"] == team]).tolist() for team in (0, 1)}
    count = max(map(len, owners.values()))
    row = {(team, robot): 1 + place for team, own in owners.items() for place, robot in enumerate(own)}
    out = np.full((len(chosen), 1 + 2 * count, COLUMNS), np.nan)
    known = np.flatnonzero(chosen >= 0)
    for column, name in enumerate(_PLACE):
        if name in _BALL:
            out[known, BALL, column] = frames.ball[name][chosen[known]]
    of_frame = frames.counts()[chosen[known]]
    within = np.arange(of_frame.sum()) - np.repeat(np.cumsum(of_frame) - of_frame, of_frame)
    robots = frames.robots[np.repeat(frames.offsets[chosen[known]], of_frame) + within]
    side = robots["team"].astype(np.int64)
    for team, own in owners.items():
        mine = side == team
        at = 1 + np.searchsorted(own, robots["id"][mine]) + count * team
        for column, name in enumerate(_PLACE):
            out[np.repeat(known, of_frame)[mine], at, column] = robots[name][mine]
    return out, row


@njit(cache=True, nogil=True, error_model="numpy")
def _see_all(bodies: F64, team: I64, attacks: I8, row: I64, goal_x: float, out: F32) -> None:
    """Write the sights of K decisions into ``out``, float32 [K, 30]; a robot of row 0 is not there: NaN."""
    view = np.empty(bodies.shape[1:])
    for k in range(len(bodies)):
        if row[k] > 0:
            see(bodies[k], team[k], attacks[k] if team[k] == 0 else -attacks[k], view)
            see_from(view, row[k], goal_x, out[k])


def _changes(moments: pl.DataFrame, values: pl.DataFrame, starts_ns: I64, lasts_ns: int) -> F64:
    """Change of V after each moment, for its team, float64 [K]; NaN where V is not known.

    It is looked at ``starts_ns`` after the moment, int64 [2] by team, and ``lasts_ns`` after that, no later
    than the end of the episode.
    """
    out = np.full(len(moments), np.nan)
    t_all, value_all = values["t_ns"].to_numpy(), values["value"].to_numpy()
    groups = moments.with_row_index("row").group_by("team", "over_ns", maintain_order=True)
    for (team, over_ns), rows in groups:
        over = int(over_ns)
        start = np.minimum(rows["t_ns"].to_numpy() + starts_ns[SIDES.index(team)], over)
        low, high = np.searchsorted(t_all, [start.min(), over + 1])
        if low == high:
            continue
        side = 1.0 if team == SIDES[0] else -1.0
        then = np.minimum(start + lasts_ns, over)
        path = side * value_all[low:high]
        before, after = (np.interp(at, t_all[low:high], path) for at in (start, then))
        goal = rows["goal"].to_numpy()
        out[rows["row"].to_numpy()] = np.where((then == over) & (goal != 0), goal, after) - before
    return out
