"""Features of moments of play, and whether the team scores soon."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.game.episodes import episodes
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.numbers.arrays import F32, F64, I64, Bools
from pitchlore.pipeline.settings import MomentSettings
from pitchlore.schemas import SIDES, Moments
from pitchlore.schemas.values import FEATURES

# Greatest distances that features tell apart: in the league's NEAR, in half goals for keepers and covers.
_FAR, _FAR_KEEPER, _FAR_COVER = 5.0, 5.0, 3.0
#: A VSSS robot's top speed, m/s; ``Scales.speed`` times this is a league's.
_TOP_SPEED = 1.2
#: Speed below which a ball rolls into no goal, m/s, to be multiplied by the league's speed scale.
_ROLLS = 0.05


class BallStates(NamedTuple):
    """The ball at T moments, each [T], metres and m/s, seen by a team that attacks +x."""

    x: F64
    y: F64
    vx: F64
    vy: F64


class RobotStates(NamedTuple):
    """R robots of a team at T moments, each [R, T]; NaN where a robot is missing."""

    x: F64
    y: F64
    theta: F64
    vx: F64
    vy: F64


class _Nearest(NamedTuple):
    """The robot of a team that is nearest to the ball, each [T]; far off and NaN where the team has none.

    Attributes:
        distance: to the ball, metres.
        second: distance of the second nearest.
        dx, dy: from the robot to the ball.
        cos, sin: cosine and sine of its heading.
        vx, vy: its velocity.
    """

    distance: F64
    second: F64
    dx: F64
    dy: F64
    cos: F64
    sin: F64
    vx: F64
    vy: F64


def moments(
    trajectories: pl.DataFrame, referee: pl.DataFrame, pitch: Pitch, settings: MomentSettings
) -> pl.DataFrame:
    """Features of both teams' moments: one sample each ``step_s`` at which the ball is seen in play.

    Args:
        trajectories: rows of schema Trajectories of one match.
        referee: rows of schema Referee of that match.
        pitch: pitch of the match.
        settings: settings of the stage.

    Returns:
        Rows of schema Moments.
    """
    step = round(settings.step_s * 1e9)
    seen = (
        trajectories.filter(
            pl.col("team") == "ball", ~pl.col("suspect"),
            pl.col("segment").is_not_null(), pl.col("vx").is_not_null(),
        )
        .sort("t_ns")
        .filter((pl.col("t_ns") // step != (pl.col("t_ns") // step).shift()).fill_null(value=True))
    )
    if seen.is_empty():
        return Moments.empty()
    ball = BallStates(*(seen[name].cast(pl.Float64).to_numpy() for name in BallStates._fields))
    home, away = (_robots(trajectories, seen["t_ns"], team) for team in SIDES)
    turned = BallStates(*(-part for part in ball)), _turned(away), _turned(home)
    views = {"home": (ball, home, away), "away": turned}
    scores = _scores(seen, episodes(trajectories, referee), round(settings.horizon_s * 1e9))
    return pl.concat(
        seen.select(
            "match_id", pl.lit(team, dtype=pl.Enum(SIDES)).alias("team"), "t_ns", "segment",
            pl.Series("features", features(*view, pitch)).arr.eval(pl.element().fill_nan(None)),
            scores[team].alias("scores"),
        )
        for team, view in views.items()
    ).cast(pl.Schema(Moments.dtypes()))


def features(ball: BallStates, own: RobotStates, their: RobotStates, pitch: Pitch) -> F32:
    """Features of T moments, float32 [T, features], in the order of ``schemas.values.FEATURES``.

    Args:
        ball: the ball.
        own: the robots of the team whose point of view it is.
        their: the adversary's.
        pitch: pitch of the match.
    """
    scales = SCALES[pitch.kind]
    goal_x, half_goal, top = pitch.goal_x, pitch.goal_width / 2, _TOP_SPEED * scales.speed
    slowest = _ROLLS * scales.speed
    mine, its = _nearest(own, ball), _nearest(their, ball)
    to_x, to_y, from_x = goal_x - ball.x, -ball.y, -goal_x - ball.x
    found = {
        "ball_x": ball.x / goal_x,
        "ball_y": np.abs(ball.y) / (pitch.width / 2),
        "goal_distance": np.hypot(to_x, to_y) / pitch.length,
        "goal_angle": _angle(to_x, ball.y, half_goal),
        "ball_vx": ball.vx / top,
        "ball_speed": np.hypot(ball.vx, ball.vy) / top,
        "on_target": _on_target(ball, to_x, ball.vx, half_goal, slowest),
        "against_target": _on_target(ball, -from_x, -ball.vx, half_goal, slowest),
        "own_distance": np.minimum(mine.distance / scales.near, _FAR),
        "their_distance": np.minimum(its.distance / scales.near, _FAR),
        "own_behind": _cosine(mine.dx, mine.dy, to_x, to_y),
        "their_behind": _cosine(its.dx, its.dy, from_x, to_y),
        "own_goal_distance": np.hypot(from_x, to_y) / pitch.length,
        "own_goal_angle": _angle(-from_x, ball.y, half_goal),
        "ball_vy": np.where((ball.y > 0) | (ball.y == 0) & (ball.vy >= 0), -ball.vy, ball.vy) / top,
        "cover": np.minimum(_cover(their, ball, to_x, to_y) / half_goal, _FAR_COVER),
        "own_cover": np.minimum(_cover(own, ball, from_x, to_y) / half_goal, _FAR_COVER),
        "keeper": np.minimum(_keeper(their, goal_x) / half_goal, _FAR_KEEPER),
        "own_keeper": np.minimum(_keeper(own, -goal_x) / half_goal, _FAR_KEEPER),
        "own_closing": _closing(mine, ball) / top,
        "their_closing": _closing(its, ball) / top,
        "own_heading": _cosine(mine.cos, mine.sin, to_x + mine.dx, to_y + mine.dy),
        "their_heading": _cosine(its.cos, its.sin, from_x + its.dx, to_y + its.dy),
        "own_second": np.minimum(mine.second / scales.near, _FAR),
        "their_second": np.minimum(its.second / scales.near, _FAR),
        "own_ahead": _share(own.x > ball.x, own),
        "their_ahead": _share(their.x < ball.x, their),
    }
    if scales.faces != 1:  # such robots play the ball with both ends, or all around
        for name in ("own_heading", "their_heading"):
            found[name] = np.abs(found[name])
    table = np.array([found[name] for name in FEATURES])
    return table.T.astype(np.float32)


def _robots(trajectories: pl.DataFrame, t_ns: pl.Series, team: str) -> RobotStates:
    """The robots of a team at the times ``t_ns`` [T]."""
    there = trajectories.filter(pl.col("team") == team, ~pl.col("suspect")).join(
        t_ns.to_frame().with_row_index("place"), on="t_ns", maintain_order="left")
    numbers = there["robot"].unique().sort()
    row = numbers.search_sorted(there["robot"]).to_numpy() if len(there) else np.empty(0, dtype=np.int64)
    found = np.full((len(RobotStates._fields), len(numbers), len(t_ns)), np.nan)
    for part, name in zip(found, RobotStates._fields, strict=True):
        part[row, there["place"].to_numpy()] = there[name].cast(pl.Float64).fill_null(np.nan).to_numpy()
    return RobotStates(*found)


def _turned(robots: RobotStates) -> RobotStates:
    """The same after half a turn of the pitch."""
    return RobotStates(-robots.x, -robots.y, robots.theta + np.pi, -robots.vx, -robots.vy)


def _nearest(robots: RobotStates, ball: BallStates) -> _Nearest:
    dx, dy = ball.x - robots.x, ball.y - robots.y
    away = np.where(np.isnan(dx), np.inf, np.hypot(dx, dy))
    if not len(away):
        far, nowhere = np.full(len(ball.x), np.inf), np.full(len(ball.x), np.nan)
        return _Nearest(far, far, *[nowhere] * 6)
    row, column = away.argmin(axis=0), np.arange(len(ball.x))
    order = np.sort([*away, np.full(len(ball.x), np.inf)], axis=0)
    heading = robots.theta[row, column]
    return _Nearest(
        order[0], order[1], dx[row, column], dy[row, column], np.cos(heading),
        np.sin(heading), robots.vx[row, column], robots.vy[row, column],
    )


def _angle(to_x: F64, y: F64, half_goal: float) -> F64:
    """Angle between the posts of a goal ``to_x`` ahead, seen from y, rad."""
    ahead = np.maximum(to_x, 1e-3)
    return np.arctan2(half_goal - y, ahead) + np.arctan2(half_goal + y, ahead)


def _on_target(ball: BallStates, to_x: F64, towards: F64, half_goal: float, slowest: float) -> F64:
    """exp(-t) where the ball rolls straight between the posts in t seconds, else 0."""
    rolls = towards > slowest
    seconds = np.maximum(to_x, 0.0) / np.where(rolls, towards, 1.0)
    return np.where(rolls & (np.abs(ball.y + ball.vy * seconds) < half_goal), np.exp(-seconds), 0.0)


def _cosine(ax: F64, ay: F64, bx: F64, by: F64) -> F64:
    """Cosine of the angle between two ways; 0 where one has no length, NaN where one is unknown."""
    lengths = np.hypot(ax, ay) * np.hypot(bx, by)
    cosine: F64 = (ax * bx + ay * by) / np.maximum(lengths, 1e-9)
    return cosine


def _cover(robots: RobotStates, ball: BallStates, to_x: F64, to_y: F64) -> F64:
    """Least distance of a robot from the line from the ball to (to_x, to_y) off it, metres."""
    length = np.maximum(to_x**2 + to_y**2, 1e-9)
    dx, dy = robots.x - ball.x, robots.y - ball.y
    along = np.clip((dx * to_x + dy * to_y) / length, 0.0, 1.0)
    return _least(np.hypot(dx - along * to_x, dy - along * to_y))


def _keeper(robots: RobotStates, goal_x: float) -> F64:
    """Distance of the robot nearest to the middle of a goal, metres."""
    return _least(np.hypot(robots.x - goal_x, robots.y))


def _least(distances: F64) -> F64:
    """The least of the known distances [R, T] at each moment; infinite without any."""
    known: F64 = np.where(np.isnan(distances), np.inf, distances)
    least: F64 = known.min(axis=0, initial=np.inf)
    return least


def _closing(robot: _Nearest, ball: BallStates) -> F64:
    """Speed at which a robot and the ball come nearer to each other, m/s."""
    apart = np.maximum(np.hypot(robot.dx, robot.dy), 1e-9)
    return ((robot.vx - ball.vx) * robot.dx + (robot.vy - ball.vy) * robot.dy) / apart


def _share(which: Bools, robots: RobotStates) -> F64:
    """Share of the robots that are there for which a mask [R, T] holds; 0 without any."""
    share: F64 = which.sum(axis=0) / np.maximum((~np.isnan(robots.x)).sum(axis=0), 1)
    return share


def _scores(seen: pl.DataFrame, ends: pl.DataFrame, horizon_ns: int) -> dict[str, pl.Series]:
    """For each team whether it scores within the horizon; null where the recording breaks off before."""
    play = seen.select("t_ns", episode="segment").join(ends, on="episode", how="left", maintain_order="left")
    left: I64 = (play["over_ns"] - play["t_ns"]).to_numpy()
    soon = pl.Series(left <= horizon_ns)
    cut_off = soon & play["outcome"].is_null()
    return {
        team: pl.Series(
            "scores", soon & (play["outcome"] == "goal").fill_null(value=False)
            & (play["scorer"] == team).fill_null(value=False),
        ).set(cut_off, None)
        for team in SIDES
    }
