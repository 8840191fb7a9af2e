"""A coach's questions about a side or a team, answered in small tables: losses, goals, passes, shots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.views.commentary.words import side_names
from pitchlore.pipeline.views.scout.content.chances import shots_over, with_chances
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch, TeamName, over_sides, sides_played
from pitchlore.pipeline.views.scout.leadup import lead_ups
from pitchlore.pipeline.views.scout.scored import (
    Scored,
    again,
    lost_before,
    of_side,
    scored,
    summary,
)
from pitchlore.pipeline.views.scout.shooting import shooting
from pitchlore.pipeline.views.scout.words import said
from pitchlore.pipeline.views.scout.zones import (
    THIRDS,
    WAYS,
    RobotNumbers,
    RoleSamples,
    losses,
    one_role,
    passing,
    robot_numbers,
    samples,
)
from pitchlore.schemas import SIDES


class MatchAnswers(NamedTuple):
    """A match as the pages of teams need it, JSON-able.

    Attributes:
        robots: samples of each side's robots by role.
        scored: its goals.
    """

    robots: dict[str, RoleSamples]
    scored: list[Scored]


def of_match(match: LeagueMatch, kept: MatchAnswers) -> dict[str, dict[str, Any]]:
    """The answers about each side of a match."""
    minutes, lengths = match.matches["duration_s"][0] / 60, {match.name: match.pitch.length}
    shots = with_chances(match)
    found: dict[str, dict[str, Any]] = {}
    for side in SIDES:
        seen = robot_numbers([(kept.robots[side], minutes)])
        held, passes, own = (table.filter(team=side) for table in (match.possession, match.passes, shots))
        found[side] = {
            "losses": losses(held, lengths, seen), "passing": passing(passes, lengths), "thirds": THIRDS,
            "ways": [name for name, _ in WAYS], "roles": {robot: it.says for robot, it in seen.items()},
            "shooting": shooting(own), "scored": how(of_side(kept.scored, side), seen),
            "conceded": how_conceded(of_side(kept.scored, SIDES[1 - SIDES.index(side)]), seen)}
    return found


def kept(match: LeagueMatch) -> MatchAnswers:
    """Samples of a match's robots, and its goals with one role a robot."""
    robots = samples(match.trajectories)
    return MatchAnswers(robots, [goal._replace(before=goal.before._replace(
        says=roles_said(goal.before.says, match, robots))) for goal in goals_of(match)])


def roles_said(says: str, match: LeagueMatch, robots: Mapping[str, RoleSamples]) -> str:
    """A sentence of a match with one role a robot (:func:`one_role`); ``robots`` are each side's samples."""
    names = side_names(match.home.name, match.away.name)
    return one_role(says, {names[side]: robot_numbers([(robots[side], 0.0)]) for side in SIDES})


def team_answers(
    team: TeamName, matches: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]]
) -> dict[str, Any]:
    """The answers about a team over its matches; ``lines`` are the league's, by match."""
    sides = [(match, side) for match in matches for side in sides_played(team, match)]
    lengths = {match.name: match.pitch.length for match in matches}
    seen = robots_of(sides, lines)
    return {
        "losses": losses(over_sides(sides, LeagueMatch.possession), lengths, seen), "thirds": THIRDS,
        "passing": passing(over_sides(sides, LeagueMatch.passes), lengths),
        "ways": [name for name, _ in WAYS], "roles": {robot: it.says for robot, it in seen.items()},
        "shooting": shooting(shots_over(sides)), "scored": how(goals_over(sides, lines), seen),
        "conceded": how_conceded(goals_over(sides, lines, own=False), seen)}


def robots_of(
    sides: Sequence[tuple[LeagueMatch, str]], lines: Mapping[str, dict[str, Any]]
) -> dict[int, RobotNumbers]:
    """Roles and minutes of each robot of a team in its matches."""
    return robot_numbers((line_samples(match, side, lines), lines[match.name]["seconds"] / 60)
                         for match, side in sides)


def line_samples(match: LeagueMatch, side: str, lines: Mapping[str, dict[str, Any]]) -> RoleSamples:
    """Samples of a side's robots in a match, from the match's line."""
    return {int(robot): roles for robot, roles in lines[match.name]["robots"][side].items()}


def goals_over(
    sides: Sequence[tuple[LeagueMatch, str]], lines: Mapping[str, dict[str, Any]], *, own: bool = True
) -> list[Scored]:
    """The goals of a team in its matches, in their order, or those against it."""
    return [goal for match, side in sides for goal in of_side(
        again(lines[match.name]["scored"]), side if own else SIDES[1 - SIDES.index(side)])]


def goals_of(match: LeagueMatch) -> list[Scored]:
    """The goals of a match whose team is known."""
    found = scored(match.goals, match.shots, match.situations, match.pitch.length)
    names = side_names(match.home.name, match.away.name)
    came = lead_ups(
        match.goals, match.possession, match.referee, match.trajectories, names, match.pitch.length)
    return [goal._replace(before=before) for goal, before in zip(found, came, strict=True)]


def how(goals: Sequence[Scored], seen: Mapping[int, RobotNumbers]) -> dict[str, Any]:
    """How goals came about, with the commonest run before them in words."""
    found = summary(goals, {robot: it.says for robot, it in seen.items()})
    last = None if found.run is None else said(found.run.codes)
    return found._asdict() | {"last": last, "goals": list(goals)}


def how_conceded(goals: Sequence[Scored], seen: Mapping[int, RobotNumbers]) -> dict[str, Any]:
    """How goals against a team came about, and who had lost the ball before."""
    found, lost = how(goals, {}), lost_before(goals, {robot: it.says for robot, it in seen.items()})
    return found | {"lost": lost, "other": len(goals) - sum(row.n for row in lost), "goals": list(goals)}


def made_by(kind: str) -> str:
    """How goals of a kind were made, after their number."""
    return "by error" if kind == "error" else kind


def scores_by(goals: Sequence[Scored], seen: Mapping[int, RobotNumbers]) -> tuple[str, list[Any]]:
    """A team's ways to score, in sentences, with clips of its commonest one."""
    found = summary(goals, {robot: it.says for robot, it in seen.items()})
    if not found.n:
        return "No goal of it is recorded.", []
    kinds = ", ".join(f"{line.n} {made_by(line.says)}" for line in found.kinds)
    says = f"{number_of(found.n, 'goal')}: {kinds}."
    if found.whole.distance is not None:
        says += (f" {found.whole.shots} came from shots, half of these from less than"
                 f" {found.whole.distance:.2f} m." if found.whole.shots > 1
                 else f" One came from a shot, from {found.whole.distance:.2f} m.")
    first = found.scorers[0]
    says += f" Most often the maker was {first.says}: {first.n}."
    if found.run is not None:
        says += (f" The scorer's commonest last situations: {said(found.run.codes)}"
                 f" ({found.run.n} of the {number_of(found.run.of, 'goal')} before which they are known).")
    return says, found.run.clips if found.run is not None else found.whole.clips
