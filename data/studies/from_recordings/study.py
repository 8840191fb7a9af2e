"""A team from its recordings: copies of six demonstrators against static, beside their controls.

``make from-recordings`` (an hour on 2 cores, and half an hour for the seasons of two apprentices) plays
the matches of each demonstrator against static, learns from poses alone, and writes ``goals.csv``. What was
done is kept: a study that was stopped goes on.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from from_recordings.executed import BETA, clone, decisions_beside, executed, improved
from from_recordings.network import NetworkController
from from_recordings.wheels import Clone, WheelController, fit, of_recordings
from harness import ROOT, Parts, going_on, log_of, of_pairs, seasons, workers
from options.dealt import NOISY
from peers.network import load

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.controllers import Controller, PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.camera import CameraSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.engine.habits import habitual
from pitchlore.pipeline.engine.imitations import settings_of
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.settings import (
    BehaviourSettings,
    GramSettings,
    HabitSettings,
    KnowledgeSettings,
    OptionSettings,
    PolicySettings,
    Settings,
)
from pitchlore.pipeline.stages.options.of_team import team_habits
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Clues, Decisions, Policies

#: Seasons whose apprentices are demonstrators, by settings and seed; and scripts that are.
SEASONS = (("looking-held", 4301), ("looking-all", 4303))
TEAMS = (*(f"{name}-static-{seed}" for name, seed in SEASONS), "best-constant", "pressing", "static")
#: A sixth demonstrator, a PPO of data/studies/peers: learner, seed of its training, matches. It was written
#: down before it was trained; its network lies here.
PPO = "ppo-2026-1400"
#: Those that log the options that they execute.
LOGS_OPTIONS = (*TEAMS[:3], PPO)
#: Numbers of recorded matches; pairs that each team plays against static; seconds of a match; first seeds.
#: All were written down before any match was played.
RECORDED, PAIRS, SECONDS, FIRST_RECORDED, FIRST_PLAYED = (5, 10, 30), 25, 480.0, 4_400_000, 4_410_000
#: The name of a demonstrator in its recordings.
NAME = "demonstrator"
#: Words of teams that no data folder has: a policy that is kept as tables, a network that tells wheels.
TABLES, WHEELS = "tables", "wheels"
#: The word of the copy whose knowledge was emptied: it is offered nothing, whatever team it would copy.
EMPTIED = "emptied"
#: Tables of a policy that no data folder has.
_KEPT = ("policies", "appraisals")
FOLDER = Path(__file__).parent


class Job(NamedTuple):
    """A match against static: data folder and word of a team, seed, the team's side, camera, seconds."""

    data: str
    team: str
    seed: int
    away: bool
    noisy: bool
    seconds: float

    def recipe(self, policies: dict[str, PolicyTables]) -> Recipe:
        """The match; the team's policy is added to ``policies``."""
        teams = [self._entrant(policies), TeamSettings(kind="static")]
        home, away = teams[::-1] if self.away else teams
        return Recipe(home=home, away=away, seed=self.seed, camera=NOISY if self.noisy else CameraSettings(),
                      referee=RefereeSettings(duration_s=self.seconds))

    def match(self, *, logged: bool) -> MatchInPlay:
        """The match, before it is played."""
        policies: dict[str, PolicyTables] = {}
        recipe = self.recipe(policies)
        return MatchInPlay(recipe, controllers_of(recipe, policies, self.live(recipe)), logged=logged)

    def live(self, recipe: Recipe) -> tuple[Controller | None, Controller | None]:
        """The controllers of home and away that are no team's of the arena."""
        mine: Controller
        if self.team == WHEELS:
            mine = WheelController(Clone.read(Path(self.data)), recipe)
        elif self.team == PPO:
            mine = NetworkController(load(FOLDER / f"{PPO}.npz"), recipe, int(self.away))
        else:
            return None, None
        return (None, mine) if self.away else (mine, None)

    def _entrant(self, policies: dict[str, PolicyTables]) -> TeamSettings:
        if self.team in (WHEELS, PPO):
            return TeamSettings(kind="remote")
        if self.team == EMPTIED:
            return TeamSettings(kind="learned")
        if self.team != TABLES:
            return entrant(Store(Path(self.data)), self.team, policies).settings
        policies[TABLES] = PolicyTables(*(
            pl.read_parquet(Path(self.data, f"{name}.parquet")) for name in _KEPT))
        return TeamSettings(kind="learned", policy=TABLES, clock_s=OptionSettings().window_s)


