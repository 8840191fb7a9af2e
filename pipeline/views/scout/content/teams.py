"""The pages of a team: over its matches, and its behaviours with clips."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import polars as pl
from markupsafe import Markup

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.views.commentary.words import enumerated, in_digits, percent
from pitchlore.pipeline.views.scout.content.analysis import analysed
from pitchlore.pipeline.views.scout.content.answers import team_answers
from pitchlore.pipeline.views.scout.content.chances import known_in, larger, shot_words, shots_over, size
from pitchlore.pipeline.views.scout.content.keeper import keeper
from pitchlore.pipeline.views.scout.content.learned import Learned
from pitchlore.pipeline.views.scout.content.matches import MEASURES, before, shown_score
from pitchlore.pipeline.views.scout.content.sources import (
    Known,
    LeagueMatch,
    TeamName,
    against_itself,
    matches_in_words,
    over_sides,
    sequence,
    sides_played,
)
from pitchlore.pipeline.views.scout.facts import (
    LEADS,
    TREND_AT,
    ByLead,
    Mean,
    Numbers,
    match_by_match,
    over_matches,
    trend,
)
from pitchlore.pipeline.views.scout.following import FOLLOWS_S, followed_by, following
from pitchlore.pipeline.views.scout.gallery import at_first, clips, leading, paths
from pitchlore.pipeline.views.scout.maps import lying, neuron_key
from pitchlore.pipeline.views.scout.moments import moment
from pitchlore.pipeline.views.scout.occurrences import occurrence_places, occurrences
from pitchlore.pipeline.views.scout.pictures import Mark, heat, on_pitch, passes_drawn
from pitchlore.pipeline.views.scout.restarts import SOON_S, FollowedSamples, paid
from pitchlore.pipeline.views.scout.restarts import control_over_matches as any_moment
from pitchlore.pipeline.views.scout.timeline import spark
from pitchlore.pipeline.views.scout.transitions import Followed, neighbours_of, transitions
from pitchlore.pipeline.views.scout.words import of_behaviour, said, titled, went_with
from pitchlore.schemas import SIDES, note_on
from pitchlore.schemas.behaviours import SHOWN_FROM, for_people

#: Matches that clips are taken from: the newest.
FROM = 40
#: Occurrences whose beginning and end are drawn, evenly from all.
DOTS = 60
#: Seconds from which rates are given of a time in which a team leads, is level or trails.
LEAST_S = 60.0
#: Shots that are drawn, each with the way to its moment: the last.
SHOTS = 200
#: Behaviours in the table of all: the first.
LISTED = 800
#: Outcomes of a match for a team, by the sign of its lead: drawn, won, lost.
RESULTS = ("drawn", "won", "lost")
_TIMES = {1: "once", 2: "twice"}
_ATTACKS = "It attacks to the right."


def team_facts(
    team: TeamName, matches: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]],
    keepers: tuple[int, int],
) -> dict[str, Any]:
    """Content of a team's page on its matches.

    Args:
        team: the team.
        matches: its matches.
        lines: the league's, by match.
        keepers: shots that the league's other goalkeepers saved, and those that reached them.
    """
    rows = []
    leads: dict[str, list[ByLead]] = {name: [] for name in LEADS}
    moments, played = [], [(match, side) for match in matches for side in sides_played(team, match)]
    matches = sorted(matches, key=lambda match: (lines[match.name]["date"], match.name))
    for match in matches:
        line = lines[match.name]
        for side in sides_played(team, match):
            moments.append(FollowedSamples(*line["any_moment"][side]))
            for name, each in leads.items():
                each.append(ByLead(*line["by_lead"][side][name]))
            ours, theirs = (line["numbers"][it] for it in (side, SIDES[1 - SIDES.index(side)]))
            against, goals = match.away if side == "home" else match.home, (ours["goals"], theirs["goals"])
            rows.append({
                "id": match.name, "date": line["date"], "against": against, "possession": ours["possession"],
                "score": shown_score(goals), "counted": line["counted"],
                "result": "" if None in goals else RESULTS[(goals[0] > goals[1]) - (goals[0] < goals[1])]})
    numbers = match_numbers(team, matches, lines)
    own, other = (over_matches(it) for it in numbers)
    trends = {name: _trend(label, match_by_match(numbers[0], name)) for label, name, _ in MEASURES}
    answers = team_answers(team, matches, lines)
    return {
        "team": team, "matches": rows,
        "counted": matches_in_words(len(matches), against_itself(team, matches)),
        "answers": answers, "measures": MEASURES, "own": own, "other": other,
        "note": note_on(team.name), "trend_at": TREND_AT,
        "known": known_in(len(rows), (own["xg"], other["xg"])), "trends": trends,
        "better": better(rows, trends) if len(rows) > 1 else [],
        "compared": any(it["since"] is not None for it in trends.values()),
        "analysed": analysed(played, answers["roles"], ran=[lines[match.name]["ran"] for match, _ in played]),
        "keeper": keeper(played, lines, keepers, answers["conceded"]),
        "pictures": _pictures(team, matches), "tiles": _tiles(rows, numbers, own),
        "restarts": paid(over_sides(played, LeagueMatch.restarts)), "soon_s": SOON_S,
        "any": any_moment(moments),
        "leads": [_led(name, each) for name, each in leads.items()],
    }


def over(
    team: TeamName, matches: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]]
) -> list[dict[str, Mean | None]]:
    """A team's numbers over its matches, and those of its adversaries."""
    return [over_matches(each) for each in match_numbers(team, matches, lines)]


