"""What is written of seasons: a document made of their tables and plots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import polars as pl

from pipeline.arena.physics.laws import RefereeSettings
from pipeline.studies.document import Block, Code, Grid, Heading, Picture, Sentences
from pipeline.studies.seasons.claims import ABLATION, AIM, BEST, IN_GAMES, LATE, PAPER
from pipeline.studies.seasons.judging import LEAST_SEASONS
from pipeline.studies.seasons.measures import distinct
from pipeline.studies.seasons.preferences import side_by_side
from pipeline.studies.seasons.settings import named
from pipeline.studies.seasons.summary import (
    LAST,
    ablated,
    attributed,
    beside_table_3,
    compared,
    measured,
    played,
)
from pipeline.studies.seasons.table3 import CHANGE, GAMES
from schemas import ROLES, STAND_IN
from schemas.evaluations import minutes_of, word_of

#: What must be said beside every result.
STANDS_IN = (
    f"{STAND_IN}. It has delays, noise and changing tactics; the paper had people with joysticks, whom we do "
    "not have: nothing here is evidence about people."
)

#: Verdicts that are coloured on the web page: what holds, what does not, what the paper denies itself.
_COLOURS = (
    ("reproduced", "#00644a"), ("reached", "#00644a"),
    ("contradicted", "#a33f00"), ("not reached", "#a33f00"),
    ("contradictory", "#8a3d70"), ("not reproduced", "#555"), ("by construction", "#555"),
)

#: How sure a share of games or matches is.
_OF_RATES = "the wider of Student's over the seasons and Wilson's over all they are shares of"

#: Name of a plot to its title and what is seen.
PICTURES: dict[str, tuple[str, str]] = {
    "table-3": (
        "Table 3: new actions",
        "Decisions of other behaviours than moves randomly, % of all in the game. Dots are the paper's own.",
    ),
    "figure-8": (
        "Figure 8: states", "States known after each game, seen in others or played in, by role.",
    ),
    "figure-9": (
        "Figure 9: actions",
        "Distinct behaviours, and pairs of state and behaviour (the paper does not say which), by role.",
    ),
    "figure-10": (
        "Figure 10: goals effectively made",
        "Goals by direct or indirect action, a game and added up; all goals less those against.",
    ),
    "best": (
        "Our best apprentice",
        "Goal difference and share of learned actions, game by game, against each opponent.",
    ),
    "ablations-paper": (
        "Ablations of the paper's settings",
        "One thing changed, against the static team; grey: none. Wide bands are cut. The line: a new score.",
    ),
    "ablations-best": (
        "Ablations of our best settings",
        "One thing changed, against the static team; grey: none. Wide bands are cut.",
    ),
}


@dataclass(frozen=True, slots=True)
class Report:
    """What the document is made of.

    Attributes:
        games: schema Games.
        evaluations: schema Evaluations, of the seasons' apprentices.
        left_out: pairs of matches of these seasons' apprentices that are not among them.
        preferences: what apprentices prefer to do, see
            :func:`pipeline.studies.seasons.preferences.side_by_side`.
        claims: schema Claims.
        pictures: PNG by name, of :data:`PICTURES`.
        software: name and version of what made it.
    """

    games: pl.DataFrame
    evaluations: pl.DataFrame
    left_out: int
    preferences: pl.DataFrame
    claims: pl.DataFrame
    pictures: Mapping[str, bytes]
    software: str


def document(report: Report) -> list[Block]:
    """The report in order: played, claims, evaluations, plots, preferences, settings, goals, Table 3."""
    blocks: list[Block] = [
        Heading("Seasons: an apprentice that learns by watching", 1),
        Sentences(f"Made by {report.software} from the tables `games`, `growth` and `evaluations`, and the "
                  "best apprentices' policies. Intervals are 95 %, over seasons: a season is one apprentice, "
                  "its games are not independent. Lines in plots are means over seasons, bands their "
                  "intervals."),
        Sentences(f"**{STANDS_IN}**"),
        Heading("What was played"),
        _grid(played(report.games), {
            "settings": "settings", "opponent": "opponent", "seasons": "seasons", "seeds": "seeds",
            "games": "games", "lead": "apprentice's lead", "minutes": "minutes a game",
            "situations": "situations a game", "knowledge": "last knowledge version",
            "policy": "last policy version",
        }),
        *([Sentences(f"Beside each game an apprentice of `{BEST}` plays {named(BEST).practice} matches that "
                     "count for learning only; what varies it does so, too, unless that is what it varies.")]
          if BEST in report.games["settings"] else []),
        Code((*commands(report.games), *evaluating(report.games, report.evaluations), "pitchlore report")),
        Heading("What is claimed, and what is seen"),
        Sentences(_verdicts_in_words(report.claims)),
        _claims(report.claims),
        Heading("Evaluations of the apprentices"),
        Sentences(_evaluations_in_words(report)),
        _measured(measured(report.games, report.evaluations)),
    ]
    for name, (title, caption) in PICTURES.items():
        if name in report.pictures:
            blocks += [Heading(title), Picture(name, caption, report.pictures[name])]
    best = report.games.filter(pl.col("settings").is_in([BEST, IN_GAMES]))
    if best.height:
        unknown = best.join(report.preferences, on="season", how="anti")["season"].unique().sort()
        blocks += [
            Heading("What our best apprentices do"),
            Sentences(
                "Their key tells roles apart and nothing else, so that an apprentice prefers one behaviour a "
                "role and does it again and again; what answers the adversary is who has which role, and the "
                "control within a situation. In brackets what it is worth: goals, discounted."
                + (f" Of {', '.join(unknown)} nobody can tell: their policies are gone, or look at more." if
                   unknown.len() else "")),
            _grid(side_by_side(report.preferences), {
                "settings": "settings", "opponent": "trained against", "season": "season",
                **dict(zip(ROLES, ROLES, strict=True)),
            }),
        ]
    blocks += [
        Heading("Settings beside each other"),
        Sentences(f"The last {LAST} games of each season. Wins and losses are shares of these games; their "
                  f"intervals are {_OF_RATES}."),
        _compared(compared(report.games)),
        Heading("What each change does"),
        Sentences(f"Ablations less what they vary, over the last {LAST} games that all their seasons have, "
                  "with Welch's interval: seasons of one seed have no more in common than the chances of "
                  "their first game. Of twenty changes that do nothing one is told apart by chance."),
        _ablated(ablated(report.games, (PAPER, BEST))),
        Heading("Who made the goals"),
        Sentences("Goals a game, means over the seasons: by direct action, by indirect action, by error of "
                  "the other team, and those of which it cannot be told (paper, Figure 10; rules of ours)."),
        _attributed(attributed(report.games)),
        Heading("Table 3, game by game"),
        Sentences(f"Ours are means over the seasons of the settings `{PAPER}`; the paper's numbers are as "
                  "printed. Of Yamamoto's game 10 it prints 5,230 actions, of which 5,239 random: a slip."),
    ]
    columns = beside_table_3(report.games, PAPER).partition_by("opponent", as_dict=True)
    for (opponent,), rows in columns.items():
        change = f" (the score is changed at game {CHANGE})" if opponent == "static" else ""
        blocks += [Heading(f"Against the {opponent} team{change}", 3), _table_3(rows)]
    return blocks


def commands(games: pl.DataFrame) -> Iterator[str]:
    """What plays the seasons again: one command for seeds that follow each other."""
    for (settings, opponent), mine in games.partition_by("settings", "opponent", as_dict=True).items():
        lengths = mine.group_by("seed").agg(pl.col("game").max()).sort("seed")
        runs = lengths.with_columns(run=(
            (pl.col("seed").diff() != 1) | (pl.col("game").diff() != 0)).fill_null(value=True).cum_sum())
        for run in runs.partition_by("run"):
            seed, last = run.select("seed", "game").row(0)
            length = "" if last == GAMES else f" --games {last}"
            yield (f"pitchlore season --settings {settings} --opponent {opponent} --seed {seed} "
                   f"--seasons {run.height}{length}")


def evaluating(games: pl.DataFrame, evaluations: pl.DataFrame) -> Iterator[str]:
    """What measures the seasons' apprentices again: one command for seeds that follow each other.

    Args:
        games: schema Games.
        evaluations: schema Evaluations.
    """
    counted = evaluations.join(distinct(games), left_on="team", right_on="season", how="semi")
    pairs = counted.group_by("team", "opponent", "duration_s", pair="seed").agg().sort(pl.all())
    usual = RefereeSettings().duration_s
    for (team, opponent, seconds), mine in pairs.partition_by(
        "team", "opponent", "duration_s", as_dict=True).items():
        minutes = "" if seconds == usual else f" --minutes {minutes_of(seconds)}"
        runs = mine.with_columns(run=(pl.col("pair").diff() != 1).fill_null(value=False).cum_sum())
        for run in runs.partition_by("run"):
            first = "" if run["pair"][0] == 0 else f" --seed {run['pair'][0]}"
            yield (f"pitchlore evaluate --policy {team} --against {word_of(opponent)}"
                   f" --matches {2 * run.height}{first}{minutes}")


def _verdicts_in_words(claims: pl.DataFrame) -> str:
    ours = pl.col("item").is_in([ABLATION, AIM])
    of_ablations, of_aims = (claims.filter(pl.col("item") == item) for item in (ABLATION, AIM))
    return (
        f"The paper's {_counted(claims.filter(~ours))}. Ours on ablations of its settings, "
        f"{_counted(of_ablations)}. Our aims, {_counted(of_aims)}. *Reproduced*: the interval lies inside of "
        "what is claimed; *contradicted*: wholly outside; *not reproduced*: neither shown nor refuted; "
        "*contradictory*: the paper's own Table 3 says otherwise (a number without an interval), whatever "
        "ours shows; *by construction*: true of any run of this system, whatever is learned, hence no "
        f"evidence; *not judged*: fewer than {LEAST_SEASONS} seasons of {GAMES} "
        f"games. Our aims are measured by evaluations of the apprentice that {GAMES} games against the "
        f"static team have made, and by its games {LATE[0]} to {LATE[1]}; a rate's interval is {_OF_RATES}. "
        "That it uses what it learned is so by its key: there is one state a role, and it is known."
    )


def _counted(claims: pl.DataFrame) -> str:
    """How many claims have each verdict."""
    counts = claims.group_by(pl.col("verdict").cast(pl.String)).len().sort("len", "verdict",
                                                                        descending=[True, False])
    said = ", ".join(f"{count} {verdict}" for verdict, count in counts.iter_rows())
    return f"{claims.height} claims: {said}"


def _evaluations_in_words(report: Report) -> str:
    """What counts as an evaluation, and how many pairs do not."""
    left = ("" if not report.left_out else
            f" Left out: {report.left_out} pairs of an earlier policy, with other options or laws, or by "
            "other code.")
    return (
        "Each apprentice as its last game has left it, which tries nothing and learns nothing any more, in "
        "pairs of matches with sides swapped, as long as its season's games. Goals and wins are means over "
        f"the seasons, an apprentice each; intervals of rates are {_OF_RATES}, here pairs.{left}"
    )


def _claims(claims: pl.DataFrame) -> Grid:
    head = ("item", "claim", "seasons of", "quantity", "claimed", "paper's table", "measured", "seasons",
            "verdict")
    rows = tuple(
        (
            row["item"], row["claim"], f"{row['settings']}, {row['opponent']}", row["quantity"],
            row["stated"],
            _number(row["table_3"]), _interval(row["measured"], row["low"], row["high"]),
            _number(row["seasons"]), row["verdict"],
        )
        for row in claims.iter_rows(named=True)
    )
    return Grid(head, rows, (False,) * 5 + (True,) * 3 + (False,), _COLOURS)


def _compared(table: pl.DataFrame) -> Grid:
    return _with_intervals(table, ("settings", "opponent", "seasons"))


def _measured(table: pl.DataFrame) -> Grid:
    names = table.rename({"opponent": "trained against", "against": "measured against"})
    return _with_intervals(
        names, ("settings", "trained against", "games", "measured against", "seasons", "matches"))


def _ablated(table: pl.DataFrame) -> Grid:
    """Which way a change goes is said where the interval tells."""
    low, high = pl.col("difference_low"), pl.col("difference_high")
    told = (pl.when(low > 0).then(pl.lit("better")).when(high < 0).then(pl.lit("worse"))
            .otherwise(pl.lit("not told apart")))
    named = table.select(
        "settings", pl.col("base").alias("less"), "opponent",
        pl.format("{} and {}", "seasons", "seasons_base").alias("seasons"),
        pl.format("{} to {}", "first", "last").alias("games"),
        pl.col("^difference.*$"), pl.col("^other.*$"), told.alias("with the change"),
    )
    return _with_intervals(named, ("settings", "less", "opponent", "seasons", "games"), ("with the change",))


#: Columns with intervals: heading, and what they are multiplied by.
_MEASURED = {"difference": ("goal difference a game", 1), "other": ("learned actions, %", 1),
             "won": ("won, %", 100), "lost": ("lost, %", 100)}


def _with_intervals(table: pl.DataFrame, first: tuple[str, ...], last: tuple[str, ...] = ()) -> Grid:
    """Columns as they are, those of :data:`_MEASURED` that the table has, with intervals, others again."""
    names = {name: said for name, said in _MEASURED.items() if name in table.columns}
    percent = table.with_columns(
        pl.col(f"{name}{end}") * scale for name, (_, scale) in names.items() for end in ("", "_low", "_high"))
    rows = tuple(
        (*(_cell(row[name]) for name in first),
         *(_interval(row[name], row[f"{name}_low"], row[f"{name}_high"]) for name in names),
         *(_cell(row[name]) for name in last))
        for row in percent.iter_rows(named=True)
    )
    head = (*first, *(label for label, _ in names.values()), *last)
    right = (*(table.schema[name].is_numeric() for name in first), *[True] * len(names), *[False] * len(last))
    return Grid(head, rows, right)


def _cell(value: str | float | None) -> str:
    return value if isinstance(value, str) else _number(value)


def _attributed(table: pl.DataFrame) -> Grid:
    kinds = ("direct", "indirect", "error", "unknown")
    return _grid(table, {
        "settings": "settings", "opponent": "opponent", "seasons": "seasons",
        "goals_for": "goals for", **dict(zip(kinds, kinds, strict=True)),
        "goals_against": "goals against", **{f"{kind}_against": kind for kind in kinds},
    })


def _table_3(rows: pl.DataFrame) -> Grid:
    """One column of the paper's table beside ours."""
    counts = ("total", "random", "other")
    cells = tuple(
        (
            str(row["game"]), *(_number(row[name], 0) for name in counts),
            _interval(row["pct"], row["low"], row["high"], 2),
            *(_number(row[f"paper_{name}"], 0) for name in counts), _number(row["paper_pct"], 2),
        )
        for row in rows.iter_rows(named=True)
    )
    head = ("game", *counts, "other, %", *(f"the paper's {name}" for name in counts), "the paper's %")
    return Grid(head, cells, (True,) * 9)


