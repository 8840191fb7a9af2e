"""An opponent rebuilt: a copy as a stand-in for its original, to play against and to the eye.

``make rebuilt`` (half an hour on one core, after ``make from-recordings``, whose data folder it takes) asks
two things of the copies that were learned from 30 recordings.

**As an opponent.** Ten policies play each original and its copy. If the copy stands in for the original, the
policies' leads over the one are in the order of their leads over the other (Spearman's rank correlation). Two
controls: the same original on other seeds (the most that can be reached with so many matches), and the other
four originals, which are no copies. Tables ``rebuilt-leads.csv`` and ``rebuilt.csv``.

**To the eye.** Matches against static are described as the study of teams told apart describes them
(data/studies/scout/teams_apart.py). A match goes to the team whose mean description is nearer, half of the
matches are learned from, the other half is judged: the area under the ROC curve (AUC) is how often a match of
the one team is more like it than a match of the other. It is .5 for halves of the same team, which are the
control. The other control is another original. Table ``rebuilt-told.csv``.

Policies, seeds, sizes and aims were written down before any of these matches was played. The aims are that
the rank correlation is .7 or more for each of the five, and that by situations the AUC of original and copy
is no greater than that of 97.5 % of the ways to halve the original's own matches.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl
from from_recordings.study import FOLDER, SEASONS, TEAMS, Job, Study, lead_in, recorded
from harness import ROOT, Parts, going_on, of_pairs, seasons, workers
from scipy.stats import rankdata, spearmanr
from scout.teams_apart import DESCRIPTIONS, MATCHES, MINUTES

from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.settings import PolicySettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.scout.alike import told

#: Apprentices that play and are no demonstrators. The team that moves at random is left out: all beat it.
APPRENTICES = (("looking-held", 4302), ("looking", 4304))
POLICIES = (
    "static", "human-like", "pressing", "counter", "best-constant", "constant:044", "constant:021",
    "constant:044/011/044", *(f"{name}-static-{seed}" for name, seed in APPRENTICES))
#: First seeds of the pairs: against the original, against the copy, against the original again; and of the
#: matches that are described, of originals and of copies.
ORIGINAL, COPY, AGAIN = "original", "copy", "original, other seeds"
FIRST = {ORIGINAL: 4_420_000, COPY: 4_421_000, AGAIN: 4_422_000}
FIRST_DESCRIBED = {ORIGINAL: 4_430_000, COPY: 4_431_000}
#: Pairs that each policy plays against each of the three (8 were planned; two were dropped for want of time,
#: before any result was looked at); resamples of the policies.
PAIRS, RESAMPLES = 6, 10_000
#: No copy is made of what is described.
BY_STATES = Settings(policies=PolicySettings(learner="sarsa"))
#: Ways to halve an original's matches, and of each the ways to learn from a half and to judge the other.
HALVINGS, SPLITS = 200, 20

Array = npt.NDArray[np.float64]
#: What describes a match: numbers by name, by the way of describing.
Description = dict[str, dict[str, float]]


class Side(NamedTuple):
    """A team: a data folder, and its word there."""

    data: str
    word: str


class Duel(NamedTuple):
    """A match of a policy against another team: seed, the policy's side, seconds."""

    policy: Side
    rival: Side
    seed: int
    away: bool
    seconds: float


def lead(duel: Duel) -> int:
    """Goals that the policy was ahead by."""
    policies: dict[str, PolicyTables] = {}
    teams = [entrant(Store(Path(side.data)), side.word, policies).settings
             for side in (duel.policy, duel.rival)]
    home, away = teams[::-1] if duel.away else teams
    recipe = Recipe(home=home, away=away, seed=duel.seed, referee=RefereeSettings(duration_s=duel.seconds))
    match = MatchInPlay(recipe, controllers_of(recipe, policies), logged=False)
    return lead_in(match, away=duel.away)


class Rebuilt(NamedTuple):
    """A run of this part: the study whose copies it takes, and its sizes."""

    study: Study
    policies: Sequence[str] = POLICIES
    pairs: int = PAIRS
    described: int = MATCHES
    minutes: float = MINUTES
    halvings: int = HALVINGS

    def rival(self, team: str, kind: str) -> Side:
        """An original, or its copy."""
        data, word = self.study.copy(team) if kind == COPY else (self.study.data, team)
        return Side(str(data), word)

    def leads(self, parts: Parts, pool: Executor, teams: Sequence[str]) -> pl.DataFrame:
        """A row for each demonstrator, rival and policy: the policy's lead over the rival."""
        rows, data = [], str(self.study.data)
        rivals = {(team, kind): self.rival(team, kind) for team in teams for kind in FIRST}
        for ((team, kind), rival), policy in product(rivals.items(), self.policies):
            duels = [Duel(Side(data, policy), rival, FIRST[kind] + place, away, self.study.seconds)
                     for place in range(self.pairs) for away in (False, True)]
            found = np.array(parts(duels, lead, pool)).reshape(-1, 2).mean(axis=1)
            rows.append({"demonstrator": team, "rival": kind, "policy": policy, **of_pairs(found.tolist())})
        return pl.DataFrame(rows)

    def matches(self, team: str, kind: str, count: int, pool: Executor) -> list[Description]:
        """Descriptions of matches of an original or a copy, at home against static."""
        data, word = self.rival(team, kind)
        folder = self.study.data / "described" / f"{team}-{kind}"
        files = [folder / "recordings" / f"{place:02d}.mcap" for place in range(count)]
        jobs = [Job(data, word, FIRST_DESCRIBED[kind] + place, away=False, noisy=False,
                    seconds=60 * self.minutes) for place in range(count)]
        list(pool.map(recorded, jobs, files))
        store = Store(folder / "data")
        report = League(store).run(*files, settings=BY_STATES, train=False)
        if report.failures:
            raise SystemExit(str(report.failures))
        return [{name: describe(store, match) for name, describe in DESCRIPTIONS.items()}
                for match in store.receipts("matches")]


