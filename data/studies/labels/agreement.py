"""Labels beside each other and beside the recogniser's answers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
from labels.moments import SEED

#: Columns by which labels and answers of a robot at a moment meet.
ROW = ("moment", "team", "robot")
#: In place of an answer: a gap between situations.
NONE = 0
#: A labeller sees a tenth or two of a second; a code that is said so near to the moment is counted as near.
NEAR_NS = 300_000_000
#: Draws of the bootstrap.
_DRAWS = 2_000


def answers(
    moments: pl.DataFrame, tables: dict[str, pl.DataFrame], situations: dict[str, pl.DataFrame]
) -> pl.DataFrame:
    """The recogniser's answer for each robot at each moment of the recordings that are given.

    Args:
        moments: columns moment, recording, t_ns.
        tables: rows of schema Trajectories of each recording.
        situations: rows of schema Situations of each recording.

    Returns:
        Columns of ROW, now (0 in a gap), near_now (all codes within ``NEAR_NS``, as text).
    """
    robot = (pl.col("team").cast(pl.String), pl.col("robot").cast(pl.Int64))
    parts = []
    for name, table in tables.items():
        drawn = moments.filter(pl.col("recording") == name)
        there = drawn.join(
            table.filter(pl.col("team") != "ball", ~pl.col("suspect")).select("t_ns", *robot), on="t_ns")
        near = drawn.join(
            situations[name].select(*robot, pl.col("code").cast(pl.Int64), "start_ns", "end_ns"), how="cross",
        ).filter(pl.col("start_ns") <= pl.col("t_ns") + NEAR_NS, pl.col("t_ns") - NEAR_NS < pl.col("end_ns"))
        said = near.filter(pl.col("start_ns") <= pl.col("t_ns"), pl.col("t_ns") < pl.col("end_ns"))
        codes = near.group_by(ROW).agg(near_now=pl.col("code").unique().sort().cast(pl.String).str.join(" "))
        parts.append(there.select(ROW).join(said.select(*ROW, now="code"), on=ROW, how="left").join(
            codes, on=ROW, how="left"))
    return (
        pl.concat(parts).with_columns(pl.col("now").fill_null(NONE), pl.col("near_now").fill_null(""))
        .sort("moment", "team", "robot", descending=[False, True, False]))


def read_labels(folder: Path) -> pl.DataFrame:
    """Both labellers' labels: columns of ROW, ``a`` and ``b`` (their codes), ``a_also``, ``b_also``."""
    both = [
        pl.read_csv(folder / f"labels-{who}.csv", schema_overrides={"also": pl.String})
        .select(*ROW, pl.col("code").alias(who), pl.col("also").fill_null("").alias(f"{who}_also"))
        for who in ("a", "b")]
    return both[0].join(both[1], on=ROW, how="inner", validate="1:1", maintain_order="left")


def agreement(labels: pl.DataFrame, said: pl.DataFrame, moments: pl.DataFrame) -> pl.DataFrame:
    """Shares of robots on which two agree, by league and use.

    Args:
        labels: from :func:`read_labels`.
        said: columns of ROW, before and now: the recogniser's codes.
        moments: columns moment, league, use.

    Returns:
        Columns league (also "all"), use, robots; both (the labellers with each other) and kappa (Cohen's).
        For before and now: the recogniser with a labeller, in the mean over the two; kappa_…, in the same
        mean; …_loosely, where a code in ``also`` counts too. random_…: the share of 194 among the robots of
        which labeller a or b, or the recogniser, does not say that they stand. …_low and …_high: 95 %
        intervals of both, before and now, by bootstrap over moments.
    """
    rows = labels.join(said, on=ROW).join(moments.select("moment", "league", "use"), on="moment")
    agrees = {
        name: pl.mean_horizontal([(pl.col(one) == pl.col(other)).cast(pl.Float64) for one in ones])
        for name, ones, other in (("both", "a", "b"), ("before", "ab", "before"), ("now", "ab", "now"))}
    everywhere = pl.concat([rows, rows.with_columns(league=pl.lit("all"))])
    by = everywhere.group_by("league", "use").agg(
        pl.len().alias("robots"),
        *(agrees[name].mean().alias(name) for name in agrees),
        *(
            _interval(agrees[name]).struct.rename_fields([f"{name}_low", f"{name}_high"])
            .alias(f"{name}_interval") for name in agrees),
        kappa=_kappa("a", "b"),
        **{
            f"kappa_{when}": pl.mean_horizontal(_kappa("a", when), _kappa("b", when))
            for when in ("before", "now")},
        **{
            f"{when}_loosely": pl.mean_horizontal(_in_also(when, "a").mean(), _in_also(when, "b").mean())
            for when in ("before", "now")},
        **{f"random_{when}": _random(when) for when in ("a", "b", "before", "now")},
    )
    return (
        by.unnest([f"{name}_interval" for name in agrees])
        .select(
            "league", "use", "robots", "both", "both_low", "both_high", "kappa", "before", "before_low",
            "before_high", "now", "now_low", "now_high", "kappa_before", "kappa_now", "before_loosely",
            "now_loosely", "random_a", "random_b", "random_before", "random_now")
        .sort("use", "league")
        .with_columns(pl.selectors.float().round(3))
    )


