"""A team's goalkeeper in numbers: its saves beside those of others, and goals after it lost the ball."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.numbers.statistics import wilson
from pitchlore.pipeline.views.commentary.words import enumerated, percent, with_minus
from pitchlore.pipeline.views.scout.content.answers import line_samples
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch, TeamName, over_sides
from pitchlore.pipeline.views.scout.gallery import Clip
from pitchlore.pipeline.views.scout.restarts import Share
from pitchlore.pipeline.views.scout.scored import ERROR, GoalGroup
from pitchlore.pipeline.views.scout.zones import time_in
from pitchlore.schemas import SIDES

#: Clips of saves, and of goals after the goalkeeper lost the ball.
CLIPS = 3
_ROLE = "goalkeeper"


class Faced(NamedTuple):
    """Shots on target at a team's goal, by their outcome.

    Attributes:
        n: all of them.
        blocked: other robots of the team touched next.
        kept: another robot of the attackers touched next.
        missed: nobody touched.
        saved: the goalkeeper touched next.
        conceded: goals.
    """

    n: int
    blocked: int
    kept: int
    missed: int
    saved: int
    conceded: int

    @property
    def reached(self) -> int:
        """Shots that reached the goalkeeper: saved ones and goals, as football counts."""
        return self.saved + self.conceded


def faced_of(shots: pl.DataFrame) -> Faced:
    """Shots on target, counted.

    Args:
        shots: rows of schema Shots, all at one team's goal.
    """
    came = pl.col("outcome")
    return Faced(*(shots.filter(it).height for it in (
        came != "wide", *(came == each for each in ("blocked", "own", "missed", "saved", "goal")))))


def others(
    team: TeamName, league: Sequence[LeagueMatch], lines: Mapping[str, Mapping[str, Any]]
) -> tuple[int, int]:
    """Shots that the other goalkeepers of a team's league saved, and those that reached them.

    Args:
        team: the team.
        league: the matches; those of other leagues are left out.
        lines: the league's, by match.
    """
    faced = [Faced(*lines[match.name]["faced"][side]) for match in league if match.home.kind == team.kind
             for side, own in zip(SIDES, (match.home, match.away), strict=True) if own != team]
    return sum(it.saved for it in faced), sum(it.reached for it in faced)


def keeper(
    played: Sequence[tuple[LeagueMatch, str]], lines: Mapping[str, dict[str, Any]], beside: tuple[int, int],
    conceded: Mapping[str, Any],
) -> dict[str, Any]:
    """Content of the section about a team's goalkeeper.

    Args:
        played: the team's sides in matches.
        lines: the league's, by match.
        beside: shots that the league's other goalkeepers saved, and those that reached them.
        conceded: how goals against the team came about.
    """
    shots = over_sides(played, LeagueMatch.shots, own=False)
    faced = faced_of(shots)
    own, other = _share(faced.saved, faced.reached), _share(*beside)
    robots = time_in(_ROLE, (line_samples(match, side, lines) for match, side in played))[:2]
    gave = [row for row in conceded["lost"] if row.role.startswith(_ROLE)]
    saved = shots.filter(pl.col("outcome") == "saved")
    clips = [Clip.about(row, row["t_ns"], row["t_ns"], "saved", before_s=2.0, after_s=1.5) for row in _spread(
        saved).iter_rows(named=True)]
    return {
        "robots": enumerated([
            f"robot {robot} for {percent(share)} of its time" for robot, share in robots]),
        "faced": faced, "sums": sums(faced, conceded["kinds"]),
        "own": own, "other": other, "verdict": verdict(own, other),
        "gave": gave, "clips": clips + [clip._replace(says="goal after it lost the ball")
                                        for row in gave for clip in row.clips][:CLIPS]}


def sums(faced: Faced, kinds: Sequence[GoalGroup]) -> str:
    """Outcomes of the shots on target at a team's goal, and where all goals against it came from.

    Args:
        faced: the shots.
        kinds: the goals against the team, a line a kind.
    """
    n, blocked, kept, missed, saved, conceded = faced
    ways = ((saved, f"it saved {saved}"), (blocked, f"other robots of its team blocked {blocked}"),
            (kept, f"the attackers kept {kept}"), (missed, f"{missed} reached nobody"),
            (conceded, f"{conceded} went in"))
    told = enumerated([it for count, it in ways if count]) if n else ""
    says = f"Of {number_of(n, 'shot')} on target at its goal {told}." if n else ""
    goals, shots = (sum(getattr(kind, name) for kind in kinds) for name in ("n", "shots"))
    if conceded > shots:
        says += f" {conceded - shots} of those that went in are counted for no team."
    if goals == shots:
        return f"{says} No other goal against its team is known."
    errors = sum(kind.n - kind.shots for kind in kinds if kind.says == ERROR)
    pushed = goals - shots - errors
    other = [f"{errors} by errors of its own team"] if errors else []
    other += [f"{pushed} pushed over the line, or by a shot that was not seen"] if pushed else []
    return (f"{says} Of {number_of(goals, 'goal')} against its team {shots} came from a shot that was seen,"
            f" and {goals - shots} did not: {enumerated(other)}.")


def verdict(own: Share | None, other: Share | None) -> str:
    """A goalkeeper's share of saves beside that of others, in a sentence.

    The interval of the difference of two shares is Newcombe's (*Statistics in Medicine* 17 (1998) 873-890,
    method 10): of shots that are independent of one another.
    """
    if own is None or other is None:
        return "Too few shots reached a goalkeeper to compare it with the others."
    (low, high), (from_, to) = (wilson(it.hits, it.n) for it in (own, other))
    value = own.share - other.share
    least = value - math.hypot(own.share - low, to - other.share)
    most = value + math.hypot(high - own.share, other.share - from_)
    points = with_minus(f"{100 * value:+.0f} percentage points [{100 * least:+.0f}, {100 * most:+.0f}]")
    if least <= 0 <= most:
        return f"The difference, {points}, is not larger than chance gives."
    return f"It saves {'more' if value > 0 else 'less'} than the others: {points}."


def _share(hits: int, n: int) -> Share | None:
    return Share(hits, n, *wilson(hits, n)) if n else None


def _spread(rows: pl.DataFrame) -> pl.DataFrame:
    """Rows for clips, far apart in the table: moments next to each other look alike."""
    return rows.gather_every(max(1, rows.height // CLIPS)).head(CLIPS)
