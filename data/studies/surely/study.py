"""Behaviours that are said to go surely with better chances, or with worse: how many do so in other matches.

``make surely`` (ten minutes of one core; what is in the data folder is not played again) records matches
of known teams against the static one, learns behaviours from eight matches of each pairing, and counts the
same behaviours in twelve others, whose V has models of its own. *Holds*: the mean change of V in the other
matches has the side of 0 that was said. *Surely holds*, *surely not*: the 95 % interval of that mean excludes
0 on that side, or on the other one. Behaviours that were seen fewer than five times in the other matches are
left out.

Rules: *today*, an interval of the shrunk value that excludes 0; *rates*, at most 5 % false ones by the false
discovery rates of the values that are not shrunk (Benjamini and Hochberg 1995), and that interval; *shrunk
rates*, the same of the shrunk values. Control: the changes of each robot's situations in a match are moved
on by a random number of situations, and have mean 0, so that no behaviour goes with anything. The rule was
chosen on the development seeds.

Aims, written down before the reported matches were played: of what *rates* says and is seen again, 90 %
holds on each side; of the moved outcomes it says at most a twentieth as much.

Matches go into three folders below DATA: ``apprentice``, ``learned`` and ``others``.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl
from harness import command, seasons

from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.statistics import wilson
from pitchlore.pipeline.settings import BehaviourSettings, Settings
from pitchlore.pipeline.stages.behaviours.grams import cover, grams, merge, spelt
from pitchlore.pipeline.stages.behaviours.rounds import RoundsOutcome, learn
from pitchlore.pipeline.stages.behaviours.shrinkage import valued
from pitchlore.pipeline.stages.sequences.league import LeagueSequences, TeamsOfSides
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.pipeline.store import Store
from pitchlore.schemas import SIDES, Sequences

#: Adversaries of the static team, first seeds of the matches, and their numbers: of learning, and of others.
TEAMS = ("pressing", "human-like", "apprentice")
DEVELOPMENT, REPORTED, LEARNED, OTHERS = 41_001, 49_001, 8, 12
#: The apprentice's season (of ``make imitation-gain``): settings, seed, games; and the nouns that are made.
SEASON, SEED, GAMES = "looking-held", 4721, 8
NOUNS = frozenset({"sides", "trajectories", "situations", "options", "goals", "events", "moments", "models",
                   "values", "sequences"})
#: Least number of times that a behaviour is seen in the other matches; false ones that are allowed.
SUPPORT, FALSE = 5, 0.05
_Z = 1.959964
_RULES = ("today", "rates", "shrunk")


def recorded(
    data: Path, first: int, teams: tuple[str, ...], counts: tuple[int, int], minutes: float,
) -> list[Store]:
    """The data folders of the matches to learn from and of the others; what is missing is played."""
    base, found = data / "apprentice", list[Store]()
    if "apprentice" in teams and not base.exists():
        seasons(SEASON, [SEED], base, "--games", GAMES)
    start = first
    for name, count in zip(("learned", "others"), counts, strict=True):
        folder = data / name
        if not folder.exists():
            if base.exists():
                shutil.copytree(base, folder)
            for team in teams:
                word = f"{SEASON}-static-{SEED}" if team == "apprentice" else team
                command("record", "--home", "static", "--away", word, "--seed", start, "--matches", count,
                        "--minutes", minutes, "--data", folder)
                start += count
        store = Store(folder)
        STAGES.make(store, Settings(), scope_of(store), NOUNS)
        found.append(store)
        start = first + len(teams) * counts[0]
    return found


def sides_of(store: Store) -> TeamsOfSides:
    """By match the teams of its sides."""
    return {own.name: {side: Team(team, own.details["kind"])
                       for side, team in zip(SIDES, own.details["counts_as"], strict=True)}
            for own in store.receipts("sides")}


def sequences_of(store: Store, moved: bool) -> list[pl.DataFrame]:
    """The sequences of all matches; moved, for the control: see the docstring above."""
    tables = [store.read_table(receipt, "sequences", Sequences) for receipt in store.receipts("sequences")]
    return [_moved(table, number) for number, table in enumerate(tables)] if moved else tables


def _moved(table: pl.DataFrame, seed: int) -> pl.DataFrame:
    rng, change = np.random.default_rng(seed), table["change"].to_numpy().copy()
    keys = table.select(pl.struct("team", "robot").rank("dense")).to_series().to_numpy()
    for key in np.unique(keys):
        rows = np.flatnonzero(keys == key)
        change[rows] = np.roll(change[rows] - change[rows].mean(), int(rng.integers(1, max(len(rows), 2))))
    return table.with_columns(change=pl.Series(change))


def said(outcome: RoundsOutcome) -> pl.DataFrame:
    """Behaviours, with the side that each rule says surely: columns today, rates, shrunk (+1, -1 or 0)."""
    counted = outcome.grams.join(outcome.neurons.select("team", "kind", "n", "neuron", "kept"),
                                 on=("team", "kind", "n", "neuron"), how="left").filter("kept")
    many = counted.group_by("team", "kind", "n").agg(candidates=pl.len())
    rows = outcome.patterns.join(many, on=("team", "kind", "n"), how="left")
    half = (pl.col("high") - pl.col("low")) / 2 / _Z
    side = pl.when(pl.col("low") > 0).then(1).when(pl.col("high") < 0).then(-1).otherwise(0)
    found = rows.with_columns(z=pl.col("value") / half).group_by("team", "kind", "n", maintain_order=True)
    parts = [part.with_columns(shrunk_q=_rates(part["z"].to_numpy(), part["candidates"][0]))
             for _, part in found]
    return pl.concat(parts).with_columns(
        today=side, rates=pl.when(pl.col("q") <= FALSE).then(side).otherwise(0),
        shrunk=pl.when(pl.col("shrunk_q") <= FALSE).then(side).otherwise(0))


def _rates(z: F64, candidates: int) -> F64:
    """False discovery rates of the surest of so many candidates; the others are less sure than all these."""
    from scipy.special import ndtr  # noqa: PLC0415 (a study's own)

    chance = 2 * ndtr(-np.abs(z))
    order = np.argsort(chance)
    rate = np.minimum.accumulate((chance[order] * candidates / np.arange(1, len(z) + 1))[::-1])[::-1]
    found: F64 = np.minimum(rate, 1.0)[np.argsort(order)]
    return found


def seen_again(outcome: RoundsOutcome, tables: list[pl.DataFrame], sides: TeamsOfSides) -> pl.DataFrame:
    """Changes of V with the grams in other matches: team, kind, role, codes, count, mean, error."""
    chunks = LeagueSequences(lambda: tables, sides)
    teams = pl.DataFrame(
        chunks.teams, orient="row", schema={"team": pl.String, "kind": pl.String},
    ).with_columns(who=pl.int_range(pl.len(), dtype=pl.Int64))
    owned = outcome.patterns.join(teams, on=("team", "kind"))
    found = []
    for n in sorted(owned["n"].unique(), reverse=True):
        longer = owned.filter(pl.col("n") > n, "kept")
        of_all = spelt(merge(grams(chunk, n, cover(chunk, longer)) for chunk in chunks), n)
        for _, own in of_all.group_by("who", maintain_order=True):
            found.append(valued(own, shrink=False).select("who", "role", "codes", "count", "mean", "error"))
    return pl.concat(found).join(teams, on="who").drop("who")


def judged(rows: pl.DataFrame, rule: str) -> Iterator[dict[str, object]]:
    """For each side that a rule says: how many behaviours, and how many of them hold."""
    for side, name in ((1, "+"), (-1, "-")):
        own = rows.filter(pl.col(rule) == side)
        again = own.filter(pl.col("count") >= SUPPORT)
        z = side * again["mean_right"] / again["error_right"]
        holds, n = int((z > 0).sum()), again.height
        low, high = wilson(holds, n) if n else (float("nan"), float("nan"))
        yield {"rule": rule, "pays": name, "said": own.height, "seen_again": n, "holds": holds,
               "share": round(holds / n, 3) if n else None, "low": round(low, 3), "high": round(high, 3),
               "surely_holds": int((z > _Z).sum()), "surely_not": int((z < -_Z).sum())}


def table_of(stores: list[Store], settings: BehaviourSettings) -> pl.DataFrame:
    """The table of the study: rules by outcomes as they were, and as they were moved."""
    rows = []
    for outcomes, moved in (("as they were", False), ("moved", True)):
        learning, other = (sequences_of(store, moved) for store in stores)
        outcome = learn(partial(list, learning), sides_of(stores[0]), settings)
        again = seen_again(outcome, other, sides_of(stores[1]))
        both = said(outcome).join(again, on=("team", "kind", "role", "codes"), how="left")
        for rule in _RULES:
            rows += [{"outcomes": outcomes} | row for row in judged(both, rule)]
        by_team(both, outcomes)
    return pl.DataFrame(rows, infer_schema_length=None)


def by_team(rows: pl.DataFrame, outcomes: str) -> None:
    """Print how much is said of each team."""
    print(outcomes, rows.group_by("team").agg(
        (pl.col(rule) == side).sum().alias(f"{rule} {side:+d}") for rule in _RULES for side in (1, -1)
    ).sort("team"), flush=True)


def main(
    out: Path, data: Path, first: int = REPORTED, teams: tuple[str, ...] = TEAMS,
    counts: tuple[int, int] = (LEARNED, OTHERS), minutes: float = 8.0,
) -> None:
    """Play what is missing, and write the table."""
    stores = recorded(data, first, teams, counts, minutes)
    table = table_of(stores, BehaviourSettings())
    table.write_csv(out / "surely.csv")


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1]))
