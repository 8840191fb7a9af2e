"""Do values predict what comes? V, and the values of behaviours, on played matches and on recordings.

``make study-values`` (a quarter of an hour; what was stopped goes on after the last whole game) plays four
pairings and reads the recordings, and writes ``models.csv``, ``calibration.csv``, ``halves.csv`` and
``increment.csv``; the README beside them says what each shows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from harness import elsewhere, going_on, logged, recordings, workers
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import log_loss, roc_auc_score
from threadpoolctl import threadpool_limits

from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.table import TeamKind
from pitchlore.pipeline.importers import readers
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.numbers import trees
from pitchlore.pipeline.settings import (
    GoalSettings,
    GramSettings,
    ModelSettings,
    MomentSettings,
    SituationSettings,
    TrajectorySettings,
    ValueSettings,
)
from pitchlore.pipeline.stages.behaviours.grams import grams, merge, spelt
from pitchlore.pipeline.stages.behaviours.shrinkage import valued
from pitchlore.pipeline.stages.goals import attribute
from pitchlore.pipeline.stages.sequences.derive import value
from pitchlore.pipeline.stages.sequences.follows import followed
from pitchlore.pipeline.stages.sequences.windows import codes_of, keys_of, role_of
from pitchlore.pipeline.stages.situations.recognise import recognise
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.stages.values import models
from pitchlore.pipeline.stages.values.fitting import fit, grow
from pitchlore.pipeline.stages.values.moments import moments
from pitchlore.pipeline.stages.values.worths import values, worths

#: Pairings and the first seed; no choice was made on these seeds.
PAIRINGS: tuple[tuple[TeamKind, TeamKind], ...] = (
    ("static", "static"), ("human-like", "human-like"), ("static", "human-like"), ("static", "random"))
FIRST_SEED, MATCHES, SECONDS = 7001, 40, 480.0
#: Instances that a gram needs in both halves.
SUPPORT = 10
#: Models of a report that a row has figures of.
MODELS = ("logistic", "boosting", "actions", "cells", "ball", "ball_x", "rate")
#: Resamples of the bootstrap by match.
RESAMPLES = 200
#: Deals of the values for the control.
_DEALS = 20
#: A gram's value counts like so many instances of value 0 more, in the prediction.
_DOUBT = 20
_FOLDS = 5
#: Situations at the ball: with it, guides, kicks, loses, yields, leaves, reaches, receives it, is hit by it.
_AT_BALL = (1, 11, 21, 22, 23, 33, 44, 45, 47)
_EDGES = (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)


@dataclass(frozen=True)
class Watched:
    """One match as tables; ``situations`` have the columns value and target by the next goal."""

    moments: pl.DataFrame
    situations: pl.DataFrame
    referee: pl.DataFrame
    trajectories: pl.DataFrame


def watch(data: bytes, name: str) -> Watched:
    """The tables of a log or recording."""
    log = readers.read(readers.open_source(data, name), TrackingMap())
    table, _ = trajectories(log, TrajectorySettings())
    found = recognise(table, log.info.pitch, SituationSettings())
    goals = attribute(log.referee, table, found, log.info.pitch, GoalSettings())
    return Watched(
        moments(table, log.referee, log.info.pitch, MomentSettings()), value(found, goals, GramSettings()),
        log.referee, table.filter(pl.col("segment").is_not_null()).select(
            "team", "robot", "t_ns", "x", "y", "segment"),
    )


def played(job: tuple[TeamKind, TeamKind, int]) -> Watched:
    """The tables of a match under the league's laws: home, away, seed."""
    home, away, seed = job
    recipe = Recipe(home=TeamSettings(kind=home), away=TeamSettings(kind=away), seed=seed,
                    referee=RefereeSettings(duration_s=SECONDS))
    return watch(logged(recipe), f"{home}-{away}-{seed}.mcap")


def chances(parts: list[Watched]) -> tuple[pl.DataFrame, dict[str, object]]:
    """Each moment with the chance that models of other matches give it, and the models' report."""
    every = pl.concat(part.moments for part in parts)
    found, report = fit(every, ModelSettings(), models.shipped())
    if found is None:
        return every.clear().with_columns(chance=pl.lit(0.0)), report
    return every.with_columns(pl.Series("chance", found.chances(every))), report