def ranks(leads: pl.DataFrame, teams: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Rank correlations of the leads over each original with those over its copy, and over the controls."""
    def over(team: str, kind: str) -> Array:
        return leads.filter(demonstrator=team, rival=kind)["difference"].to_numpy()

    for team in teams:
        rivals = {COPY: (team, COPY), AGAIN: (team, AGAIN)}
        rivals |= {f"another original: {other}": (other, AGAIN) for other in teams if other != team}
        own = over(team, ORIGINAL)
        for name, rival in rivals.items():
            found = over(*rival)
            yield {"demonstrator": team, "rival": name, "policies": len(own), **correlation(own, found),
                   "same_sign": int((np.sign(own) == np.sign(found)).sum()),
                   "lead": float(own.mean()), "lead_over_rival": float(found.mean())}


def correlation(one: Array, other: Array) -> dict[str, float]:
    """Spearman's rank correlation with its 95 % interval: policies are resampled (percentiles)."""
    drawn = np.random.default_rng(0).integers(len(one), size=(RESAMPLES, len(one)))
    first, second = (rankdata(leads[drawn], axis=1) for leads in (one, other))
    first, second = (ranks - ranks.mean(axis=1, keepdims=True) for ranks in (first, second))
    spread = np.sqrt((first**2).sum(axis=1) * (second**2).sum(axis=1))
    found = (first * second).sum(axis=1)[spread > 0] / spread[spread > 0]
    low, high = np.quantile(found, (0.025, 0.975))
    return {"spearman": float(spearmanr(one, other).statistic), "low": float(low), "high": float(high)}


def by_eye(
    described: dict[tuple[str, str], list[Description]], teams: Sequence[str], halvings: int
) -> Iterator[dict[str, Any]]:  # fmt: skip
    """Rows of how well originals are told from their copies, their other halves, and other originals."""
    for team, way in product(teams, DESCRIPTIONS):
        names = sorted({name for each in described.values() for match in each for name in match[way]})
        tables = {key: np.array([[match[way].get(name, 0.0) for name in names] for match in each])
                  for key, each in described.items()}
        if way.startswith("control"):  # numbers of different units
            scale = np.maximum(np.concatenate(list(tables.values())).std(axis=0), 1e-12)
            tables = {key: table / scale for key, table in tables.items()}
        own, copy, rng = tables[team, ORIGINAL], tables[team, COPY], np.random.default_rng(0)
        half, found = len(own) // 2, dict[str, list[float]]()
        for _ in range(halvings):
            first, second = np.split(rng.permutation(own)[:2 * half], 2)
            rivals = {"halves": second, COPY: copy} | {
                other: tables[other, ORIGINAL][:half] for other in teams if other != team}
            for name, rival in rivals.items():
                found.setdefault(name, []).append(told(first, rival, rng, SPLITS))
        others = [float(np.mean(aucs)) for name, aucs in found.items() if name not in ("halves", COPY)]
        yield {
            "demonstrator": team, "described_by": way, "matches": half,
            "auc_halves": float(np.mean(found["halves"])),
            "auc_halves_975": float(np.quantile(found["halves"], 0.975)),
            "auc_copy": float(np.mean(found[COPY])), "auc_others_least": min(others, default=None),
            "auc_others": float(np.mean(others)) if others else None}


def main(rebuilt: Rebuilt, out: Path = FOLDER, teams: Sequence[str] = TEAMS) -> dict[str, pl.DataFrame]:
    """Play what is missing, and write the tables.

    Args:
        rebuilt: sizes.
        out: the folder of the tables.
        teams: the demonstrators.
    """
    with going_on(out, __file__) as parts, workers() as pool:
        for team in teams:
            list(pool.map(recorded, *zip(*rebuilt.study.recordings(team, noisy=False), strict=True)))
        leads = rebuilt.leads(parts, pool, teams)
        described = {(team, kind): rebuilt.matches(team, kind, count, pool) for team in teams
                     for kind, count in ((ORIGINAL, 2 * rebuilt.described), (COPY, rebuilt.described))}
    tables = {
        "rebuilt-leads": leads, "rebuilt": pl.DataFrame(list(ranks(leads, teams))),
        "rebuilt-told": pl.DataFrame(list(by_eye(described, teams, rebuilt.halvings)))}
    for name, table in tables.items():
        table.with_columns(pl.selectors.float().round(3)).write_csv(out / f"{name}.csv")
    return tables


if __name__ == "__main__":
    data = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "data" / "from-recordings"
    for settings, season in (*SEASONS, *APPRENTICES):
        seasons(settings, [season], data)
    main(Rebuilt(Study(data)))
