"""Worth of a second of each way to act, from the seconds of a trial."""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl
from looking.lots import Trial

from pitchlore.pipeline.arena.teams.constant import constant
from pitchlore.pipeline.numbers.statistics import mean_interval, welch
from pitchlore.schemas import ROLES


def differences(rows: pl.DataFrame, trial: Trial, by: Sequence[str]) -> pl.DataFrame:
    """Worth of a second of one way to act, less that of another, with Welch's intervals.

    Returns:
        A row a pair of ways and group: way, less, the columns of ``by``, seconds (of all ways), difference,
        low and high; null where there are fewer than two seconds of a way.
    """
    found = []
    for key, own in rows.group_by(by, maintain_order=True) if by else [((), rows)]:
        for pair in trial.compared:
            ours, theirs = (own.filter(way=trial.ways.index(way))["change"] for way in pair)
            ends = welch(ours, theirs)
            found.append({
                "way": pair[0], "less": pair[1], **dict(zip(by, key, strict=True)), "seconds": own.height,
                "difference": None if ends is None else ours.mean() - theirs.mean(),  # type: ignore[operator]
                "low": ends and ends[0], "high": ends and ends[1]})
    return pl.DataFrame(found, infer_schema_length=None).sort("way", "less", *by)


def shares(rows: pl.DataFrame, trial: Trial, by: Sequence[str]) -> pl.DataFrame:
    """Shares of time in groups where a way to act is surely worth more than another, and surely less.

    The first second of play counts as neither, in the share and in the evidence.
    """
    found = differences(rows.filter(~pl.col("first")), trial, by).with_columns(
        share=pl.col("seconds") / rows.height)
    return found.group_by("way", "less", maintain_order=True).agg(
        pl.lit(" ".join(by)).alias("states"), groups=pl.len(),
        surely_more=pl.col("share").filter(pl.col("low") > 0).sum(),
        surely_less=pl.col("share").filter(pl.col("high") < 0).sum())


def worth_of(rows: pl.DataFrame, trial: Trial) -> pl.DataFrame:
    """Change of V in a second of each role's constants, the best first.

    Returns:
        A row a role and way: role, code, seconds, change (mean), low, high.
    """
    found = []
    for (role, way), own in rows.group_by("role", "way", maintain_order=True):
        team = constant(trial.ways[int(str(way))])
        if team is not None:
            low, high = mean_interval(own["change"].to_numpy()) or (None, None)
            found.append({"role": role, "code": getattr(team, str(role)), "seconds": own.height,
                          "change": own["change"].mean(), "low": low, "high": high})
    return pl.DataFrame(found).sort(
        pl.col("role").cast(pl.Enum(ROLES)), -pl.col("change"), "code")
