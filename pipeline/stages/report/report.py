"""The report on seasons: its sections in Markdown, made of their tables.

A section is a function that yields its paragraphs; :func:`markdown` puts them in order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

import polars as pl

from pitchlore.pipeline.numbers.claims import counted
from pitchlore.pipeline.stages.report.claims import BEST, LEAST_SEASONS, PAPER, STATIC
from pitchlore.pipeline.stages.report.document import interval, markdown_table, number, picture
from pitchlore.pipeline.stages.report.sensitivity import varied_settings
from pitchlore.pipeline.stages.report.summary import (
    LAST,
    attributed,
    beside_table_3,
    measured,
    seasons_played,
    settings_compared,
)
from pitchlore.pipeline.stages.report.table3 import CHANGE, GAMES
from pitchlore.pipeline.stages.seasons.settings import named_settings
from pitchlore.schemas import STAND_IN, called
from pitchlore.schemas.seasons import PERSON

#: Colours of verdicts on the web page: fulfilled, not fulfilled, denied by the paper's own table, undecided.
COLOURS = {
    "reproduced": "#00644a", "contradicted": "#a33f00", "contradictory": "#8a3d70", "not reproduced": "#555",
    "by construction": "#555",
}

#: Interval of a share of games or matches.
OF_RATES = "the wider of Student's over the seasons and Wilson's over all {}"

#: Title and caption of each plot, by its name.
PICTURES: Mapping[str, tuple[str, str]] = MappingProxyType({
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
})


def markdown(
    games: pl.DataFrame, evaluations: pl.DataFrame, left_out: int, claims: pl.DataFrame,
    pictures: Sequence[str], software: str,
) -> str:
    """The report in Markdown.

    Args:
        games: schema Games.
        evaluations: schema Evaluations, of the seasons' apprentices.
        left_out: pairs of matches of these apprentices that do not count.
        claims: schema Claims.
        pictures: names of the plots that there are, of :data:`PICTURES`.
        software: name and version of the program.
    """
    parts = [
        *about_played(games, software), *about_claims(claims),
        *about_evaluations(games, evaluations, left_out), *about_pictures(PICTURES, pictures),
        *about_comparisons(games), *about_goals(games), *about_table_3(games),
    ]
    return "\n\n".join(parts) + "\n"


def about_played(games: pl.DataFrame, software: str) -> Iterator[str]:
    """Title, and the seasons that there are."""
    yield "# Seasons: an apprentice that learns by watching"
    yield (
        f"Made by {software} from the tables `games`, `growth` and `evaluations`. All intervals are 95 % "
        "intervals over seasons. A season is one apprentice; its games are not independent. Lines in plots "
        "are means over seasons, bands are their intervals.")
    yield f"**{_people(games)}**"
    yield "## Seasons and matches played"
    yield renamed(seasons_played(games), {
        "lead": "apprentice's lead", "minutes": "minutes a game", "situations": "situations a game",
        "knowledge": "last knowledge version", "policy": "last policy version",
    })
    if BEST in games["settings"]:
        practice = named_settings(BEST).practice
        yield (f"An apprentice of `{BEST}` plays {practice} more matches beside each game, for learning only."
               " Its ablations do so, too, unless they vary this.")


def _people(games: pl.DataFrame) -> str:
    """The note on what stands beside the paper's human column, and what it is evidence of."""
    mine = games.filter(pl.col("opponent") == PERSON)
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


def about_claims(
    claims: pl.DataFrame, groups: Mapping[str, pl.Expr] = MappingProxyType({"The paper": pl.lit(value=True)}),
    remark: str = "",
) -> Iterator[str]:
    """Verdicts on the claims.

    Args:
        claims: schema Claims.
        groups: claims that are counted together, by the words for their source.
        remark: paragraph on their quantities.
    """
    yield "## Claims and verdicts"
    given, lines = pl.col("verdict") == "by construction", []
    for source, group in groups.items():
        left = claims.filter(group, given).height
        more = f" {left} more hold by construction and are not counted." if left else ""
        lines.append(f"- {source}, {counted(claims.filter(group, ~given)['verdict'])}.{more}")
    yield "\n".join(lines)
    yield (
        "*Reproduced*: the interval lies wholly inside the claimed range. *Contradicted*: wholly "
        "outside. *Not reproduced*: neither, so the claim is neither shown nor refuted. "
        "*Contradictory*: the paper's own Table 3 has a number outside the claimed range, whatever we "
        "measured. *By construction*: every run of this system fulfils the claim, so it is no "
        f"evidence. *Not judged*: there are fewer than {LEAST_SEASONS} seasons of {GAMES} games. The number "
        "of actions in a game holds by construction: nearly all are \"moves randomly\", which lasts 0.4 s "
        "by our choice.")
    if remark:
        yield remark
    head = ("item", "claim", "seasons of", "quantity", "claimed", "paper's table", "measured", "seasons",
            "verdict")
    rows = [
        (row["item"], row["claim"], f"{row['settings']}, {called(row['opponent'])}", row["quantity"],
         row["stated"], number(row["table_3"]), interval(row["measured"], row["low"], row["high"]),
         number(row["seasons"]), row["verdict"])
        for row in claims.iter_rows(named=True)
    ]
    yield markdown_table(head, rows, (*[False] * 5, *[True] * 3, False))


