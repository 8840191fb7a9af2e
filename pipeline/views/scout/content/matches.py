"""The page of a match, and its line in the league."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.views.commentary import Commentary
from pitchlore.pipeline.views.commentary.words import side_names
from pitchlore.pipeline.views.scout.changes import Change, change, change_of_count, reported_changes
from pitchlore.pipeline.views.scout.content.analysis import analysed, space_over_time
from pitchlore.pipeline.views.scout.content.answers import MatchAnswers, of_match
from pitchlore.pipeline.views.scout.content.chances import rests_on, shot_words, size, with_chances
from pitchlore.pipeline.views.scout.content.flaws import flaws
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch, TeamName
from pitchlore.pipeline.views.scout.facts import (
    Numbers,
    balance,
    by_lead,
    halves,
    is_counted,
    markers,
    numbers,
    parts,
    played_s,
)
from pitchlore.pipeline.views.scout.moments import moment
from pitchlore.pipeline.views.scout.pictures import Mark, bars, heat, on_pitch, pass_arrow
from pitchlore.pipeline.views.scout.restarts import any_moment
from pitchlore.pipeline.views.scout.scored import Scored, clip_of
from pitchlore.pipeline.views.scout.timeline import GoalLine, on_top, over_time
from pitchlore.schemas import SIDES, note_on

#: What is counted of a side: label, field of Numbers, whether it is a share.
MEASURES = (
    ("goals", "goals", False), ("possession", "possession", True),
    ("ball in the adversary's half", "territory", True),
    ("shots on target", "shots", False), ("shots past the post", "wide", False),
    ("goals from shots", "scored", False), ("expected goals (xG) of shots", "xg", False),
    ("passes that arrive", "passes", False), ("of these through passes", "through", False),
    ("balls lost to the adversary", "lost", False),
    ("times a robot pressed", "pressed", False), ("of these won the ball", "won", False),
)
#: What the clip of a goal shows.
_HOW = "how it came"
#: Seconds before an event at which its link opens the replay.
_BEFORE_S = 1.0


def match_facts(match: LeagueMatch, moments: Commentary, kept: MatchAnswers) -> dict[str, Any]:
    """Content of the page of a match; ``moments`` are its commentary, ``kept`` as for :func:`line`."""
    row, pitch = match.matches.row(0, named=True), match.pitch
    answers = of_match(match, kept)
    whole = [("whole match", 0, 1 << 62), *halves(match)]
    counts = [numbers(match, start, end) for _, start, end in whole]
    sides, names = (match.home, match.away), side_names(match.home.name, match.away.name)
    changes = _changes(counts[1], counts[2], [(end - start) / 1e9 for _, start, end in whole[1:]])
    each, goals = parts(match), [
        GoalLine(t_ns / 1e9 / max(row["duration_s"], 1e-9), team or "",
                 f"goal for {names[team] if team else 'nobody knows whom'}")
        for t_ns, team in match.goals.select("t_ns", "team").iter_rows()]
    return {
        "id": match.name, "home": match.home, "away": match.away, "kind": pitch.kind.value,
        "score": shown_score((counts[0][side].goals for side in SIDES), counted=is_counted(match)),
        "seconds": row["duration_s"], "flaws": _flaws(match),
        "note": note_on(row["home"], row["away"]), "measures": MEASURES,
        "called": names, "changes": changes, "changed": reported_changes([
            (f"{names[side]}: {label}", changes[side][name])
            for side in SIDES for label, name, _ in MEASURES]),
        "analysed": [{"name": names[side], "key": side, "facts": facts} for side in SIDES
                     if (facts := analysed([(match, side)], side))],
        "parts": [{"name": name, "numbers": {side: own._asdict() for side, own in each.items()}}
                  for (name, _, _), each in zip(whole, counts, strict=True)],
        "top": on_top(balance(match), goals, "who is on top", row["duration_s"]),
        "over_time": each, "strips": [
            {"name": name, "blank": blank if any(getattr(part, of) is None for part in each) else "",
             "picture": over_time(
                 [getattr(part, of) for part in each], goals, name, row["duration_s"], blank)}
            for name, of, blank in (("Possession over time", "possession", "nobody had the ball"),
                                    ("Territory over time", "territory", "ball not in play"))] + _space(
                                        match, goals),
        "goals": _goals(match, moments, kept.scored), "told": _reported(moments),
        "shots": _shots(match, names),
        "sides": [{"key": side, "name": team.name, "answers": answers[side],
                   **_passes(match, side, names[side], pitch)}
                  for side, team in zip(SIDES, sides, strict=True)],
        "robots": _robots(match),
    }


def line(match: LeagueMatch, kept: MatchAnswers) -> dict[str, Any]:
    """A match's line in the league, JSON-able; ``kept`` is what the pages of its teams need of it."""
    row, own, leads = match.matches.row(0, named=True), numbers(match), by_lead(match)
    counted = is_counted(match)
    ball = match.trajectories.filter(pl.col("team") == "ball", pl.col("segment").is_not_null())
    counts, _ = np.histogram(ball["x"].to_numpy(), 12, (-match.pitch.goal_x, match.pitch.goal_x))
    return {
        "score": shown_score((own[side].goals for side in SIDES), counted=counted), "counted": counted,
        "seconds": row["duration_s"], "played_s": played_s(match.trajectories),
        "kind": match.pitch.kind.value,
        "date": row["started_at"].date().isoformat() if row["started_at"] else "",
        "flaws": _flaws(match), "numbers": {side: it._asdict() for side, it in own.items()},
        "any_moment": {side: list(it) for side, it in any_moment(
            match.trajectories, match.shots, match.referee).items()},
        **kept._asdict(),
        "by_lead": {side: {name: list(it) for name, it in each.items()} for side, each in leads.items()},
        "picture": bars([float(share) for share in counts], "where the ball was, from home's goal to away's"),
    }


