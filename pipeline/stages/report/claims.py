"""The paper's claims about its seasons.

The measures are in :mod:`pipeline.stages.report.measures`, the verdicts' rule in
:mod:`pipeline.numbers.claims`. The paper gives numbers without a spread, since it played one season for each
column: "about" means from half to double of its number. "Almost none" of the static column's other actions is
at most a tenth of the column's mean from the change of the score on: 0.33 %.

Some claims hold in every run of a system like ours: a first game has no policy to play, known states and
behaviours are never forgotten and new ones always appear, behaviours come from training alone. Three robots
that move randomly for 0.4 s at a time decide 3,600 times in eight minutes, whatever is learned. Such claims
are judged like the others. Their verdict, by construction, says that they are no evidence, and no tally
counts them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import polars as pl

from pitchlore.pipeline.numbers.claims import ABOVE, BELOW, Claim, Range, findings
from pitchlore.pipeline.stages.report.measures import (
    EFFECTIVE,
    OTHER,
    Pooling,
    SeasonMeasure,
    Seasons,
    both,
    greatest_in_games,
    grown_without_training,
    known,
    least_step,
    less,
    mean_in_games,
    overall_other,
    paper_value,
    season_evidence,
    slope,
    total,
)
from pitchlore.pipeline.stages.report.table3 import CHANGE, GAMES
from pitchlore.schemas import ROLES, Claims

#: Names of settings: as close to the paper as its text allows; the same without the score in the state; our
#: best; our best without practice matches.
PAPER, WITHOUT_SCORE, BEST, IN_GAMES = "paper", "paper-full35", "best", "best-in-games"
STATIC = "static"
#: The paper's human column. Beside it stand our seasons against a person; if there are none, those against a
#: second script (:func:`pipeline.stages.report.table3.beside`).
HUMAN = "humans"

#: Least share of time in learned behaviours that we aim at, %.
LEARNED = 90.0
#: Seasons that are enough to judge a claim.
LEAST_SEASONS = 5

ZERO = Range("0", 0.0, 0.0)
ALL = Range("1", 1.0, 1.0)
NOT_BELOW = Range("at least 0", low=0.0)
LOW_RATE = Range("at most 8 %", high=8.0)
#: A tenth of 3.27 %, the static column's mean over games 11 to 35.
ALMOST_NONE = Range("at most 0.33 % (almost none)", high=0.33)
MOST = Range("more than half", low=0.5, strict=True)


def _claim(
    item: str, text: str, sides: tuple[tuple[str, str], ...], quantity: str, measure: SeasonMeasure,
    stated: Range, *, pooling: Pooling = "mean", in_table_3: bool = False, by_construction: bool = False,
) -> Claim[Seasons]:
    """Claim about seasons; see :func:`pipeline.stages.report.measures.season_evidence` for the arguments."""
    evidence = season_evidence(sides, measure, pooling, in_table_3=in_table_3)
    return Claim(item, text, quantity, stated, evidence, by_construction=by_construction)


def _table_3(
    text: str, opponent: str, quantity: str, measure: SeasonMeasure, stated: Range, *,
    pooling: Pooling = "mean", by_construction: bool = False,
) -> Claim[Seasons]:
    """Claim about one of Table 3's columns."""
    return _claim("Table 3", text, ((PAPER, opponent),), quantity, measure, stated, pooling=pooling,
                 in_table_3=True, by_construction=by_construction)


def _about(
    text: str, quantity: str, measure: SeasonMeasure, unit: str = "",
    kinds: tuple[str, ...] = (HUMAN, STATIC), *, by_construction: bool = False,
) -> Iterator[Claim[Seasons]]:
    """Claims that a quantity is about as great as in the paper's columns."""
    for kind in kinds:
        value = paper_value(measure, kind)
        about = Range(f"about {value:,.4g}{unit} (half to double)", value / 2, 2 * value)
        yield _table_3(text, kind, quantity, measure, about, pooling="percent" if unit else "count",
                       by_construction=by_construction)


_BEFORE = mean_in_games(OTHER, 1, CHANGE - 1)
_AFTER = mean_in_games(OTHER, CHANGE, CHANGE + 9)
#: Rise of other actions after the change of the score, %.
JUMP = less(_AFTER, _BEFORE)
#: 1 if other actions are almost none before the change of the score and more than that after, else 0.
EVOLVES = both(_BEFORE, _AFTER, lambda before, after: before <= ALMOST_NONE.high < after)
_SOME = pl.col("other_actions") > 0
_EARLY, _LATER = (1, CHANGE - 1), (CHANGE, GAMES)
_BOTH = ((PAPER, HUMAN), (PAPER, STATIC))
_REVERSED = ((PAPER, STATIC), (PAPER, HUMAN))

