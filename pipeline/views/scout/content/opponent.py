"""The scouting report on an opponent: sentences, each with its n and the clips that it rests on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import polars as pl

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.engine.tables import TableOf
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.views.card import Card
from pitchlore.pipeline.views.commentary.words import enumerated, percent, restart_word
from pitchlore.pipeline.views.scout.content.answers import (
    goals_over,
    line_samples,
    made_by,
    robots_of,
    scores_by,
)
from pitchlore.pipeline.views.scout.content.chances import larger, shots_over
from pitchlore.pipeline.views.scout.content.danger import dangerous, of_keeper
from pitchlore.pipeline.views.scout.content.keeper import faced_of
from pitchlore.pipeline.views.scout.content.sources import (
    LeagueMatch,
    TeamName,
    against_itself,
    matches_in_words,
    over_sides,
    sides_played,
)
from pitchlore.pipeline.views.scout.content.teams import shots_drawn
from pitchlore.pipeline.views.scout.gallery import Clip
from pitchlore.pipeline.views.scout.restarts import SOON_S, Share, came_soon, paid
from pitchlore.pipeline.views.scout.scored import clip_of
from pitchlore.pipeline.views.scout.shooting import outcome_words
from pitchlore.pipeline.views.scout.zones import third, time_in

#: Chooses rows for clips.
Spread: TypeAlias = Callable[[pl.DataFrame], pl.DataFrame]
#: Matches that the report is made from, the newest; clips of a sentence.
FROM, CLIPS = 20, 3
#: Behaviours that went with its adversaries' chances: the report names so many.
_WORSE = 3
#: Thirds of the pitch, along and across, as the team sees them.
_ALONG, _ACROSS = ("its own third", "the middle third", "the attacking third"), ("right", "centre", "left")


def opponent_facts(
    team: TeamName, matches: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]],
    gallery: dict[str, Any], card: Card | None, mine: str = "",
) -> dict[str, Any]:
    """Content of the report on a team.

    Args:
        team: the team.
        matches: its matches.
        lines: the league's, by match.
        gallery: the facts of its behaviours.
        card: sentences on what went with its winning and losing; None where that is not known.
        mine: name of the team that reads: clips against it come first.
    """
    last = matches[-FROM:]
    played = [(match, side) for match in last for side in sides_played(team, match)]
    behaviours = dangerous(gallery["cards"], gallery["sides"])
    pitch, faced = matches[-1].pitch, over_sides(played, LeagueMatch.shots, own=False)
    spread = partial(_spread, first=[match.name for match, side in played if mine == (
        match.away if side == "home" else match.home).name])
    return {
        "team": team, "counted": matches_in_words(len(last), against_itself(team, last)), "card": card,
        "behaviours": behaviours, "learned": gallery["sides"], "keeper": of_keeper(behaviours),
        "worse": dangerous(gallery["cards"], gallery["sides"], worse=True)[:_WORSE],
        "known": bool(gallery["cards"]),
        "sentences": [
            _said("What it scores by", *scores_by(goals_over(played, lines), robots_of(played, lines))),
            _striker(played, lines, spread),
            _losses(over_sides(played, LeagueMatch.possession), pitch, spread),
            _pressed(over_sides(played, LeagueMatch.pressure, own=False), spread),
            _conceded(played, faced, spread),
            _keeper(played, lines, faced, pitch, spread),
            _restarts(played, spread),
        ],
    }


def _clip(row: dict[str, Any], at_ns: int, says: str, *, before_s: float = 3.0) -> Clip:
    return Clip.about(row, at_ns, at_ns, says, before_s=before_s, after_s=1.5)


def _spread(rows: pl.DataFrame, first: Sequence[str]) -> pl.DataFrame:
    """Rows for clips, far apart in the table, because moments next to each other look alike.

    Those of the matches ``first`` come before the others.
    """
    there = pl.col("match_id").is_in(first)
    return pl.concat([
        some.gather_every(max(1, some.height // CLIPS)) for some in (rows.filter(there), rows.filter(~there))
    ]).head(CLIPS)


def _said(title: str, says: str, clips: Sequence[Clip] = ()) -> dict[str, Any]:
    return {"title": title, "says": says, "clips": list(clips), "picture": None}


def _losses(held: pl.DataFrame, pitch: Pitch, spread: Spread) -> dict[str, Any]:
    """Where the team loses the ball."""
    lost = held.filter(pl.col("ended") == "lost").with_columns(
        along=third("end_x", pitch.length),
        across=((pl.col("end_y") / pitch.width + 0.5) * 3).floor().clip(0, 2).cast(pl.Int8))
    if lost.is_empty():
        return _said("Where it loses the ball", "No loss of the ball to the adversary was seen.")
    (along, across, count) = lost.group_by("along", "across").len().sort(
        "len", "along", "across", descending=[True, False, False]).row(0)
    there = spread(lost.filter(along=along, across=across))
    return _said(
        "Where it loses the ball",
        f"Most often in {_ALONG[along]}, {_ACROSS[across]}: {count} of {lost.height} losses.",
        [_clip(row, row["end_ns"], "lost")
         for row in there.with_columns(robot="last_robot").iter_rows(named=True)])


def _pressed(pressed: pl.DataFrame, spread: Spread) -> dict[str, Any]:
    """Gains by pressure on the team."""
    won = pressed.filter("won")
    share = won.height / max(pressed.height, 1)
    return _said(
        "Under pressure",
        f"A robot pressed it {number_of(pressed.height, 'time')}. In {won.height:,} of these"
        f" ({percent(share)}) the pressing team won the ball.",
        [_clip(row, row["end_ns"], "won by pressing")
         for row in spread(won).iter_rows(named=True)])


def _conceded(
    played: Sequence[tuple[LeagueMatch, str]], shots: pl.DataFrame, spread: Spread
) -> dict[str, Any]:
    """Goals that the team conceded, and how; ``shots`` are those at its goal."""
    goals = over_sides(played, LeagueMatch.goals, own=False)
    kind = pl.col("kind").cast(pl.String).fill_null("of unknown kind")
    counts = goals.select(kind=kind).group_by("kind").len()
    kinds = ", ".join(f"{count} {made_by(kind)}" for kind, count in counts.sort(
        "len", "kind", descending=[True, False]).iter_rows())
    says = f"{number_of(goals.height, 'goal')}{f': {kinds}' if kinds else ''}."
    if shots.height:
        middle = float(np.median(shots["distance"].to_numpy()))
        says += (f" Half of the {shots.height} shots at it came from less than {middle:.2f} m."
                 if shots.height > 1 else f" The only shot at it came from {middle:.2f} m.")
    return _said("What has worked against it", says, [
        clip_of(row, "how it came") for row in spread(goals).iter_rows(named=True)])


def _striker(
    played: Sequence[tuple[LeagueMatch, str]], lines: Mapping[str, dict[str, Any]], spread: Spread
) -> dict[str, Any]:
    """The robots that play as the team's striker, and what they do while they are it."""
    often = time_in("striker", (line_samples(match, side, lines) for match, side in played))[:2]
    if not often:
        return _said("Its striker", "No striker was seen.")
    plays = [
        f"robot {robot} plays striker for {percent(share)} of its time" for robot, share in often]
    shots = shots_over(played).filter(role="striker")
    passes, lost, goals = (_as_striker(played, table, robot, t_ns) for table, robot, t_ns in (
        (LeagueMatch.passes, "robot", "t_ns"), (LeagueMatch.possession, "last_robot", "end_ns"),
        (LeagueMatch.goals, "robot", "t_ns")))
    made = goals.filter(pl.col("kind").cast(pl.String).fill_null("") != "error")
    lost = lost.filter(pl.col("ended") == "lost")
    near = (f", half of them from less than {np.median(shots['distance'].to_numpy()):.2f} m"
            if shots.height > 1 else "")
    clips = [clip_of(row, "its goal") for row in spread(made).iter_rows(named=True)] or [
        _clip(row, row["t_ns"], f"its shot: {outcome_words(row['outcome'])}")
        for row in spread(shots).iter_rows(named=True)]
    pitch = played[-1][0].pitch
    same = shots.filter(pl.col("match_id").is_in([match.name for match, _ in played if match.pitch == pitch]))
    return _said(
        "Its striker",
        f"{' and '.join(plays).capitalize()}. Whichever robot was the striker at the time made"
        f" {number_of(made.height, 'goal')}, shot {number_of(shots.height, 'time')}{near}, made"
        f" {passes.height:,} passes that arrived, and lost the ball {number_of(lost.height, 'time')}.",
        clips) | ({"picture": shots_drawn(same, pitch, "shots of its striker"), "head": "Its shots", "legend":
                   f"Filled shots are goals, dashed ones are wide. {larger(same)}It attacks to the right."}
                  if same.height else {})


