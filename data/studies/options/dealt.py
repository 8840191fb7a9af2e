"""Teams that deal options at random, and the windows of their matches: what the shipped ratios are fitted to.

A dealt team draws some options for each role, and lets its robots take any of them for a while. It is
nobody's team: it aims at nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import polars as pl
from harness import log_of

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.controllers import LearnedTeam, PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.camera import CameraSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.table import TeamKind
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.numbers.arrays import F32, F64, I64
from pitchlore.pipeline.settings import OptionSettings, TrajectorySettings
from pitchlore.pipeline.stages.options.robots import RobotTraits
from pitchlore.pipeline.stages.options.windows import Bodies, OptionWindows, bodies, windows_of
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import ROLES, SIDES, Appraisals, Policies
from pitchlore.schemas.options import OPTIONS

#: Options of which each role has one at least, or nobody would ever be at the ball.
_AT_BALL = (1, 11, 21, 44, 46)
#: Options of a role in a match, and seconds for which a robot stays with one.
_OF_ROLE, _HOLDS_S = 8, (0.2, 0.6, 1.0)
#: A camera as FIRASim's and grSim's.
NOISY = CameraSettings(position_noise=0.003, heading_noise=0.035)
_OPPONENTS: tuple[TeamKind, ...] = ("static", "human-like", "pressing", "counter")
#: Other options that each window is described with.
OTHERS = 4


class Job(NamedTuple):
    """A match: its seed, whether the camera is noisy, every which sample is kept, seconds."""

    seed: int
    noisy: bool
    every: int
    seconds: float


class Known(NamedTuple):
    """The windows of a team's robots that executed one option throughout.

    Attributes:
        windows: the windows.
        option: int64 [W], index in OPTIONS of what was executed.
    """

    windows: OptionWindows
    option: I64


def dealt(rng: np.random.Generator) -> LearnedTeam:
    """A team that deals options at random."""
    rows = []
    for role in ROLES:
        own = {int(rng.choice(_AT_BALL)), *rng.choice(OPTIONS, _OF_ROLE - 1, replace=False).tolist()}
        rows += [{"version": 1, "knowledge_version": 1, "role": role, "key": "role0", "state": 0,
                  "behaviour_id": f"{role}-{code:03d}", "q": 0.0, "visits": 0, "evidence": 0.0}
                 for code in sorted(own)]
    settings = TeamSettings(
        kind="learned", policy=f"dealt-{rng.integers(1 << 30)}", explore=1.0, clock_s=0.2,
        explore_s=float(rng.choice(_HOLDS_S)))
    return LearnedTeam(settings, PolicyTables(Policies.of(rows), Appraisals.empty()))


def played(job: Job, move: Callable[[MatchInPlay], None] = lambda _: None) -> MatchLog:
    """A match of a dealt team against another, or against a script; ``move`` may let other bodies move."""
    rng = np.random.default_rng([job.seed, 43])
    home, away = dealt(rng), dealt(rng)
    policies = {str(team.settings.policy): team.tables for team in (home, away)}
    other = away.settings if job.seed % 2 else TeamSettings(kind=_OPPONENTS[job.seed // 2 % len(_OPPONENTS)])
    recipe = Recipe(
        home=home.settings, away=other, seed=job.seed, camera=NOISY if job.noisy else CameraSettings(),
        referee=RefereeSettings(duration_s=job.seconds))
    match = MatchInPlay(recipe, controllers_of(recipe, policies))
    move(match)
    return thinned(matches.read(log_of(match), where=recipe.match_id), job.every)


def thinned(log: MatchLog, every: int) -> MatchLog:
    """The match as a slower camera saw it: one sample of so many."""
    kept = np.arange(len(log.frames)) % every == 0
    return MatchLog(log.info, log.frames.where(kept), log.referee, log.decisions)


def executed(log: MatchLog, match: Bodies, own: OptionWindows, team: int) -> I64:
    """Index in OPTIONS of what each window's robot executed by the log; -1 if it changed, or is none."""
    found = np.full(len(own.first), -1, dtype=np.int64)
    place = {f"{code:03d}": index for index, code in enumerate(OPTIONS)}
    made = log.decisions.filter(pl.col("team") == SIDES[team])
    for row, number in enumerate(match.numbers[team], start=1):
        mine = made.filter(pl.col("robot") == number).sort("t_ns")
        if mine.is_empty():
            continue
        code = np.array([place.get((name or "").rpartition("-")[2], -1) for name in mine["behaviour_id"]])
        his = np.flatnonzero(own.robot == row)
        # the command of a frame shows in the next
        made_ns = mine["t_ns"].to_numpy()
        first, last = (np.searchsorted(made_ns, match.t_ns[own.first[his] + shift], side="right") - 1
                       for shift in (0, own.samples - 1))
        same = (first >= 0) & np.array([code[a] == code[b] and (code[a:b + 1] == code[a]).all()
                                        for a, b in zip(first, last, strict=True)])
        found[his] = np.where(same, code[np.maximum(first, 0)], -1)
    return found


def known(log: MatchLog, settings: OptionSettings, robots: RobotTraits | None = None) -> list[Known]:
    """The windows of teams that logged their decisions, in which they executed one option."""
    table, _ = trajectories(log, TrajectorySettings())
    match = bodies(table, settings.sample_s)
    found = []
    for team in range(len(SIDES)):
        if log.decisions.filter(pl.col("team") == SIDES[team]).is_empty():
            continue
        own = windows_of(match, team, log.info.pitch, settings, robots)
        option = executed(log, match, own, team)
        keep = option >= 0
        kept = {name: getattr(own, name)[keep]
                for name in ("first", "robot", "role", "features", "sight", "aims")}
        found.append(Known(own._replace(**kept), option[keep]))
    return found


def rows(
    job: Job, move: Callable[[MatchInPlay], None] = lambda _: None, robots: RobotTraits | None = None
) -> tuple[F32, F64]:  # fmt: skip
    """Windows described with what was executed (1), and with OTHERS options each (0).

    Args:
        job: the match.
        move: as for :func:`played`.
        robots: robots that are described; None: those of our arena.
    """
    rng = np.random.default_rng([job.seed, 44])
    features, labels = [], []
    for own in known(played(job, move), OptionSettings(), robots):
        count = len(own.option)
        which = np.column_stack([own.option, rng.integers(len(OPTIONS), size=(count, OTHERS))])
        described = own.windows.features[np.arange(count)[:, None], which]
        features.append(described.reshape(-1, described.shape[2]))
        labels.append(np.tile(np.arange(which.shape[1]) == 0, count).astype(np.float64))
    return np.concatenate(features), np.concatenate(labels)