CLAIMS: tuple[Claim[Seasons], ...] = (
    *(_table_3("The first game knows only random actions", kind, "other actions in game 1, %",
               mean_in_games(OTHER, 1, 1), ZERO, pooling="percent", by_construction=True)
      for kind in (HUMAN, STATIC)),
    _table_3("Against humans new actions are used from game 2 on", HUMAN, "other actions in game 2, %",
             mean_in_games(OTHER, 2, 2), ABOVE, pooling="percent"),
    _table_3("Against humans new actions are used in every game from game 2 on", HUMAN,
             f"share of games 2 to {GAMES} with other actions", mean_in_games(_SOME, 2, GAMES), ALL,
             pooling="share"),
    _table_3("Against humans new actions grow in the first ten games", HUMAN,
             "slope of other actions in games 1 to 10, % a game", slope(OTHER, *_EARLY), ABOVE),
    _table_3("After these the progress is slower", HUMAN,
             f"slope in games 11 to {GAMES} less that in games 1 to 10, % a game",
             less(slope(OTHER, *_LATER), slope(OTHER, *_EARLY)), BELOW),
    _table_3("… but with a tendency to increase", HUMAN,
             f"slope of other actions in games 11 to {GAMES}, % a game", slope(OTHER, *_LATER), ABOVE),
    _table_3("Against the static team nothing evolves in the first ten games", STATIC,
             "other actions in games 1 to 10, mean %", _BEFORE, ALMOST_NONE, pooling="percent"),
    _table_3("… and it does from game 11 on, when the score is changed", STATIC,
             "other actions in game 11 less those in games 1 to 10, %",
             less(mean_in_games(OTHER, CHANGE, CHANGE), _BEFORE), ABOVE),
    _table_3("… and it does from game 11 on, when the score is changed", STATIC,
             "other actions in games 11 to 20 less those in games 1 to 10, mean %", JUMP, ABOVE),
    _claim("Table 3", "Both halves of this hold in a season", ((PAPER, STATIC),),
          "share of seasons with almost none in games 1 to 10 and more in games 11 to 20",
          EVOLVES, MOST, pooling="seasons"),
    *(_table_3("The rate of new actions stays low", kind, "greatest share of other actions in a game, %",
               greatest_in_games(OTHER, 1, GAMES), LOW_RATE, pooling="percent") for kind in (HUMAN, STATIC)),
    *(_table_3("The column falls back to zero in some later games", kind,
               f"games of 12 to {GAMES} without other actions",
               total((~_SOME).cast(pl.Int64), CHANGE + 1, GAMES), ABOVE, pooling="count")
      for kind in (HUMAN, STATIC)),
    _claim("Table 3", "Against humans more new actions are executed", _BOTH,
          f"other actions in games 11 to {GAMES}, mean %", mean_in_games(OTHER, *_LATER), ABOVE,
          pooling="percent",
          in_table_3=True),
    _claim("Table 3", "Against humans more new actions are executed", _BOTH,
          "other actions in the season", total(pl.col("other_actions"), 1, GAMES), ABOVE, in_table_3=True),
    *_about("Actions in a game", "actions a game, mean", mean_in_games(pl.col("actions"), 1, GAMES),
            by_construction=True),
    *_about("New actions over all games", "other of all actions, %", overall_other(1, GAMES), " %"),
    *_about("New actions in games 1 to 10", "other actions in games 1 to 10, mean %", _BEFORE, " %",
            kinds=(HUMAN,)),
    *_about("New actions in games 11 to 20", "other actions in games 11 to 20, mean %", _AFTER, " %"),
    *_about("New actions in games 21 to 35", "other actions in games 21 to 35, mean %",
            mean_in_games(OTHER, 21, GAMES), " %"),

    *(_claim("Figure 8", "The number of states never falls", ((PAPER, kind),),
            "least change of a role's states from game to game", least_step("states", 1, GAMES), NOT_BELOW,
            by_construction=True) for kind in (HUMAN, STATIC)),
    *(_claim("Figure 8", f"States increase during {when}", ((PAPER, kind),),
            f"{column.replace('_', ' ')} after game {GAMES} less those after game 1, all roles",
            less(known(column, GAMES), known(column, 1)), ABOVE, by_construction=True)
      for column, when in (("states_played", "playing"), ("states_seen", "training"))
      for kind in (HUMAN, STATIC)),
    *(_claim("Figure 8", f"Against the static team the {role} knows more states", _REVERSED,
            f"states after game {GAMES}", known("states", GAMES, (role,)), ABOVE) for role in ROLES),
    *(_claim("Figure 9", "Actions increase only during training", ((PAPER, kind),),
            "behaviours gained over games that no new knowledge followed",
            grown_without_training("behaviours", 1, GAMES), ZERO, by_construction=True)
      for kind in (HUMAN, STATIC)),
    *(_claim("Figure 9", "Actions increase during training", ((PAPER, kind),),
            f"behaviours after game {GAMES} less those after game 1, all roles",
            less(known("behaviours", GAMES), known("behaviours", 1)), ABOVE, by_construction=True)
      for kind in (HUMAN, STATIC)),
    *(_claim("Figure 9", f"Against the static team the {role} knows more actions", _REVERSED,
            f"{what} after game {GAMES}", known(column, GAMES, (role,)), ABOVE)
      for column, what in (("behaviours", "distinct behaviours"), ("pairs", "pairs of state and behaviour"))
      for role in ROLES),
    *(_claim("Figure 10", "Trained against humans it makes more goals", _BOTH, f"{what}, mean a game",
            mean_in_games(value, 1, GAMES), ABOVE)
      for value, what in ((EFFECTIVE, "goals by direct or indirect action"),
                          (pl.col("direct"), "goals by direct action alone"))),
)


def season_verdicts(seasons: Seasons, claims: Iterable[Claim[Seasons]] = CLAIMS) -> pl.DataFrame:
    """Schema Claims: one row for each claim, in their order.

    A claim without seasons is not judged, unless the paper's own Table 3 contradicts it.
    """
    rows = findings(claims, seasons, LEAST_SEASONS)
    return Claims.validate(pl.DataFrame(list(rows), schema=Claims.dtypes()), cast=True)
