"""The report on seasons: its text, made of their tables, and the names of its plots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import polars as pl

from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.numbers.claims import counted
from pitchlore.pipeline.report.claims import (
    ABLATION,
    AIM,
    BEST,
    IN_GAMES,
    LATE,
    LEAST_SEASONS,
    PAPER,
    STATIC,
)
from pitchlore.pipeline.report.document import code, interval, number, picture, table
from pitchlore.pipeline.report.measures import CONTROLS, distinct
from pitchlore.pipeline.report.preferences import side_by_side
from pitchlore.pipeline.report.sections import about_kick_offs, about_sensitivity, cell, estimates
from pitchlore.pipeline.report.sensitivity import varied
from pitchlore.pipeline.report.summary import (
    LAST,
    ablated,
    attributed,
    beside_table_3,
    compared,
    measured,
    played,
)
from pitchlore.pipeline.report.table3 import CHANGE, GAMES
from pitchlore.pipeline.seasons.settings import named, names
from pitchlore.schemas import STAND_IN, called
from pitchlore.schemas.evaluations import minutes_of, word_of
from pitchlore.schemas.seasons import PERSON

#: Colours of verdicts on the web page: fulfilled, not fulfilled, denied by the paper's own table, undecided.
COLOURS = {
    "reproduced": "#00644a", "reached": "#00644a", "contradicted": "#a33f00", "not reached": "#a33f00",
    "contradictory": "#8a3d70", "not reproduced": "#555", "by construction": "#555",
}

#: Interval of a share of games or matches.
_OF_RATES = "the wider of Student's over the seasons and Wilson's over all {}"

#: Title and caption of each plot, by its name.
PICTURES: dict[str, tuple[str, str]] = {
    "table-3": (
        "Table 3: new actions",
        "Decisions of other behaviours than moves randomly, % of all decisions in the game. Dots: the paper.",
    ),
    "figure-8": (
        "Figure 8: states", "Known states after each game, by role: states seen in others or played in.",
    ),
    "figure-9": (
        "Figure 9: actions",
        "Distinct behaviours, and pairs of state and behaviour, by role (the paper does not say which).",
    ),
    "figure-10": (
        "Figure 10: goals effectively made",
        "Goals by direct or indirect action, in each game and added up; goals for minus goals against.",
    ),
    "best": (
        "Our best apprentice",
        "Goal difference and share of time in learned behaviours, game by game, against each opponent.",
    ),
    "ablations-paper": (
        "Ablations of the paper's settings",
        "One thing is changed, against the static team. Grey: none. Wide bands are cut. Line: a new score.",
    ),
    "ablations-best": (
        "Ablations of our best settings",
        "One thing is changed, against the static team. Grey: none. Wide bands are cut.",
    ),
}


@dataclass(frozen=True, slots=True)
class SeasonsReport:
    """Contents of the report.

    Attributes:
        games: schema Games.
        growth: schema Growth.
        evaluations: schema Evaluations, of the seasons' apprentices.
        left_out: pairs of matches of these apprentices that do not count.
        preferences: preferences of the best apprentices, see
            :func:`pipeline.report.preferences.side_by_side`.
        claims: schema Claims.
        pictures: names of the plots that there are, of :data:`PICTURES`.
        software: name and version of the program.
    """

    games: pl.DataFrame
    growth: pl.DataFrame
    evaluations: pl.DataFrame
    left_out: int
    preferences: pl.DataFrame
    claims: pl.DataFrame
    pictures: Sequence[str]
    software: str

    def markdown(self) -> str:
        """The report in Markdown."""
        parts = [
            *self._played(), *self._claims(), *self._evaluations(), *self._pictures(), *self._preferences(),
            *self._comparisons(), *self._goals(), *about_kick_offs(self.games),
            *about_sensitivity(self.games, self.growth), *self._table_3(),
        ]
        return "\n\n".join(parts) + "\n"

    def _played(self) -> Iterator[str]:
        yield "# Seasons: an apprentice that learns by watching"
        yield (
            f"Made by {self.software} from the tables `games`, `growth` and `evaluations` and from the "
            "best apprentices' policies. All intervals are 95 % intervals over seasons. A season is one "
            "apprentice; its games are not independent. Lines in plots are means over seasons, bands are "
            "their intervals.")
        yield f"**{self._people()}**"
        yield "## Seasons and matches played"
        yield _renamed(played(self.games), {
            "lead": "apprentice's lead", "minutes": "minutes a game", "situations": "situations a game",
            "knowledge": "last knowledge version", "policy": "last policy version",
        })
        if BEST in self.games["settings"]:
            yield (f"An apprentice of `{BEST}` plays {named(BEST).practice} more matches beside each game, "
                   "for learning only. Its ablations do so, too, unless they vary this.")
        again = ("These commands make the study again, but for what people do:"
                 if PERSON in self.games["opponent"] else "These commands make the study again:")
        yield again
        yield code((*commands(self.games), *evaluating(self.games, self.evaluations), "pitchlore report"))
        yield ("In a checkout, `make seasons` runs all commands of the study that comes with Pitchlore. It "
               "takes about three hours on two free cores.")

    def _people(self) -> str:
        """The note on what stands beside the paper's human column, and what it is evidence of."""
        mine = self.games.filter(pl.col("opponent") == PERSON)
        script = f"{STAND_IN}. It has delays, noise and changing tactics"
        if not mine.height:
            return (f"{script}. The paper's opponents were people with joysticks. Here nobody has played a "
                    "season yet: claims about humans are measured against the second script, and nothing is "
                    "evidence about people.")
        return (
            f"Seasons that people played: {mine['season'].n_unique()}, games: {mine.height}. Those of "
            f"`{PAPER}` stand beside the paper's human column. A person drove one robot at a time, with "
            "keyboard or gamepad; the static team's rules drove the others. Games left before their end, and "
            f"played anew: {mine['left'].sum()}. {script}.")

    def _claims(self) -> Iterator[str]:
        yield "## Claims and verdicts"
        items, given = pl.col("item"), pl.col("verdict") == "by construction"
        groups = {"The paper": ~items.is_in([ABLATION, AIM]), "Ours on ablations": items == ABLATION,
                  "Our aims": items == AIM}
        lines = [f"- {whose}, {counted(self.claims.filter(mine, ~given)['verdict'])}."
                 for whose, mine in groups.items()]
        if (left := self.claims.filter(given)).height:
            aims = left.filter(items == AIM).height
            lines.append(f"- {aims} of our aims and {left.height - aims} other claims hold by construction"
                         " and are not counted.")
        yield "\n".join(lines)
        yield (
            "*Reproduced*: the interval lies wholly inside the claimed range. *Contradicted*: wholly "
            "outside. *Not reproduced*: neither, so the claim is neither shown nor refuted. "
            "*Contradictory*: the paper's own Table 3 has a number outside the claimed range, whatever we "
            "measured. *By construction*: every run of this system fulfils the claim, so it is no "
            f"evidence. *Not judged*: there are fewer than {LEAST_SEASONS} seasons of {GAMES} games.")
        yield (
            f"Our aims concern the apprentice after {GAMES} games against the static team. They are "
            f"measured by its evaluations and by its games {LATE[0]} to {LATE[1]}. The interval of a rate "
            f"is {_OF_RATES.format('its games or matches')}. `{BEST}` spends all its time from game 2 on in "
            "learned behaviours. This holds by construction: its key has one state per role, which it knows. "
            "A constant team's time all counts as learned, too. To win against the random team takes no "
            "learning either: constant teams do. The number of actions in a game holds by construction as "
            "well: nearly all are \"moves randomly\", which lasts 0.4 s by our choice.")
        head = ("item", "claim", "seasons of", "quantity", "claimed", "paper's table", "measured", "seasons",
                "verdict")
        rows = [
            (row["item"], row["claim"], f"{row['settings']}, {called(row['opponent'])}", row["quantity"],
             row["stated"], number(row["table_3"]), interval(row["measured"], row["low"], row["high"]),
             number(row["seasons"]), row["verdict"])
            for row in self.claims.iter_rows(named=True)
        ]
        yield table(head, rows, (*[False] * 5, *[True] * 3, False))

    def _evaluations(self) -> Iterator[str]:
        yield "## Evaluations of the apprentices, and of constant teams"
        left = (f" Left out: {self.left_out} pairs of an earlier policy, with other options or laws, or by "
                "other code." if self.left_out else "")
        yield (
            "Each apprentice plays with the policy of its last game; it neither explores nor learns. Matches "
            "come in pairs with sides swapped and are as long as the games of its season. Goals and wins are "
            "means over the seasons, one apprentice each. The interval of a rate is "
            f"{_OF_RATES.format('pairs')}. In a constant team every robot always takes one behaviour: 044 "
            "reaches the ball, 021 kicks it to the adversary's goal. best-constant has a behaviour for each "
            "role, which searches found best against the static team. Constant teams play the same pairs, "
            f"and their means are over pairs.{left}")
        names = {"opponent": "trained against", "against": "measured against"}
        yield _with_intervals(
            measured(self.games, self.evaluations).rename(names),
            ("settings", "trained against", "games", "measured against", "seasons", "matches"))

    def _pictures(self) -> Iterator[str]:
        for name, (title, caption) in PICTURES.items():
            if name in self.pictures:
                yield f"## {title}"
                yield picture(name, caption)

    def _preferences(self) -> Iterator[str]:
        best = self.games.filter(pl.col("settings").is_in([BEST, IN_GAMES]))
        if not best.height:
            return
        unknown = best.join(self.preferences, on="season", how="anti")["season"].unique().sort()
        left = (f" {', '.join(unknown)} cannot be listed: the policy is gone, or its key has other states."
                if unknown.len() else "")
        yield "## Preferred behaviours of our best apprentices"
        yield (
            "Their key tells roles apart and nothing else. An apprentice therefore prefers one behaviour "
            "in each role and repeats it. It answers the opponent by who has which role and by the control "
            f"within a situation. The value of the behaviour is in brackets: goals, discounted.{left}")
        yield _renamed(side_by_side(self.preferences), {"opponent": "trained against"})

    def _comparisons(self) -> Iterator[str]:
        games = self.games.filter(~varied())
        yield "## Settings beside each other"
        yield (f"The last {LAST} games of each season. The learned share is of the robots' time. Brief "
               "decisions last two frames or fewer (1/30 s). Wins and losses are shares of these games; "
               f"their intervals are {_OF_RATES.format('these games')}.")
        yield _with_intervals(compared(games), ("settings", "opponent", "seasons"))
        yield "## Effect of each change"
        yield (
            f"Each ablation minus the settings that it varies, over the last {LAST} games that all their "
            "seasons have, with Welch's interval. Seasons of one seed share the chances of their first "
            "game and no more. If twenty changes had no effect, one would still be told apart by chance.")
        yield _ablated(ablated(games, (PAPER, BEST)))

    def _goals(self) -> Iterator[str]:
        yield "## How goals came about"
        yield ("Goals in each game, means over the seasons: by direct action, by indirect action, by an "
               "error of the other team, and of unknown origin (paper, Figure 10; the rules are ours).")
        kinds = ("direct", "indirect", "error", "unknown")
        yield _renamed(attributed(self.games), {
            "goals_for": "goals for", "goals_against": "goals against",
            **{f"{kind}_against": kind for kind in kinds},
        })

    def _table_3(self) -> Iterator[str]:
        yield "## Table 3, game by game"
        yield (
            f"Our numbers are means over the seasons of the settings `{PAPER}`; the paper's are as "
            "printed. For Yamamoto's game 10 the paper prints 5,230 actions, 5,239 of them random: one "
            "number is a slip.")
        counts = ("total", "random", "other")
        head = ("game", *counts, "other, %", "other, % of time",
                *(f"the paper's {name}" for name in counts), "the paper's %")
        columns = beside_table_3(self.games, PAPER).partition_by("opponent", as_dict=True)
        for (opponent,), games in columns.items():
            yield "### Against " + {
                STATIC: f"the static team (the score changes at game {CHANGE})", PERSON: "people",
            }.get(str(opponent), f"{called(str(opponent))}, beside the paper's human column")
            rows = [
                (str(row["game"]), *(number(row[name], 0) for name in counts),
                 interval(row["pct"], row["low"], row["high"], 2), number(row["time_pct"], 2),
                 *(number(row[f"paper_{name}"], 0) for name in counts), number(row["paper_pct"], 2))
                for row in games.iter_rows(named=True)
            ]
            yield table(head, rows, [True] * len(head))