def by_cell(parts: list[Watched]) -> dict[str, float] | None:
    """The chance by the ball's cell, of 16 by 12 as in expected threat (Singh 2018), cross-fitted."""
    _, features, scores, fold = _known(parts)
    cell = np.clip((features[:, 0] + 1) * 8, 0, 15).astype(int) * 12 + np.clip(
        features[:, 1] * 12, 0, 11).astype(int)
    chance = np.empty(len(scores))
    for f in range(_FOLDS):
        own = fold == f
        if not own.any():
            continue
        count, total = (np.bincount(cell[~own], weights=w, minlength=192) for w in (None, scores[~own]))
        chance[own] = ((total + scores[~own].mean()) / (count + 1))[cell[own]]
    return _of(scores, chance)


def by_actions(parts: list[Watched]) -> dict[str, float] | None:
    """The chance by the last three situations at the ball and their places: VAEP's, cross-fitted.

    VAEP (Decroos et al. 2019) describes a moment by the last three actions: what they were, whose, where and
    when. Actions are here the situations at the ball that are over, with the ball's place.
    """
    _, features, scores, fold = _known(parts)
    table = np.concatenate([features[:, :4], np.concatenate([_actions(part) for part in parts])], axis=1)
    chance = np.empty(len(scores))
    for f in range(_FOLDS):
        own = fold == f
        if own.any():
            grown = grow(table[~own].astype(np.float32), scores[~own], ModelSettings())
            chance[own] = 1 / (1 + np.exp(-trees.logits(grown, table[own].astype(np.float32))))
    return _of(scores, chance)


def _known(parts: list[Watched]) -> tuple[pl.DataFrame, np.ndarray, np.ndarray, np.ndarray]:
    """Moments with a known outcome, a second apart: rows, features, outcomes, folds (matches or minutes)."""
    seen = pl.concat(_apart(part) for part in parts)
    names = {name: i for i, name in enumerate(seen["match_id"].unique(maintain_order=True))}
    match = np.array([names[name] for name in seen["match_id"]])
    number = match if len(names) >= _FOLDS else match + seen["t_ns"].to_numpy() // 60_000_000_000
    return seen, seen["features"].to_numpy(), seen["scores"].to_numpy(), number % _FOLDS


def _apart(part: Watched) -> pl.DataFrame:
    second = pl.col("t_ns") // 1_000_000_000
    known = part.moments.filter(pl.col("scores").is_not_null())
    return known.filter((second != second.shift()).over("team").fill_null(value=True))


def _actions(part: Watched) -> np.ndarray:
    """Code, team (own 1, theirs 0), place along and across, age of the last three situations at the ball."""
    seen = _apart(part)
    done = part.situations.filter(pl.col("code").is_in(_AT_BALL)).sort("end_ns")
    found = np.full((seen.height, 15), np.nan)
    t_ns, own = seen["t_ns"].to_numpy(), seen["team"].cast(pl.String).to_numpy()
    end, segment = done["end_ns"].to_numpy(), done["segment"].to_numpy()
    code, team = done["code"].to_numpy(), done["team"].cast(pl.String).to_numpy()
    ball = part.moments.filter(pl.col("team") == "home").sort("t_ns")
    place = np.searchsorted(ball["t_ns"].to_numpy(), end).clip(max=ball.height - 1)
    x, y = (ball["features"].to_numpy()[place, i] for i in (0, 1))
    last = np.searchsorted(end, t_ns, side="right") - 1
    for back in range(3):
        row = last - back
        there = (
            (row >= 0) & (segment[np.maximum(row, 0)] == seen["segment"].to_numpy()) if len(end)
            else row > np.inf)
        at = np.maximum(row, 0)[there]
        mine = team[at] == own[there]
        side = np.where(own[there] == "home", 1.0, -1.0)
        found[there, 5 * back:5 * back + 5] = np.stack(
            [code[at], mine, side * x[at], y[at], (t_ns[there] - end[at]) / 1e9], axis=1)
    return found


def _of(scores: np.ndarray, chance: np.ndarray) -> dict[str, float] | None:
    if not (scores.any() and not scores.all()):
        return None
    return {
        "log_loss": round(float(log_loss(scores, chance)), 5),
        "auc": round(float(roc_auc_score(scores, chance)), 4)}


