"""What is written of seasons: a document made of their tables and plots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import polars as pl

from pipeline.document import Block, Code, Grid, Heading, Picture, Sentences
from pipeline.seasons.claims import LATE, PAPER, WINNING
from pipeline.seasons.judging import LEAST_SEASONS
from pipeline.seasons.summary import LAST, attributed, beside_table_3, compared, played
from pipeline.seasons.table3 import CHANGE, GAMES
from schemas import STAND_IN

#: What must be said beside every result.
STANDS_IN = (
    f"{STAND_IN}. It has delays, noise and changing tactics; the paper had people with joysticks, whom we do "
    "not have: nothing here is evidence about people."
)

#: Verdicts that are coloured on the web page: what holds, what does not, what the paper denies itself.
_COLOURS = (
    ("reproduced", "#00644a"), ("reached", "#00644a"),
    ("contradicted", "#a33f00"), ("not reached", "#a33f00"),
    ("contradictory", "#8a3d70"), ("not reproduced", "#555"),
)

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
        "Against the static team, one thing changed at a time. The line: the paper changes the score.",
    ),
    "ablations-best": (
        "Ablations of our best settings", "Against the static team, with one thing changed at a time.",
    ),
}


@dataclass(frozen=True, slots=True)
class Report:
    """What the document is made of.

    Attributes:
        games: schema Games.
        claims: schema Claims.
        pictures: PNG by name, of :data:`PICTURES`.
        software: name and version of what made it.
    """

    games: pl.DataFrame
    claims: pl.DataFrame
    pictures: Mapping[str, bytes]
    software: str


def document(report: Report) -> list[Block]:
    """The report in order: what was played, claims, plots, settings compared, goals, Table 3."""
    blocks: list[Block] = [
        Heading("Seasons: an apprentice that learns by watching", 1),
        Sentences(f"Made by {report.software} from the tables `games` and `growth`. Intervals are 95 %, over "
                  "seasons: a season is one apprentice, its games are not independent. Lines in plots are "
                  "means over seasons, bands their intervals."),
        Sentences(f"**{STANDS_IN}**"),
        Heading("What was played"),
        _grid(played(report.games), {
            "settings": "settings", "opponent": "opponent", "seasons": "seasons", "seeds": "seeds",
            "games": "games", "lead": "apprentice's lead", "minutes": "minutes a game",
            "situations": "situations a game", "knowledge": "last knowledge version",
            "policy": "last policy version",
        }),
        Code((*commands(report.games), "pitchlore report")),
        Heading("What is claimed, and what is seen"),
        Sentences(_verdicts_in_words(report.claims)),
        _claims(report.claims),
    ]
    for name, (title, caption) in PICTURES.items():
        if name in report.pictures:
            blocks += [Heading(title), Picture(name, caption, report.pictures[name])]
    blocks += [
        Heading("Settings beside each other"),
        Sentences(f"The last {LAST} games of each season. Wins and losses are shares of these games, with "
                  "Wilson's interval over games."),
        _compared(compared(report.games)),
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


def _verdicts_in_words(claims: pl.DataFrame) -> str:
    counts = claims.group_by(pl.col("verdict").cast(pl.String)).len().sort("len", "verdict",
                                                                        descending=[True, False])
    said = ", ".join(f"{count} {verdict}" for verdict, count in counts.iter_rows())
    return (
        f"{claims.height} claims: {said}. *Reproduced*: the interval lies inside of what is claimed; "
        "*contradicted*: wholly outside; *not reproduced*: neither shown nor refuted; *contradictory*: the "
        f"paper's own Table 3 says otherwise; *not judged*: fewer than {LEAST_SEASONS} seasons of {GAMES} "
        f"games. Our aims are measured over games {LATE[0]} to {LATE[1]}, the win rate over games "
        f"{WINNING[0]} to {WINNING[1]} with Wilson's interval over games."
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
    names = {"difference": ("goal difference a game", 1), "other": ("learned actions, %", 1),
             "won": ("won, %", 100), "lost": ("lost, %", 100)}
    percent = table.with_columns(
        pl.col(f"{name}{end}") * scale for name, (_, scale) in names.items() for end in ("", "_low", "_high"))
    rows = tuple(
        (row["settings"], row["opponent"], _number(row["seasons"]),
         *(_interval(row[name], row[f"{name}_low"], row[f"{name}_high"]) for name in names))
        for row in percent.iter_rows(named=True)
    )
    head = ("settings", "opponent", "seasons", *(label for label, _ in names.values()))
    return Grid(head, rows, (False,) * 2 + (True,) * 5)


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
    rows = tuple(tuple(value if isinstance(value, str) else _number(value) for value in row)
                 for row in shown.iter_rows())
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
