"""A value of doing a behaviour, beside random draws: is it in the order of what doing it changes?

``make doing`` (an hour of one core; what is in the data folder is not played again) plays matches of teams
against themselves. In those with draws (:mod:`doing.trial`) a robot does a drawn behaviour in random seconds,
where that behaviour is seen. The *effect of doing* of a pair of role and code is the mean change of V in
these seconds, less that in seconds of the same cells in which the team went on. From recordings without draws
(:mod:`doing.watched`) each measure gives the same pairs a value (:mod:`doing.estimates`). Spearman's rank
correlation of value and effect says whether a measure has the right order; intervals are over matches with
draws (bootstrap). At last the five best pairs of each measure are inserted where they are seen: each robot
that is there does one of them, a second at a time, and its team plays the team without insertions, on both
sides. Without insertions the difference is 0 by construction.

Teams, seeds, numbers of matches, and where a behaviour counts as seen were written down before any of the
reported matches was played. Settings were chosen on the development teams alone.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from doing.estimates import Drawn, Effects, Pairs, adjusted, doubly_robust, left_of, of_draws
from doing.trial import Game, Seconds, drawn, offered_of, played
from doing.watched import Watched, league_of, today, watched, where_seen
from harness import of_pairs
from looking.pairs import kept
from scipy.stats import spearmanr

from pitchlore.pipeline import arena
from pitchlore.pipeline.numbers.arrays import F64, Bools
from pitchlore.schemas import ROLES
from pitchlore.schemas.options import OPTIONS

#: Development teams: draws of the first teach the model of doing, and the second team's draws judge it.
TAUGHT_BY, DEVELOPED_ON = "static", "counter"
#: Teams that nothing was chosen on: a script, and a PPO whose robots do options.
REPORTED = ("pressing", "ppo-2026-1400")
#: Each team plays itself. First seeds of recordings without draws, and of matches with draws, by team;
#: numbers of both.
SEEDS = {"static": (5_100_000, 5_110_000), "counter": (5_101_000, 5_111_000),
         "pressing": (5_200_000, 5_210_000), "ppo-2026-1400": (5_201_000, 5_211_000)}
RECORDED = {"static": 8, "counter": 6, "pressing": 6, "ppo-2026-1400": 6}
DRAWN = {"static": 62, "counter": 40, "pressing": 60, "ppo-2026-1400": 60}
#: First seed of the matches in which the five best pairs are inserted.
INSERTED = 5_220_000
#: Chance that a robot does a drawn behaviour in a second in which some are offered.
SHARE = 0.5
#: Pairs that are inserted; pairs of matches by arm, and those that are played before results are kept.
BEST, _BLOCK = 5, 5
ARMS = {"carried over": 30, "today": 30, "shuffle": 20, "paper": 20}
FOLDER = Path(__file__).parent


class Sizes(NamedTuple):
    """Numbers of a run: recordings and matches with draws by team, pairs of matches by arm, seconds of a match."""

    recorded: Mapping[str, int] = RECORDED
    drawn: Mapping[str, int] = DRAWN
    arms: Mapping[str, int] = ARMS
    seconds: float = 480.0
    bootstraps: int = 1000

    def games(self, team: str, drawing: bool) -> list[Game]:
        """The matches of a team."""
        count = (self.drawn if drawing else self.recorded)[team]
        return [Game(team, SEEDS[team][drawing] + place, self.seconds) for place in range(count)]


class Known(NamedTuple):
    """All that is known of a team: its recordings, behaviours as the product values them, and draws."""

    moments: Watched
    behaviours: pl.DataFrame
    pairs: Pairs
    offered: Bools
    seconds: Seconds

    @classmethod
    def of(cls, data: Path, team: str, sizes: Sizes) -> Known:
        """Play what is missing, and read it."""
        store = league_of(data, sizes.games(team, drawing=False))
        moments, behaviours = watched(store), today(store)
        cells = {(role, code): where_seen(moments, moments.seen, ROLES.index(role), OPTIONS.index(code))
                 for role, code in behaviours.select("role", "code").iter_rows()}
        pairs = {pair: own for pair, own in cells.items() if len(own)}
        offered = offered_of(pairs)
        return cls(moments, behaviours, pairs, offered,
                   drawn(data, sizes.games(team, drawing=True), offered, SHARE))

    def measures(self, effects: Effects) -> dict[str, F64]:
        """Values of the pairs by each measure, float64 [P], NaN where it has none."""
        said = {(role, code): own for role, code, *own in
                self.behaviours.select("role", "code", "value", "paper").iter_rows()}
        value, paper = np.array([said[pair] for pair in self.pairs]).T
        moments = self.moments
        return {
            "today": value, "paper": paper,
            "shuffle": np.random.default_rng(0).permutation(value),
            "adjusted, situations": adjusted(moments, moments.seen, self.pairs),
            "adjusted, options": adjusted(moments, moments.did, self.pairs),
            "doubly robust, options": doubly_robust(moments, moments.did, self.pairs),
            "carried over": effects.carried_over(moments, self.pairs),
            "carried over, less its own": effects.carried_over(moments, self.pairs, own=True),
        }

    def drawn(self) -> Drawn:
        """The sums of its draws."""
        return of_draws(self.seconds, self.pairs, self.offered, left_of(self.seconds))


def correlations(team: str, drawn: Drawn, measures: Mapping[str, F64], times: int) -> list[dict[str, object]]:
    """A row a measure: Spearman's rank correlation with the effect of doing, over the pairs that it has."""
    effect, anew = drawn.effects(), drawn.drawn_anew(times)
    rows = []
    for name, value in measures.items():
        there = np.isfinite(value) & np.isfinite(effect)
        of_draws = [spearmanr(value[there], own[there], nan_policy="omit").statistic for own in anew]
        low, high = np.nanquantile(of_draws, [0.025, 0.975])
        rows.append({
            "team": team, "measure": name, "pairs": int(there.sum()),
            "correlation": spearmanr(value[there], effect[there]).statistic, "low": low, "high": high})
    return rows