def figures(known: pl.DataFrame) -> dict[str, object]:
    """AUC of chances, with an interval by bootstrap over matches (over minutes if there is one match)."""
    unit = (pl.struct("match_id", pl.col("t_ns") // 60_000_000_000) if known["match_id"].n_unique() == 1
            else pl.col("match_id"))
    groups = [part for _, part in known.group_by(unit, maintain_order=True)]
    scores = [(part["scores"].to_numpy(), part["chance"].to_numpy()) for part in groups]
    low, high = interval(len(scores), lambda drawn: float(roc_auc_score(
        np.concatenate([scores[i][0] for i in drawn]), np.concatenate([scores[i][1] for i in drawn]))))
    return {"auc": round(float(roc_auc_score(known["scores"], known["chance"])), 4),
            "low": round(low, 4), "high": round(high, 4)}


def interval(count: int, measure: Callable[[np.ndarray], float]) -> tuple[float, float]:
    """95 % interval of a measure of ``count`` units by bootstrap."""
    rng = np.random.default_rng(0)
    found = [measure(rng.integers(0, count, count)) for _ in range(RESAMPLES)]
    return float(np.quantile(found, 0.025)), float(np.quantile(found, 0.975))


def calibration(known: pl.DataFrame) -> pl.DataFrame:
    """Observed share of scoring soon where the chance is in each interval [from, to)."""
    return (
        known.with_columns(bin=pl.Series(np.digitize(known["chance"].to_numpy(), _EDGES[1:-1])))
        .group_by("bin")
        .agg(
            moments=pl.len(), chance=pl.col("chance").mean().round(4), scores=pl.col("scores").mean().round(4)
        )
        .sort("bin")
        .with_columns(
            pl.Series("from", [_EDGES[b] for b in range(len(_EDGES) - 1)])[
                pl.Series(sorted(set(np.digitize(known["chance"].to_numpy(), _EDGES[1:-1]).tolist())))]
        )
        .select("from", "moments", "chance", "scores")
    )


def changed(parts: list[Watched], own: models.Models) -> list[pl.DataFrame]:
    """The situations of each match with what they change of the V of some models."""
    found = []
    for part in parts:
        table = values(part.moments, own)
        worth = worths(part.situations.drop("value"), table, part.referee, part.trajectories, ValueSettings())
        found.append(part.situations.hstack(worth.select("change", "x", "y")))
    return found


def counted(parts: Iterable[pl.DataFrame], n: int, outcome: str) -> pl.DataFrame:
    """The grams of one length of all sides, each side of a match by itself, with their estimated values."""
    found = []
    for part in parts:
        sequence = followed(part, GramSettings().gap_s).with_columns(
            who=pl.col("team").to_physical().cast(pl.Int64))
        if outcome == "paper":
            sequence = sequence.with_columns(change=pl.lit(None, dtype=pl.Float64))
        of_sides = grams(sequence, n)
        key = of_sides["key"].to_numpy()
        found.append(of_sides.with_columns(key=keys_of(role_of(key), codes_of(key, n))))
    return valued(spelt(merge(found), n), shrink=True)


def learned_apart(split: list[list[Watched]]) -> list[list[pl.DataFrame]] | None:
    """The situations of each half of the matches, by models of its own; None if a half has too few goals."""
    found = []
    for half in split:
        fitted, _ = fit(pl.concat(part.moments for part in half), ModelSettings(), models.shipped())
        if fitted is None:
            return None
        found.append(changed(half, fitted))
    return found


def halves(pairing: str, situations: list[list[pl.DataFrame]]) -> list[dict[str, object]]:
    """Correlation of values between the halves of the matches, each with models of its own."""
    rng, rows = np.random.default_rng(0), []
    shuffled = [[part.with_columns(pl.Series("change", rng.permutation(part["change"].to_numpy())))
                 for part in half] for half in situations]
    for n in (1, 2, 3, 4):
        row: dict[str, object] = {"game": pairing, "n": n}
        for name, source, outcome, columns in (
            ("change", situations, "change", ("mean", "mean")),
            ("shrunk", situations, "change", ("value", "value")),
            ("family", situations, "change", ("family", "mean")),
            ("paper", situations, "paper", ("mean", "mean")),
            ("shuffled", shuffled, "change", ("mean", "mean")),
        ):
            one, two = (counted(half, n, outcome).filter(pl.col("count") >= SUPPORT) for half in source)
            both = one.join(two, on=("role", "codes"), suffix="_two")
            row["grams"] = both.height
            if both.height > 2:
                pair = both[columns[0]].to_numpy(), both[f"{columns[1]}_two"].to_numpy()
                row[name] = round(float(np.corrcoef(*pair)[0, 1]), 3) if min(map(np.std, pair)) > 0 else None
        rows.append(row)
    return rows


def increment(
    pairing: str, split: list[list[Watched]], situations: list[list[pl.DataFrame]]
) -> list[dict[str, object]]:
    """Gains by the robots' situations beside the ball's model, learned on one half and asked on the other.

    The control deals the values out anew among the codes: mean, least and greatest gain of several deals.
    """
    rows = []
    for outcome in ("change", "paper"):
        for known in ("under way", "over"):
            asked = [_asked(split, situations, k, outcome, known) for k in (0, 1)]
            ball, both, scores, match = (
                np.concatenate([half[i] for half in asked]) for i in range(4))
            auc = _gain(scores, both, ball, match)
            rows.append(
                {
                    "game": pairing, "outcome": outcome, "situations": known,
                    "ball": round(roc_auc_score(scores, ball), 4),
                    "both": round(roc_auc_score(scores, both), 4), "gain_low": round(auc[0], 5),
                    "gain_high": round(auc[1], 5), "log_loss_ball": round(log_loss(scores, ball), 5),
                    "log_loss_both": round(log_loss(scores, both), 5)}
            )
        deals = []
        for deal in range(_DEALS):
            asked = [_asked(split, situations, k, outcome, "under way", deal) for k in (0, 1)]
            ball, both, scores, _ = (np.concatenate([half[i] for half in asked]) for i in range(4))
            deals.append((roc_auc_score(scores, ball), roc_auc_score(scores, both),
                          log_loss(scores, ball), log_loss(scores, both)))
        alone, with_it, loss, loss_with = np.array(deals).T
        rows.append({
            "game": pairing, "outcome": outcome, "situations": "shuffled", "ball": round(alone.mean(), 4),
            "both": round(with_it.mean(), 4), "gain_low": round((with_it - alone).min(), 5),
            "gain_high": round((with_it - alone).max(), 5), "log_loss_ball": round(loss.mean(), 5),
            "log_loss_both": round(loss_with.mean(), 5)})
    return rows


def _gain(scores: np.ndarray, both: np.ndarray, ball: np.ndarray, match: np.ndarray) -> tuple[float, float]:
    """95 % interval of the AUC of ``both`` above that of ``ball``, by bootstrap over matches."""
    units = [np.flatnonzero(match == each) for each in np.unique(match)]

    def gain(drawn: np.ndarray) -> float:
        rows = np.concatenate([units[i] for i in drawn])
        return float(roc_auc_score(scores[rows], both[rows]) - roc_auc_score(scores[rows], ball[rows]))

    return interval(len(units), gain)


def _asked(
    split: list[list[Watched]], situations: list[list[pl.DataFrame]], k: int, outcome: str, known: str,
    deal: int | None = None,
) -> tuple[np.ndarray, ...]:
    """Chances by the ball and by ball and situations in half k, learned in the other; outcomes; matches.

    With a ``deal``, the values are dealt out anew among the codes.
    """
    column = "change" if outcome == "change" else "value"
    learned = pl.concat(situations[1 - k]).group_by("role", "code").agg(
        worth=pl.col(column).sum() / (pl.len() + _DOUBT)).sort("role", "code")
    if deal is not None:
        order = np.random.default_rng(deal).permutation(learned.height)
        learned = learned.with_columns(learned["worth"][order])
    tables = [
        [_looked(part, table, learned, known, number) for number, (part, table) in enumerate(
            zip(split[half], situations[half], strict=True))]
        for half in (1 - k, k)
    ]
    (ball, extra, scores, _), (ball_k, extra_k, scores_k, match) = (
        tuple(np.concatenate([part[i] for part in half]) for i in range(4)) for half in tables)
    with threadpool_limits(1):  # type: ignore[no-untyped-call]
        plain, full = (LogisticRegression(max_iter=1000).fit(table, scores)  # type: ignore[no-untyped-call]
                       for table in (ball, np.c_[ball, extra]))
    return (plain.predict_proba(ball_k)[:, 1], full.predict_proba(np.c_[ball_k, extra_k])[:, 1], scores_k,
            match + 1000 * k)


def _looked(
    part: Watched, table: pl.DataFrame, learned: pl.DataFrame, known: str, number: int
) -> tuple[np.ndarray, ...]:
    """Ball's features, worths of both teams' situations, outcome and match of each known moment."""
    seen = part.moments.filter(pl.col("scores").is_not_null())
    worth = table.join(learned, on=("role", "code"), how="left").with_columns(pl.col("worth").fill_null(0.0))
    extra = np.zeros((seen.height, 2))
    t_ns, team = seen["t_ns"].to_numpy(), seen["team"].cast(pl.String).to_numpy()
    for (side, _), own in worth.group_by("team", "robot", maintain_order=True):
        start, end, its = (own.sort("start_ns")[name].to_numpy() for name in ("start_ns", "end_ns", "worth"))
        if known == "over":  # the last that was over, at most a second ago
            row = np.searchsorted(end, t_ns, side="right") - 1
            there = (row >= 0) & (t_ns - end[np.maximum(row, 0)] < 1_000_000_000)
        else:
            row = np.searchsorted(start, t_ns, side="right") - 1
            there = (row >= 0) & (t_ns < end[np.maximum(row, 0)])
        add = np.where(there, its[np.maximum(row, 0)], 0.0) * _DOUBT
        extra[:, 0] += np.where(team == side, add, 0.0)
        extra[:, 1] += np.where(team != side, add, 0.0)
    ball = seen["features"].to_numpy()[:, :8].astype(np.float64)
    return ball, extra, seen["scores"].to_numpy(), np.full(seen.height, number)


def judged(game: str, parts: list[Watched]) -> dict[str, list[dict[str, object]]]:
    """The rows of a game in each table of the study."""
    seen, report = chances(parts)
    known = seen.filter(pl.col("scores").is_not_null())
    row: dict[str, object] = {"game": game, **{name: report[name] for name in ("matches", "goals", "kind")}}
    rows: dict[str, list[dict[str, object]]] = {
        "models": [row], "calibration": [], "halves": [], "increment": []}
    if report["kind"] is not None:
        row |= figures(known)
        report |= {"cells": by_cell(parts), "actions": by_actions(parts)}
        row |= {f"{name}_{what}": of[what] for name in MODELS if isinstance(of := report.get(name), dict)
                for what in ("auc", "log_loss")}
        rows["calibration"] = calibration(known).select(pl.lit(game).alias("game"), pl.all()).to_dicts()
    split = [parts[0::2], parts[1::2]]
    situations = learned_apart(split) if len(parts) > 1 else None
    if situations is not None:
        rows["halves"], rows["increment"] = halves(game, situations), increment(game, split, situations)
    print(game, row, flush=True)
    return rows


def main(out: Path, folder: Path, matches: int = MATCHES) -> None:
    """Write the study's tables: the pairings, then the recordings."""
    with workers() as pool, going_on(out, __file__) as parts:
        def pairing(job: tuple[TeamKind, TeamKind]) -> dict[str, list[dict[str, object]]]:
            jobs = [(*job, FIRST_SEED + i) for i in range(matches)]
            return judged(" - ".join(job), list(pool.map(played, jobs, chunksize=5)))

        def recording(path: str) -> dict[str, list[dict[str, object]]]:
            return judged(Path(path).name, [watch(Path(path).read_bytes(), Path(path).name)])

        found = [*parts(PAIRINGS, pairing), *parts(map(str, recordings(folder).values()), recording)]
        for name in found[0]:
            rows = [row for game in found for row in game[name]]
            pl.DataFrame(rows, infer_schema_length=None).write_csv(out / f"{name}.csv")


if __name__ == "__main__":
    main(Path(__file__).parent, elsewhere())
