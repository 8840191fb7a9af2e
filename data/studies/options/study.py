"""Is what is recovered what was done? Executed options against recovered ones, of teams not used before.

``make study-options`` (an hour on 2 cores) plays seasons of apprentices, and matches of what they learned
against static, and writes ``kappa.csv``. Seasons go on where they stopped.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from harness import ROOT, logged, seasons, workers
from options.alike import classes
from options.dealt import NOISY, thinned

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.camera import CameraSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.settings import OptionSettings, SituationSettings, TrajectorySettings
from pitchlore.pipeline.stages.options.likelihood import shipped_ratios
from pitchlore.pipeline.stages.options.recover import options
from pitchlore.pipeline.stages.situations.recognise import recognise
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.store import Store
from pitchlore.schemas.options import OPTIONS

#: Seasons whose apprentices are looked at, by settings and seed; written down before any of them was played.
SEASONS = (("looking-held", 4301), ("looking-held", 4302), ("looking-all", 4303), ("looking", 4304))
TEAMS = tuple(f"{name}-static-{seed}" for name, seed in SEASONS)
#: Matches of each, with and without a camera's noise; their length; their first seed.
MATCHES, SECONDS, _FIRST_SEED = 8, 480.0, 4_300_000
FOLDER = Path(__file__).parent


class Seen(NamedTuple):
    """Decisions of a match: what was executed, recovered, recognised, as indices in OPTIONS, -1 for none."""

    executed: I64
    recovered: I64
    recognised: I64


def kappa(one: I64, other: I64) -> float:
    """Cohen's kappa of two labels of the same things (Cohen 1960)."""
    size = int(max(one.max(initial=0), other.max(initial=0))) + 1
    shares = [np.bincount(each, minlength=size) / max(len(each), 1) for each in (one, other)]
    chance = float(shares[0] @ shares[1])
    return (float((one == other).mean()) - chance) / (1 - chance)


def seen(log: MatchLog, settings: OptionSettings = OptionSettings()) -> Seen:  # noqa: B008 (frozen)
    """Look at the decisions that the match's teams logged; options are recovered by ``settings``."""
    table, _ = trajectories(log, TrajectorySettings())
    place = {code: index for index, code in enumerate(OPTIONS)}
    made = log.decisions.filter("chosen").select(
        pl.col("team").cast(pl.String), pl.col("robot").cast(pl.Int16),
        middle=(pl.col("t_ns") + pl.min_horizontal("end_ns", pl.col("t_ns") + 200_000_000)) // 2,
        code=pl.col("behaviour_id").str.split("-").list.last().cast(pl.Int16),
    ).drop_nulls("code").sort("middle")
    found = [made["code"]]
    trees = shipped_ratios(settings.robots)
    for rows, code in ((options(table, log.info.pitch, settings, trees)[0], "option"),
                       (recognise(table, log.info.pitch, SituationSettings()), "code")):
        spans = rows.select(
            pl.col("team").cast(pl.String), pl.col("robot").cast(pl.Int16), "start_ns", "end_ns",
            said=pl.col(code)).sort("start_ns")
        joined = made.join_asof(spans, left_on="middle", right_on="start_ns", by=["team", "robot"],
                                check_sortedness=False)
        found.append(joined.select(pl.when(pl.col("end_ns") > pl.col("middle")).then("said"))["said"])
    return Seen(*(np.array([place.get(code, -1) for code in each]) for each in found))


class Job(NamedTuple):
    """A match that is looked at: the team's data folder and word, the camera, the seed, seconds."""

    data: Path
    team: str
    noisy: bool
    seed: int
    seconds: float


def looked(job: Job) -> tuple[Seen, Seen]:
    """A match against static, seen at 60 and at 30 Hz."""
    policies: dict[str, PolicyTables] = {}
    team = entrant(Store(job.data), job.team, policies).settings
    recipe = Recipe(
        home=team, away=TeamSettings(kind="static"), seed=job.seed,
        camera=NOISY if job.noisy else CameraSettings(), referee=RefereeSettings(duration_s=job.seconds))
    log = matches.read(logged(recipe, policies), where=recipe.match_id)
    return seen(log), seen(thinned(log, 2))


def rows_of(team: str, noisy: bool, every: int, parts: Sequence[Seen]) -> Iterator[dict[str, object]]:
    """Rows of the table, one for all options and one for classes of them."""
    executed, recovered, recognised = (np.concatenate(each) for each in zip(*parts, strict=True))
    kept = (executed >= 0) & (recovered >= 0)
    executed, recovered, recognised = executed[kept], recovered[kept], recognised[kept]
    shuffled = np.random.default_rng(0).permutation(recovered)
    for name, group in (("31", np.arange(len(OPTIONS))), ("classes", classes())):
        said = [np.where(each < 0, -1, group[each]) + 1
                for each in (executed, recovered, recognised, shuffled)]
        yield {
            "team": team, "camera": "noisy" if noisy else "exact", "hz": 60 // every, "options": name,
            "decisions": len(executed), "covered": round(float(kept.mean()), 3),
            "recovered": round(kappa(said[0], said[1]), 3), "recognised": round(kappa(said[0], said[2]), 3),
            "shuffled": round(kappa(said[0], said[3]), 3),
        }


def main(
    data: Path, out: Path = FOLDER / "kappa.csv", teams: Sequence[str] = TEAMS, count: int = MATCHES,
    seconds: float = SECONDS,
) -> None:  # fmt: skip
    """Play the matches of teams, and write the table."""
    rows: list[dict[str, object]] = []
    with workers() as pool:
        for team in teams:
            for noisy in (False, True):
                jobs = [Job(data, team, noisy, _FIRST_SEED + i, seconds) for i in range(count)]
                parts = list(pool.map(looked, jobs))
                for every, of_rate in zip((1, 2), zip(*parts, strict=True), strict=True):
                    rows += rows_of(team, noisy, every, of_rate)
                pl.DataFrame(rows).write_csv(out)
    print(pl.DataFrame(rows))


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "data" / "options"
    for settings, season in SEASONS:
        seasons(settings, [season], folder)
    main(folder)