def _space(match: LeagueMatch, goals: Sequence[GoalLine]) -> list[dict[str, Any]]:
    """The strip of space over time; none where it was not sampled."""
    shares, name = space_over_time(match), "Space over time"
    if all(share is None for share in shares):
        return []
    blank = "no play"
    return [{"name": name, "blank": blank if None in shares else "",
             "picture": over_time(shares, goals, name, match.matches["duration_s"][0], blank)}]


def _changes(
    first: dict[str, Numbers], second: dict[str, Numbers], seconds: Sequence[float]
) -> dict[str, dict[str, Change | None]]:
    """Changes from the first to the second half, by side and measure."""
    found: dict[str, dict[str, Change | None]] = {side: {} for side in SIDES}
    for side in SIDES:
        for _, name, share in MEASURES:
            values = getattr(first[side], name), getattr(second[side], name)
            if share or name == "xg":  # as they are shown, so that the change is that of the shown numbers
                shown = [None if value is None else round(value, 2) for value in values]
                found[side][name] = change(*shown)
            else:
                found[side][name] = change_of_count(*values, (seconds[0], seconds[1]))
    return found


def shown_score(goals: Iterable[int | None], *, counted: bool) -> str:
    """A score in words; what is not known is a question mark. ``counted`` as by :func:`is_counted`."""
    return " : ".join("?" if it is None else str(it) for it in goals) + " counted" * counted


def _flaws(match: LeagueMatch) -> str:
    return flaws(match.recorded_quality, match.trajectories["frame"].n_unique())


def _reported(reported: Commentary) -> list[dict[str, Any]]:
    """Each sentence of the commentary, with the moment of the replay that it tells of, seconds."""
    return [{"at": before(moment.t_ns / 1e9), "seconds": moment.t_ns / 1e9, "team": moment.team or "",
             "actor": moment.actor or moment.team or "", "robot": moment.robot,
             "says": moment.text}
            for moment in reported.moments]