def _grid(table: pl.DataFrame, names: Mapping[str, str]) -> Grid:
    """A table's columns under other names."""
    shown = table.select(pl.col(name) if table.schema[name].is_numeric() else pl.col(name).cast(pl.String)
                         for name in names)
    rows = tuple(tuple(_cell(value) for value in row) for row in shown.iter_rows())
    return Grid(tuple(names.values()), rows, tuple(dtype.is_numeric() for dtype in shown.dtypes))


def _number(value: float | None, places: int | None = None) -> str:
    """A number to so many places, or to about three digits (whole ones whole); a dash where there is none."""
    if value is None:
        return "–"
    if places is None:
        places = 0 if value == round(value) else _places(value)
    return f"{value:,.{places}f}"


def _interval(value: float | None, low: float | None, high: float | None, places: int | None = None) -> str:
    """``1.50 [1.20, 1.80]``, the value alone where there is no interval, all to the same places."""
    if value is None or low is None or high is None:
        return _number(value, places)
    if places is None:
        places = _places(max(abs(end) for end in (value, low, high)))
    return f"{value:,.{places}f} [{low:,.{places}f}, {high:,.{places}f}]"


def _places(value: float) -> int:
    """Places that a number of this size is written with."""
    return 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2 if abs(value) >= 0.1 else 3
