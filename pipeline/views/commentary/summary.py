"""Statistics of a match."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import polars as pl
from pydantic import BaseModel, ConfigDict

from pitchlore.pipeline.views.commentary.goals import usual_confidence
from pitchlore.pipeline.views.commentary.settings import CommentarySettings
from pitchlore.pipeline.views.commentary.words import percent, time_elapsed
from pitchlore.schemas import ROLES, note_on
from pitchlore.schemas.goals import KINDS
from pitchlore.schemas.situations import MOVES_RANDOMLY


class SideStatistics(BaseModel):
    """Statistics of one team in a match.

    Attributes:
        name: name of the team.
        score: its goals; None where unknown.
        goals: its goals by kind: direct, indirect, error (of the adversary), and unknown; None where nobody
            knows whether it has any.
        found: how many of them were found from the ball.
        scorers: robot's number to its goals, errors of the adversary not counted.
        shots: at the goal, wide ones and goals included.
        on_target: shots among them that were on target.
        saves: shots of the other team that its goalkeeper stopped.
        possession: share of the time in which a team has the ball, in [0, 1]; None if none has.
        situations: role to its most frequent situations, name and count, most frequent first;
            without "moves randomly".
        random: role to the share of its time in situations that was "moves randomly".
    """

    model_config = ConfigDict(frozen=True)

    name: str
    score: int | None
    goals: dict[str, int] | None
    found: int
    scorers: dict[int, int]
    shots: int
    on_target: int
    saves: int
    possession: float | None
    situations: dict[str, list[tuple[str, int]]]
    random: dict[str, float]


class MatchStatistics(BaseModel):
    """Statistics of both teams in a match.

    Attributes:
        match_id: id of the match.
        duration_s: first to last sample.
        home, away: the teams.
        note: note beside results of these teams, None if there is none.
        sure: how sure half of the goals that were found from the ball are, in [0, 1]; None without one.
    """

    model_config = ConfigDict(frozen=True)

    match_id: str
    duration_s: float
    home: SideStatistics
    away: SideStatistics
    note: str | None
    sure: float | None


def match_statistics(
    match: pl.DataFrame, goals: pl.DataFrame, situations: pl.DataFrame, possession: pl.DataFrame,
    shots: pl.DataFrame, settings: CommentarySettings,
) -> MatchStatistics:
    """Statistics of a match.

    Args:
        match: schema Matches, one row.
        goals: schema Goals, of that match.
        situations: schema Situations, of that match.
        possession: schema Possession, of that match.
        shots: schema Shots, of that match.
        settings: settings of the commentary.
    """
    row = match.row(0, named=True)
    held = possession.group_by(pl.col("team").cast(pl.String)).agg(
        (pl.col("end_ns") - pl.col("start_ns")).sum())
    on_ball: dict[str, int] = dict(held.iter_rows())
    total = sum(on_ball.values())

    def side(team: str) -> SideStatistics:
        own = goals.filter(pl.col("team") == team)
        unknown = row[f"score_{team}"] is None and own.is_empty()
        made = own.filter(pl.col("kind") != "error").drop_nulls("robot")["robot"]
        kinds = Counter(own["kind"].cast(pl.String).fill_null("unknown"))
        tried, against = (
            shots.filter((pl.col("team") == team) == us)["outcome"].to_list() for us in (True, False))
        return SideStatistics(
            name=row[team], score=row[f"score_{team}"],
            goals=None if unknown else {
                kind: kinds[kind] for kind in (*KINDS, "unknown") if kind in KINDS or kinds[kind]},
            found=own["confidence"].count(),
            scorers=dict(Counter(made.to_list()).most_common()),
            shots=len(tried), on_target=len(tried) - tried.count("wide"), saves=against.count("saved"),
            possession=on_ball.get(team, 0) / total if total else None,
            situations={role: _most(done, settings) for role, done in _by_role(situations, team)},
            random={role: _random(done) for role, done in _by_role(situations, team)},
        )

    return MatchStatistics(
        match_id=row["match_id"], duration_s=row["duration_s"], home=side("home"), away=side("away"),
        note=note_on(row["home"], row["away"]), sure=usual_confidence(goals),
    )


def _by_role(situations: pl.DataFrame, team: str) -> list[tuple[str, pl.DataFrame]]:
    """A team's situations by role; roles that it never had are left out."""
    own = situations.filter(pl.col("team") == team)
    parts = [(role, own.filter(pl.col("role") == role)) for role in ROLES]
    return [(role, done) for role, done in parts if done.height]


def _most(done: pl.DataFrame, settings: CommentarySettings) -> list[tuple[str, int]]:
    """The most frequent situations, of equal ones the lower code first."""
    named = done.filter(pl.col("code") != MOVES_RANDOMLY).group_by("code", "name").len()
    most = named.sort("len", "code", descending=[True, False]).head(settings.most_frequent)
    return list(most.select("name", "len").iter_rows())


def _random(done: pl.DataFrame) -> float:
    """Share of the time in situations that is 194, moves randomly."""
    lasts = (done["end_ns"] - done["start_ns"]).to_numpy()
    return float(lasts[(done["code"] == MOVES_RANDOMLY).to_numpy()].sum() / lasts.sum())


def heading(summary: MatchStatistics) -> tuple[str, ...]:
    """Teams, score and duration, for people, line by line."""
    home, away = summary.home, summary.away
    duration = f"{time_elapsed(round(summary.duration_s * 1e9))} min"
    if home.score is None or away.score is None:
        played = f"{home.name} (home) – {away.name} (away), score unknown, {duration}"
    else:
        played = f"{home.name} (home) {home.score} : {away.score} {away.name} (away), {duration}"
    note = None if summary.note is None else f"{summary.note}."
    return tuple(line for line in (played, note, found_words(summary.sure)) if line)


def found_words(sure: float | None) -> str:
    """How sure goals are that were found from the ball, in a sentence; empty without one."""
    return "" if sure is None else (
        f"Goals were found from the ball: each is at least {percent(sure)} sure, or says how sure it is.")


def summary_lines(summary: MatchStatistics) -> Iterator[str]:
    """The summary for people, line by line."""
    sides = {"home": summary.home, "away": summary.away}
    rows = [("", *(f"{team} ({side.name})" for team, side in sides.items()))]
    rows.append(("goals", *(_goals(side) for side in sides.values())))
    rows.append(("made by", *(_scorers(side) for side in sides.values())))
    rows.append(("shots", *(f"{side.shots}, {side.on_target} on target" for side in sides.values())))
    rows.append(("saves", *(str(side.saves) for side in sides.values())))
    rows.append(("possession", *(percent(side.possession) for side in sides.values())))
    first, second = (max(len(row[i]) for row in rows) for i in (0, 1))
    yield from (f"{label:<{first}}  {home:<{second}}  {away}".rstrip() for label, home, away in rows)
    yield ""
    yield "Most frequent situations, beside moves randomly"
    for team, side in sides.items():
        for role, most in side.situations.items():
            done = ", ".join(f"{name.removeprefix('Robot ')} {count}" for name, count in most)
            yield f"  {team} {role}: {done} ({percent(side.random[role])} of its time moves randomly)"


def _goals(side: SideStatistics) -> str:
    if side.goals is None:
        return "unknown"
    kinds = ", ".join(f"{count} {kind}" for kind, count in side.goals.items() if count)
    total = sum(side.goals.values())
    found = " (found from the ball)" if side.found else ""
    return f"{total}: {kinds}{found}" if total else "0"


def _scorers(side: SideStatistics) -> str:
    return ", ".join(f"{robot} ({count})" for robot, count in side.scorers.items()) or "–"