def match_numbers(
    team: TeamName, matches: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]]
) -> list[list[tuple[Numbers, float]]]:
    """A team's numbers in each match with its minutes, and those of its adversaries."""
    found: list[list[tuple[Numbers, float]]] = [[], []]
    for match in matches:
        line = lines[match.name]
        for side in sides_played(team, match):
            minutes = max(line["seconds"] / 60, 1e-9)
            for each, of in zip(found, (side, SIDES[1 - SIDES.index(side)]), strict=True):
                each.append((Numbers(**line["numbers"][of]), minutes))
    return found


def _tiles(
    rows: Sequence[Mapping[str, Any]], each: Sequence[Sequence[tuple[Numbers, float]]],
    own: Mapping[str, Mean | None],
) -> list[dict[str, str]]:
    """A team in a few numbers: what it won, its goals, its share of the ball, its shots."""
    counts = [sum(row["result"] == name for row in rows) for name in ("won", "drawn", "lost")]
    record = " – ".join(map(str, counts))
    tiles = [{"value": record, "says": "won – drawn – lost"}] if any(counts) else []
    goals = [[it.goals for it, _ in side] for side in each]
    if rows and None not in goals[0] + goals[1]:
        tiles.append({"value": f"{sum(goals[0])} : {sum(goals[1])}", "says": "goals"})  # type: ignore[arg-type]
    if own["possession"] is not None:
        tiles.append({"value": percent(own["possession"].mean), "says": "possession"})
    shots = [sum(it.shots for it, _ in side) for side in each]
    return [*tiles, {"value": f"{shots[0]} : {shots[1]}", "says": "shots on target"}]


