"""The game that is played here beside recorded ones: goals, fouls, time in play, and speeds.

``PYTHONPATH=tests python -m studies.game data/studies/world/game.csv [FOLDER]`` (under five minutes). FOLDER
has further recordings, which are read and not copied; those that are absent are left out. Played and recorded
matches go the same way: they are read as logs, and the stage trajectories measures them.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from support.played import logged

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamKind, TeamSettings
from pitchlore.pipeline.arena.physics.laws import Marks, RefereeSettings
from pitchlore.pipeline.importers import readers
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.trajectories.derive import trajectories

PAIRINGS: tuple[tuple[TeamKind, TeamKind], ...] = (
    ("static", "static"), ("static", "human-like"), ("human-like", "human-like"), ("static", "random"),
    ("random", "random"),
)
#: Laws of the referee: the league's, and those of the first release.
LAWS = {"league": RefereeSettings(), "first release": RefereeSettings(remember_crowds=False)}
SEEDS = range(1, 21)
SAMPLE = Path(__file__).parents[2] / "data" / "samples" / "rsim-vss-3v3.parquet"
#: Recordings that may be in the folder: their names here, and what they are.
OTHERS = {
    "rcssserver-3v3.rcg.gz": "rcssserver, 2D, 3 a side", "insper-2d-2022-unfinished.rcg.gz": "Insper, 2D, 11 a side",
    "ssl-2025-robocin-tigers-345s.parquet": "RoboCup SSL 2025, real robots",
}
#: Restarts after fouls, by the letters of their note.
FOULS = ("freeball", "penalty", "goalkick")
#: Percentile of the speeds beside their mean.
_PERCENTILE = 95


class Seen(NamedTuple):
    """What was measured of a match.

    Attributes:
        minutes: duration.
        in_play: minutes of play.
        goals, annulled: how many.
        fouls: restarts after fouls, by :data:`FOULS`, then others.
        ball, robots: speeds in play, m/s, float32.
        areas: share of the samples in play at which the ball is in a goal area.
    """

    minutes: float
    in_play: float
    goals: int
    annulled: int
    fouls: tuple[int, ...]
    ball: np.ndarray
    robots: np.ndarray
    areas: float


def seen(log: MatchLog) -> Seen:
    """Measure a match by its trajectories and its referee's events."""
    table, _ = trajectories(log, TrajectorySettings())
    play = table.filter(pl.col("segment").is_not_null())
    samples = table.group_by("t_ns").agg(pl.col("segment").max()).sort("t_ns")
    steps = samples.select(pl.col("t_ns").diff().shift(-1).fill_null(0), pl.col("segment"))
    # a gap in the recording is no time in play
    within = steps.filter(pl.col("segment").is_not_null(), pl.col("segment") == pl.col("segment").shift(-1))
    speeds = play.with_columns(speed=(pl.col("vx") ** 2 + pl.col("vy") ** 2).sqrt()).drop_nulls("speed")
    ball = play.filter(pl.col("team") == "ball")
    marks = Marks.of(log.info.pitch)
    inside = (ball["x"].abs() > marks.area_x) & (ball["y"].abs() < marks.area_y)
    events = log.referee.with_columns(pl.col("event").cast(pl.String), pl.col("note").fill_null(""))
    notes = [
        "".join(letter for letter in note.lower() if letter.isalpha())
        for note in events.filter(pl.col("event") == "fault")["note"]
    ]
    fouls = [sum(note.startswith(kind) for note in notes) for kind in FOULS]
    return Seen(
        steps["t_ns"].sum() / 60e9, within["t_ns"].sum() / 60e9, int((events["event"] == "goal").sum()),
        int(events["note"].str.contains("goal annulled").sum()), (*fouls, len(notes) - sum(fouls)),
        speeds.filter(pl.col("team") == "ball")["speed"].to_numpy(),
        speeds.filter(pl.col("team") != "ball")["speed"].to_numpy(), float(inside.mean() or 0.0),
    )


def played(home: TeamKind, away: TeamKind, laws: str, seed: int) -> Seen:
    """Play a match, log it, read the log, and measure it."""
    recipe = Recipe(home=TeamSettings(kind=home), away=TeamSettings(kind=away), seed=seed, referee=LAWS[laws])
    return seen(matches.read(logged(recipe), where=recipe.match_id))


def recorded(path: Path) -> Seen:
    """Import a recording, and measure it."""
    return seen(readers.read(readers.open_source(path.read_bytes(), path.name), TrackingMap()))


def row(game: str, laws: str, all_seen: Iterable[Seen]) -> dict[str, object]:
    """The mean of some matches; shares and numbers a minute are of all their time, speeds of all samples in play."""
    of = list(all_seen)
    minutes = sum(match.minutes for match in of)
    low, high = mean_interval([match.goals / match.minutes for match in of]) or (None, None)
    fouls = np.sum([match.fouls for match in of], axis=0) / minutes
    ball, robots = (np.concatenate([getattr(match, body) for match in of]) for body in ("ball", "robots"))
    numbers = {
        "goals_a_minute": sum(match.goals for match in of) / minutes, "goals_low": low, "goals_high": high,
        "annulled_a_minute": sum(match.annulled for match in of) / minutes,
        "in_play": sum(match.in_play for match in of) / minutes,
        **{f"{kind}_a_minute": value for kind, value in zip(("free_ball", "penalty", "goal_kick", "other_restart"), fouls, strict=True)},
        "ball_speed": ball.mean(), "ball_speed_95": np.percentile(ball, _PERCENTILE),
        "robot_speed": robots.mean(), "robot_speed_95": np.percentile(robots, _PERCENTILE),
        "ball_in_areas": sum(match.areas * match.in_play for match in of) / sum(match.in_play for match in of),
    }
    return {"game": game, "laws": laws, "matches": len(of), "minutes": round(minutes, 1)} | {
        name: None if value is None else round(float(value), 3) for name, value in numbers.items()
    }


def main(path: Path, folder: Path | None) -> None:
    """Write the table: recordings first, then each pairing under each laws."""
    recordings = {SAMPLE: "rsim, VSSS, 3 a side (the sample)"}
    for name, game in OTHERS.items():
        if folder is not None and (folder / name).exists():
            recordings[folder / name] = game
        else:
            print(f"left out: {game}: no {name}" + (f" in {folder}" if folder else ": no folder was given"))
    # polars' threads do not survive a fork
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        rows = [
            row(game, "as recorded", [look])
            for game, look in zip(recordings.values(), pool.map(recorded, recordings), strict=True)
        ]
        for home, away in PAIRINGS:
            for laws in LAWS:
                looks = pool.map(played, *zip(*((home, away, laws, seed) for seed in SEEDS), strict=True))
                rows.append(row(f"{home} against {away}", laws, looks))
    path.parent.mkdir(parents=True, exist_ok=True)
    pl.DataFrame(rows, infer_schema_length=None).write_csv(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 and sys.argv[2] else None)