def _as_striker(
    played: Sequence[tuple[LeagueMatch, str]], table: TableOf, robot: str, t_ns: str
) -> pl.DataFrame:
    """Rows of a table about a team's robots that were its striker then, by their last sample before."""
    found = [table.schema.empty()]
    for match, side in played:
        roles = match.trajectories.filter(pl.col("team") == side).select(
            "t_ns", "robot", then=pl.col("role").cast(pl.String)).sort("t_ns")
        own = table.of(match).filter(pl.col("team") == side, pl.col(robot).is_not_null())
        columns = own.columns
        found.append(own.sort(t_ns, maintain_order=True).join_asof(
            roles, left_on=t_ns, right_on="t_ns", by_left=robot, by_right="robot", strategy="backward",
            check_sortedness=False, coalesce=False, suffix="_seen",
        ).filter(pl.col("then") == "striker").select(columns))
    return pl.concat(found)


def _keeper(
    played: Sequence[tuple[LeagueMatch, str]], lines: Mapping[str, dict[str, Any]], faced: pl.DataFrame,
    pitch: Pitch, spread: Spread,
) -> dict[str, Any]:
    """The team's goalkeeper."""
    places = [np.zeros((0, 2))]
    for match, side in played:
        turn = 1 if side == "home" else -1
        seen = match.trajectories.filter(
            pl.col("team") == side, pl.col("role") == "goalkeeper", pl.col("segment").is_not_null())
        places.append(turn * seen.select("x", "y").to_numpy())
    at = np.concatenate(places)
    if not len(at):
        return _said("Its keeper", "No goalkeeper was seen.")
    out, aside = np.median(at[:, 0]) + pitch.goal_x, np.median(np.abs(at[:, 1]))
    robots = [f"robot {robot} for {percent(share)} of its time" for robot, share in time_in(
        "goalkeeper", (line_samples(match, side, lines) for match, side in played))[:2]]
    return _said(
        "Its keeper",
        f"In goal is {enumerated(robots)}. Its median distance from its goal line is {out:.2f} m,"
        f" and from the goal's middle, sideways, {aside:.2f} m. {saves(faced)}",
        [_clip(row, row["t_ns"], "saved", before_s=2.0)
         for row in spread(faced.filter(pl.col("outcome") == "saved")).iter_rows(named=True)])


