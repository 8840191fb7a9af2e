"""The study's tables and its plot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import polars as pl
from looking.learners import STATIC
from matplotlib.figure import Figure
from peers.teams import ONCE, OURS, WHOLE, Team

from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.numbers.statistics import mean_interval, welch
from pitchlore.pipeline.views.plots.style import plot_png
from pitchlore.schemas.table import called

#: Of what an interval is where there is one training, and how the tables mark it.
_PAIRS, _ONE = "pairs of matches", "†"
#: Ticks of the plot; a learner's points lie so many times further right than those of the one before.
_TICKS, _ASIDE = (20, 40, 80, 140, 280, 560, 1_400, 2_800, 5_600, 12_400), 1.025
#: What rows are made of: trainings of one learner after as many matches.
_ROW = ("learner", "matches")


def row(team: Team, opponent: str, pairs: pl.DataFrame) -> dict[str, object]:
    """A team against an opponent, with Student's interval over its pairs of matches."""
    low, high = mean_interval(pairs["difference"].to_numpy()) or (None, None)
    return {"learner": team.learner, "seed": team.seed, "matches": team.matches, "opponent": opponent,
            "pairs": pairs.height, "difference": pairs["difference"].mean(), "low": low, "high": high}


def learners(results: pl.DataFrame) -> pl.DataFrame:
    """A row for each learner, number of matches and opponent.

    The interval is Student's over trainings. With one training it is that over its pairs of matches: it says
    nothing of other trainings. ``of`` says which, and the tables mark them.
    """
    return pl.DataFrame(list(_learners(results)), infer_schema_length=None)


def _learners(results: pl.DataFrame) -> Iterator[dict[str, object]]:
    for (learner, matches, opponent), own in results.group_by(*_ROW, "opponent", maintain_order=True):
        found = mean_interval(own["difference"].to_numpy())
        low, high = found or (own["low"][0], own["high"][0])
        yield {"learner": learner, "matches": matches, "opponent": opponent, "trainings": own.height,
               "difference": own["difference"].mean(), "low": low, "high": high,
               "of": _PAIRS if found is None else "trainings"}


def ahead(results: pl.DataFrame) -> pl.DataFrame:
    """Lead of our apprentices over each peer after as many matches, by their leads over the static team.

    Returns:
        A row a peer and number of matches: learner, matches, trainings, difference, low, high. Who learned
        from the logs of our apprentices is compared with these, pair by pair, others with all of them by
        Welch's interval.
    """
    rows = []
    against = results.filter(pl.col("matches") > 0, opponent=STATIC)
    peers = against.filter(pl.col("learner") != OURS)
    for (learner, matches), own in peers.group_by(*_ROW, maintain_order=True):
        ours = against.filter(learner=OURS, matches=matches)
        pairs = own.join(ours, on="seed", suffix="_ours")
        if pairs.height == own.height:
            leads = pairs["difference_ours"]
            ends = mean_interval((leads - pairs["difference"]).to_numpy())
        else:
            leads = ours["difference"]
            ends = welch(leads, own["difference"])
        if ends is not None:
            rows.append({
                "learner": learner, "matches": matches, "trainings": own.height,
                "difference": leads.mean() - own["difference"].mean(),  # type: ignore[operator]
                "low": ends[0], "high": ends[1]})
    return pl.DataFrame(rows, infer_schema_length=None)


