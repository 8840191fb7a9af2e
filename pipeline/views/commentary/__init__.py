"""The commentary of a match, from tables only.

The referee's decisions, shots, passes and teams' times on the ball (:mod:`.spells`) become moments
(:mod:`.moments`), and so do goals, with what led to them (:mod:`.goals`), in words (:mod:`.words`). The
moments that matter are reported, a line each; the rest is counted (:mod:`.summary`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain

from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.views.commentary.goals import at_ball, of_goals
from pitchlore.pipeline.views.commentary.moments import (
    Moment,
    Weight,
    of_lulls,
    of_passes,
    of_shots,
    of_spells,
    of_the_referee,
)
from pitchlore.pipeline.views.commentary.settings import CommentarySettings
from pitchlore.pipeline.views.commentary.spells import spells
from pitchlore.pipeline.views.commentary.summary import (
    MatchStatistics,
    heading,
    match_statistics,
    summary_lines,
)
from pitchlore.pipeline.views.commentary.words import side_names

__all__ = ["Commentary", "CommentarySettings", "commentary"]


@dataclass(frozen=True, slots=True, repr=False)
class Commentary:
    """The commentary of a match. As text it is what ``pitchlore commentary`` prints.

    Attributes:
        moments: the moments reported, by time.
        summary: the match in numbers.
    """

    moments: tuple[Moment, ...]
    summary: MatchStatistics

    def sentences(self) -> list[tuple[int, str]]:
        """The sentences reported with their times, ns since the first sample, by time."""
        return [(moment.t_ns, moment.text) for moment in self.moments]

    def heading(self) -> tuple[str, ...]:
        """Teams, score and duration, line by line."""
        return heading(self.summary)

    def numbers(self) -> tuple[str, ...]:
        """The summary for people, line by line."""
        return tuple(summary_lines(self.summary))

    def __str__(self) -> str:
        return "\n".join([*self.heading(), *(moment.line() for moment in self.moments), "", *self.numbers()])

    __repr__ = __str__


def commentary(match: MatchTables, settings: CommentarySettings | None = None) -> Commentary:
    """The commentary of a match: moments to tell, and statistics.

    The referee's decisions and the goals are always reported. A chance (a save, a wide shot) is reported
    unless a greater moment is close. Other shots are reported where neither of these is near,
    passes and possession where nothing else happens.

    Args:
        match: has one goal for each goal of the referee.
        settings: thresholds of the commentary, None for the defaults.
    """
    settings = settings or CommentarySettings()
    row, pitch = match.matches, match.pitch
    referee, goals, situations = match.referee, match.goals, match.situations
    trajectories, possession, passes, shots = match.trajectories, match.possession, match.passes, match.shots
    names = side_names(row["home"][0], row["away"][0])
    touched, kept = at_ball(trajectories, pitch), spells(possession, passes, trajectories, names)
    moments = chain(
        of_the_referee(referee, row, names),
        of_goals(match, touched, names, settings),
        of_shots(shots, touched, names),
        of_passes(passes, trajectories, pitch, names, settings),
        of_spells(kept, situations, pitch, settings),
    )
    reported = _chosen(moments, settings)
    reported = sorted([*reported, *of_lulls(reported, kept, names, settings)], key=lambda moment: moment.t_ns)
    return Commentary(tuple(reported), match_statistics(row, goals, situations, possession, shots, settings))


def _chosen(moments: Iterable[Moment], settings: CommentarySettings) -> list[Moment]:
    """The moments to tell, by time; of equal weight the earlier one has precedence."""
    play_ns, chances_ns = (round(s * 1e9) for s in (settings.play_apart_s, settings.chances_apart_s))
    reported: list[Moment] = []
    for moment in sorted(moments, key=lambda moment: (-moment.weight, moment.t_ns)):
        apart = {Weight.ALWAYS: 0, Weight.CHANCE: chances_ns}.get(moment.weight, play_ns)
        if all(abs(moment.t_ns - other.t_ns) >= apart for other in reported):
            reported.append(moment)
    return sorted(reported, key=lambda moment: moment.t_ns)
