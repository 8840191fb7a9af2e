"""Passing, running, phases, pressing and space of a team, from the tables of the stage analysis; stamina."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import polars as pl
from markupsafe import Markup

from pitchlore.pipeline.game.pitch import Kind, Pitch
from pitchlore.pipeline.settings import AnalysisSettings
from pitchlore.pipeline.stages.analysis.efforts import efforts
from pitchlore.pipeline.stages.analysis.paces import paces
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch, over_sides
from pitchlore.pipeline.views.scout.facts import PARTS, halves, means_of_parts
from pitchlore.pipeline.views.scout.pictures import Mark, on_pitch
from pitchlore.schemas import SIDES
from pitchlore.schemas.analysis import PHASES


def analysed(
    sides: Sequence[tuple[LeagueMatch, str]], roles: Mapping[int, str], style: str = "home",
    ran: Sequence[Mapping[str, Sequence[float]]] = ()
) -> dict[str, Any] | None:
    """Content of the section about a team's sides in matches; None where the stage has not run yet.

    Each row has a label, the value of the team and of its adversaries (None where not known), and a unit:
    share, or the digits after the point. The network is drawn on the newest match's pitch. ``roles`` are
    those of the team's robots in words. ``ran`` is what :func:`in_halves` gives for each match.
    """
    if over_sides(sides, LeagueMatch.efforts).is_empty():
        return None
    own, other = (_numbers(sides, own=own) | _halves(sides, ran, own=own) for own in (True, False))
    pitch = sides[-1][0].pitch
    fast, sprint = paces(pitch.kind)
    tried = over_sides([side for side in sides if side[0].pitch == pitch], LeagueMatch.pass_attempts)
    running = over_sides(sides, LeagueMatch.efforts).group_by("robot").agg(
        pl.col("seconds", "distance", "fast", "sprints").sum(), pl.col("top_speed").max(),
        pl.col("space").mean()).sort("robot")
    return {
        "rows": [{"label": label, "unit": unit, "own": own[name], "other": other[name]}
                 for label, name, unit in _ROWS
                 if own.get(name) is not None or name not in _SOMETIMES],
        "paces": f"Fast is from {fast:.2f} m/s, a sprint from {sprint:.2f} m/s: "
                 f"{_PACES[pitch.kind is Kind.HUMAN]}.",
        "network": network(tried, pitch, style),
        "running": [row | {"role": roles.get(row["robot"], "")} for row in running.to_dicts()]}


_Place = tuple[float, float]
#: Times that discs which are too near each other are moved apart.
_PUSHES = 20
#: Least distance of two discs' middles, in sums of their radii.
_ROOM = 2.2
#: Distance of an arrow from the line between the middles, hundredths of the pitch's length.
_ASIDE = 0.7
#: What is told: label, name in the numbers, unit.
_ROWS = (
    ("passes tried", "tried", "0"), ("of these arrive", "arrive", "share"),
    ("of these are intercepted", "intercepted", "share"),
    ("distance of all, m a match", "covered", "0"),
    ("of this in the first half", "first_half", "0"), ("in the second half", "second_half", "0"),
    ("distance of all, m a minute", "covered_a_minute", "1"),
    ("distance of a robot, m a minute", "distance", "1"), ("of this fast", "fast", "share"),
    ("sprints of a robot, each 10 minutes", "sprints", "1"), ("top speed, m/s", "top", "2"),
    ("passes allowed for each ball won or duel (PPDA)", "ppda", "2"),
    ("presses in the adversary's third", "high", "share"),
    ("lost balls that are soon regained", "regained", "share"),
    ("pitch that it reaches first", "space", "share"), ("of the third ahead", "ahead", "share"),
    ("stamina of a player, mean", "stamina", "0"), ("least stamina of a player", "least_stamina", "0"),
    *((f"of its possession: {phase}", phase, "share") for phase in PHASES),
)


#: Numbers that only some leagues or matches have.
_SOMETIMES = ("stamina", "least_stamina", "first_half", "second_half")
#: Why a pace is that of a league: of robots, of people.
_PACES = ("60 % and 90 % of the top cruising speed of its league, so that short stretches count, too",
          "as football counts")


def in_halves(match: LeagueMatch) -> dict[str, list[float]]:
    """Distance that each side's robots cover in each half of a match, m, as the table efforts counts."""
    spaces = pl.DataFrame(schema={"team": pl.String, "robot": pl.Int16, "space": pl.Float64})
    found: dict[str, list[float]] = {side: [] for side in SIDES}
    for _, start, end in halves(match):
        own = match.trajectories.filter(pl.col("t_ns").is_between(start, end, closed="left"))
        ran = efforts(own, spaces, match.pitch, AnalysisSettings())
        for side in SIDES:
            found[side].append(float(ran.filter(pl.col("team") == side)["distance"].sum()))
    return found


def _halves(
    sides: Sequence[tuple[LeagueMatch, str]], ran: Sequence[Mapping[str, Sequence[float]]], *, own: bool
) -> dict[str, float | None]:
    if not ran:
        return {}
    of = [each[side if own else SIDES[1 - SIDES.index(side)]]
          for (_, side), each in zip(sides, ran, strict=True)]
    return {name: sum(each[at] for each in of) / len(of)
            for at, name in enumerate(("first_half", "second_half"))}


def _share(part: float, of: float) -> float | None:
    return part / of if of else None