def markdown(found: pl.DataFrame) -> str:
    """The table: a row a learner and number of matches, a column an opponent.

    Who learned from a season's matches comes first, the best against static before the others; then who
    learned from other numbers, then who learned nothing.
    """
    last = pl.col("matches") == pl.col("matches").max().over("learner")
    whole = found.filter(pl.col("matches").is_in(WHOLE) | last)
    equal, learned = pl.col("matches") == ONCE, pl.col("matches") > 0
    order = whole.filter(opponent=STATIC).sort(equal, learned, "difference", descending=True)
    if not order.filter(learner=STATIC).height:  # it does not play against itself
        order = pl.concat([order, whole.filter(learner=STATIC).unique(_ROW)])
    lines = ["| | matches | trainings | " + " | ".join(map(called, PANEL)) + " |",
             "|---|---|---|" + "---|" * len(PANEL)]
    for each in order.iter_rows(named=True):
        own = whole.filter(learner=each["learner"], matches=each["matches"])
        cells = [_cell(own.filter(opponent=opponent)) for opponent in PANEL]
        bold = "**" if each["learner"] == OURS else ""
        lines.append(f"| {bold}{each['learner']}{bold} | {each['matches'] or ''} | "
                     f"{each['trainings'] if each['matches'] else ''} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def curve(found: pl.DataFrame) -> str:
    """The learning curves against the static team: a row a number of matches, a column a learner.

    The best after a season's matches comes first.
    """
    own = found.filter(pl.col("matches") > 0, opponent=STATIC)
    best_first = own.sort(pl.col("matches") == ONCE, "difference", descending=True)
    names = best_first["learner"].unique(maintain_order=True)
    lines = [f"| against {STATIC} after | " + " | ".join(names) + " |", "|---" * (1 + len(names)) + "|"]
    for matches in own["matches"].unique().sort():
        cells = [_cell(own.filter(learner=name, matches=matches)) for name in names]
        lines.append(f"| {matches} matches | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(own: pl.DataFrame) -> str:
    if own.is_empty():
        return ""
    numbers = own.select("difference", "low", "high").row(0)
    mean, *ends = (f"{number:+.1f}".replace("-", "−") for number in numbers)
    mark = _ONE if own["of"][0] == _PAIRS and own["matches"][0] else ""
    return f"{mean} [{ends[0].lstrip('+')}, {ends[1].lstrip('+')}]{mark}"


def plot(found: pl.DataFrame, path: Path) -> None:
    """Goal difference against the static team over the number of matches, with intervals over trainings.

    A point of one training has no interval. Controls are lines.
    """
    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.subplots()
    against = found.filter(opponent=STATIC).sort("matches")
    for number, ((learner,), own) in enumerate(
            against.filter(pl.col("matches") > 0).group_by("learner", maintain_order=True)):
        marker = "o" if own.height > 1 else "D"
        color, width = ("black", 2.5) if learner == OURS else (f"C{number}", 1.2)
        x, y = own["matches"] * _ASIDE**number, own["difference"].to_numpy()
        spread = np.where(own["of"] == _PAIRS, 0, [y - own["low"].to_numpy(), own["high"].to_numpy() - y])
        axes.errorbar(
            x, y, yerr=spread, capsize=2, label=learner, marker=marker, color=color, linewidth=width)
    for (learner,), own in against.filter(matches=0).group_by("learner", maintain_order=True):
        level = own["difference"][0]
        axes.axhline(level, color="grey", linestyle=":", linewidth=1)
        axes.annotate(str(learner), (1.0, level), xycoords=("axes fraction", "data"), ha="right", va="bottom",
                      fontsize=8, color="grey")
    axes.axhline(0, color="grey", linewidth=0.8)
    axes.set_xscale("log")
    axes.set_xticks(_TICKS, [f"{tick:,}" for tick in _TICKS])
    axes.minorticks_off()
    axes.set_ylim(top=34)  # room for the legend
    axes.set_xlabel("matches of eight minutes against the static team")
    axes.set_ylabel("goals a match more than the static team")
    axes.legend(fontsize=8, loc="upper left", ncols=2)
    path.write_bytes(plot_png(figure))


def write(out: Path, rows: Sequence[dict[str, object]]) -> None:
    """Write ``results.csv``, ``learners.csv``, ``ahead.csv``, ``table.md`` and ``peers.png``."""
    out.mkdir(parents=True, exist_ok=True)
    results = pl.DataFrame(rows, infer_schema_length=None)
    results.write_csv(out / "results.csv", float_precision=2)
    found = learners(results)
    found.write_csv(out / "learners.csv", float_precision=2)
    ahead(results).write_csv(out / "ahead.csv", float_precision=3)
    (out / "table.md").write_text(f"{markdown(found)}\n{curve(found)}", encoding="utf-8")
    plot(found, out / "peers.png")
