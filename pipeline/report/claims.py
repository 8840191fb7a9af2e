"""The paper's claims about its seasons, our claims about ablations, and our aims.

The measures are in :mod:`pipeline.report.measures`, the verdicts' rule in
:mod:`pipeline.numbers.claims`. The paper gives numbers without a spread, since it played one season for each
column: "about" means from half to double of its number. "Almost none" of the static column's other actions is
at most a tenth of the column's mean from the change of the score on: 0.33 %.

Our aims concern the apprentice after 35 games against the static team. It is measured by evaluations against
the static and the random team, in which it neither explores nor learns, and by the end of its learning curve.
Beside it stand constant teams: an apprentice that is no better than them has learned nothing worth having.

Some claims hold in every run of a system like ours: a first game has no policy to play, known states and
behaviours are never forgotten and new ones always appear, behaviours come from training alone. Three robots
that move randomly for 0.4 s at a time decide 3,600 times in eight minutes, whatever is learned. Our best
apprentice has one state a role, so it knows what to do in it. Such claims are judged like the others. Their
verdict, by construction, says that they are no evidence, and no tally counts them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import polars as pl

from pitchlore.pipeline.numbers.claims import ABOVE, BELOW, Claim, Range, findings
from pitchlore.pipeline.report.measures import (
    CONTROLS,
    DIFFERENCE,
    EFFECTIVE,
    NOTHING,
    OTHER,
    OTHER_TIME,
    WON,
    Pooling,
    SeasonMeasure,
    Seasons,
    SeasonTables,
    both,
    compared,
    evaluated,
    greatest,
    grown_without_training,
    known,
    least_step,
    less,
    mean,
    overall_other,
    pairs,
    printed,
    seasons_of,
    slope,
    total,
)
from pitchlore.pipeline.report.table3 import CHANGE, GAMES
from pitchlore.schemas import ROLES, Claims

#: Names of settings: as close to the paper as its text allows; our best; our best without practice matches;
#: the two ablations of the score.
PAPER, BEST, IN_GAMES, WITHOUT_SCORE, LEVEL = "paper", "best", "best-in-games", "paper-full35", "paper-level"
STATIC, RANDOM, SCRIPT = "static", "random", "human-like"
#: The paper's human column. Beside it stand our seasons against a person; if there are none, those against a
#: second script (:func:`pipeline.report.table3.beside`).
HUMAN = "humans"

#: Items of our own claims.
ABLATION, AIM = "ablation", "aim"
#: First and last of the games at the end of the learning curve.
LATE = (GAMES - 9, GAMES)
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
FEW = Range("less than half", high=0.5, strict=True)
MOSTLY_LEARNED = Range(f"at least {LEARNED:g} %", low=LEARNED)


def _claim(
    item: str, text: str, sides: tuple[tuple[str, str], ...], quantity: str, measure: SeasonMeasure,
    stated: Range, *, pooling: Pooling = "mean", trials: Callable[[SeasonTables], int] = lambda _: 1,
    in_table_3: bool = False, by_construction: bool = False,
) -> Claim[Seasons]:
    """Claim about seasons; see :func:`pipeline.report.measures.compared` for the arguments."""
    evidence = compared(sides, measure, pooling, trials, in_table_3=in_table_3)
    return Claim(item, text, quantity, stated, evidence, by_construction=by_construction, aim=item == AIM)


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
        value = printed(measure, kind)
        about = Range(f"about {value:,.4g}{unit} (half to double)", value / 2, 2 * value)
        yield _table_3(text, kind, quantity, measure, about, pooling="percent" if unit else "count",
                       by_construction=by_construction)


def _beats(text: str, settings: str) -> Claim[Seasons]:
    """Claim that apprentices of some settings beat the static team."""
    return _claim(AIM, text, ((settings, STATIC),), "goal difference a match in evaluations against static",
                 evaluated(DIFFERENCE, STATIC, GAMES), ABOVE)


def _wins(text: str, settings: str) -> Claim[Seasons]:
    """Claim that apprentices of some settings win against the random team."""
    return _claim(AIM, text, ((settings, STATIC),), "share won of evaluations against random",
                 evaluated(WON, RANDOM, GAMES), Range("at least 0.95", low=0.95), pooling="rate",
                 trials=pairs(RANDOM))


_BEFORE = mean(OTHER, 1, CHANGE - 1)
_AFTER = mean(OTHER, CHANGE, CHANGE + 9)
_JUMP = less(_AFTER, _BEFORE)
#: 1 if other actions are almost none before the change of the score and more than that after, else 0.
_EVOLVES = both(_BEFORE, _AFTER, lambda before, after: before <= ALMOST_NONE.high < after)
_SOME = pl.col("other_actions") > 0
_EARLY, _LATER = (1, CHANGE - 1), (CHANGE, GAMES)
_ABLATIONS = {WITHOUT_SCORE: "With the score out of the key", LEVEL: "Without the change of the score"}
_BOTH = ((PAPER, HUMAN), (PAPER, STATIC))
_REVERSED = ((PAPER, STATIC), (PAPER, HUMAN))

CLAIMS: tuple[Claim[Seasons], ...] = (
    *(_table_3("The first game knows only random actions", kind, "other actions in game 1, %",
               mean(OTHER, 1, 1), ZERO, pooling="percent", by_construction=True) for kind in (HUMAN, STATIC)),
    _table_3("Against humans new actions are used from game 2 on", HUMAN, "other actions in game 2, %",
             mean(OTHER, 2, 2), ABOVE, pooling="percent"),
    _table_3("Against humans new actions are used in every game from game 2 on", HUMAN,
             f"share of games 2 to {GAMES} with other actions", mean(_SOME, 2, GAMES), ALL, pooling="share"),
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
             less(mean(OTHER, CHANGE, CHANGE), _BEFORE), ABOVE),
    _table_3("… and it does from game 11 on, when the score is changed", STATIC,
             "other actions in games 11 to 20 less those in games 1 to 10, mean %", _JUMP, ABOVE),
    _claim("Table 3", "Both halves of this hold in a season", ((PAPER, STATIC),),
          "share of seasons with almost none in games 1 to 10 and more in games 11 to 20",
          _EVOLVES, MOST, pooling="seasons"),
    *(_table_3("The rate of new actions stays low", kind, "greatest share of other actions in a game, %",
               greatest(OTHER, 1, GAMES), LOW_RATE, pooling="percent") for kind in (HUMAN, STATIC)),
    *(_table_3("The column falls back to zero in some later games", kind,
               f"games of 12 to {GAMES} without other actions",
               total((~_SOME).cast(pl.Int64), CHANGE + 1, GAMES), ABOVE, pooling="count")
      for kind in (HUMAN, STATIC)),
    _claim("Table 3", "Against humans more new actions are executed", _BOTH,
          f"other actions in games 11 to {GAMES}, mean %", mean(OTHER, *_LATER), ABOVE, pooling="percent",
          in_table_3=True),
    _claim("Table 3", "Against humans more new actions are executed", _BOTH,
          "other actions in the season", total(pl.col("other_actions"), 1, GAMES), ABOVE, in_table_3=True),
    *_about("Actions in a game", "actions a game, mean", mean(pl.col("actions"), 1, GAMES),
            by_construction=True),
    *_about("New actions over all games", "other of all actions, %", overall_other(1, GAMES), " %"),
    *_about("New actions in games 1 to 10", "other actions in games 1 to 10, mean %", _BEFORE, " %",
            kinds=(HUMAN,)),
    *_about("New actions in games 11 to 20", "other actions in games 11 to 20, mean %", _AFTER, " %"),
    *_about("New actions in games 21 to 35", "other actions in games 21 to 35, mean %",
            mean(OTHER, 21, GAMES), " %"),

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
            mean(value, 1, GAMES), ABOVE)
      for value, what in ((EFFECTIVE, "goals by direct or indirect action"),
                          (pl.col("direct"), "goals by direct action alone"))),

    *(_claim(ABLATION, f"{without}, the static column does not wait for game 11", ((settings, STATIC),),
            "share of seasons with almost none in games 1 to 10 and more in games 11 to 20",
            _EVOLVES, FEW, pooling="seasons")
      for settings, without in _ABLATIONS.items()),
    *(_claim(ABLATION, f"{without}, the rise after game 10 is smaller",
            ((settings, STATIC), (PAPER, STATIC)),
            "other actions in games 11 to 20 less those in games 1 to 10, mean %", _JUMP, BELOW)
      for settings, without in _ABLATIONS.items()),
    _claim(ABLATION, "With the score out of the key, more new actions are used against the second script",
          ((WITHOUT_SCORE, SCRIPT), (PAPER, SCRIPT)), "other of all actions, %", overall_other(1, GAMES),
          ABOVE),

    _beats("The best apprentice beats the static team", BEST),
    *(_claim(AIM, f"It uses what it learned: against the {kind} team", ((BEST, STATIC),),
            f"time in other behaviours in evaluations against {kind}, mean %",
            evaluated(OTHER_TIME, kind, GAMES),
            MOSTLY_LEARNED, pooling="percent", by_construction=True) for kind in (STATIC, RANDOM)),
    _wins("It wins against the random team, too", BEST),
    _beats(f"One that has {GAMES} matches and no others beats the static team", IN_GAMES),
    _wins(f"One that has {GAMES} matches and no others wins against the random team", IN_GAMES),
    *(_claim(AIM, f"It beats the static team by more than a constant team does ({control})",
            ((BEST, STATIC), (control, NOTHING)), "goal difference a match in evaluations against static",
            evaluated(DIFFERENCE, STATIC, GAMES), ABOVE) for control in CONTROLS),
    _claim(AIM, "In its last games it beats the static team", ((BEST, STATIC),),
          f"goal difference in games {LATE[0]} to {LATE[1]}, mean", mean(DIFFERENCE, *LATE), ABOVE),
    *(_claim(AIM, "In its last games it uses what it learned", ((BEST, kind),),
            f"time in other behaviours in games {LATE[0]} to {LATE[1]}, mean %", mean(OTHER_TIME, *LATE),
            MOSTLY_LEARNED, pooling="percent", by_construction=True)
      for kind in (STATIC, SCRIPT)),
)


def verdicts(games: pl.DataFrame, growth: pl.DataFrame, evaluations: pl.DataFrame) -> pl.DataFrame:
    """Schema Claims: one row for each claim, in their order, from the tables Games, Growth and Evaluations.

    A claim without seasons is not judged, unless the paper's own Table 3 contradicts it.
    """
    rows = findings(CLAIMS, seasons_of(games, growth, evaluations), LEAST_SEASONS)
    return Claims.validate(pl.DataFrame(list(rows), schema=Claims.dtypes()), cast=True)