def better(rows: Sequence[Mapping[str, Any]], trends: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The newer half of a team's matches beside the older one in sentences, and whom it played in each.

    Args:
        rows: the matches, oldest first, each with the adversary.
        trends: for each number ``beyond`` and its label.
    """
    if len(rows) < TREND_AT:
        return [f"Whether it is better now cannot be told: halves are compared from {TREND_AT} matches on."]
    older, newer = rows[:len(rows) // 2], rows[len(rows) // 2:]
    counted = f"(the older {len(older)} matches against the newer {len(newer)})"
    changed = [it["label"] for it in trends.values() if it["beyond"]]
    says = [f"Changed by more than chance gives: {enumerated(changed)} {counted}." if changed else
            f"No difference between the two halves is larger than chance gives {counted}."]
    met = [Counter(row["against"].name for row in half) for half in (older, newer)]
    every = sorted({*met[0], *met[1]})
    if all(met[0][name] * len(newer) == met[1][name] * len(older) for name in every):
        return [*says, f"Both halves have the same adversaries{', in the same shares' * (len(every) > 1)}."]
    told = [enumerated([
        f"{name} {_TIMES.get(half[name], f'{half[name]} times')}" if half[name] else f"no {name}"
        for name in every]) for half in met]
    what = "adversaries" if met[0].keys() ^ met[1].keys() else "shares of the adversaries"
    return [*says, (f"The {what} differ, too: the older half has {told[0]}; "
                    f"the newer half has {told[1]}.")]


def _trend(label: str, values: Sequence[float | None]) -> dict[str, Any]:
    """A number's way over matches, as a picture and in words."""
    found = trend(values)
    return found._asdict() | {"label": label, "picture": spark(values, f"{label}, match by match")}


def _led(name: str, each: Sequence[ByLead]) -> dict[str, Any]:
    """A team's play while it leads, is level or trails, over its matches; no rates below LEAST_S."""
    seconds, owned = sum(it.seconds for it in each), sum(it.owned_s for it in each)
    enough = seconds >= LEAST_S
    shots, lost = sum(it.shots for it in each), sum(it.lost for it in each)
    return {
        "name": name, "minutes": seconds / 60, "enough": enough, "n": {"shots": shots, "lost": lost},
        "possession": sum(it.held_s for it in each) / owned if enough and owned else None,
        "shots": 600 * shots / seconds if enough else None,
        "lost": 600 * lost / seconds if enough else None,
    }


def _pictures(team: TeamName, matches: Sequence[LeagueMatch]) -> list[dict[str, Any]]:
    """Where a team loses the ball, shoots, passes and stands with and without the ball."""
    pitch = matches[-1].pitch
    same = [match for match in matches if match.pitch == pitch]
    sides = [(match, side) for match in same for side in sides_played(team, match)]
    losses = over_sides(sides, LeagueMatch.possession).filter(pl.col("ended") == "lost")
    arrows, shots = over_sides(sides, LeagueMatch.passes), shots_over(sides)
    places = [places_of(match, side) for match in same[-8:] for side in sides_played(team, match)]
    place = pl.concat(places).filter(pl.col("role") == "goalkeeper")
    count = len(same[-8:])
    last = "its last match" if count == 1 else f"its last {count} matches"
    many = shots.height > SHOTS
    passes, drawn = passes_drawn(arrows, "home", pitch)
    return [
        {"name": "Shots", "says": f"{number_of(shots.height, 'shot')}: filled ones are goals, dashed ones "
            f"are wide{f'; the last {SHOTS} are drawn, all are shaded' if many else ''}."
            f" {larger(shots)}{_ATTACKS}",
         "picture": shots_drawn(shots, pitch, "shots")},
        {"name": "Passes", "says": f"Passes that arrive: {arrows.height}. {drawn} {_ATTACKS}",
         "picture": on_pitch(pitch, "passes", marks=passes)},
        {"name": "Where it loses the ball", "says": f"{number_of(losses.height, 'ball')} lost. {_ATTACKS}",
         "picture": on_pitch(pitch, "where it loses the ball", cells=heat(
             losses["end_x"].to_numpy(), losses["end_y"].to_numpy(), pitch))},
        {"name": "Where its keeper is", "says": f"In {last}, while a team has the ball: "
            f"{place.height:,} samples. {_ATTACKS}",
         "picture": on_pitch(pitch, "where its keeper is", cells=heat(
             place["x"].to_numpy(), place["y"].to_numpy(), pitch))},
        {"name": "Formation", "says": f"Mean places in {last}: filled with the ball, hollow while the "
            f"adversary has it (G goalkeeper, M midfield, S striker): "
            f"{sum(it.height for it in places):,} samples. {_ATTACKS}",
         "picture": formation(pl.concat(places), pitch)},
    ]


def shots_drawn(shots: pl.DataFrame, pitch: Pitch, says: str) -> Markup:
    """A picture of a team's last SHOTS shots; where there are more, all are shaded."""
    return on_pitch(pitch, says, marks=_shots(shots.tail(SHOTS)), cells=heat(
        shots["x"].to_numpy(), shots["y"].to_numpy(), pitch) if shots.height > SHOTS else None)


def _shots(shots: pl.DataFrame) -> list[Mark]:
    """Marks of shots; each leads to its moment."""
    marks = []
    for row in shots.iter_rows(named=True):
        at = before(row["t_ns"] / 1e9)
        marks.append(Mark(
            row["x"], row["y"], f"mark home {row['outcome']}",
            f"robot {row['robot']}: {shot_words(row)}", size=size(row["xg"], shots.height),
            link=moment(row["match_id"], at, ours=row["team"])))
    return marks


def places_of(match: LeagueMatch, side: str) -> pl.DataFrame:
    """Places of a side's robots in play, as it sees them, with whether it has the ball then."""
    held = match.possession.select(
        t_ns="start_ns", owner=pl.col("team").cast(pl.String), until="end_ns").sort("t_ns")
    turn = 1 if side == "home" else -1
    return (
        match.trajectories
        .filter(pl.col("team") == side, pl.col("segment").is_not_null(), pl.col("frame") % 5 == 0)
        .select("t_ns", "robot", "role", x=turn * pl.col("x"), y=turn * pl.col("y")).sort("t_ns")
        .join_asof(held, on="t_ns", strategy="backward").filter(pl.col("t_ns") < pl.col("until"))
        .with_columns(has=pl.col("owner") == side)
    )


def formation(places: pl.DataFrame, pitch: Pitch) -> Any:
    """Mean places by role, with the ball and without."""
    means = places.group_by("role", "has").agg(pl.col("x", "y").mean(), pl.len()).sort("role", "has")
    return on_pitch(pitch, "mean places by role", marks=[
        Mark(row["x"], row["y"], f"mark home{' hit' if row['has'] else ''}",
             f"{row['role']} {'with' if row['has'] else 'without'} the ball, n = {row['len']:,}",
             letter=row["role"][0].upper(), size=2.6)
        for row in means.iter_rows(named=True)])


def gallery(
    team: TeamName, matches: Sequence[LeagueMatch], known: Known, learned: Learned
) -> dict[str, Any] | None:
    """Content of the page of a team's behaviours; None if it has none of its own."""
    own = known.of(team)
    if own.is_empty():
        return None
    every = _typical(team, known, learned)
    shown = lying(leading(every), learned.grams(team))
    pitch, newest = matches[-1].pitch, matches[-FROM:]
    ids = shown["behaviour_id"].to_list()
    seen = [_seen(match, team, own).filter(pl.col("behaviour_id").is_in(ids)) for match in newest]
    ways = paths(pl.concat(rows for match, rows in zip(newest, seen, strict=True) if match.pitch == pitch))
    led = following(pl.concat(seen))
    by_behaviour, near = clips(pl.concat(seen)), neighbours_of(transitions(learned.decisions(team)))
    return {
        "team": team, "version": known.manifest.version, "total": own.height, "shown_from": SHOWN_FROM,
        "roles": every["role"].cast(pl.String).unique().sort().to_list(), "follows_s": FOLLOWS_S,
        "counted_in": matches_in_words(len(newest), 0),
        "phrases": [said([code]) for code in every["codes"].explode().unique().sort().to_list()],
        "every": [row | {"title": titled(row["codes"]), "words": said(row["codes"]),
                         "shown": row["behaviour_id"] in ids, "went": went_with(row)}
                  for row in every.head(LISTED).select(
                      "behaviour_id", "codes", "role", "support", "value", "low", "high", "q", "times",
                      "at_least",
                  ).iter_rows(named=True)],
        "cards": [{
            "id": row["behaviour_id"], "title": titled(row["codes"]), "words": said(row["codes"]),
            "role": row["role"],
            "length": len(row["codes"]),
            "went": went_with(row), "codes": row["codes"],
            **{name: row[name] for name in (
                "support", "new", "value", "low", "high", "effect", "neuron", "times", "at_least")},
            "on": None if row["neuron"] is None else neuron_key(row["n"], row["neuron"]),
            "before": _reported(near.get(row["behaviour_id"], ([], []))[0], ids),
            "after": _reported(near.get(row["behaviour_id"], ([], []))[1], ids),
            "clips": at_first(by_behaviour.get(row["behaviour_id"], [])),
            "led": led.get(row["behaviour_id"]),
            **_way(pitch, row, ways.get(row["behaviour_id"])),
        } for row in shown.iter_rows(named=True)],
    }


def on_page(team: TeamName, known: Known, learned: Learned) -> pl.DataFrame:
    """The behaviours of a team that have cards, in their order, with how typical of it they are."""
    return leading(_typical(team, known, learned))


def _typical(team: TeamName, known: Known, learned: Learned) -> pl.DataFrame:
    """All behaviours of a team, in their order, with how typical of it they are."""
    own = for_people(known.of(team))
    return own.join(learned.typical(team), on=["role", "codes"], how="left", maintain_order="left")


def _seen(match: LeagueMatch, team: TeamName, own: pl.DataFrame) -> pl.DataFrame:
    """The occurrences of all of a team's behaviours in a match, with their places and what followed."""
    found = pl.concat([occurrences(sequence(match, side), own) for side in sides_played(team, match)])
    trajectories = match.trajectories
    return followed_by(occurrence_places(found, trajectories), match.shots, match.goals, trajectories)


def _way(pitch: Pitch, row: Mapping[str, Any], way: pl.DataFrame | None) -> dict[str, Any]:
    """Where a behaviour begins and ends, as a picture and in words."""
    if way is None:
        begins = row["x"] is not None and np.isfinite(row["x"])
        return {"way": None, "picture": on_pitch(pitch, "where it begins", marks=[
            Mark(row["x"], row["y"], "mark home hit", "mean place at which it begins")] if begins else [])}
    x, y, to_x, to_y = (float(way[name].mean()) for name in ("x", "y", "to_x", "to_y"))  # type: ignore[arg-type]
    drawn = way.gather_every(max(1, -(-way.height // DOTS)))
    dots = [Mark(place[0], place[1], f"mark {style}", says, size=1.2)
            for names, style, says in ((("x", "y"), "begun", "begins"), (("to_x", "to_y"), "ended", "ends"))
            for place in drawn.select(names).iter_rows()]
    says = "on average from ({}, {}) m to ({}, {}) m".format(*map(in_digits, (x, y, to_x, to_y)))
    return {"way": {"says": says, "n": way.height}, "picture": on_pitch(
        pitch, f"where it begins and ends: {says}", marks=[
            *dots, Mark(x, y, "mark home mean", says, to=(to_x, to_y), size=4.5),
            Mark(x, y, "mark home hit", "mean place at which it begins", size=1.8)])}


def _reported(neighbours: Sequence[Followed], shown: Sequence[str]) -> list[dict[str, Any]]:
    """Behaviours before or after another, in words; those that have a card are marked."""
    return [{"id": each.behaviour, "words": of_behaviour(each.behaviour),
             "role": each.behaviour.split("-")[0], "times": each.times, "of": each.of,
             "shown": each.behaviour in shown} for each in neighbours]
