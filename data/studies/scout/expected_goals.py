"""Shots beside their expected goals: they become goals as often as these say, or not.

``make expected-goals`` (five minutes). RECORDINGS is a folder of further recordings.

The matches of :mod:`scout.teams_apart` are played and become chances as in any data folder, but that all are
in the fit. A shot's xG is of a model without its match. Beside it, without the same match: the distance
alone, the rate of the other matches, and the model of goals that were dealt out anew among the shots (mean of
twenty deals). Features were chosen on other matches: seeds 501,000 to 505,011 of the same teams, by log-loss
without the match. They were chosen twice: shots that the first ones held for chances of .15 to .35 became
goals in 103 of 284 cases here. Then recordings are read; a league with fewer than 30 goals has no xG.
``xg.csv`` has a row for each, ``xg-calibration.csv`` the shots by their xG. Intervals of observed over
expected goals are 95 %, by bootstrap over matches; for one match, over shots.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import polars as pl
from harness import command, elsewhere, recordings
from scout.teams_apart import MATCHES, play

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import ModelSettings
from pitchlore.pipeline.stages.values.chances import FEATURES, shot_features
from pitchlore.pipeline.stages.values.shooting import CONTROLS, figures, left_out
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Chances, Shots

#: Deals of the goals, and resamples of the bootstrap.
DEALS, RESAMPLES = 20, 2000
#: Bins of xG, each from its edge on.
EDGES = (0.0, 0.05, 0.15, 0.35, 0.7)
#: All matches are in the fit.
_SETTINGS = "[models]\nmatches_at_most = 1000\n"
_PLAYED = "five teams against static"


def shots_of(store: Store) -> pl.DataFrame:
    """All shots of a data folder: features, xG and what it rests on, whether they were goals, home, kind."""
    found = []
    for match in store.receipts("matches"):
        events, made = store.receipt("events", match.name), store.receipt("chances", match.name)
        assert events is not None
        assert made is not None
        shots = store.read_table(events, "shots", Shots)
        chances = store.read_table(made, "chances", Chances)
        pitch = Pitch.model_validate(match.details["pitch"])
        found.append(
            chances.with_columns(
                pl.Series("features", shot_features(shots, pitch), dtype=pl.Array(pl.Float64, len(FEATURES))),
                scored=shots["outcome"] == "goal", home=pl.lit(str(match.details["home"])),
                kind=pl.lit(pitch.kind.value))
        )
    return pl.concat(found)


def observed(scored: np.ndarray, chances: np.ndarray, match: np.ndarray) -> dict[str, float]:
    """Observed over expected goals with its interval."""
    rng = np.random.default_rng(0)
    unit = match if len(np.unique(match)) > 1 else np.arange(len(match))
    _, unit = np.unique(unit, return_inverse=True)
    goals, expected = (np.bincount(unit, weights=each) for each in (scored, chances))
    drawn = rng.integers(0, len(goals), (RESAMPLES, len(goals)))
    low, high = np.quantile(goals[drawn].sum(axis=1) / expected[drawn].sum(axis=1), (0.025, 0.975))
    return {"observed_over_expected": round(float(goals.sum() / expected.sum()), 3),
            "low": round(float(low), 3), "high": round(float(high), 3)}


def judged(
    game: str, model: str, scored: np.ndarray, chances: np.ndarray, match: np.ndarray
) -> dict[str, object]:
    """A row of ``xg.csv``."""
    return {"game": game, "model": model, "matches": len(np.unique(match)), "shots": len(scored),
            "goals": int(scored.sum()), **figures(scored, chances), **observed(scored, chances, match)}


def of_played(shots: pl.DataFrame) -> Iterator[dict[str, object]]:
    """The rows of the played matches: the model, plainer ones, the control, each team's matches."""
    penalty, (scored, xg, features) = ModelSettings().penalty, (
        shots[name].to_numpy() for name in ("scored", "xg", "features"))
    match = np.unique(shots["match_id"].to_numpy(), return_inverse=True)[1]
    yield judged(_PLAYED, "xg", scored, xg, match)
    for name, places in CONTROLS.items():
        yield judged(_PLAYED, name, scored, left_out(features, scored, match, places, penalty), match)
    rng, rows = np.random.default_rng(0), []
    for _ in range(DEALS):
        dealt = rng.permutation(scored)
        rows.append(judged(_PLAYED, "xg of shuffled goals", dealt,
                           left_out(features, dealt, match, range(len(FEATURES)), penalty), match))
    numbers = {name for name, value in rows[0].items() if isinstance(value, float)}
    yield rows[0] | {name: round(float(np.mean([row[name] for row in rows])), 5) for name in numbers}
    for home in sorted(shots["home"].unique()):  # both teams that repeat a situation are called learned
        own = (shots["home"] == home).to_numpy()
        yield judged(f"{home} against static", "xg", scored[own], xg[own], match[own])


def of_recording(name: str, league: pl.DataFrame, own: pl.DataFrame) -> Iterator[dict[str, object]]:
    """The rows of a recording: the model and plainer ones of the other matches of its league."""
    there = (league["match_id"] == own["match_id"][0]).to_numpy()
    features, scored = league["features"].to_numpy(), league["scored"].to_numpy()
    match = np.unique(league["match_id"].to_numpy(), return_inverse=True)[1]
    yield judged(
        name, "xg of the played matches", scored[there], league["xg"].to_numpy()[there], match[there])
    for control, places in CONTROLS.items():
        chances = left_out(features, scored, match, places, ModelSettings().penalty)
        yield judged(name, f"{control} of the played matches", scored[there], chances[there], match[there])


def bins(game: str, shots: pl.DataFrame) -> pl.DataFrame:
    """Shots by their xG: how many, and the goals that were expected and observed."""
    return (
        shots.with_columns(
            at_least=pl.lit(np.array(EDGES)[np.searchsorted(EDGES, shots["xg"], side="right") - 1]))
        .group_by("at_least")
        .agg(shots=pl.len(), expected=pl.col("xg").sum().round(1), goals=pl.col("scored").sum())
        .sort("at_least")
        .select(game=pl.lit(game), xg_at_least="at_least", shots="shots", expected="expected", goals="goals")
    )


def main(out: Path, folder: Path, matches: int = MATCHES) -> None:
    """Play, read, judge, and write the tables."""
    with tempfile.TemporaryDirectory(prefix="pitchlore-xg-") as data:
        settings = Path(data, "settings.toml")
        settings.write_text(_SETTINGS)
        play(data, matches)
        command("run", "--no-train", "--settings", settings, "--data", data)
        shots = shots_of(Store(Path(data)))
        rows, tables = list(of_played(shots)), [bins(_PLAYED, shots)]
        for name, path in recordings(folder).items():
            before = set(shots["match_id"])
            command("import", path, "--data", data)
            command("run", "--no-train", "--settings", settings, "--data", data)
            shots = shots_of(Store(Path(data)))
            own = shots.filter(~pl.col("match_id").is_in(list(before)))
            if own["xg"].null_count() == own.height:
                rows.append({"game": name, "model": "none", "matches": 1, "shots": own.height,
                             "goals": int(own["scored"].sum())})
                continue
            rows += of_recording(name, shots.filter(pl.col("kind") == own["kind"][0]), own)
            tables.append(bins(name, own))
    pl.DataFrame(rows, infer_schema_length=None).write_csv(out / "xg.csv")
    pl.concat(tables).write_csv(out / "xg-calibration.csv")
    print(pl.DataFrame(rows, infer_schema_length=None), pl.concat(tables))


if __name__ == "__main__":
    main(Path(__file__).parent, elsewhere())
