"""Content of an export, whatever the format."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.matches.frame import Period
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.schemas import SIDES

#: Names of the teams of ``ROBOT_DTYPE``'s numbers, as the tables have them.
BALL = "ball"
#: The event of a sample without one, in play and out of it.
PLAY, STOP = "play", "stop"


class ExportedMatch:
    """A match to be exported: its log, and its tables.

    Args:
        match: the match.

    Attributes:
        log: the match as it was recorded: axes of the pitch, home attacks as ``log.info.periods`` say.
    """

    def __init__(self, match: MatchTables) -> None:
        self.match = match
        self.log = match.log

    def bodies(self) -> pl.DataFrame:
        """Every body at every sample as recorded, samples in the order of time, the ball first.

        Returns:
            Columns ``sample`` (rank of the sample in order of time), ``frame`` (the source's number),
            ``t_ns``, ``team`` (home, away or ball), ``player`` (null for the ball), ``x``, ``y`` (metres;
            null where the ball was not seen), ``z`` (the ball's height; null where not known), ``heading``
            (rad; null where not known). A robot that was not seen has no row.
        """
        frames, robots = self.log.frames, self.log.frames.robots
        order = np.argsort(frames.t_ns, kind="stable")
        rank = np.empty(len(order), dtype=np.int64)
        rank[order] = np.arange(len(order))
        of = frames.robot_frames()
        heights = pl.DataFrame({"t_ns": self.log.heights.t_ns, "z": self.log.heights.z}).unique(
            "t_ns", keep="first")
        ball = pl.DataFrame({
            "sample": rank, "frame": frames.number, "t_ns": frames.t_ns, "team": [BALL] * len(rank),
            "player": pl.Series([None] * len(rank), dtype=pl.Int32),
            "x": frames.ball["x"], "y": frames.ball["y"],
            "heading": np.full(len(rank), np.nan, dtype=np.float32),
        }).join(heights, on="t_ns", how="left", maintain_order="left")
        players = pl.DataFrame({
            "sample": rank[of], "frame": frames.number[of], "t_ns": frames.t_ns[of],
            "team": np.array(SIDES)[robots["team"]], "player": robots["id"].astype(np.int32),
            "x": robots["x"], "y": robots["y"], "heading": robots["theta"],
        }).with_columns(z=pl.lit(None, dtype=pl.Float32))
        both = pl.concat([ball, players.select(ball.columns)]).sort("sample", maintain_order=True)
        return both.with_columns(pl.col("x", "y", "z", "heading").fill_nan(None))

    def times(self) -> I64:
        """Times of the samples in order, int64 [F], ns; two samples may have the same one."""
        return np.sort(self.log.frames.t_ns, kind="stable")

    def hz(self) -> float:
        """Sampling rate: 1 / median of the intervals, 1/s; 1 where there is only one sample."""
        steps = np.diff(self.times())
        steps = steps[steps > 0]
        return 1e9 / float(np.median(steps)) if len(steps) else 1.0

    def in_play(self) -> pl.Series:
        """Mask of samples in play, in order of time, bool [F]."""
        times = pl.DataFrame({"t_ns": self.times()})
        samples = self.match.trajectories.select("t_ns", on=pl.col("segment").is_not_null())
        on = samples.unique("t_ns", keep="first")
        return times.join(on, on="t_ns", how="left", maintain_order="left")["on"].fill_null(value=False)

    def periods(self) -> tuple[Period, ...]:
        """The match's periods; one for the whole match where its log has none."""
        times = self.times()
        end = int(times[-1]) + 1 if len(times) else 1
        whole = Period(start_ns=0, end_ns=end, home_attacks=1, inferred=True)
        return self.log.info.periods or (whole,)

    def score(self) -> tuple[int | None, int | None]:
        """The last score that the referee reported, null where not known."""
        reported = self.log.referee.sort("t_ns", maintain_order=True)
        home, away = (reported[f"score_{side}"].drop_nulls() for side in SIDES)
        return (home[-1] if len(home) else None), (away[-1] if len(away) else None)


def places(bodies: pl.DataFrame) -> dict[tuple[str, int | None], tuple[I64, F64]]:
    """By body (team, player): int64 [n] times at which it was seen, float64 [n, 4] x, y, z, heading.

    Args:
        bodies: bodies of :meth:`ExportedMatch.bodies`.
    """
    seen = bodies.drop_nulls(["x", "y"]).with_columns(pl.col("z", "heading").cast(pl.Float64))
    return {
        (str(team), None if player is None else int(player)): (
            rows["t_ns"].to_numpy(),
            rows.select(pl.col("x", "y", "z", "heading").cast(pl.Float64).fill_null(float("nan"))).to_numpy(),
        )
        for (team, player), rows in seen.partition_by(["team", "player"], as_dict=True).items()
    }
