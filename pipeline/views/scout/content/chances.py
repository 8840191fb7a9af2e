"""Expected goals on the pages: what they rest on, in words, and the shots with theirs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch, over_sides
from pitchlore.pipeline.views.scout.facts import Mean
from pitchlore.pipeline.views.scout.shooting import outcome_words

#: Up to so many shots in a picture have marks of full size.
_CLEAR = 40


def with_chances(match: MatchTables) -> pl.DataFrame:
    """The shots of a match with the column xg of the table chances."""
    return _with(match.shots, match.chances)


def shots_over(sides: Sequence[tuple[LeagueMatch, str]]) -> pl.DataFrame:
    """The shots of a team's sides in matches with the column xg of the table chances."""
    return _with(over_sides(sides, LeagueMatch.shots), over_sides(sides, LeagueMatch.chances))


def _with(shots: pl.DataFrame, chances: pl.DataFrame) -> pl.DataFrame:
    key = ["match_id", "team", "t_ns", "robot"]
    return shots.join(
        chances.select(*key, "xg"), on=key, how="left", maintain_order="left", validate="1:1")


def rests_on(match: LeagueMatch, chances: pl.DataFrame) -> str:
    """A sentence on what a match's expected goals rest on, or why it has none; empty without a shot."""
    if chances.is_empty():
        return ""
    goals, shots = chances.select("goals", "shots").row(0)
    if chances["xg"].null_count():
        return (
            f"There are no expected goals (xG): {number_of(shots, 'shot')} of other matches of the league "
            f"became {number_of(goals, 'goal')}. At least {match.goals_at_least} goals, and a shot that "
            "fails, are needed.")
    return (
        "xG is the probability that a shot becomes a goal, by its distance, its angle and the adversaries in "
        f"the way. It is calibrated on other matches of the league: {number_of(shots, 'shot')} and "
        f"{number_of(goals, 'goal')}. "
        "The larger a mark, the greater its xG.")


def known_in(matches: int, xg: Sequence[Mean | None]) -> str:
    """In how many matches expected goals are known; ``xg`` are those of a team and of its adversaries."""
    known = min((0 if each is None else each.n) for each in xg)
    says = f"Expected goals are known in {known} of {matches} {'match' if matches == 1 else 'matches'}"
    return f"{says}. They are of shots; a ball pushed over the line is a goal without a shot."


def shot_words(shot: Mapping[str, Any]) -> str:
    """A shot in words: its outcome, its distance and its expected goals, as far as they are known."""
    says = f"{outcome_words(shot['outcome'])}, from {shot['distance']:.2f} m"
    return says if shot["xg"] is None else f"{says}, xG {shot['xg']:.2f}"


def larger(shots: pl.DataFrame) -> str:
    """A sentence on the size of shots' marks (:func:`size`), and a space; empty where no xG is known.

    Args:
        shots: rows of :func:`shots_over`.
    """
    return "" if shots["xg"].null_count() == shots.height else "The larger a mark, the greater its xG. "


def size(xg: float | None, shots: int) -> float:
    """Size of a shot's mark: its area grows with xG, and falls where there are more than 40 shots."""
    area = min(1.0, _CLEAR / max(shots, 1)) * (1.0 if xg is None else 0.3 + 3.0 * xg)
    return 1.1 * math.sqrt(area)
