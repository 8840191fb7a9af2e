"""Touches of the ball, and teams' times on the ball."""

from __future__ import annotations

from itertools import groupby
from typing import NamedTuple

import numpy as np
import polars as pl

from pipeline.arrays import F64, I64
from pipeline.pitch import SCALES, Pitch
from pipeline.views.commentary.settings import CommentarySettings


class Touch(NamedTuple):
    """One robot's uninterrupted touch of the ball.

    Lengths are metres, in the frame in which the toucher's team attacks +x.

    Attributes:
        team, robot, role: the toucher; its role at the start.
        segment: stretch of play that it lies in.
        start_ns, end_ns: first and last sample of it, both included.
        start_x, start_y: the ball at the start.
        x, y: the ball at the end.
        speed: speed of the ball on leaving, m/s; NaN where unknown.
        aim: y at which the ball's straight line crosses the adversary's goal line; NaN if it does not.
        reach: greatest x of the ball until the next touch, or the end of the segment.
    """

    team: str
    robot: int
    role: str
    segment: int
    start_ns: int
    end_ns: int
    start_x: float
    start_y: float
    x: float
    y: float
    speed: float
    aim: float
    reach: float


class _BallPath(NamedTuple):
    """The ball in play by time, each [n]."""

    t_ns: I64
    segment: I64
    x: F64
    y: F64


def touches(trajectories: pl.DataFrame, pitch: Pitch, settings: CommentarySettings) -> list[Touch]:
    """Touches of a match, by time.

    At each sample the nearest robot within contact distance touches the ball. In a duel the nearest robot
    changes with each jolt, so a touch shorter than ``hold_s`` does not count while the robot that had the
    ball before is within contact distance to the end of it and at the next sample.

    The trajectories are rows of schema Trajectories of one match.
    """
    in_play = trajectories.filter(pl.col("segment").is_not_null(), ~pl.col("suspect"))
    seen = in_play.filter(pl.col("team") == "ball").sort("t_ns").with_row_index("sample")
    t_ns, segment = (seen[name].to_numpy().astype(np.int64) for name in ("t_ns", "segment"))
    x, y = (seen[name].to_numpy().astype(np.float64) for name in ("x", "y"))
    ball = _BallPath(t_ns, segment, x, y)
    distance = ((pl.col("x") - pl.col("bx")) ** 2 + (pl.col("y") - pl.col("by")) ** 2).sqrt()
    near = (
        in_play.filter(pl.col("team") != "ball")
        .join(seen.select("t_ns", "sample", bx="x", by="y"), on="t_ns")
        .with_columns(distance=distance)
        .filter(pl.col("distance") < SCALES[pitch.kind].contact)
        .sort("sample", "distance", "team", "robot")
        .select("sample", "t_ns", "segment", pl.col("team").cast(pl.String), "robot",
                pl.col("role").cast(pl.String))
    )
    near = _settled(near, round(settings.hold_s * 1e9))
    period = int(np.median(np.diff(t_ns))) if len(t_ns) > 1 else 0
    longest = round(settings.flicker_s * 1e9) + period
    runs = near.with_columns(
        run=(
            pl.struct("segment", "team", "robot").rle_id().diff().ne(0).fill_null(value=True)
            | (pl.col("t_ns").diff() > longest)
        ).cum_sum()
    ).group_by("run", maintain_order=True).agg(
        pl.col("team", "robot", "role", "segment").first(),
        pl.col("sample").first(), last=pl.col("sample").last(),
    )
    rows = list(runs.drop("run").iter_rows())
    ends = [*(row[4] for row in rows[1:]), len(ball.t_ns)][:len(rows)]
    line_ns = round(settings.line_s * 1e9)
    return [
        _touch(*row, following=end, ball=ball, pitch=pitch, line_ns=line_ns)
        for row, end in zip(rows, ends, strict=True)
    ]