def commands(games: pl.DataFrame) -> Iterator[str]:
    """Commands that play the seasons again, one for each row of consecutive seeds.

    Settings that are not in the package are a file of their name.
    """
    there = names()
    for (settings, opponent), mine in games.partition_by("settings", "opponent", as_dict=True).items():
        lengths = mine.group_by("seed").agg(pl.col("game").max()).sort("seed")
        runs = lengths.with_columns(run=(
            (pl.col("seed").diff() != 1) | (pl.col("game").diff() != 0)).fill_null(value=True).cum_sum())
        for run in runs.partition_by("run"):
            seed, last = run.select("seed", "game").row(0)
            length = "" if last == GAMES else f" --games {last}"
            word = settings if settings in there else f"{settings}.toml"
            words = f"pitchlore season --settings {word} --opponent {opponent}"
            if opponent == PERSON:  # one at a time
                yield from (f"{words} --seed {seed + number}{length}" for number in range(run.height))
            else:
                yield f"{words} --seed {seed} --seasons {run.height}{length}"


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


def _ablated(rows: pl.DataFrame) -> str:
    """Table of the ablations; the direction of the change is named if the interval excludes 0."""
    low, high = pl.col("difference_low"), pl.col("difference_high")
    told = (pl.when(low > 0).then(pl.lit("better")).when(high < 0).then(pl.lit("worse"))
            .otherwise(pl.lit("not told apart")))
    named_columns = rows.select(
        "settings", pl.col("base").alias("minus"), "opponent",
        pl.format("{} and {}", "seasons", "seasons_base").alias("seasons"),
        pl.format("{} to {}", "first", "last").alias("games"),
        pl.col("^difference.*$"), pl.col("^other.*$"), told.alias("with the change"),
    )
    return _with_intervals(
        named_columns, ("settings", "minus", "opponent", "seasons", "games"), ("with the change",))


#: Heading and factor of each column that has an interval.
_WITH_INTERVALS = {"difference": ("goal difference a game", 1), "other": ("learned, % of time", 1),
                   "brief": ("brief decisions, %", 1), "won": ("won, %", 100), "lost": ("lost, %", 100)}


def _with_intervals(rows: pl.DataFrame, first: tuple[str, ...], last: tuple[str, ...] = ()) -> str:
    """Table of the ``first`` columns, those of :data:`_WITH_INTERVALS` that there are, and the ``last``."""
    names = {name: label for name, label in _WITH_INTERVALS.items() if name in rows.columns}
    scaled = rows.with_columns(
        pl.col(f"{name}{end}") * factor
        for name, (_, factor) in names.items() for end in ("", "_low", "_high"))
    return estimates(scaled, {name: label for name, (label, _) in names.items()}, first, last)


def _renamed(rows: pl.DataFrame, names: Mapping[str, str]) -> str:
    """Table of the rows, some columns under other names."""
    head = [names.get(name, name) for name in rows.columns]
    cells = [[cell(value) for value in row] for row in rows.iter_rows()]
    return table(head, cells, [dtype.is_numeric() for dtype in rows.dtypes])