def saves(shots: pl.DataFrame) -> str:
    """A goalkeeper's saves, of the shots that reached it: saved ones and goals, as football counts.

    Args:
        shots: rows of schema Shots, all at its goal.
    """
    faced = faced_of(shots)
    n, blocked, kept, missed, saved, conceded = faced
    aside = [f"other robots blocked {blocked}"]
    aside += [f"after {kept} the attackers kept the ball"] if kept else []
    aside += [f"{missed} reached nobody"] if missed else []
    says = f"Of {number_of(n, 'shot')} on target, {enumerated(aside)}."
    if not faced.reached:
        return f"{says} None reached it."
    share = percent(saved / faced.reached)
    return f"{says} Of {faced.reached} that reached it, it saved {saved} ({share}), and {conceded} went in."


def _within(share: Share) -> str:
    """A share and its interval in words; empty without one."""
    return "" if share.low is None or share.high is None else (
        f" ({percent(share.share)} [{100 * share.low:.0f}, {100 * share.high:.0f}])")


def _restarts(played: Sequence[tuple[LeagueMatch, str]], spread: Spread) -> dict[str, Any]:
    """Outcomes of the team's restarts, by the numbers of its page."""
    given = over_sides(played, LeagueMatch.restarts).filter("own")
    led = given.filter(came_soon("shot_ns"))
    parts = ", ".join(
        f"{it.kind} {it.shot.hits} of {it.shot.n}{_within(it.shot)}" for it in paid(given))
    return _said(
        "Its restarts",
        f"Of {number_of(given.height, 'restart')} that it took, {led.height} led to a shot"
        f" within {SOON_S:.0f} s of the first touch{f': {parts}' if parts else ''}.",
        [Clip.about(row, row["taken_ns"], row["taken_ns"] + round(SOON_S * 1e9),
                    restart_word(row["note"] or row["kind"]), before_s=0, after_s=0)
         for row in spread(led).iter_rows(named=True)])
