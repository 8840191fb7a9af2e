"""A value of doing a behaviour, beside random draws.

``make doing`` (twenty minutes of one core; what is in the data folder is not played again) plays matches of
teams against themselves. In those with draws (:mod:`doing.trial`) a robot does a drawn behaviour in random
seconds, where that behaviour is seen. The *effect of doing* of a pair of role and code is the mean change of
V in these seconds, less that in seconds of the same cells in which the team went on. From recordings without
draws (:mod:`doing.watched`) each measure gives the same pairs a value (:mod:`doing.estimates`). Spearman's
rank correlation of value and effect says whether a measure has the right order. At last the five best pairs
of each measure are inserted where they are seen: each robot that is there does one of them, a second at a
time, and its team plays the team without insertions, on both sides. Without insertions the difference is 0
by construction.

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
from doing.estimates import (
    Drawn,
    Effects,
    Pairs,
    adjusted,
    doubly_robust,
    left_of,
    left_of_moments,
    of_draws,
)
from doing.trial import Game, Seconds, drawn, offered_of, played
from doing.watched import Watched, league_of, today, watched, where_seen
from harness import of_pairs
from looking.pairs import kept
from scipy.stats import spearmanr

from pitchlore.pipeline import arena
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
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
DRAWN = {"static": 62, "counter": 40, "pressing": 30, "ppo-2026-1400": 26}
#: First seed of the matches in which the five best pairs are inserted.
INSERTED = 5_220_000
#: Chance that a robot does a drawn behaviour in a second in which some are offered.
SHARE = 0.5
#: The team that behaviours are inserted into, and the measure without its goalkeeper's pairs.
INSERTED_INTO, OF_FIELD = "pressing", "carried over, field players"
#: Pairs that are inserted; pairs of matches by arm, and those that are played before results are kept.
BEST, _BLOCK = 5, 5
ARMS = {"carried over": 15, OF_FIELD: 15, "today": 15, "shuffle": 5}
FOLDER = Path(__file__).parent

#: A row of a table.
Row = dict[str, object]


class Sizes(NamedTuple):
    """Recordings and matches with draws by team, pairs of matches by arm, a match's seconds, resamples."""

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

    def measures(self, effects: Effects, by_pair: Mapping[tuple[str, int], float]) -> dict[str, F64]:
        """Values of the pairs by each measure, float64 [P], NaN where it has none.

        Args:
            effects: model of doing, of another team's trials.
            by_pair: effects of that team's pairs, whatever robots observe.
        """
        said = {(role, code): own for role, code, *own in
                self.behaviours.select("role", "code", "value", "paper").iter_rows()}
        value, paper = np.array([said[pair] for pair in self.pairs]).T
        moments, left = self.moments, left_of_moments(self.moments)
        carried = effects.carried_over(moments, self.pairs)
        return {
            "today": value, "paper": paper,
            "shuffle": np.random.default_rng(0).permutation(value),
            "adjusted, situations": adjusted(moments, moments.seen, self.pairs, left),
            "adjusted, options": adjusted(moments, moments.did, self.pairs, left),
            "doubly robust, options": doubly_robust(moments, moments.did, self.pairs, left),
            "carried over, less its own": carried + effects.gap(moments, self.pairs, left),
            "carried over, without observation": np.array([by_pair.get(pair, np.nan) for pair in self.pairs]),
            "carried over": carried,
        }

    def sums(self) -> Drawn:
        """The sums of its draws."""
        return of_draws(self.seconds, self.pairs, self.offered, left_of(self.seconds))


def correlations(team: str, drawn: Drawn, measures: Mapping[str, F64]) -> list[Row]:
    """A row a measure: Spearman's rank correlation with the effect of doing, over the pairs that it has.

    Its interval is over pairs (Bonett and Wright 2000). Matches drawn anew would add the noise of the draws
    a second time, and so lower the correlation. ``halves`` is what two such trials would agree by: the
    correlation of effects of two halves of the matches (mean of 100), by Spearman and Brown's formula.
    """
    effect, agree = drawn.effects(), drawn.agreement()
    rows = list[Row]()
    for name, value in measures.items():
        there = np.isfinite(value) & np.isfinite(effect)
        found, n = float(spearmanr(value[there], effect[there]).statistic), int(there.sum())
        half = 1.959964 * np.sqrt((1 + found**2 / 2) / (n - 3))
        low, high = np.tanh(np.arctanh(found) + np.array([-half, half]))
        rows.append({"team": team, "measure": name, "pairs": n, "correlation": found, "low": low,
                     "high": high, "halves": agree})
    return rows


