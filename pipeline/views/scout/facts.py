"""Facts of the pages about matches and teams, from match."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.numbers.statistics import mean_interval, welch
from pitchlore.schemas import SIDES

#: Parts of a match in the pictures over time.
PARTS = 40
#: Fields of :class:`Numbers` that are shares; the others are counts.
SHARES = ("possession", "territory")
#: Matches from which on halves of them are compared: four against four can differ beyond chance.
TREND_AT = 8
#: Matches from which a mean has an interval, and is compared with that of as many others. Six matches can be
#: dealt out as three and three in 20 ways, so that no exact test goes below 2 / 20; four and four: 2 / 70.
LEAST_MATCHES = 4


class Numbers(NamedTuple):
    """A side of a match in numbers.

    Attributes:
        possession: share of the time in which a team has the ball; None if none has it at all.
        territory: share of the ball's time in play in the adversary's half; None if it is never seen.
        passes: number of passes that arrived.
        through: number of through passes among these.
        shots: on target.
        wide: shots past the post.
        goals: goals then, by the table goals; over a whole match the final score, or where that is unknown
            the goals that are known (:func:`is_counted`); None where there are none.
        lost: possessions that the adversary ended.
        pressed: how often its robots pressed.
        won: how often that won the ball.
        scored: shots that became goals; None where nobody knows of goals: no score, and none was found.
        xg: expected goals of its shots; None where they are not known.
    """

    possession: float | None
    territory: float | None
    passes: int
    through: int
    shots: int
    wide: int
    goals: int | None
    lost: int
    pressed: int
    won: int
    scored: int | None = 0
    xg: float | None = None


def is_counted(match: MatchTables) -> bool:
    """True if nobody tells the score, so that the goals count whose team is known for all."""
    told = match.matches.select(f"score_{side}" for side in SIDES).row(0)
    return None in told and not match.goals.is_empty() and not match.goals["team"].null_count()


def numbers(match: MatchTables, start_ns: int = 0, end_ns: int = 1 << 62) -> dict[str, Numbers]:
    """Each side in numbers, of what begins in an interval of a match, end exclusive."""

    def within(table: pl.DataFrame, column: str) -> pl.DataFrame:
        return table.filter(pl.col(column).is_between(start_ns, end_ns, closed="left"))

    held = within(match.possession, "start_ns").with_columns(
        lasts=pl.min_horizontal("end_ns", pl.lit(end_ns)) - pl.col("start_ns"))
    ball = within(match.trajectories, "t_ns").filter(
        pl.col("team") == "ball", pl.col("segment").is_not_null())
    total = int(held["lasts"].sum())
    passes, shots, pressed, chances = (within(table, column) for table, column in (
        (match.passes, "t_ns"), (match.shots, "t_ns"), (match.pressure, "start_ns"),
        (match.chances, "t_ns")))
    known = not match.chances["xg"].null_count()
    row = match.matches.row(0, named=True)
    unknown = match.goals.is_empty() and any(row[f"score_{side}"] is None for side in SIDES)
    whole, counted = start_ns <= 0 and end_ns > row["duration_s"] * 1e9, is_counted(match)
    told = {side: row[f"score_{side}"] for side in SIDES}
    scored = within(match.goals, "t_ns")["team"].drop_nulls().cast(pl.String).to_list()
    ahead = float((ball["x"].to_numpy() > 0).mean()) if ball.height else 0.0
    found = dict[str, Numbers]()
    for side, territory in zip(SIDES, (ahead, 1 - ahead), strict=True):
        own = {name: table.filter(pl.col("team") == side) for name, table in (
            ("held", held), ("passes", passes), ("shots", shots), ("pressed", pressed),
            ("chances", chances))}
        wide = own["shots"].filter(pl.col("outcome") == "wide").height
        found[side] = Numbers(
            int(own["held"]["lasts"].sum()) / total if total else None,
            territory if ball.height else None,
            own["passes"].height, int(own["passes"]["through"].sum()),
            own["shots"].height - wide, wide,
            told[side] if not counted and (whole or told[side] is None) else scored.count(side),
            own["held"].filter(pl.col("ended") == "lost").height,
            own["pressed"].height, int(own["pressed"]["won"].sum()),
            None if unknown else own["shots"].filter(pl.col("outcome") == "goal").height,
            float(own["chances"]["xg"].sum()) if known else None)
    return found


def played_s(trajectories: pl.DataFrame) -> float:
    """Seconds of play: from the first to the last sample of each segment, without the stops between.

    Args:
        trajectories: rows of schema Trajectories of one match.
    """
    spans = trajectories.drop_nulls("segment").group_by("segment").agg(
        lasts=pl.col("t_ns").max() - pl.col("t_ns").min())
    return int(spans["lasts"].sum()) / 1e9


class MatchPart(NamedTuple):
    """A part of a match.

    Attributes:
        start_s: its start, seconds.
        possession: home's share of the time in which a team has the ball; None where nobody has it.
        territory: share of the ball's samples in play in away's half; None where there are none.
    """

    start_s: float
    possession: float | None
    territory: float | None


def parts(match: MatchTables) -> list[MatchPart]:
    """Possession and territory in each of :data:`PARTS` parts of a match of equal length."""
    end = max(int(match.matches["duration_s"][0] * 1e9), 1)
    edges = np.linspace(0, end, PARTS + 1)
    held = np.zeros((len(SIDES), PARTS))
    for team, start, stop in match.possession.select("team", "start_ns", "end_ns").iter_rows():
        overlap = np.minimum(stop, edges[1:]) - np.maximum(start, edges[:-1])
        held[SIDES.index(team)] += np.maximum(overlap, 0)
    ball = match.trajectories.filter(pl.col("team") == "ball", pl.col("segment").is_not_null())
    ahead = means_of_parts(match, ball["t_ns"], ball["x"] > 0, PARTS)
    rows = zip(edges[:-1], held[0], held.sum(axis=0), ahead, strict=True)
    return [MatchPart(float(start) / 1e9, float(home / both) if both else None, territory)
            for start, home, both, territory in rows]


def means_of_parts(
    match: MatchTables, t_ns: pl.Series, values: pl.Series, count: int
) -> list[float | None]:
    """The mean of values [n] at times [n], ns, in each of some equal parts of a match; None without any."""
    edges = np.linspace(0, max(int(match.matches["duration_s"][0] * 1e9), 1), count + 1)
    total, there = (np.histogram(t_ns.to_numpy(), edges, weights=weights)[0]
                    for weights in (values.to_numpy().astype(np.float64), np.ones(len(values))))
    return [float(each / n) if n else None for each, n in zip(total, there, strict=True)]


def halves(match: MatchTables) -> list[tuple[str, int, int]]:
    """The halves of a match: name, start and end, ns. Where the referee gave none, those of its time."""
    end = int(match.matches["duration_s"][0] * 1e9) + 1
    given = match.referee.filter(pl.col("event") == "half")["t_ns"].to_list()
    middle = next((int(at) for at in given if 0 < at < end), None)
    named = middle is not None
    middle = middle if middle is not None else end // 2
    return [("first half" if named else "first half of the time", 0, middle),
            ("second half" if named else "second half of the time", middle, end)]


def markers(trajectories: pl.DataFrame) -> pl.DataFrame:
    """Marking: for each robot, the adversary that it is nearest to most of the time in play.

    Returns:
        Columns team, robot, marks (its number), share (of the robot's samples), sorted by team and robot.
    """
    robots = trajectories.filter(pl.col("team") != "ball", pl.col("segment").is_not_null()).select(
        "frame", pl.col("team").cast(pl.String), "robot", "x", "y")
    robots = robots.filter(pl.col("frame") % 5 == 0)
    pairs = robots.join(robots, on="frame", suffix="_2").filter(pl.col("team") != pl.col("team_2"))
    near = pairs.with_columns(d=(pl.col("x") - pl.col("x_2")) ** 2 + (pl.col("y") - pl.col("y_2")) ** 2).sort(
        "d", "robot_2").group_by("frame", "team", "robot", maintain_order=True).agg(
            marks=pl.col("robot_2").first())
    counts = near.group_by("team", "robot", "marks").len()
    return (
        counts.with_columns(share=pl.col("len") / pl.col("len").sum().over("team", "robot"))
        .sort("share", "marks", descending=[True, False])
        .group_by("team", "robot", maintain_order=True).first()
        .select("team", "robot", "marks", "share").sort("team", "robot", descending=[True, False]))


#: What a team may be at a moment, by the score.
LEADS = ("leads", "level", "trails")


class ByLead(NamedTuple):
    """A side of a match while it leads, is level or trails.

    Attributes:
        seconds: so long.
        held_s: seconds in which it has the ball.
        owned_s: seconds in which either team has it.
        shots: on target.
        lost: possessions that the adversary ended.
    """

    seconds: float
    held_s: float
    owned_s: float
    shots: int
    lost: int


def by_lead(match: MatchTables) -> dict[str, dict[str, ByLead]]:
    """Each side while it leads, is level and trails. What begins before a goal counts as before it.

    The score is that of the table goals; a goal of nobody knows whom changes nothing. Where neither the final
    score nor goals are known, nobody knows who leads: no time counts.
    """
    if None in match.matches.select("score_home", "score_away").row(0) and not is_counted(match):
        return {side: dict.fromkeys(LEADS, ByLead(0.0, 0.0, 0.0, 0, 0)) for side in SIDES}
    goals = match.goals.drop_nulls("team").sort("t_ns").select("t_ns", lead=pl.when(
        pl.col("team") == SIDES[0]).then(1).otherwise(-1).cum_sum())
    score = pl.concat([pl.DataFrame({"t_ns": [-1], "lead": [0]}, schema=goals.schema), goals])

    def at(table: pl.DataFrame, column: str) -> pl.DataFrame:
        return table.sort(column).join_asof(
            score.rename({"t_ns": "since_ns"}), left_on=column, right_on="since_ns", strategy="backward")

    end = int(match.matches["duration_s"][0] * 1e9)
    spans = score.with_columns(t_ns=pl.col("t_ns").clip(lower_bound=0)).with_columns(
        lasts=pl.col("t_ns").shift(-1).fill_null(end) - pl.col("t_ns"))
    held = at(match.possession, "start_ns").with_columns(lasts=pl.col("end_ns") - pl.col("start_ns"))
    shots = at(match.shots.filter(pl.col("outcome") != "wide"), "t_ns")
    found: dict[str, dict[str, ByLead]] = {}
    for side, turn in zip(SIDES, (1, -1), strict=True):
        found[side] = {}
        for name, sign in zip(LEADS, (1, 0, -1), strict=True):
            then = (pl.col("lead") * turn).sign() == sign
            owned = held.filter(then)
            own = owned.filter(pl.col("team") == side)
            found[side][name] = ByLead(
                max(int(spans.filter(then)["lasts"].sum()), 0) / 1e9, int(own["lasts"].sum()) / 1e9,
                int(owned["lasts"].sum()) / 1e9, shots.filter(then, pl.col("team") == side).height,
                own.filter(pl.col("ended") == "lost").height)
    return found


class Mean(NamedTuple):
    """A mean over matches with its 95 % interval (Student's t).

    It has no ends below :data:`LEAST_MATCHES` matches. It ``varies`` too much to be shown with its interval
    if that leads from 0 to twice the mean. Its ``error`` is its standard error, for Welch's intervals.
    """

    mean: float
    low: float | None
    high: float | None
    n: int
    varies: bool = False
    error: float | None = None


def mean_number(values: Sequence[float]) -> Mean | None:
    """The mean of a number over matches; None without any."""
    if not values:
        return None
    if len(values) < LEAST_MATCHES:
        return Mean(float(np.mean(values)), None, None, len(values))
    low, high = mean_interval(values) or (None, None)
    return Mean(float(np.mean(values)), low, high, len(values),
                error=float(np.std(values, ddof=1)) / len(values) ** 0.5)


def over_matches(each: Sequence[tuple[Numbers, float]]) -> dict[str, Mean | None]:
    """A team over its matches: means of shares, and of counts in each ten minutes.

    No end of an interval is below 0, and that of a share is not above 1: no such number is. An interval that
    reaches from 0 to twice the mean says nothing of the mean, which is marked; a difference may use it.

    Args:
        each: the team's numbers in each match, and its minutes.
    """
    return {name: _within(mean_number([value for value in match_by_match(each, name) if value is not None]),
                          1.0 if name in SHARES else None) for name in Numbers._fields}


def match_by_match(each: Sequence[tuple[Numbers, float]], name: str) -> list[float | None]:
    """A number of a team in each match: a share, or a count in each ten minutes; None where it is unknown."""
    found = ((getattr(own, name), minutes) for own, minutes in each)
    return [value if value is None or name in SHARES else 10 * value / minutes for value, minutes in found]


class Trend(NamedTuple):
    """A number's way over matches, oldest first.

    Attributes:
        values: it in each match; None where it is unknown.
        before, since: its means in the older and the newer half of the matches; None below TREND_AT.
        beyond: whether the halves differ by more than chance gives (Welch, 95 %).
    """

    values: list[float | None]
    before: float | None
    since: float | None
    beyond: bool


def trend(values: Sequence[float | None]) -> Trend:
    """The trend of a number over matches, oldest first."""
    known = [value for value in values if value is not None]
    if len(known) < TREND_AT:
        return Trend(list(values), None, None, beyond=False)
    older, newer = known[:len(known) // 2], known[len(known) // 2:]
    differ = welch(newer, older)
    return Trend(list(values), float(np.mean(older)), float(np.mean(newer)),
                 beyond=differ is not None and not differ[0] <= 0.0 <= differ[1])


def _within(mean: Mean | None, most: float | None) -> Mean | None:
    """A mean whose interval ends at 0 and at the most that there can be."""
    if mean is None or mean.low is None or mean.high is None:
        return mean
    low, high = max(mean.low, 0.0), mean.high if most is None else min(mean.high, most)
    if low == 0.0 and high >= 2 * mean.mean > 0:
        return mean._replace(low=low, high=high, varies=True)
    return mean._replace(low=low, high=high)
