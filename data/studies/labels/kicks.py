"""Kicks, catches and tackles that a 2D server counted, beside the situations that the recogniser finds.

An act is a run of one kind of command of one player, in play. A situation of the same player that has a time
in common with the act, or with a cycle before or after it, names the act.
"""

from __future__ import annotations

import polars as pl
from labels.moments import Recording

from pitchlore.pipeline.game.pitch import SCALES
from pitchlore.pipeline.stages.situations import fuzzy
from pitchlore.pipeline.stages.situations.fuzzy import Variable

#: Commands that are further apart are two acts.
GAP_NS = 300_000_000
#: A cycle: a situation that ends or begins so near to an act still names it.
BESIDE_NS = 100_000_000
#: Situations that name an act: of a kick, of a tackle, and of a goalkeeper who catches the ball.
NAMES = {"kick": (21,), "tackle": (21,), "catch": (1, 44, 45, 47)}
#: With the ball, guides, kicks, loses and yields it: a command should lie in one of them.
FAMILY = (1, 11, 21, 22, 23)
#: Groups of acts, and of situations, by what is known just before and just after them.
GROUPS = {
    "all": pl.lit(value=True), "slow": ~pl.col("fast"), "fast": pl.col("fast"),
    "at the body": pl.col("at_body"), "further off": ~pl.col("at_body"), "under pressure": pl.col("pressed"),
    "free": ~pl.col("pressed")}


def acts(commands: pl.DataFrame, command: str, in_play: pl.Series) -> pl.DataFrame:
    """Runs of one kind of command of one player.

    Args:
        commands: rows of schema Commands of one match.
        command: the kind.
        in_play: times in play, ns; commands at other times do not count.

    Returns:
        Columns team, robot, start_ns, end_ns: the first and the last command's time, both included.
    """
    given = (
        commands.filter(pl.col("command") == command, pl.col("t_ns").is_in(in_play.implode()))
        .with_columns(pl.col("team").cast(pl.String), pl.col("robot").cast(pl.Int64))
        .sort("team", "robot", "t_ns"))
    late = (pl.col("t_ns").diff() > GAP_NS).fill_null(value=True).over("team", "robot")
    return given.with_columns(act=late.cum_sum().over("team", "robot")).group_by(
        "team", "robot", "act", maintain_order=True,
    ).agg(start_ns=pl.col("t_ns").min(), end_ns=pl.col("t_ns").max()).drop("act")


def found_as(situations: pl.DataFrame, codes: tuple[int, ...]) -> pl.DataFrame:
    """Situations of some codes: columns team, robot, start_ns, end_ns."""
    return situations.filter(pl.col("code").is_in(codes)).select(
        pl.col("team").cast(pl.String), pl.col("robot").cast(pl.Int64), "start_ns", "end_ns")


def named(these: pl.DataFrame, others: pl.DataFrame) -> pl.Series:
    """Tell which of ``these`` have one of ``others`` of the same robot within ``BESIDE_NS``, bool [rows]."""
    pairs = these.with_row_index("place").join(others, on=["team", "robot"], suffix="_other").filter(
        pl.col("start_ns_other") <= pl.col("end_ns") + BESIDE_NS,
        pl.col("end_ns_other") >= pl.col("start_ns") - BESIDE_NS)
    return pl.int_range(these.height, eager=True).is_in(pairs["place"].unique().implode())


def with_conditions(these: pl.DataFrame, film: Recording) -> pl.DataFrame:
    """Acts or situations, with what is known about them.

    Args:
        these: columns team, robot, start_ns, end_ns; the ball has its new velocity at ``end_ns``.
        film: their match.

    Returns:
        The same rows with three more columns, null where the ball or the robot is missing. ``fast``: the
        ball's speed at the end is MUCH_FASTER. ``at_body``: the ball's distance is BODY at the last sample
        before the end that has both. ``pressed``: then an opponent is within CLOSE of the ball.
    """
    scales, terms = SCALES[film.pitch.kind], fuzzy.terms(SCALES[film.pitch.kind])
    fast = fuzzy.crossings(terms[Variable.VELOCITY]["MUCH_FASTER"])[0]
    seen = film.table.filter(~pl.col("suspect")).with_columns(
        pl.col("team").cast(pl.String), pl.col("robot").cast(pl.Int64), pl.col("x", "y").cast(pl.Float64))
    ball = (
        seen.filter(pl.col("team") == "ball")
        .sort("t_ns")
        .select("t_ns", bx="x", by="y")
        .with_columns(
            ball_speed=(pl.col("bx").diff() ** 2 + pl.col("by").diff() ** 2).sqrt()
            / (pl.col("t_ns").diff() * 1e-9))
    )
    away = seen.filter(pl.col("team") != "ball").join(ball, on="t_ns").with_columns(
        distance=((pl.col("x") - pl.col("bx")) ** 2 + (pl.col("y") - pl.col("by")) ** 2).sqrt())
    nearest = pl.concat(
        [
            away.filter(pl.col("team") != team).group_by("t_ns").agg(opponent=pl.col("distance").min())
            .with_columns(team=pl.lit(team)) for team in ("home", "away")]
    )
    before = away.join(nearest, on=["team", "t_ns"], how="left").select(
        "team", "robot", "distance", "opponent", last_ns="t_ns").sort("last_ns")
    return (
        these.with_row_index("place")
        .with_columns(last_ns=pl.col("end_ns") - 1)
        .sort("last_ns")
        .join_asof(before, on="last_ns", by=["team", "robot"], check_sortedness=False)
        .join(ball, left_on="end_ns", right_on="t_ns", how="left")
        .sort("place")
        .select(
            "team", "robot", "start_ns", "end_ns", fast=pl.col("ball_speed") >= fast,
            at_body=pl.col("distance") < scales.body,
            pressed=(pl.col("opponent") < scales.close).fill_null(value=False))
    )


def judged(situations: pl.DataFrame, film: Recording) -> pl.DataFrame:
    """How many of the server's acts the recogniser names, and how many of its names are acts.

    Args:
        situations: rows of schema Situations of the match.
        film: the match, with its commands.

    Returns:
        Columns command, group (all of ``GROUPS`` for kicks, else "all"); acts; recall and family: shares of
        the acts that a situation of ``NAMES``, or of ``NAMES`` or ``FAMILY``, names; for kicks, situations
        (of ``NAMES``) and precision: the share of them that name a kick. Shares of nothing are null.
    """
    in_play = film.table.filter(pl.col("segment").is_not_null())["t_ns"].unique()
    rows = []
    for command, codes in NAMES.items():
        done = with_conditions(acts(film.commands, command, in_play), film)
        found = with_conditions(found_as(situations, codes), film)
        done = done.with_columns(
            named=named(done, found), in_family=named(done, found_as(situations, (*codes, *FAMILY))))
        found = found.with_columns(named=named(found, done))
        for group, holds in GROUPS.items() if command == "kick" else [("all", GROUPS["all"])]:
            mine, theirs = done.filter(holds), found.filter(holds)
            rows.append({
                "command": command, "group": group, "acts": mine.height, "recall": mine["named"].mean(),
                "family": mine["in_family"].mean(),
                "situations": theirs.height if command == "kick" else None,
                "precision": theirs["named"].mean() if command == "kick" else None})
    shares = ("recall", "family", "precision")
    return pl.DataFrame(rows, infer_schema_length=None).with_columns(pl.col(shares).cast(pl.Float64).round(3))