def _numbers(sides: Sequence[tuple[LeagueMatch, str]], *, own: bool) -> dict[str, float | None]:
    """Numbers of a team's sides, or of its adversaries'."""
    tried, runs, phases, pressing, space = (over_sides(sides, table, own=own) for table in (
        LeagueMatch.pass_attempts, LeagueMatch.efforts, LeagueMatch.phases, LeagueMatch.pressing,
        LeagueMatch.space))
    came = dict(tried.group_by(pl.col("came").cast(pl.String)).len().iter_rows())
    run = runs.select(
        pl.col("seconds", "distance", "fast", "sprints").sum(), pl.col("top_speed").max()).row(0, named=True)
    press = pressing.select(pl.exclude("match_id", "team", "ppda").sum()).row(0, named=True)
    held = dict(phases.group_by(pl.col("phase").cast(pl.String)).agg(
        (pl.col("end_ns") - pl.col("start_ns")).sum()).iter_rows())
    shares = space.select(pl.col("share", "ahead").mean()).row(0, named=True)
    minutes = sum(match.matches["duration_s"][0] for match, _ in sides) / 60
    left = over_sides(sides, LeagueMatch.stamina, own=own)["stamina"].cast(pl.Float64)
    return {
        "tried": float(tried.height), "arrive": _share(came.get("arrives", 0), tried.height),
        "intercepted": _share(came.get("intercepted", 0), tried.height),
        "covered": _share(run["distance"], len(sides)), "covered_a_minute": _share(run["distance"], minutes),
        "distance": _share(60 * run["distance"], run["seconds"]),
        "fast": _share(run["fast"], run["distance"]),
        "sprints": _share(600 * run["sprints"], run["seconds"]), "top": run["top_speed"],
        "ppda": _share(press["passes"], press["actions"]), "high": _share(press["high"], press["presses"]),
        "regained": _share(press["regained"], press["lost"]),
        "space": shares["share"], "ahead": shares["ahead"],
        "stamina": left.mean(), "least_stamina": left.min(),
        **{phase: _share(held.get(phase, 0), sum(held.values())) for phase in PHASES}}


def network(tried: pl.DataFrame, pitch: Pitch, style: str) -> Markup:
    """The network of passes that arrive: robots at their mean places, an arrow for each pair that passes.

    Robots are moved apart as far as an arrow between them needs. Bold arrows are of pairs that pass at least
    half as often as the pair that passes most.

    Args:
        tried: rows of schema PassAttempts of a team.
        pitch: pitch of its matches.
        style: class of the style sheet that has its colour.
    """
    arrive = tried.filter(pl.col("came") == "arrives")
    places = {robot: (x, y, n) for robot, x, y, n in pl.concat([
        arrive.select("robot", "x", "y"), arrive.select(robot="next_robot", x="to_x", y="to_y"),
    ]).group_by("robot").agg(pl.col("x", "y").mean(), pl.len()).sort("robot").iter_rows()}
    pairs = arrive.group_by("robot", "next_robot").len().sort("len", "robot", "next_robot").rows()
    most = max((n for *_, n in pairs), default=0)
    busiest = max((n for *_, n in places.values()), default=1)
    sizes = {robot: 1.8 + 1.4 * n / busiest for robot, (*_, n) in places.items()}
    places = _apart(places, {robot: size * pitch.length / 100 for robot, size in sizes.items()})
    marks = []
    for one, other, n in pairs:
        start, end = _beside(places[one][:2], places[other][:2], pitch.length / 100, sizes[other])
        marks.append(Mark(*start, f"mark {style}{' mean' if 2 * n >= most else ''}",
                          f"{one} to {other}: {n}", to=end, size=1.8))
    marks += [Mark(x, y, f"mark {style} hit", f"robot {robot}: {n} passes given or received",
                   letter=str(robot), size=sizes[robot]) for robot, (x, y, n) in places.items()]
    return on_pitch(pitch, "network of passes", marks=marks)


def _apart(
    places: Mapping[int, tuple[float, float, int]], sizes: Mapping[int, float]
) -> dict[int, tuple[float, float, int]]:
    """Places of robots, moved until an arrow fits between any two; ``sizes`` are their discs' radii, m."""
    at = {robot: np.array(place[:2]) for robot, place in places.items()}
    for _ in range(_PUSHES):
        for one, other in combinations(sorted(at), 2):
            way = at[other] - at[one]
            far, least = float(np.hypot(*way)), _ROOM * (sizes[one] + sizes[other])
            if far < least:
                push = (way / far if far else np.array([0.0, 1.0])) * (least - far) / 2
                at[one], at[other] = at[one] - push, at[other] + push
    return {robot: (float(x), float(y), places[robot][2]) for robot, (x, y) in at.items()}


def _beside(start: _Place, end: _Place, percent: float, size: float) -> tuple[_Place, _Place]:
    """An arrow between the middles of two robots, somewhat to its right, so that the one back is seen, too.

    Args:
        start: the middle of the robot that passes, metres.
        end: middle of the robot that receives, metres.
        percent: a hundredth of the pitch's length, metres.
        size: radius of the disc that the arrow ends at, in such hundredths.
    """
    x, y = np.subtract(end, start) / max(float(np.hypot(*np.subtract(end, start))), 1e-9)
    aside = np.array([y, -x]) * _ASIDE * percent
    first, last = start + aside, end + aside - np.array([x, y]) * size * percent
    return (float(first[0]), float(first[1])), (float(last[0]), float(last[1]))


def space_over_time(match: LeagueMatch) -> list[float | None]:
    """Home's share of the pitch in each of PARTS parts of a match; None where nothing was sampled."""
    home = match.space.filter(pl.col("team") == SIDES[0])
    return means_of_parts(match, home["t_ns"], home["share"], PARTS)
