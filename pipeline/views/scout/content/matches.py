"""The page of a match, and its line in the league."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.views.commentary import Commentary
from pitchlore.pipeline.views.commentary.summary import found_words
from pitchlore.pipeline.views.commentary.words import percent, side_names, time_elapsed
from pitchlore.pipeline.views.scout.changes import Change, change, change_of_count, reported_changes
from pitchlore.pipeline.views.scout.content.analysis import analysed, in_halves, space_over_time
from pitchlore.pipeline.views.scout.content.answers import MatchAnswers, of_match, roles_said
from pitchlore.pipeline.views.scout.content.chances import rests_on, shot_words, size, with_chances
from pitchlore.pipeline.views.scout.content.flaws import flaws
from pitchlore.pipeline.views.scout.content.keeper import faced_of
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch, TeamName
from pitchlore.pipeline.views.scout.facts import (
    Numbers,
    by_lead,
    halves,
    is_counted,
    markers,
    numbers,
    parts,
    played_s,
)
from pitchlore.pipeline.views.scout.moments import moment
from pitchlore.pipeline.views.scout.pictures import Mark, bars, heat, on_pitch, passes_drawn
from pitchlore.pipeline.views.scout.restarts import any_moment
from pitchlore.pipeline.views.scout.scored import Scored, clip_of
from pitchlore.pipeline.views.scout.swings import (
    SWING_S,
    Swing,
    deciding,
    drawn_lines,
    lead_words,
    on_top_words,
    stretches,
    swings,
)
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
#: Seconds after a swing in which the commentary still tells of it.
_AFTER_S = 1.0


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
                 f"goal for {names[team] if team else 'nobody knows whom'} at {time_elapsed(t_ns)}",
                 f"../matches/{match.name}.html#goal-{place}")
        for place, (t_ns, team) in enumerate(match.goals.sort("t_ns").select("t_ns", "team").iter_rows(), 1)]
    moments = replace(moments, moments=tuple(
        it._replace(text=roles_said(it.text, match, kept.robots)) for it in moments.moments))
    played, said, ran = stretches(match.values), _reported(moments), in_halves(match)
    drawn, decided = drawn_lines(played, row["duration_s"]), deciding(match.goals)
    swung = swings(drawn)
    return {
        "id": match.name, "home": match.home, "away": match.away, "kind": pitch.kind.value,
        "score": shown_score(counts[0][side].goals for side in SIDES), "counted": is_counted(match),
        "seconds": row["duration_s"], "flaws": _flaws(match),
        "note": note_on(row["home"], row["away"]), "measures": MEASURES,
        "called": names, "changes": changes, "changed": reported_changes([
            (f"{names[side]}: {label}", changes[side][name])
            for side in SIDES for label, name, _ in MEASURES]),
        "analysed": [{"name": names[side], "key": side, "facts": facts} for side in SIDES
                     if (facts := analysed([(match, side)], answers[side]["roles"], side, [ran]))],
        "parts": [{"name": name, "numbers": {side: own._asdict() for side, own in each.items()}}
                  for (name, _, _), each in zip(whole, counts, strict=True)],
        "top": on_top(drawn, goals, "who is on top", row["duration_s"], _half(match), swung),
        "swung": [on_top_words(played, names), lead_words(match.goals, names)],
        "swings": [_swing(swing, match, said, names) for swing in swung],
        "decided": decided,
        "tiles": _tiles(match, counts[0]),
        "swing_s": SWING_S, "found": found_words(moments.summary.sure),
        "over_time": each, "strips": [
            {"name": name, "blank": blank if any(getattr(part, of) is None for part in each) else "",
             "picture": over_time(
                 [getattr(part, of) for part in each], goals, name, row["duration_s"], blank)}
            for name, of, blank in (("Possession over time", "possession", "nobody had the ball"),
                                    ("Territory over time", "territory", "ball not in play"))] + _space(
                                        match, goals),
        "goals": _goals(match, moments, kept.scored, names), "told": said,
        "shots": _shots(match, names),
        "sides": [{"key": side, "name": team.name, "answers": answers[side],
                   **_passes(match, side, names[side], pitch)}
                  for side, team in zip(SIDES, sides, strict=True)],
        "robots": _robots(match),
    }


def line(match: LeagueMatch, kept: MatchAnswers) -> dict[str, Any]:
    """A match's line in the league, JSON-able; ``kept`` is what the pages of its teams need of it."""
    row, own, leads = match.matches.row(0, named=True), numbers(match), by_lead(match)
    ball = match.trajectories.filter(pl.col("team") == "ball", pl.col("segment").is_not_null())
    counts, _ = np.histogram(ball["x"].to_numpy(), 12, (-match.pitch.goal_x, match.pitch.goal_x))
    return {
        "score": shown_score(own[side].goals for side in SIDES), "counted": is_counted(match),
        "seconds": row["duration_s"], "played_s": played_s(match.trajectories),
        "kind": match.pitch.kind.value,
        "date": row["started_at"].date().isoformat() if row["started_at"] else "",
        "flaws": _flaws(match), "numbers": {side: it._asdict() for side, it in own.items()},
        "any_moment": {side: list(it) for side, it in any_moment(
            match.trajectories, match.shots, match.referee).items()},
        "faced": {side: faced_of(match.shots.filter(pl.col("team") != side)) for side in SIDES},
        "ran": in_halves(match), **kept._asdict(),
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


def shown_score(goals: Iterable[int | None]) -> str:
    """A score in words; what is not known is a question mark."""
    return " : ".join("?" if it is None else str(it) for it in goals)


def _flaws(match: LeagueMatch) -> str:
    return flaws(match.recorded_quality, match.trajectories["frame"].n_unique())


def _reported(reported: Commentary) -> list[dict[str, Any]]:
    """Each sentence of the commentary, with the moment of the replay that it tells of, seconds."""
    return [{"at": before(moment.t_ns / 1e9), "seconds": moment.t_ns / 1e9, "team": moment.team or "",
             "actor": moment.actor or moment.team or "", "robot": moment.robot,
             "says": moment.text, "kind": moment.kind}
            for moment in reported.moments]


def _half(match: LeagueMatch) -> float | None:
    """Place of half-time in the match, 0 to 1; None where no referee gave one."""
    given = match.referee.filter(pl.col("event") == "half")["t_ns"]
    return float(given[0]) / 1e9 / max(match.matches["duration_s"][0], 1e-9) if len(given) else None


def _swing(
    swing: Swing, match: LeagueMatch, said: Sequence[dict[str, Any]], names: Mapping[str, str]
) -> dict[str, Any]:
    """A swing in words: what the commentary tells of it, else who had the ball, and where.

    Its time is that of a goal in it, else of the first other event that is told, else of its end. Where a
    shot of the side that V moved away from was no goal, the swing is the end of that side's chance.
    """
    start_s, end_s = swing.start_ns / 1e9, swing.end_ns / 1e9
    told = [line for line in said
            if start_s <= line["seconds"] <= end_s + _AFTER_S and line["kind"] != "possession"]
    event = next((line for line in told if line["kind"] == "goal"), told[0] if told else {"seconds": end_s})
    first, then = (_had(match, at, names) for at in (swing.start_ns, swing.end_ns))
    words = f"{first}, then {then}." if first != then else f"{first}."
    says = " ".join(line["says"] for line in told) or words[:1].upper() + words[1:]
    shot = next((line["actor"] for line in told if line["kind"] in ("save", "shot")), swing.side)
    missed = shot if event.get("kind") != "goal" and shot != swing.side else None
    way = f"{names[missed]}: a chance ends" if missed else f"to {names[swing.side]}"
    return swing._asdict() | {
        "side": missed or swing.side, "way": way, "says": says,
        "at": before(min(start_s, event["seconds"])), "seconds": event["seconds"]}


def _had(match: LeagueMatch, t_ns: int, names: Mapping[str, str]) -> str:
    """The team that had the ball at a moment, and the third where the ball was, in words."""
    held = match.possession.filter(pl.col("start_ns") <= t_ns, pl.col("end_ns") > t_ns)
    who = f"{names[held['team'][0]]} had the ball" if len(held) else "nobody had the ball"
    ball = match.trajectories.filter(pl.col("team") == "ball", pl.col("t_ns") <= t_ns).sort("t_ns").tail(1)
    if ball.is_empty():
        return who
    x, sixth = float(ball["x"][0]), match.pitch.length / 6
    if abs(x) <= sixth:
        return f"{who} in the middle third"
    return f"{who} in the third of {names[SIDES[0] if x < 0 else SIDES[1]]}"


def _tiles(match: LeagueMatch, counts: Mapping[str, Numbers]) -> list[dict[str, str]]:
    """The numbers that everybody asks for first, home's then away's."""
    def both(name: str, of: Callable[[Any], str]) -> str:
        values = [getattr(counts[side], name) for side in SIDES]
        return " : ".join("–" if value is None else of(value) for value in values)

    tried = match.pass_attempts
    rows = [("possession", both("possession", percent)), ("shots on target", both("shots", str)),
            ("past the post", both("wide", str)), ("expected goals (xG)", both("xg", "{:.1f}".format))]
    if not tried.is_empty():
        shares = [tried.filter(pl.col("team") == side).select((pl.col("came") == "arrives").mean()).item()
                  for side in SIDES]
        rows.append(("of the passes tried arrive", " : ".join(map(percent, shares))))
    return [{"says": says, "value": value} for says, value in rows]


def _goals(
    match: LeagueMatch, reported: Commentary, scored: Sequence[Scored], names: Mapping[str, str]
) -> list[dict[str, Any]]:
    """The goals by side, those of nobody known last: what came before, the commentary, a clip."""
    own = {goal.t_ns: goal for goal in scored}
    said = [moment.text.removeprefix("GOAL").partition("! ")[2] for moment in reported.moments
            if moment.kind == "goal"]  # the head of its list says for whom it is
    goals = match.goals.sort("t_ns", maintain_order=True).iter_rows(named=True)
    groups: dict[str, list[dict[str, Any]]] = {side: [] for side in (*SIDES, "")}
    for place, (goal, line) in enumerate(zip(goals, said, strict=True), 1):
        known, group = own.get(goal["t_ns"]), groups[goal["team"] or ""]
        shot = "" if known is None else (
            "no shot" if known.distance is None else f"shot from {known.distance:.2f} m")
        group.append({"place": place, "nth": len(group) + 1})
        group[-1].update({
            "says": line, "shot": shot, "clip": clip_of(goal, _HOW),
            "at": goal["t_ns"] / 1e9, "before": "" if known is None else known.before.says,
            "score": " : ".join(str(len(groups[side])) for side in SIDES)})
    heads: dict[str, str] = {
        side: f"{names[side]} scored, {names[SIDES[1 - SIDES.index(side)]]} conceded" for side in SIDES}
    return [{"team": side, "head": heads.get(side, "Nobody knows for whom"), "goals": group}
            for side, group in groups.items() if group]


def _shots(match: LeagueMatch, names: Mapping[str, str]) -> dict[str, Any]:
    rows, marks, shots = [], [], with_chances(match)
    for shot in shots.iter_rows(named=True):
        turn = 1 if shot["team"] == "home" else -1
        at = shot["t_ns"] / 1e9
        says = f"{names[shot['team']]} {shot['robot']}: {shot_words(shot)}"
        style = f"mark {shot['team']} {shot['outcome']}"
        marks.append(Mark(turn * shot["x"], turn * shot["y"], style, says,
                          link=moment(match.name, before(at), of=match.name),
                          size=size(shot["xg"], shots.height)))
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
    arrows, drawn = passes_drawn(own, side, pitch)
    rows = [(row["t_ns"], row["robot"],
             f"passes to {row['receiver']}, {'through, ' * row['through']}{row['direction']}",
             row["x"], row["y"]) for row in own.iter_rows(named=True)]
    rows += [(row["end_ns"], row["last_robot"], "loses the ball", row["end_x"], row["end_y"])
             for row in lost.iter_rows(named=True)]
    return {
        "drawn": drawn, "picture": on_pitch(
            pitch, f"passes of {name}, and where it loses the ball", marks=marks + arrows),
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


def menu(matches: Sequence[LeagueMatch], mine: str = "") -> list[TeamName]:
    """The teams of some matches: those that are called so first, then by name.

    No match changes that order, so that a new one leaves the pages of the others as they are; a script that
    all pages load puts the teams of the newest match first (:func:`newest_first`).
    """
    return sorted({team for match in matches for team in (match.home, match.away)},
                  key=lambda team: (team.name != mine, team))


def newest_first(matches: Sequence[LeagueMatch], teams: Sequence[TeamName], mine: str = "") -> list[TeamName]:
    """The teams as pages begin with them: those called so, then those of the newest match, home first.

    Args:
        matches: the matches, oldest first.
        teams: their teams.
        mine: a team's name.
    """
    newest = [matches[-1].home, matches[-1].away]
    return sorted(teams, key=lambda team: (
        team.name != mine, newest.index(team) if team in newest else len(newest)))