def _settled(near: pl.DataFrame, hold_ns: int) -> pl.DataFrame:
    """The robot that has the ball at each sample: of all that are near, nearest first, one row a sample."""
    robots: dict[int, list[tuple[str, int]]] = {}
    for sample, team, robot in near.select("sample", "team", "robot").iter_rows():
        robots.setdefault(sample, []).append((team, robot))
    first = near.unique("sample", keep="first", maintain_order=True)
    rows = first.select("sample", "t_ns", "segment").rows()
    owners: list[tuple[str, int]] = []
    k = 0
    while k < len(rows):
        nearest = robots[rows[k][0]][0]
        end = k + 1
        while end < len(rows) and _goes_on(rows[end - 1], rows[end]) and robots[rows[end][0]][0] == nearest:
            end += 1
        before = owners[-1] if k and _goes_on(rows[k - 1], rows[k]) else nearest
        duel = all(before in robots[row[0]] for row in rows[k:min(end + 1, len(rows))])
        brief = rows[end - 1][1] - rows[k][1] < hold_ns
        owners += [before if brief and duel else nearest] * (end - k)
        k = end
    owned = first.select("sample").with_columns(
        pl.Series("team", [team for team, _ in owners], dtype=pl.String),
        pl.Series("robot", [robot for _, robot in owners], dtype=near.schema["robot"]),
    )
    key = ["sample", "team", "robot"]
    return owned.join(near, on=key, how="left", maintain_order="left").select(near.columns)


def _goes_on(before: tuple[int, int, int], after: tuple[int, int, int]) -> bool:
    """Whether two rows (sample, time, segment) are neighbouring samples of the ball in one segment."""
    return after[0] == before[0] + 1 and after[2] == before[2]


def _touch(
    team: str, robot: int, role: str, segment: int, first: int, last: int, *, following: int, ball: _BallPath,
    pitch: Pitch, line_ns: int,
) -> Touch:
    """A touch from its first to its last sample; ``following`` is the first sample of the next one."""
    side = 1.0 if team == "home" else -1.0
    end = min(following, int(np.searchsorted(ball.segment, segment, side="right")))
    x, y = side * ball.x[last:end], side * ball.y[last:end]
    to = min(int(np.searchsorted(ball.t_ns[last:end], ball.t_ns[last] + line_ns, side="right")), len(x)) - 1
    speed = aim = float("nan")
    if to > 0:
        dx, dy = float(x[to] - x[0]), float(y[to] - y[0])
        speed = float(np.hypot(dx, dy)) / ((int(ball.t_ns[last + to]) - int(ball.t_ns[last])) / 1e9)
        if dx > 0:
            aim = float(y[0]) + dy * (pitch.goal_x - float(x[0])) / dx
    return Touch(
        team, robot, role, segment, int(ball.t_ns[first]), int(ball.t_ns[last]),
        side * float(ball.x[first]), side * float(ball.y[first]), float(x[0]), float(y[0]),
        speed, aim, float(x.max()),
    )


class Spell(NamedTuple):
    """A team's time on the ball: from its first touch to the other team's, or to the end of the segment.

    Attributes:
        touches: its touches, at least one.
        end_ns: exclusive.
        lost_by: the other team's last touch before it in the segment, None at its beginning.
    """

    touches: tuple[Touch, ...]
    end_ns: int
    lost_by: Touch | None

    @property
    def team(self) -> str:
        """The team on the ball."""
        return self.touches[0].team

    @property
    def start_ns(self) -> int:
        """Start, ns, inclusive."""
        return self.touches[0].start_ns

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return (self.end_ns - self.start_ns) / 1e9


def spells(touched: list[Touch], trajectories: pl.DataFrame) -> list[Spell]:
    """Teams' times on the ball, by time; the ball belongs to the team that touched it last in the segment.

    The touches are those of :func:`touches`, from the same trajectories.
    """
    ends = trajectories.drop_nulls("segment").group_by("segment").agg(pl.col("t_ns").max())
    last_ns = dict(ends.iter_rows())
    runs = [tuple(run) for _, run in groupby(touched, lambda touch: (touch.team, touch.segment))]
    found = []
    for before, run, after in zip((None, *runs), runs, (*runs[1:], None), strict=False):
        segment = run[0].segment
        end_ns = after[0].start_ns if after and after[0].segment == segment else int(last_ns[segment])
        lost_by = before[-1] if before and before[-1].segment == segment else None
        found.append(Spell(run, end_ns, lost_by))
    return found
