"""Our claims about ablations of the score, and our aims.

The aims concern the apprentice after 35 games against the static team. It is measured by evaluations against
the static and the random team, in which it neither explores nor learns, and by the end of its learning curve.
Beside it stand constant teams: an apprentice that is no better than them has learned nothing worth having.
The best apprentice has one state a role, so it knows what to do in it: aims about learned actions hold by
construction.
"""

from __future__ import annotations

from collections.abc import Callable

from pitchlore.pipeline.numbers.claims import ABOVE, BELOW, Claim, Evidence, Range
from pitchlore.pipeline.stages.report.claims import (
    BEST,
    EVOLVES,
    IN_GAMES,
    JUMP,
    LEARNED,
    PAPER,
    STATIC,
    WITHOUT_SCORE,
)
from pitchlore.pipeline.stages.report.measures import (
    CONTROLS,
    DIFFERENCE,
    NOTHING,
    OTHER_TIME,
    WON,
    Pooling,
    SeasonMeasure,
    Seasons,
    SeasonTables,
    evaluated,
    mean_in_games,
    overall_other,
    pairs,
    season_evidence,
)
from pitchlore.pipeline.stages.report.table3 import GAMES

#: Items of these claims.
ABLATION, AIM = "ablation", "aim"
#: First and last of the games at the end of the learning curve.
LATE = (GAMES - 9, GAMES)

_RANDOM, _SCRIPT = "random", "human-like"
_WITHOUT = {WITHOUT_SCORE: "With the score out of the key", "paper-level": "Without the change of the score"}
_FEW = Range("less than half", high=0.5, strict=True)
_MOSTLY_LEARNED = Range(f"at least {LEARNED:g} %", low=LEARNED)


class Aim(Claim[Seasons]):
    """Claim that we aim at: it is reached, or it is not."""

    def verdict(self, evidence: Evidence, least: int) -> str:
        """Verdict by the rule of claims, in the words of an aim."""
        verdict = Claim.verdict(self, evidence, least)
        words = {"reproduced": "reached", "not reproduced": "not reached", "contradicted": "not reached"}
        return words.get(verdict, verdict)


def _ablation(
    text: str, sides: tuple[tuple[str, str], ...], quantity: str, measure: SeasonMeasure, stated: Range,
    pooling: Pooling = "mean",
) -> Claim[Seasons]:
    return Claim(ABLATION, text, quantity, stated, season_evidence(sides, measure, pooling))


def _aim(
    text: str, sides: tuple[tuple[str, str], ...], quantity: str, measure: SeasonMeasure, stated: Range,
    pooling: Pooling = "mean", trials: Callable[[SeasonTables], int] = lambda _: 1, *,
    by_construction: bool = False,
) -> Claim[Seasons]:
    return Aim(AIM, text, quantity, stated, season_evidence(sides, measure, pooling, trials),
               by_construction=by_construction)


def _beats(text: str, *sides: tuple[str, str]) -> Claim[Seasons]:
    """Aim that apprentices beat the static team, or beat it by more than others do."""
    return _aim(text, sides, "goal difference a match in evaluations against static",
                evaluated(DIFFERENCE, STATIC, GAMES), ABOVE)


def _wins(text: str, settings: str) -> Claim[Seasons]:
    """Aim that apprentices of some settings win against the random team."""
    return _aim(text, ((settings, STATIC),), "share won of evaluations against random",
                evaluated(WON, _RANDOM, GAMES), Range("at least 0.95", low=0.95), "rate", pairs(_RANDOM))


OURS: tuple[Claim[Seasons], ...] = (
    *(_ablation(f"{without}, the static column does not wait for game 11", ((settings, STATIC),),
                "share of seasons with almost none in games 1 to 10 and more in games 11 to 20",
                EVOLVES, _FEW, "seasons")
      for settings, without in _WITHOUT.items()),
    *(_ablation(f"{without}, the rise after game 10 is smaller", ((settings, STATIC), (PAPER, STATIC)),
                "other actions in games 11 to 20 less those in games 1 to 10, mean %", JUMP, BELOW)
      for settings, without in _WITHOUT.items()),
    _ablation("With the score out of the key, more new actions are used against the second script",
              ((WITHOUT_SCORE, _SCRIPT), (PAPER, _SCRIPT)), "other of all actions, %",
              overall_other(1, GAMES), ABOVE),

    _beats("The best apprentice beats the static team", (BEST, STATIC)),
    *(_aim(f"It uses what it learned: against the {kind} team", ((BEST, STATIC),),
           f"time in other behaviours in evaluations against {kind}, mean %",
           evaluated(OTHER_TIME, kind, GAMES), _MOSTLY_LEARNED, "percent", by_construction=True)
      for kind in (STATIC, _RANDOM)),
    _wins("It wins against the random team, too", BEST),
    _beats(f"One that has {GAMES} matches and no others beats the static team", (IN_GAMES, STATIC)),
    _wins(f"One that has {GAMES} matches and no others wins against the random team", IN_GAMES),
    *(_beats(f"It beats the static team by more than a constant team does ({control})", (BEST, STATIC),
             (control, NOTHING)) for control in CONTROLS),
    _aim("In its last games it beats the static team", ((BEST, STATIC),),
         f"goal difference in games {LATE[0]} to {LATE[1]}, mean", mean_in_games(DIFFERENCE, *LATE), ABOVE),
    *(_aim("In its last games it uses what it learned", ((BEST, kind),),
           f"time in other behaviours in games {LATE[0]} to {LATE[1]}, mean %",
           mean_in_games(OTHER_TIME, *LATE), _MOSTLY_LEARNED, "percent", by_construction=True)
      for kind in (STATIC, _SCRIPT)),
)