def about_evaluations(games: pl.DataFrame, evaluations: pl.DataFrame, left_out: int) -> Iterator[str]:
    """Evaluations of the apprentices, and of the constant teams beside them."""
    yield "## Evaluations of the apprentices, and of constant teams"
    left = (f" Left out: {left_out} pairs of an earlier policy, with other options or laws, or by "
            "other code." if left_out else "")
    yield (
        "Each apprentice plays with the policy of its last game; it neither explores nor learns. Matches "
        "come in pairs with sides swapped and are as long as the games of its season. Goals and wins are "
        "means over the seasons, one apprentice each. The interval of a rate is "
        f"{OF_RATES.format('pairs')}. In a constant team every robot always takes one behaviour: 044 "
        "reaches the ball, 021 kicks it to the adversary's goal. best-constant has a behaviour for each "
        "role, which searches found best against the static team. Constant teams play the same pairs, "
        f"and their means are over pairs.{left}")
    names = {"opponent": "trained against", "against": "measured against"}
    yield with_intervals(
        measured(games, evaluations).rename(names),
        ("settings", "trained against", "games", "measured against", "seasons", "matches"))


def about_pictures(captions: Mapping[str, tuple[str, str]], pictures: Sequence[str]) -> Iterator[str]:
    """Each plot that there is, with its caption."""
    for name, (title, caption) in captions.items():
        if name in pictures:
            yield f"## {title}"
            yield picture(name, caption)


def about_comparisons(games: pl.DataFrame) -> Iterator[str]:
    """Settings beside each other, but variations of what the paper leaves open."""
    yield "## Settings beside each other"
    yield (f"The last {LAST} games of each season. The learned share is of the robots' time. Brief "
           "decisions last two frames or fewer (1/30 s). Wins and losses are shares of these games; "
           f"their intervals are {OF_RATES.format('these games')}.")
    others = settings_compared(games.filter(~varied_settings()))
    yield with_intervals(others, ("settings", "opponent", "seasons"))


def about_goals(games: pl.DataFrame) -> Iterator[str]:
    """Goals by kind."""
    yield "## How goals came about"
    yield ("Goals in each game, means over the seasons: by direct action, by indirect action, by an "
           "error of the other team, and of unknown origin (paper, Figure 10; the rules are ours).")
    kinds = ("direct", "indirect", "error", "unknown")
    yield renamed(attributed(games), {
        "goals_for": "goals for", "goals_against": "goals against",
        **{f"{kind}_against": kind for kind in kinds},
    })


def about_table_3(games: pl.DataFrame) -> Iterator[str]:
    """The paper's Table 3 beside ours, game by game."""
    yield "## Table 3, game by game"
    yield (
        f"Our numbers are means over the seasons of the settings `{PAPER}`; the paper's are as "
        "printed. For Yamamoto's game 10 the paper prints 5,230 actions, 5,239 of them random: one "
        "number is a slip.")
    counts = ("total", "random", "other")
    head = ("game", *counts, "other, %", "other, % of time",
            *(f"the paper's {name}" for name in counts), "the paper's %")
    columns = beside_table_3(games, PAPER).partition_by("opponent", as_dict=True)
    for (opponent,), rows in columns.items():
        yield "### Against " + {
            STATIC: f"the static team (the score changes at game {CHANGE})", PERSON: "people",
        }.get(str(opponent), f"{called(str(opponent))}, beside the paper's human column")
        cells = [
            (str(row["game"]), *(number(row[name], 0) for name in counts),
             interval(row["pct"], row["low"], row["high"], 2), number(row["time_pct"], 2),
             *(number(row[f"paper_{name}"], 0) for name in counts), number(row["paper_pct"], 2))
            for row in rows.iter_rows(named=True)
        ]
        yield markdown_table(head, cells, [True] * len(head))


#: Heading and factor of each column that has an interval.
_WITH_INTERVALS = {"difference": ("goal difference a game", 1), "other": ("learned, % of time", 1),
                   "brief": ("brief decisions, %", 1), "won": ("won, %", 100), "lost": ("lost, %", 100)}


def with_intervals(rows: pl.DataFrame, first: tuple[str, ...], last: tuple[str, ...] = ()) -> str:
    """Table of the ``first`` columns, those of :data:`_WITH_INTERVALS` that there are, and the ``last``."""
    names = {name: label for name, label in _WITH_INTERVALS.items() if name in rows.columns}
    scaled = rows.with_columns(
        pl.col(f"{name}{end}") * factor
        for name, (_, factor) in names.items() for end in ("", "_low", "_high"))
    return estimates(scaled, {name: label for name, (label, _) in names.items()}, first, last)


def estimates(
    rows: pl.DataFrame, headings: Mapping[str, str], first: tuple[str, ...], last: tuple[str, ...] = ()
) -> str:
    """Table of the ``first`` columns, those with intervals that ``headings`` names, and the ``last``."""
    cells = [
        (*(_cell(row[name]) for name in first),
         *(interval(row[name], row[f"{name}_low"], row[f"{name}_high"]) for name in headings),
         *(_cell(row[name]) for name in last))
        for row in rows.iter_rows(named=True)
    ]
    numbers = (rows.schema[name].is_numeric() for name in first)
    right = (*numbers, *[True] * len(headings), *[False] * len(last))
    return markdown_table((*first, *headings.values(), *last), cells, right)


def renamed(rows: pl.DataFrame, names: Mapping[str, str]) -> str:
    """Table of the rows, some columns under other names."""
    head = [names.get(name, name) for name in rows.columns]
    cells = [[_cell(value) for value in row] for row in rows.iter_rows()]
    return markdown_table(head, cells, [dtype.is_numeric() for dtype in rows.dtypes])


def _cell(value: str | float | None) -> str:
    """A name or a number, as tables of the report show it."""
    return called(value) if isinstance(value, str) else number(value)
