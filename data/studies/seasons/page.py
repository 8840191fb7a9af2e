"""The page of the study: the sections of ``pitchlore report``, and those on our own settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import polars as pl
from harness import ROOT, settings_file
from seasons.claims import ABLATION, AIM, LATE
from seasons.kickoffs import about_kick_offs

from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.stages.report.claims import BEST, IN_GAMES, PAPER
from pitchlore.pipeline.stages.report.document import code
from pitchlore.pipeline.stages.report.measures import CONTROLS, distinct
from pitchlore.pipeline.stages.report.preferences import side_by_side
from pitchlore.pipeline.stages.report.report import (
    OF_RATES,
    PICTURES,
    about_claims,
    about_comparisons,
    about_evaluations,
    about_goals,
    about_pictures,
    about_played,
    about_table_3,
    renamed,
    with_intervals,
)
from pitchlore.pipeline.stages.report.sensitivity import varied_settings
from pitchlore.pipeline.stages.report.summary import LAST, ablated
from pitchlore.pipeline.stages.report.table3 import GAMES
from pitchlore.pipeline.views.report import ReportTables
from pitchlore.schemas.evaluations import minutes_of, word_of
from pitchlore.schemas.seasons import PERSON

#: Title and caption of each plot, by its name.
CAPTIONS = {
    **PICTURES,
    "ablations-paper": (
        "Ablations of the paper's settings",
        "One thing is changed, against the static team. Grey: none. Wide bands are cut. Line: a new score.",
    ),
    "ablations-best": (
        "Ablations of our best settings",
        "One thing is changed, against the static team. Grey: none. Wide bands are cut.",
    ),
}

_ITEM = pl.col("item")
_GROUPS = {"The paper": ~_ITEM.is_in([ABLATION, AIM]), "Ours on ablations": _ITEM == ABLATION,
           "Our aims": _ITEM == AIM}
_AIMS = (
    f"Our aims concern the apprentice after {GAMES} games against the static team. They are "
    f"measured by its evaluations and by its games {LATE[0]} to {LATE[1]}. The interval of a rate "
    f"is {OF_RATES.format('its games or matches')}. `{BEST}` spends all its time from game 2 on in "
    "learned behaviours. This holds by construction: its key has one state per role, which it knows. "
    "A constant team's time all counts as learned, too. To win against the random team takes no "
    "learning either: constant teams do.")


def markdown(found: ReportTables, claims: pl.DataFrame, pictures: Sequence[str], software: str) -> str:
    """The page in Markdown.

    Args:
        found: tables of the seasons.
        claims: schema Claims, the paper's and ours.
        pictures: names of the plots that there are, of :data:`CAPTIONS`.
        software: name and version of the program.
    """
    games, _, evaluations, left_out, preferences = found
    parts = [
        *about_played(games, software), *_about_commands(games, evaluations),
        *about_claims(claims, _GROUPS, _AIMS), *about_evaluations(games, evaluations, left_out),
        *about_pictures(CAPTIONS, pictures), *about_preferences(games, preferences),
        *about_comparisons(games), *about_ablations(games), *about_goals(games), *about_kick_offs(games),
        *about_table_3(games),
    ]
    return "\n\n".join(parts) + "\n"


def _about_commands(games: pl.DataFrame, evaluations: pl.DataFrame) -> Iterator[str]:
    """Commands that make the study again."""
    people = ", but for what people do" if PERSON in games["opponent"] else ""
    yield f"`make seasons` makes the study again{people}, in about three hours on two free cores:"
    yield code((*commands(games), *evaluating(games, evaluations)))


def commands(games: pl.DataFrame) -> Iterator[str]:
    """Commands that play the seasons again, one for each row of consecutive seeds."""
    for (settings, opponent), mine in games.partition_by("settings", "opponent", as_dict=True).items():
        lengths = mine.group_by("seed").agg(pl.col("game").max()).sort("seed")
        runs = lengths.with_columns(run=(
            (pl.col("seed").diff() != 1) | (pl.col("game").diff() != 0)).fill_null(value=True).cum_sum())
        for run in runs.partition_by("run"):
            seed, last = run.select("seed", "game").row(0)
            length = "" if last == GAMES else f" --games {last}"
            words = f"pitchlore season --settings {_given(str(settings))} --opponent {opponent}"
            if opponent == PERSON:  # one at a time
                yield from (f"{words} --seed {seed + number}{length}" for number in range(run.height))
            else:
                yield f"{words} --seed {seed} --seasons {run.height}{length}"


def _given(settings: str) -> str:
    """Word for ``--settings``: the file of settings that only the study has, by the checkout, or the name."""
    path = settings_file(settings)
    return settings if path is None else str(path.relative_to(ROOT))


def evaluating(games: pl.DataFrame, evaluations: pl.DataFrame) -> Iterator[str]:
    """Commands that measure apprentices and controls again; each row of consecutive seeds has its own."""
    teams, key = [*distinct(games)["season"], *CONTROLS], ("team", "opponent", "duration_s")
    counted = evaluations.filter(pl.col("team").is_in(teams))
    pairs = counted.group_by(*key, pair="seed").agg().sort(pl.all())
    runs = pairs.with_columns(
        run=(pl.col("pair").diff() != 1).fill_null(value=True).cum_sum().over(key)
    ).group_by(*key, "run", maintain_order=True).agg(first=pl.col("pair").min(), matches=2 * pl.len())
    together = runs.group_by("team", "duration_s", "first", "matches", maintain_order=True).agg("opponent")
    for team, seconds, first, matches, opponents in together.iter_rows():
        words = list(map(word_of, opponents))
        panel = PANEL if set(PANEL) <= set(words) else ()
        seed = "" if first == 0 else f" --seed {first}"
        minutes = "" if seconds == RefereeSettings().duration_s else f" --minutes {minutes_of(seconds)}"
        others = (f" --against {word}" for word in words if word not in panel)
        for whom in (*([""] if panel else []), *others):  # the panel is who plays if nobody is named
            yield f"pitchlore evaluate --policy {team}{whom} --matches {matches}{seed}{minutes}"


def about_preferences(games: pl.DataFrame, preferences: pl.DataFrame) -> Iterator[str]:
    """Preferred behaviours of our best apprentices; nothing without their seasons."""
    best = games.filter(pl.col("settings").is_in([BEST, IN_GAMES]))
    if not best.height:
        return
    unknown = best.join(preferences, on="season", how="anti")["season"].unique().sort()
    left = (f" {', '.join(unknown)} cannot be listed: the policy is gone, or its key has other states."
            if unknown.len() else "")
    yield "## Preferred behaviours of our best apprentices"
    yield (
        "Their key tells roles apart and nothing else. An apprentice therefore prefers one behaviour "
        "in each role and repeats it. It answers the opponent by who has which role and by the control "
        f"within a situation. The value of the behaviour is in brackets: goals, discounted.{left}")
    yield renamed(side_by_side(preferences), {"opponent": "trained against"})


def about_ablations(games: pl.DataFrame) -> Iterator[str]:
    """Effect of each ablation; its direction is named if the interval excludes 0."""
    yield "## Effect of each change"
    yield (
        f"Each ablation minus the settings that it varies, over the last {LAST} games that all their "
        "seasons have, with Welch's interval. Seasons of one seed share the chances of their first "
        "game and no more. If twenty changes had no effect, one would still differ significantly by chance.")
    low, high = pl.col("difference_low"), pl.col("difference_high")
    reported = (pl.when(low > 0).then(pl.lit("better")).when(high < 0).then(pl.lit("worse"))
            .otherwise(pl.lit("no significant difference")))
    rows = ablated(games.filter(~varied_settings()), (PAPER, BEST)).select(
        "settings", pl.col("base").alias("minus"), "opponent",
        pl.format("{} and {}", "seasons", "seasons_base").alias("seasons"),
        pl.format("{} to {}", "first", "last").alias("games"),
        pl.col("^difference.*$"), pl.col("^other.*$"), reported.alias("with the change"),
    )
    yield with_intervals(rows, ("settings", "minus", "opponent", "seasons", "games"), ("with the change",))