def recorded(job: Job, path: Path, move: Callable[[MatchInPlay], None] = lambda _: None) -> None:
    """Play a match, and keep its poses and its referee's words; what the team decided lies beside them.

    Args:
        job: the match; nothing is played if it is there.
        path: where it is kept.
        move: called before it is played; may let another simulator move the bodies.
    """
    if path.exists() and decisions_beside(path).exists():
        return
    match = job.match(logged=True)
    move(match)
    log = matches.read(log_of(match), where=match.recipe.match_id)
    named = {"away" if job.away else "home": NAME, "home" if job.away else "away": "static"}
    bare = replace(log, decisions=Decisions.empty(), info=log.info.model_copy(update=named))
    path.parent.mkdir(parents=True, exist_ok=True)
    log.decisions.write_parquet(decisions_beside(path))
    with path.open("wb") as file:
        matches.write(bare, file)


def ahead(job: Job, move: Callable[[MatchInPlay], None] = lambda _: None) -> int:
    """Goals that the team was ahead by; ``move`` as for :func:`recorded`."""
    match = job.match(logged=False)
    move(match)
    return lead_in(match, away=job.away)


def lead_in(match: MatchInPlay, *, away: bool) -> int:
    """Goals that a side was ahead by, in a match that is played."""
    while match.advance(4096):
        pass
    ours, theirs = match.score[::-1] if away else match.score
    return ours - theirs


class Study(NamedTuple):
    """A run of the study: its data folder, its sizes, and where matches are played."""

    data: Path
    recorded: Sequence[int] = RECORDED
    pairs: int = PAIRS
    seconds: float = SECONDS

    def pair(self, place: int, data: Path, team: str) -> list[Job]:
        """The two matches of a pair."""
        seed = FIRST_PLAYED + place
        return [Job(str(data), team, seed, away, False, self.seconds) for away in (False, True)]

    def recordings(self, team: str, noisy: bool) -> list[tuple[Job, Path]]:
        """The recordings of a demonstrator; it plays home and away in turn."""
        folder = self.data / "recordings" / f"{team}{'-noisy' if noisy else ''}"
        return [(Job(str(self.data), team, FIRST_RECORDED + i, i % 2 == 1, noisy, self.seconds),
                 folder / f"{i:02d}.mcap") for i in range(max(self.recorded))]

    def learned(self, team: str) -> Iterator[tuple[str, int, Path, str]]:
        """Kind, recordings, data folder and word of each team that is learned from a demonstrator."""
        for count in self.recorded:
            yield "copy", count, *self.copy(team, count)
        files = [path for _, path in self.recordings(team, False)[:self.recorded[0]]]
        usual = Settings(knowledge=KnowledgeSettings(imitate=NAME))
        yield "run by default", self.recorded[0], *self.run(team, f"default-{self.recorded[0]}", files, usual)
        yield "copy, noisy camera", self.recorded[-1], *self.copy(team, noisy=True)
        for count in sorted({self.recorded[0], self.recorded[-1]}):
            files = [path for _, path in self.recordings(team, False)[:count]]
            by_states = PolicySettings(learner="sarsa")
            seen = Settings(knowledge=KnowledgeSettings(imitate=NAME), policies=by_states)
            yield "recognised codes, Sarsa", count, *self.run(team, f"usual-{count}", files, seen)
            done = seen.model_copy(update={
                "options": OptionSettings(recover=True), "grams": GramSettings(of="options")})
            yield "behaviours of options, Sarsa", count, *self.run(team, f"done-{count}", files, done)
            # fixed on development before it was played: a role that nothing pays keeps what it usually does
            kept = done.model_copy(update={"behaviours": BehaviourSettings(usual=True)})
            own = self.run(team, f"kept-{count}", files, kept)
            yield "behaviours of options, usual kept, Sarsa", count, *own
        most = self.recorded[-1]
        dealt = self.data / "learned" / f"{team}-shuffled"
        yield "copy, clues shuffled", most, *shuffled(self._copy(team), dealt)
        if team in LOGS_OPTIONS:
            for name, beta in (("copy, options known", None), ("copy, options known, and V", BETA)):
                yield name, most, *self._told(team, beta)
        yield "wheel clone", most, *self._wheels(team)

    def copy(self, team: str, count: int | None = None, *, noisy: bool = False) -> tuple[Path, str]:
        """Data folder and word of a demonstrator's copy from so many recordings (None: all)."""
        count = self.recorded[-1] if count is None else count
        files = [path for _, path in self.recordings(team, noisy)[:count]]
        return self.run(team, f"copy{noisy:d}-{count}", files, settings_of(Settings(), NAME))

    def run(self, team: str, name: str, files: Sequence[Path], settings: Settings) -> tuple[Path, str]:
        """The newest policy of a run on recordings."""
        store = Store(self.data / "learned" / f"{team}-{name}")
        report = League(store).run(*files, settings=settings)
        if report.failures:
            raise SystemExit(str(report.failures))
        return store.root, f"learned:{report.policy}"

    def _told(self, team: str, beta: float | None) -> tuple[Path, str]:
        """A policy as that of the copy, told what was executed; with ``beta`` improved by V."""
        plain = self.data / "learned" / f"{team}-told"
        root = plain if beta is None else plain.with_name(f"{plain.name}-{beta}")
        if not (root / "appraisals.parquet").exists():
            done = executed(self._copy(team), [path for _, path in self.recordings(team, False)])
            if beta is None:
                keep(*clone(done), root)
            else:
                policies, appraisals = (pl.read_parquet(plain / f"{name}.parquet") for name in _KEPT)
                keep(policies, improved(done, policies, appraisals, beta), root)
        return root, TABLES

    def _wheels(self, team: str) -> tuple[Path, str]:
        """The wheel clone of a demonstrator."""
        path = self.data / "learned" / f"{team}-wheels.npz"
        if not path.exists():
            files = [path for _, path in self.recordings(team, False)]
            fit(of_recordings(files, NAME, OptionSettings())).write(path)
        return path, WHEELS

    def _copy(self, team: str) -> Store:
        """The data folder of the copy of most recordings."""
        return Store(self.data / "learned" / f"{team}-copy0-{self.recorded[-1]}")