class Inserted(NamedTuple):
    """A team whose robots do some behaviours where they are seen: its word, the pairs, seconds of a match."""

    team: str
    pairs: Pairs
    seconds: float

    def ahead(self, seeds: Sequence[int]) -> pl.DataFrame:
        """Goals a match that it is ahead of itself without insertions, by seed: seed, difference."""
        offered, found = offered_of(self.pairs), []
        for seed in seeds:
            one, other = (played(Game(self.team, seed, self.seconds), offered, 1.0, [side]).goals for side in (0, 1))
            found.append((one[0] - one[1] + other[1] - other[0]) / 2)
        return pl.DataFrame({"seed": list(seeds), "difference": found}, schema_overrides={"difference": pl.Float64})

    def measured(self, data: Path, seeds: Sequence[int]) -> dict[str, float | None]:
        """The mean of these with its interval; what lies in the data folder is not played again."""
        said = f"{self.team} {[(*pair, *cells) for pair, cells in self.pairs.items()]} {self.seconds} {arena.VERSION}"
        parts = [kept(data / "inserted", said, seeds[at:at + _BLOCK], self.ahead)
                 for at in range(0, len(seeds), _BLOCK)]
        return of_pairs(pl.concat(parts)["difference"].to_list())


def best_of(measure: F64, pairs: Pairs) -> list[tuple[str, int]]:
    """The pairs that a measure puts first."""
    names, order = list(pairs), np.argsort(-np.nan_to_num(measure, nan=-np.inf), kind="stable")
    return [names[place] for place in order[:BEST]]


def main(out: Path, data: Path, sizes: Sizes = Sizes()) -> None:  # noqa: B008 (frozen)
    """Play what is missing, and write the tables."""
    effects = Effects.fit(Known.of(data, TAUGHT_BY, sizes).seconds)
    compared, of_pair, goals = list[dict[str, object]](), list[pl.DataFrame](), list[dict[str, object]]()
    for team in (DEVELOPED_ON, *REPORTED):
        known = Known.of(data, team, sizes)
        draws, measures = known.drawn(), known.measures(effects)
        compared += correlations(team, draws, measures, sizes.bootstraps)
        print(compared[-len(measures):], flush=True)
        of_pair.append(pl.DataFrame({
            "team": team, "role": [role for role, _ in known.pairs], "code": [code for _, code in known.pairs],
            "cells": [len(own) for own in known.pairs.values()], "draws": draws.count, "effect": draws.effects(),
            "error": draws.drawn_anew(sizes.bootstraps).std(axis=0), **measures}))
        for arm, pairs in sizes.arms.items() if team in REPORTED else ():
            best = {pair: known.pairs[pair] for pair in best_of(measures[arm], known.pairs)}
            seeds = range(INSERTED, INSERTED + pairs)
            said = " ".join(f"{role}-{code:03d}" for role, code in best)
            goals.append({"team": team, "best by": arm, "pairs": said,
                          **Inserted(team, best, sizes.seconds).measured(data, seeds)})
            print(goals[-1], flush=True)
    for name, rows, digits in (("correlations", compared, 3), ("pairs", pl.concat(of_pair), 5), ("inserted", goals, 2)):
        pl.DataFrame(rows).write_csv(out / f"{name}.csv", float_precision=digits)


if __name__ == "__main__":
    main(FOLDER, Path(sys.argv[1]))
