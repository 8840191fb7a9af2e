"""Space: who reaches each place of the pitch first."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import AnalysisSettings
from pitchlore.pipeline.stages.analysis.paces import crossings_ns
from pitchlore.pipeline.stages.events.views import tabled
from pitchlore.schemas import SIDES, Space

#: Places along and across the pitch, the middles of equal cells.
_PLACES = (36, 24)


def space(
    trajectories: pl.DataFrame, pitch: Pitch, settings: AnalysisSettings
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Rows of schema Space of one match; and columns team, robot and space, each robot's mean share.

    An instant counts if a robot of each team is seen.

    Args:
        trajectories: rows of schema Trajectories of the match.
        pitch: pitch of the match.
        settings: settings of the stage.
    """
    robots = trajectories.filter(
        pl.col("team") != "ball", pl.col("segment").is_not_null(), ~pl.col("suspect"))
    reaction_s = crossings_ns(pitch, settings.reaction) / 1e9
    slot = pl.col("t_ns") // round(settings.space_each_s * 1e9)
    instants = robots.select("t_ns").unique().sort("t_ns").group_by(
        slot.alias("slot"), maintain_order=True).first()
    seen = robots.join(instants.select("t_ns"), on="t_ns", maintain_order="right").select(
        "t_ns", pl.col("team").cast(pl.String), "robot",
        *(pl.col(at).cast(pl.Float64) + pl.col(v).fill_null(0.0) * reaction_s
          for at, v in (("x", "vx"), ("y", "vy"))))
    along, across = ((np.arange(n) + 0.5) / n - 0.5 for n in _PLACES)
    px, py = (it.ravel() for it in np.meshgrid(along * pitch.length, across * pitch.width))
    rows, shares = [], dict[tuple[str, int], list[float]]()
    for (t_ns,), here in seen.group_by("t_ns", maintain_order=True):
        team = here["team"].to_numpy()
        if len(set(team)) < len(SIDES):
            continue
        first = np.argmin(
            (here["x"].to_numpy()[:, None] - px) ** 2 + (here["y"].to_numpy()[:, None] - py) ** 2, axis=0)
        for name, number, share in zip(
                team, here["robot"], np.bincount(first, minlength=len(team)) / len(px), strict=True):
            shares.setdefault((name, number), []).append(float(share))
        for side, turn in zip(SIDES, (1, -1), strict=True):
            mine, ahead = team[first] == side, turn * px > pitch.length / 6
            seen_of = int((team == side).sum())
            rows.append((t_ns, side, seen_of, float(mine.mean()), float(mine[ahead].mean())))
    table = pl.DataFrame(rows, schema=["t_ns", "team", "robots", "share", "ahead"], orient="row")
    means = pl.DataFrame(
        [(*key, float(np.mean(each))) for key, each in shares.items()],
        schema={"team": pl.String, "robot": trajectories.schema["robot"], "space": pl.Float64}, orient="row")
    return (tabled(Space, trajectories, table.to_dict()) if rows else Space.empty()), means
