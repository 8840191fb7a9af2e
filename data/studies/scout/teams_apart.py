"""Matches of known teams, clustered without their names: what robots do tells who plays, or not.

``make teams-apart`` (two minutes) writes ``teams.csv``. Each of five teams plays so many matches of two
minutes against the static team. Of each match one side is described: by the shares of its situations, by
those of pairs of situations, or by a control that needs none. KMeans makes five clusters. The Rand index says
how many pairs of matches it has right, and the adjusted index how much that is above chance (0) on the way to
all (1). The p-value is the share of 10,000 shuffles of the teams' names whose adjusted index is as great.
Beside it: Adachi, Ito and Naruse 2016 report Rand indices of .877 and .840 for strategies in SSL logs; their
matches are others, so the numbers are no race.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import polars as pl
from harness import command
from sklearn.cluster import KMeans
from sklearn.metrics import adjusted_rand_score, rand_score

from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.schemas import Matches, Possession, Situations, Trajectories

TEAMS = ("static", "human-like", "random", "constant:044", "constant:021")
#: Matches of each team, their length, and shuffles of the names.
MATCHES, MINUTES, SHUFFLES = 20, 2, 10_000


def situations(store: Store, match: Receipt) -> dict[str, float]:
    """Shares of home's situations, by role and code."""
    rows = _home(store, match)
    return _shares(rows.select(key=pl.format("{}-{}", pl.col("role").cast(pl.String), "code"))["key"])


def pairs(store: Store, match: Receipt) -> dict[str, float]:
    """Shares of pairs of situations of home that follow each other, by role and codes."""
    rows = _home(store, match).sort("robot", "start_ns").with_columns(
        then=pl.col("code").shift(-1).over("robot", "segment")).drop_nulls("then")
    return _shares(
        rows.select(key=pl.format("{}-{}-{}", pl.col("role").cast(pl.String), "code", "then"))["key"])


def score(store: Store, match: Receipt) -> dict[str, float]:
    """The score: a control."""
    row = store.read_table(match, "matches", Matches).row(0, named=True)
    return {"for": float(row["score_home"] or 0), "against": float(row["score_away"] or 0)}


def places(store: Store, match: Receipt) -> dict[str, float]:
    """Mean places of home's roles, and their spread: a control."""
    receipt = store.receipt("trajectories", match.name)
    assert receipt is not None
    rows = store.read_table(receipt, "trajectories", Trajectories).filter(
        pl.col("team") == "home", pl.col("segment").is_not_null())
    found = rows.group_by("role").agg(
        x=pl.col("x").mean(), y=pl.col("y").abs().mean(), dx=pl.col("x").std(), dy=pl.col("y").std())
    return {f"{role}-{name}": float(value) for role, *values in found.iter_rows()
            for name, value in zip(("x", "y", "dx", "dy"), values, strict=True)}


def having(store: Store, match: Receipt) -> dict[str, float]:
    """Home's possession: its share, and how long and how often: a control."""
    receipt = store.receipt("events", match.name)
    assert receipt is not None
    rows = store.read_table(receipt, "possession", Possession).with_columns(
        lasts=(pl.col("end_ns") - pl.col("start_ns")) / 1e9)
    own = rows.filter(pl.col("team") == "home")
    total = float(rows["lasts"].sum()) or 1.0
    return {
        "share": float(own["lasts"].sum()) / total, "length": float(own["lasts"].sum()) / max(own.height, 1),
        "touches": float(own["touches"].sum()) / max(own.height, 1)}


DESCRIPTIONS: dict[str, Callable[[Store, Receipt], dict[str, float]]] = {
    "situations": situations, "pairs of situations": pairs, "control: score": score,
    "control: mean places": places, "control: possession": having}


def _home(store: Store, match: Receipt) -> pl.DataFrame:
    receipt = store.receipt("situations", match.name)
    assert receipt is not None
    return store.read_table(receipt, "situations", Situations).filter(pl.col("team") == "home")


def _shares(keys: pl.Series) -> dict[str, float]:
    """Square roots of shares: then distances are those of Hellinger."""
    counts = keys.value_counts()
    return {key: float(np.sqrt(count / len(keys))) for key, count in counts.iter_rows()}


def judged(described: list[dict[str, float]], teams: list[str], *, scaled: bool) -> dict[str, float]:
    """Rand indices of clusters of descriptions, and how rare they are among shuffled names."""
    names = sorted({name for each in described for name in each})
    table = np.array([[each.get(name, 0.0) for name in names] for each in described])
    if scaled:  # numbers of different units
        table = (table - table.mean(axis=0)) / np.maximum(table.std(axis=0), 1e-12)
    found = KMeans(len(TEAMS), n_init=20, random_state=0).fit_predict(table)  # type: ignore[no-untyped-call]
    adjusted = adjusted_rand_score(teams, found)
    rng = np.random.default_rng(0)
    shuffled = [adjusted_rand_score(rng.permutation(teams), found) for _ in range(SHUFFLES)]
    return {"rand": round(rand_score(teams, found), 3), "adjusted": round(adjusted, 3),
            "adjusted_of_shuffles_95": round(float(np.quantile(shuffled, 0.95)), 3),
            "p": (1 + sum(each >= adjusted for each in shuffled)) / (1 + SHUFFLES)}


def play(folder: str, matches: int) -> dict[str, str]:
    """Play each team's matches into a data folder; the team of each (constant ones are learned)."""
    teams = dict[str, str]()
    for number, team in enumerate(TEAMS):
        command("record", "--home", team, "--away", "static", "--minutes", MINUTES, "--matches", matches,
                "--seed", 1_000 * (number + 1), "--data", folder)
        teams |= {
            match.name: teams.get(match.name, team) for match in Store(Path(folder)).receipts("matches")}
    return teams


def rows(matches: int) -> Iterator[dict[str, object]]:
    """A row for each way of describing a match."""
    with tempfile.TemporaryDirectory(prefix="pitchlore-teams-") as folder:
        names = play(folder, matches)
        command("run", "--no-train", "--data", folder)
        store = Store(Path(folder))
        played = list(store.receipts("matches"))
        teams = [names[match.name] for match in played]
        assert len(set(teams)) == len(TEAMS)
        for name, describe in DESCRIPTIONS.items():
            reported = [describe(store, match) for match in played]
            yield {"described_by": name, "teams": len(TEAMS), "matches": len(played),
                   **judged(reported, teams, scaled=name.startswith("control"))}


def main(out: Path, matches: int = MATCHES) -> None:
    """Play, describe, cluster, and write the table into a folder."""
    table = pl.DataFrame(list(rows(matches)))
    table.write_csv(out / "teams.csv")
    print(table)


if __name__ == "__main__":
    main(Path(__file__).parent)
