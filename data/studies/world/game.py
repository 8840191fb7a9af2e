"""The game that is played here beside recorded ones: goals, fouls, time in play, and speeds.

``make world`` (under five minutes) writes ``game.csv``. RECORDINGS is a folder of further recordings, which
are read and not copied; those that are absent are left out. Played and recorded matches go the same way: they
are read as logs, and the stage trajectories measures them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from harness import INSPER, RCSS, RSIM, SSL, elsewhere, logged, read, recordings, workers

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import Marks, RefereeSettings
from pitchlore.pipeline.arena.teams.table import TeamKind
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.derive import trajectories

PAIRINGS: tuple[tuple[TeamKind, TeamKind], ...] = (
    ("static", "static"), ("static", "human-like"), ("human-like", "human-like"), ("static", "random"),
    ("random", "random"))
#: Laws of the referee: the league's, and those of the first release.
LAWS = {"league": {}, "first release": {"remember_crowds": False}}
SEEDS, SECONDS = range(1, 21), 480.0
#: The recordings in words.
GAMES = {
    RSIM: "rsim, VSSS, 3 a side (the sample)", RCSS: "rcssserver, 2D, 3 a side",
    INSPER: "Insper, 2D, 11 a side", SSL: "RoboCup SSL 2025, real robots"}
#: Restarts after fouls, by the letters of their note.
FOULS = ("freeball", "penalty", "goalkick")
#: Percentile of the speeds beside their mean.
_PERCENTILE = 95


class Seen(NamedTuple):
    """Measures of a match.

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
        for note in events.filter(pl.col("event") == "fault")["note"]]
    fouls = [sum(note.startswith(kind) for note in notes) for kind in FOULS]
    return Seen(
        float(steps["t_ns"].sum()) / 60e9, float(within["t_ns"].sum()) / 60e9,
        int((events["event"] == "goal").sum()),
        int(events["note"].str.contains("goal annulled").sum()), (*fouls, len(notes) - sum(fouls)),
        speeds.filter(pl.col("team") == "ball")["speed"].to_numpy(),
        speeds.filter(pl.col("team") != "ball")["speed"].to_numpy(),
        inside.to_numpy().mean() if len(inside) else 0.0)


def played(home: TeamKind, away: TeamKind, laws: str, seed: int) -> Seen:
    """Play a match, log it, read the log, and measure it."""
    referee = RefereeSettings(duration_s=SECONDS, **LAWS[laws])
    recipe = Recipe(home=TeamSettings(kind=home), away=TeamSettings(kind=away), seed=seed, referee=referee)
    return seen(matches.read(logged(recipe), where=recipe.match_id))


def recorded(path: Path) -> Seen:
    """Import a recording, and measure it."""
    return seen(read(path))


def row(game: str, laws: str, all_seen: Iterable[Seen]) -> dict[str, object]:
    """The mean of some matches: numbers a minute are of all their time, speeds of all samples in play."""
    of = list(all_seen)
    minutes = sum(match.minutes for match in of)
    low, high = mean_interval([match.goals / match.minutes for match in of]) or (None, None)
    fouls = np.sum([match.fouls for match in of], axis=0) / minutes
    ball, robots = (np.concatenate([getattr(match, body) for match in of]) for body in ("ball", "robots"))
    numbers = {
        "goals_a_minute": sum(match.goals for match in of) / minutes,
        "goals_low": low,
        "goals_high": high,
        "annulled_a_minute": sum(match.annulled for match in of) / minutes,
        "in_play": sum(match.in_play for match in of) / minutes,
        **{
            f"{kind}_a_minute": value
            for kind, value in zip(("free_ball", "penalty", "goal_kick", "other_restart"), fouls, strict=True)
        },
        "ball_speed": ball.mean(),
        "ball_speed_95": np.percentile(ball, _PERCENTILE),
        "robot_speed": robots.mean(),
        "robot_speed_95": np.percentile(robots, _PERCENTILE),
        "ball_in_areas": sum(match.areas * match.in_play for match in of)
        / sum(match.in_play for match in of),
    }
    return {"game": game, "laws": laws, "matches": len(of), "minutes": round(minutes, 1)} | {
        name: None if value is None else round(float(value), 3) for name, value in numbers.items()}


def main(out: Path, folder: Path, seeds: Sequence[int] = SEEDS) -> None:
    """Write the table into a folder: recordings first, then each pairing under each laws."""
    there = recordings(folder, GAMES)
    with workers() as pool:
        rows = [row(GAMES[name], "as recorded", [look])
                for name, look in zip(there, pool.map(recorded, there.values()), strict=True)]
        for home, away in PAIRINGS:
            for laws in LAWS:
                looks = pool.map(played, *zip(*((home, away, laws, seed) for seed in seeds), strict=True))
                rows.append(row(f"{home} against {away}", laws, looks))
    pl.DataFrame(rows, infer_schema_length=None).write_csv(out / "game.csv")


if __name__ == "__main__":
    main(Path(__file__).parent, elsewhere())
