"""The commentary of a match, from tables only.

Touches of the ball (:mod:`.touches`) give shots and passes (:mod:`.chances`). Together with the referee,
the goals and the situations they become moments (:mod:`.moments`), in words (:mod:`.words`). The
moments that matter are told, a line each; the rest is counted (:mod:`.summary`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain

import polars as pl

from pipeline.pitch import Pitch
from pipeline.views.commentary.chances import passes, shots
from pipeline.views.commentary.moments import (
    Moment,
    Weight,
    of_goals,
    of_lulls,
    of_play,
    of_shots,
    of_the_referee,
)
from pipeline.views.commentary.settings import CommentarySettings
from pipeline.views.commentary.summary import MatchStatistics, summarise
from pipeline.views.commentary.touches import spells, touches

__all__ = ["Commentary", "CommentarySettings", "commentary"]


@dataclass(frozen=True, slots=True)
class Commentary:
    """The commentary of a match.

    Attributes:
        moments: the moments told, by time.
        summary: the match in numbers.
    """

    moments: tuple[Moment, ...]
    summary: MatchStatistics


def commentary(
    match: pl.DataFrame,
    referee: pl.DataFrame,
    goals: pl.DataFrame,
    situations: pl.DataFrame,
    trajectories: pl.DataFrame,
    pitch: Pitch,
    settings: CommentarySettings | None = None,
) -> Commentary:
    """The commentary of a match: moments to tell, and statistics.

    The referee's decisions and the goals are always told. A chance is told unless a greater one is
    close; passes and possession only where nothing else happens.

    Args:
        match: schema Matches, one row.
        referee: schema Referee, of that match.
        goals: schema Goals, of that match: one for each goal of the referee.
        situations: schema Situations, of that match.
        trajectories: schema Trajectories, of that match.
        pitch: pitch of the match.
        settings: thresholds of the commentary, None for the defaults.
    """
    settings = settings or CommentarySettings()
    touched = touches(trajectories, pitch, settings)
    kept = spells(touched, trajectories)
    scored = goals.drop_nulls("team").select(pl.col("team").cast(pl.String), "t_ns").rows()
    tried = shots(touched, scored, pitch, settings)
    moments = chain(
        of_the_referee(referee, match),
        of_goals(goals, referee, situations, touched, settings),
        of_shots(tried),
        of_play(passes(touched, pitch, settings), kept, situations, pitch, settings),
    )
    told = _chosen(moments, settings)
    told = sorted([*told, *of_lulls(told, kept, settings)], key=lambda moment: moment.t_ns)
    return Commentary(tuple(told), summarise(match, goals, situations, tried, kept, settings))


def _chosen(moments: Iterable[Moment], settings: CommentarySettings) -> list[Moment]:
    """The moments to tell, by time; of equal weight the earlier one has precedence."""
    play_ns, chances_ns = (round(s * 1e9) for s in (settings.play_apart_s, settings.chances_apart_s))
    told: list[Moment] = []
    for moment in sorted(moments, key=lambda moment: (-moment.weight, moment.t_ns)):
        apart = {Weight.ALWAYS: 0, Weight.PLAY: play_ns}.get(moment.weight, chances_ns)
        if all(abs(moment.t_ns - other.t_ns) >= apart for other in told):
            told.append(moment)
    return sorted(told, key=lambda moment: moment.t_ns)