def _goals(match: LeagueMatch, reported: Commentary, scored: Sequence[Scored]) -> list[dict[str, Any]]:
    """Each goal in the commentary's words and with its shot, and the clip that leads to it."""
    shots = {goal.t_ns: "no shot" if goal.distance is None else f"shot from {goal.distance:.2f} m"
             for goal in scored}
    said = [moment.line() for moment in reported.moments if moment.kind == "goal"]
    goals = match.goals.sort("t_ns", maintain_order=True).iter_rows(named=True)
    return [{"team": goal["team"] or "", "says": line, "shot": shots.get(goal["t_ns"], ""),
             "clip": clip_of(goal, _HOW)}
            for goal, line in zip(goals, said, strict=True)]


def _shots(match: LeagueMatch, names: Mapping[str, str]) -> dict[str, Any]:
    rows, marks = [], []
    for shot in with_chances(match).iter_rows(named=True):
        turn = 1 if shot["team"] == "home" else -1
        at = shot["t_ns"] / 1e9
        says = f"{names[shot['team']]} {shot['robot']}: {shot_words(shot)}"
        style = f"mark {shot['team']} {shot['outcome']}"
        marks.append(Mark(turn * shot["x"], turn * shot["y"], style, says,
                          link=moment(match.name, before(at), of=match.name), size=size(shot["xg"])))
        reported = ("team", "robot", "distance", "speed", "xg", "outcome")
        rows.append({key: shot[key] for key in reported}
                    | {"name": names[shot["team"]], "at": at, "watch": before(at)})
    return {"rows": rows, "rests_on": rests_on(match, match.chances),
            "picture": on_pitch(match.pitch, "shots of both teams", marks=marks)}


def _passes(match: LeagueMatch, side: str, name: str, pitch: Pitch) -> dict[str, Any]:
    """Passes and losses of a side, as a picture and as rows."""
    own = match.passes.filter(pl.col("team") == side)
    lost = match.possession.filter(pl.col("team") == side, pl.col("ended") == "lost")
    marks = [Mark(row["end_x"], row["end_y"], "mark lost", f"{row['last_robot']} loses the ball")
             for row in lost.iter_rows(named=True)]
    marks += [pass_arrow(row, side, pitch) for row in own.iter_rows(named=True)]
    rows = [(row["t_ns"], row["robot"],
             f"passes to {row['receiver']}, {'through, ' * row['through']}{row['direction']}",
             row["x"], row["y"]) for row in own.iter_rows(named=True)]
    rows += [(row["end_ns"], row["last_robot"], "loses the ball", row["end_x"], row["end_y"])
             for row in lost.iter_rows(named=True)]
    return {
        "picture": on_pitch(pitch, f"passes of {name}, and where it loses the ball", marks=marks),
        "rows": [{"at": t_ns / 1e9, "watch": before(t_ns / 1e9), "robot": robot, "says": says, "x": x, "y": y}
                 for t_ns, robot, says, x, y in sorted(rows)],
    }


def before(at: float) -> float:
    """When to begin to watch what happens at a time, seconds."""
    return round(max(at - _BEFORE_S, 0.0), 2)


def _robots(match: LeagueMatch) -> list[dict[str, Any]]:
    """A heat map of each robot, as its team sees the pitch, and whom it is nearest to."""
    near = {(team, robot): (marks, share)
            for team, robot, marks, share in markers(match.trajectories).iter_rows()}
    seen = match.trajectories.filter(pl.col("team") != "ball", pl.col("segment").is_not_null())
    seen = seen.with_columns(pl.col("team").cast(pl.String))
    found = []
    for (team, robot), rows in sorted(
            seen.group_by("team", "robot"), key=lambda part: (part[0][0] != "home", part[0][1])):
        turn = 1 if team == "home" else -1
        cells = heat(turn * rows["x"].to_numpy(), turn * rows["y"].to_numpy(), match.pitch)
        marks, share = near.get((str(team), int(str(robot))), (None, None))
        name = match.home if team == "home" else match.away
        found.append({"team": team, "number": robot, "name": name.name, "marks": marks,
                      "share": share, "n": rows.height,
                      "picture": on_pitch(match.pitch, f"where {name.name} {robot} was", cells=cells)})
    return found


def menu(matches: Sequence[LeagueMatch]) -> list[TeamName]:
    """The teams of some matches, sorted."""
    return sorted({team for match in matches for team in (match.home, match.away)})