def dealt_clues(store: Store) -> pl.DataFrame:
    """The clues to a demonstrator's options in all matches, dealt out anew among the windows of a role."""
    home = dict(League(store).ask("select match_id, home from matches").iter_rows())
    clues = pl.concat([table_of(store, receipt, Clues).filter(
        pl.col("team") == ("home" if home[receipt.name] == NAME else "away"))
        for receipt in store.receipts("options")])
    return clues.with_columns(pl.col("ratios").shuffle(seed=0).over("role"))


def shuffled(store: Store, root: Path) -> tuple[Path, str]:
    """A policy as that of a copy, from clues that were dealt out anew among the windows of a role.

    Args:
        store: has learned the copy.
        root: folder of the policy; one that is there is taken.
    """
    if not (root / "appraisals.parquet").exists():
        known = team_habits(dealt_clues(store), Team(NAME, "vsss"), HabitSettings(), 1)
        keep(*habitual(*known, 1), root)
    return root, TABLES


def keep(pairs: pl.DataFrame, appraisals: pl.DataFrame, root: Path) -> None:
    """Keep a policy as its tables, from pairs with their values or from rows of schema Policies."""
    root.mkdir(parents=True, exist_ok=True)
    if "value" in pairs.columns:
        pairs = Policies.of([row | {"version": 1, "knowledge_version": 1, "q": row["value"], "visits": 0,
                                    "evidence": 0.0} for row in pairs.drop("initial").iter_rows(named=True)])
    for name, table in zip(_KEPT, (pairs, appraisals), strict=True):
        table.write_parquet(root / f"{name}.parquet")


def row(
    study: Study, parts: Parts, pool: Executor, team: str, kind: str, count: int, data: Path, word: str
) -> dict[str, object]:  # fmt: skip
    """A row of the table: how far a team is ahead of static."""
    jobs = [job for place in range(study.pairs) for job in study.pair(place, data, word)]
    found = np.array(parts(jobs, ahead, pool)).reshape(-1, 2).mean(axis=1)
    return {"demonstrator": team, "team": kind, "recordings": count, **of_pairs(found.tolist())}


def main(study: Study, out: Path = FOLDER, teams: Sequence[str] = (*TEAMS, PPO)) -> pl.DataFrame:
    """Play what is missing, and write the table; rows of demonstrators that are not played stay."""
    rows: list[dict[str, object]] = []
    with going_on(out, __file__) as parts, workers() as pool:
        rows.append(row(study, parts, pool, "any", "copy, knowledge emptied", 0, study.data, EMPTIED))
        for team in teams:
            for noisy in (False, True):
                list(pool.map(recorded, *zip(*study.recordings(team, noisy), strict=True)))
            made = partial(row, study, parts, pool, team)
            rows.append(made("itself", 0, study.data, team))
            for kind, count, data, word in study.learned(team):
                rows.append(made(kind, count, data, word))
                print(rows[-1], flush=True)
            write(rows, out / "goals.csv")
    return pl.DataFrame(rows)


def write(rows: Sequence[dict[str, object]], path: Path) -> None:
    """Put rows into a table, in place of all that their demonstrators have there."""
    table = pl.DataFrame(rows).with_columns(pl.col("difference", "low", "high").round(2))
    if path.exists():
        table = pl.concat([pl.read_csv(path).join(table, on="demonstrator", how="anti"), table])
    table.write_csv(path)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "data" / "from-recordings"
    for settings, season in SEASONS:
        seasons(settings, [season], folder)
    main(Study(folder), teams=sys.argv[2:] or (*TEAMS, PPO))