def means(team: str, drawn: Drawn, measures: Mapping[str, F64], times: int) -> list[Row]:
    """Mean effect of doing, over the five best pairs of a measure and over all that it puts above 0.

    Its interval is over matches with draws (bootstrap).
    """
    effect, anew, rows = drawn.effects(), drawn.drawn_anew(times), list[Row]()
    for name, value in measures.items():
        known = np.where(np.isfinite(effect), value, np.nan)
        for which, own in (("five best", _best(known)), ("all above 0", np.flatnonzero(known > 0))):
            low, high = np.nanquantile(np.nanmean(anew[:, own], axis=1), [0.025, 0.975])
            rows.append({"team": team, "measure": name, "which": which, "pairs": len(own),
                         "effect": effect[own].mean(), "low": low, "high": high})
    return rows


def _best(measure: F64) -> I64:
    """Places of the pairs that a measure puts first."""
    found: I64 = np.argsort(-np.nan_to_num(measure, nan=-np.inf), kind="stable")[:BEST]
    return found


class Inserted(NamedTuple):
    """A team whose robots do some behaviours where they are seen: its word, the pairs, seconds of a match."""

    team: str
    pairs: Pairs
    seconds: float

    def ahead(self, seeds: Sequence[int]) -> pl.DataFrame:
        """Goals a match that it is ahead of itself without insertions, by seed: seed, difference."""
        offered, found = offered_of(self.pairs), []
        for seed in seeds:
            game = Game(self.team, seed, self.seconds)
            one, other = (played(game, offered, 1.0, [side]).goals for side in (0, 1))
            found.append((one[0] - one[1] + other[1] - other[0]) / 2)
        return pl.DataFrame({"seed": list(seeds), "difference": pl.Series(found, dtype=pl.Float64)})

    def measured(self, data: Path, seeds: Sequence[int]) -> dict[str, float | None]:
        """The mean of these with its interval; what lies in the data folder is not played again."""
        where = [(*pair, *cells.tolist()) for pair, cells in self.pairs.items()]
        said = f"{self.team} {where} {self.seconds} {arena.VERSION}"
        parts = [kept(data / "inserted", said, seeds[at:at + _BLOCK], self.ahead)
                 for at in range(0, len(seeds), _BLOCK)]
        return of_pairs(pl.concat(parts)["difference"].to_list())


def best_of(measure: F64, pairs: Pairs) -> list[tuple[str, int]]:
    """The pairs that a measure puts first."""
    names = list(pairs)
    return [names[place] for place in _best(measure)]


def main(out: Path, data: Path, sizes: Sizes = Sizes()) -> None:  # noqa: B008 (frozen)
    """Play what is missing, and write the tables."""
    taught = Known.of(data, TAUGHT_BY, sizes)
    effects = Effects.fit(taught.seconds)
    by_pair = dict(zip(taught.pairs, taught.sums().effects().tolist(), strict=True))
    compared, seconds, goals, of_pair = list[Row](), list[Row](), list[Row](), list[pl.DataFrame]()
    for team in (DEVELOPED_ON, *REPORTED):
        known = Known.of(data, team, sizes)
        draws, measures = known.sums(), known.measures(effects, by_pair)
        compared += correlations(team, draws, measures)
        seconds += means(team, draws, measures, sizes.bootstraps)
        print(compared[-len(measures):], flush=True)
        of_pair.append(pl.DataFrame({
            "team": team, "role": [role for role, _ in known.pairs],
            "code": [code for _, code in known.pairs], "cells": [len(own) for own in known.pairs.values()],
            "draws": draws.seconds, "effect": draws.effects(),
            "error": draws.drawn_anew(sizes.bootstraps).std(axis=0), **measures}))
        keeps = np.array([role == ROLES[0] for role, _ in known.pairs])
        measures[OF_FIELD] = np.where(keeps, np.nan, measures["carried over"])
        for arm, pairs in sizes.arms.items() if team == INSERTED_INTO else ():
            best = {pair: known.pairs[pair] for pair in best_of(measures[arm], known.pairs)}
            seeds = range(INSERTED, INSERTED + pairs)
            said = " ".join(f"{role}-{code:03d}" for role, code in best)
            goals.append({"team": team, "best by": arm, "pairs": said,
                          **Inserted(team, best, sizes.seconds).measured(data, seeds)})
            print(goals[-1], flush=True)
    tables = {"correlations": (pl.DataFrame(compared), 3), "seconds": (pl.DataFrame(seconds), 4),
              "pairs": (pl.concat(of_pair), 5), "inserted": (pl.DataFrame(goals), 2)}
    for name, (table, digits) in tables.items():
        table.write_csv(out / f"{name}.csv", float_precision=digits)


if __name__ == "__main__":
    main(FOLDER, Path(sys.argv[1]))
