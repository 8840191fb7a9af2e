"""Kinds of learners that were tried against the static team: their curves, from results of other studies.

``tried.py`` reads the games of ``seasons`` and ``imitation`` and the results of ``peers``, which are
committed, and plays nothing. It writes ``tried.csv`` and ``tried.png``.

A season's point is a counted match, at the number of matches that its apprentice has learned from; a peer's
is its evaluation. Means are over seasons or trainings, with Student's interval over them.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import polars as pl
from harness import settings_of
from looking.learners import STATIC
from matplotlib.figure import Figure
from peers.teams import OURS

from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.stages.report.measures import DIFFERENCE
from pitchlore.pipeline.views.plots.style import plot_png

#: The study of learners that play no seasons.
PEERS = "peers"


class Kind(NamedTuple):
    """A kind of learner.

    Attributes:
        said: its words in the legend.
        study: folder of its results.
        name: settings of its seasons, or learner of its trainings.
    """

    said: str
    study: str
    name: str

    def learned_from(self, game: int) -> int:
        """Matches from which it has learned before a game's counted match; a peer's game is that number."""
        return game if self.study == PEERS else (game - 1) * settings_of(self.name).matches_a_game


#: The learner that won.
WON = Kind("tries held (looking-held)", PEERS, OURS)
#: All others, by family.
FAMILIES = {
    "the paper's learner, Sarsa(λ)": (
        Kind("one state a role (best)", "seasons", "best"),
        Kind("states of all elements (best-states)", "seasons", "best-states")),
    "trees on what V did after an action": (
        Kind("not held (looking-all)", "imitation", "looking-all"),
        Kind("watched actions offered (looking)", "imitation", "looking"),
        Kind("actions appraised by watching (looking-imitates)", "imitation", "looking-imitates")),
    "libraries' learners": (
        Kind("PPO", PEERS, "ppo"),
        Kind("DQN", PEERS, "dqn"),
        Kind("behaviour cloning of its log", PEERS, "bc"),
        Kind("CQL of its log, goals", PEERS, "cql"),
        Kind("CQL of its log, V's change", PEERS, "cql-v")),
}
KINDS = (WON, *(kind for kinds in FAMILIES.values() for kind in kinds))


def results(folder: Path) -> pl.DataFrame:
    """Goal differences against the static team: study, name, seed, game (or matches), difference.

    Args:
        folder: folder of the studies.
    """
    seasons, imitation, peers = (pl.read_csv(folder / path) for path in (
        "seasons/games.csv", "imitation/games.csv", "peers/results.csv"))
    parts = {
        "seasons": seasons.filter(opponent=STATIC).select(
            "seed", "game", name="settings", difference=DIFFERENCE),
        "imitation": imitation.select("seed", "game", name="settings", difference="difference"),
        PEERS: peers.filter(pl.col("matches") > 0, opponent=STATIC).select(
            "seed", game="matches", name="learner", difference="difference"),
    }
    columns = ("name", "seed", "game", pl.col("difference").cast(float))
    return pl.concat([own.select(pl.lit(study).alias("study"), *columns) for study, own in parts.items()])


def curves(found: pl.DataFrame) -> pl.DataFrame:
    """A row for each kind and number of matches: kind, matches, apprentices, difference, low, high."""
    rows = []
    for kind in KINDS:
        own = found.filter(study=kind.study, name=kind.name)
        for (game,), each in own.group_by("game", maintain_order=True):
            low, high = mean_interval(each["difference"].to_numpy()) or (None, None)
            rows.append({
                "kind": kind.said, "matches": kind.learned_from(int(str(game))), "apprentices": each.height,
                "difference": each["difference"].mean(), "low": low, "high": high})
    schema = {"kind": pl.String, "matches": pl.Int64, "apprentices": pl.Int64} | dict.fromkeys(
        ("difference", "low", "high"), pl.Float64)
    return pl.DataFrame(rows, schema=schema).filter(pl.col("matches") > 0).sort(
        pl.col("kind").cast(pl.Enum([kind.said for kind in KINDS])), "matches")


def plot(found: pl.DataFrame, path: Path) -> None:
    """The curves and bands of their intervals, a panel a family; the learner that won is in each."""
    figure = Figure(figsize=(13, 5), layout="constrained")
    panels = figure.subplots(1, len(FAMILIES), sharey=True)
    for axes, (family, kinds) in zip(panels, FAMILIES.items(), strict=True):
        for number, kind in enumerate((WON, *kinds)):
            own = found.filter(kind=kind.said)
            x, y = own["matches"].to_numpy(), own["difference"].to_numpy()
            color, width = ("black", 2.5) if kind is WON else (f"C{number}", 1.5)
            marker = "o" if own.height == 1 else None
            axes.plot(x, y, marker=marker, linewidth=width, color=color, label=kind.said)
            ends = (own["low"].to_numpy(), own["high"].to_numpy())
            axes.fill_between(x, *ends, color=color, alpha=0.12, linewidth=0)
        axes.axhline(0, color="grey", linewidth=0.8)
        axes.set_ylim(-60, 30)  # bands of the first games, of three seasons, are wider
        axes.set_xscale("log")
        there = found.filter(pl.col("kind").is_in([kind.said for kind in (WON, *kinds)]))["matches"]
        ticks = [tick for tick in (4, 10, 20, 40, 80, 140, 560, 2_800, 12_400) if tick in there]
        axes.set_xticks(ticks, [f"{tick:,}" for tick in ticks])
        axes.minorticks_off()
        axes.set_title(family, fontsize=10)
        axes.set_xlabel("matches of eight minutes against the static team")
        axes.legend(fontsize=8, loc="lower right")
    panels[0].set_ylabel("goals a match more than the static team")
    path.write_bytes(plot_png(figure))


def main(out: Path) -> None:
    """Write the table and the plot into a folder."""
    found = curves(results(Path(__file__).parents[1]))
    found.write_csv(out / "tried.csv", float_precision=2)
    plot(found, out / "tried.png")


if __name__ == "__main__":
    main(Path(__file__).parent)