def _interval(agrees: pl.Expr) -> pl.Expr:
    """95 % interval of the mean of a column, by bootstrap over moments, as a struct of two."""
    return pl.struct("moment", agrees=agrees).map_batches(
        lambda rows: pl.Series([dict(zip(("low", "high"), interval(*rows.struct.unnest()), strict=True))]),
        return_dtype=pl.Struct({"low": pl.Float64, "high": pl.Float64}), returns_scalar=True)


def interval(moment: pl.Series, agrees: pl.Series) -> tuple[float, float]:
    """95 % interval of the mean over robots: moments are drawn again, because robots of one are alike."""
    of = pl.DataFrame({"moment": moment, "agrees": agrees}).group_by("moment", maintain_order=True).agg(
        pl.col("agrees").sum(), robots=pl.len())
    drawn = np.random.default_rng(SEED).integers(len(of), size=(_DRAWS, len(of)))
    means = of["agrees"].to_numpy()[drawn].sum(axis=1) / of["robots"].to_numpy()[drawn].sum(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    return float(low), float(high)


def _kappa(a: str, b: str) -> pl.Expr:
    """Cohen's kappa of two columns of codes."""
    return pl.struct(a, b).map_batches(
        lambda pairs: pl.Series([kappa(pairs.struct.field(a), pairs.struct.field(b))]),
        return_dtype=pl.Float64, returns_scalar=True)


def kappa(a: pl.Series, b: pl.Series) -> float:
    """Cohen's kappa: agreement above that of labels in random order, as a share of what is left above it."""
    shares = {code: count / len(b) for code, count in b.value_counts().rows()}
    chance = sum(count / len(a) * shares.get(code, 0.0) for code, count in a.value_counts().rows())
    return (float((a == b).to_numpy().mean()) - chance) / (1 - chance) if chance < 1 else float("nan")


def _in_also(when: str, who: str) -> pl.Expr:
    """Tell whether a labeller gives the recogniser's code, first or among the others."""
    others = pl.col(f"{who}_also").str.split(" ")
    return (pl.col(when) == pl.col(who)) | others.list.contains(pl.col(when).cast(pl.String))


def _random(column: str) -> pl.Expr:
    """Share of 194 among the robots of which it does not say that they stand."""
    return (pl.col(column) == 194).sum() / (pl.col(column) != 184).sum()


def by_code(labels: pl.DataFrame, said: pl.DataFrame, moments: pl.DataFrame) -> pl.DataFrame:
    """For each code: how often both labellers say it, and how often the recogniser says so too.

    Returns:
        Columns use, code, both (robots with that label from both), kept_a (share of a's labels that b
        confirms); for before and now: found (share of ``both`` that the recogniser gives), near (the same
        within ``NEAR_NS``), said (robots to which it gives the code), right (share of those to which at least
        one labeller gives it).
    """
    rows = labels.join(said, on=ROW).join(moments.select("moment", "use"), on="moment")
    codes = sorted({*rows["a"], *rows["b"], *rows["before"], *rows["now"]} - {NONE})
    out = []
    for (use,), part in rows.group_by("use", maintain_order=True):
        for code in codes:
            both = part.filter(pl.col("a") == code, pl.col("b") == code)
            row: dict[str, object] = {
                "use": use, "code": code, "both": both.height,
                "kept_a": _share(both.height, part.filter(pl.col("a") == code).height)}
            for when in ("before", "now"):
                given = part.filter(pl.col(when) == code)
                right = given.filter((pl.col("a") == code) | (pl.col("b") == code))
                close = both.filter(pl.col(f"near_{when}").str.split(" ").list.contains(str(code)))
                row[f"near_{when}"] = _share(close.height, both.height)
                row[f"found_{when}"] = _share(both.filter(pl.col(when) == code).height, both.height)
                row[f"said_{when}"] = given.height
                row[f"right_{when}"] = _share(right.height, given.height)
            out.append(row)
    return pl.DataFrame(out, infer_schema_length=None).sort("use", "code")


def _share(part: int, whole: int) -> float | None:
    return round(part / whole, 3) if whole else None
