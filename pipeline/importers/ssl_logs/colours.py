"""Teams followed by name while their colours change.

The league's rules let teams change colours after the first half of a match and of overtime
(RoboCup-SSL/ssl-rules, ``chapters/gamestructure.adoc`` at 4300196). The game controller then exchanges all
that it knows of the two teams at once: names, scores, cards and sides
(RoboCup-SSL/ssl-game-controller, ``internal/app/statemachine/change_switchcolors.go`` at 78a9b3b). People
also type names by hand, one after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from pitchlore.pipeline.importers.ssl_logs.home import HomeColour
from pitchlore.pipeline.importers.ssl_logs.referee import RefereeReport
from pitchlore.pipeline.importers.ssl_logs.stages import BREAKS, is_running
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, YELLOW

Names = tuple[str, str]


class FollowedTeams(NamedTuple):
    """Teams of a match, each with the colour of its beginning.

    Attributes:
        names: name of the team that begins as yellow, and of the other; "" where nobody typed one.
        switches: numbers of the packets from which on they have the other colour.
        reported: the referee's messages, scores that people moved with the colours put right.
    """

    names: Names
    switches: tuple[int, ...]
    reported: list[RefereeReport]


def follow(reported: Sequence[RefereeReport]) -> FollowedTeams:
    """The teams of a match by their names.

    Names that cross, or one of them, are a change of colours if scores, cards or sides cross with them, or
    in a break of the match, where the rules allow it. Before play they are a correction, and so are names
    that cross alone. Without names, scores that cross in a break are one, too.
    """
    reported = list(reported)
    stable: tuple[Names, int] | None = None  # two different names that were told last, and in which report
    switches: list[int] = []
    begun, stopped = False, 0
    for i, now in enumerate(reported):
        if begun and i and _unnamed_switch(reported[i - 1], now):
            switches.append(now.order)
            stable = None if stable is None else (stable[0][::-1], stable[1])
        if is_running(now):
            begun, stopped = True, i + 1
        told = now.teams[YELLOW].name, now.teams[BLUE].name
        if not all(told) or told[0] == told[1]:
            continue
        crossed = stable is not None and (told[0] == stable[0][1] or told[1] == stable[0][0])
        if stable is not None and crossed and begun:
            end = next((j for j in range(i, len(reported)) if is_running(reported[j])), len(reported))
            if end > i and tuple(team.name for team in reported[end - 1].teams) == stable[0]:
                # a mistake that is put right
                _settle(reported, i, i, end)
                continue
            if _is_switch(reported[stable[1]], now, reported[end - 1]):
                switches.append(now.order)
                _settle(reported, stopped, i, end)
        stable = told, i
    return FollowedTeams(_names(reported, switches), tuple(switches), reported)


def _unnamed_switch(before: RefereeReport, now: RefereeReport) -> bool:
    """True if two teams without names exchange different scores in a break of the match."""
    scores = [team.score for team in before.teams]
    return (now.stage in BREAKS and not any(team.name for team in now.teams) and scores[0] != scores[1]
            and [team.score for team in now.teams] == scores[::-1])


def _is_switch(before: RefereeReport, now: RefereeReport, last: RefereeReport) -> bool:
    """True if names that cross are a change of colours; ``last`` ends the stoppage."""
    crossed, stayed = _goes_on(before, now, crossed=True), _goes_on(before, now, crossed=False)
    if crossed != stayed:
        by_hand = _goes_on(before, last, crossed=True) and not _goes_on(before, last, crossed=False)
        return crossed or (now.stage in BREAKS and by_hand)
    turned = None not in (before.blue_on_positive, now.blue_on_positive) and (
        before.blue_on_positive != now.blue_on_positive)
    return now.stage in BREAKS or turned


def _goes_on(before: RefereeReport, now: RefereeReport, *, crossed: bool) -> bool:
    """True if no team has fewer goals or cards than before, if each has the other colour or keeps its own."""
    teams = now.teams[::-1] if crossed else now.teams
    return all(had <= has for old, new in zip(before.teams, teams, strict=True)
               for had, has in zip(old[1:], new[1:], strict=True))


def _settle(reported: list[RefereeReport], first: int, switch: int, end: int) -> None:
    """Give each team of a stoppage what it has at its end: people may move names and scores by and by."""
    last = reported[end - 1].teams
    for i in range(first, end):
        now = reported[i]
        teams = last if i >= switch else last[::-1]
        named = [team._replace(name=own.name) for team, own in zip(teams, now.teams, strict=True)]
        reported[i] = now._replace(teams=(named[0], named[1]))


def _names(reported: Sequence[RefereeReport], switches: Sequence[int]) -> Names:
    """The last name of each team; two equal ones count only if no others were told."""
    colour, names, equal = HomeColour(YELLOW, tuple(switches)), ["", ""], ["", ""]
    for now in reported:
        first = colour.now(now.order)
        told = now.teams[first].name, now.teams[1 - first].name
        into = equal if told[0] == told[1] else names
        into[:] = [new or old for new, old in zip(told, into, strict=True)]
    return names[0] or equal[0], names[1] or equal[1]
