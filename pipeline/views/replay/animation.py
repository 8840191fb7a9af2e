"""The replay as a film: some seconds of a match as one animated GIF, for places that cannot open a page.

A GIF moves wherever a picture is shown. With flat colours of one palette it is smaller than the other
formats that browsers and GitHub animate. 20 s of a VSSS match take 0.87 MB; as WebP 0.90 (quality 70)
or 0.93 (lossless), as APNG 2.8.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import polars as pl

from pipeline import painting
from pipeline.errors import BadSettings, NotFound
from pipeline.painting import Markings, Painter, Point, Robot, Snapshot, clock, gif
from pipeline.pitch import Kind, Pitch

#: GIF counts in hundredths of a second: 12.5 pictures a second.
STEP_MS = 80
WIDTH = 400
#: Longest film, seconds; for whole matches there is the page.
LONGEST_S = 120.0

#: Ages up to which a body, the ball's trail and a goal are shown, seconds.
_STALE_S, _TRAIL_S, _GOAL_S = 0.5, 0.7, 1.6
#: Most robots a side whose situations are listed.
_LISTED = 5
#: Pixels: a line of the list, and the space above and below the list.
_LINE, _FOOT = 16, 6
_NS = 1_000_000_000

#: As on the replay's page (``draw.js``).
MARKINGS = {
    Kind.VSSS: Markings(0.2, ((0.15, 0.7),), 0.07, ((0.375, 0.0), (0.375, 0.4), (0.375, -0.4))),
    Kind.SSL: Markings(0.5, ((1.8, 3.6),), 0.0, ()),
    Kind.SIM2D: Markings(9.15, ((16.5, 40.32), (5.5, 18.32)), 0.0, ((41.5, 0.0),)),
}


def animation(
    match: pl.DataFrame, trajectories: pl.DataFrame, situations: pl.DataFrame, referee: pl.DataFrame,
    pitch: Pitch, *, start_s: float, seconds: float,
) -> bytes:
    """Some seconds of a match as GIF; the same tables give the same bytes.

    Each picture shows the last sample before it. Equal pictures become one that stays longer.

    Args:
        match: schema Matches, one row.
        trajectories: schema Trajectories, of that match.
        situations: schema Situations, of that match.
        referee: schema Referee, of that match.
        pitch: the field of play.
        start_s: where the film begins, seconds since the first sample; at least 0.
        seconds: how long it is at most, above 0 and at most :data:`LONGEST_S`; it ends with the match.

    Raises:
        BadSettings: if start or length are out of their bounds.
        NotFound: if nothing is recorded in that time.
    """
    if not (0 < seconds <= LONGEST_S and 0 <= start_s < math.inf):
        raise BadSettings(f"cannot show {seconds:g} s from {start_s:g} s on", where="replay", next_step=(
            f"Begin at 0 or later and show up to {LONGEST_S:g} s"))
    lasts = seconds_shown(match, start_s, seconds)
    shown = _shown(match, trajectories, situations, referee, start_s, lasts) if lasts > 0 else []
    if trajectories.is_empty() or not any(moment.robots or moment.trail for moment in shown):
        name, length = match.select("match_id", "duration_s").row(0)
        raise NotFound(f"has nothing to show from {start_s:g} s on", where=str(name),
                       next_step=f"It is {length:.1f} s long; begin earlier")
    return gif(list(_pictures(shown, pitch, match.select("home", "away").row(0))), STEP_MS)


def seconds_shown(match: pl.DataFrame, start_s: float, seconds: float) -> float:
    """Duration of a film that ends with the match (schema Matches, one row), s; not above 0 after its end."""
    return min(seconds, float(match["duration_s"].item()) - start_s)


class _Body(NamedTuple):
    """A row of schema Trajectories."""

    t_ns: int
    team: str
    robot: int | None
    x: float
    y: float
    theta: float | None
    segment: int | None
    suspect: bool


def _shown(
    match: pl.DataFrame, trajectories: pl.DataFrame, situations: pl.DataFrame, referee: pl.DataFrame,
    start_s: float, seconds: float,
) -> list[Snapshot]:
    """The pictures' contents, one every :data:`STEP_MS`."""
    start, stop = round(start_s * _NS), round((start_s + seconds) * _NS)
    earliest = start - round(max(_TRAIL_S, _STALE_S) * _NS)
    bodies = trajectories.filter(pl.col("t_ns").is_between(earliest, stop)).sort(
        "t_ns", "team", "robot").with_columns(pl.col("team").cast(pl.String), pl.col("theta").fill_nan(None))
    samples = [
        [_Body(*row) for row in part.select(_Body._fields).iter_rows()]
        for part in bodies.partition_by("t_ns", maintain_order=True)
    ]
    unknown = match["score_home"][0] is None and match["score_away"][0] is None
    doings = list(situations.filter((pl.col("start_ns") < stop) & (pl.col("end_ns") > start)).select(
        pl.col("team").cast(pl.String), "robot", "start_ns", "end_ns", "name").iter_rows())
    events = list(referee.filter(pl.col("t_ns") <= stop).sort("t_ns", maintain_order=True).select(
        "t_ns", "event", "team", "score_home", "score_away").iter_rows())
    times = range(start, stop, STEP_MS * 1_000_000)
    return list(_moments(samples, doings, events, times, (None, None) if unknown else (0, 0)))


def _moments(
    samples: Sequence[Sequence[_Body]], doings: Sequence[tuple[str, int, int, int, str]],
    events: Sequence[tuple[int, str, str | None, int | None, int | None]], times: range,
    first_score: tuple[int | None, int | None],
) -> Iterator[Snapshot]:
    last = -1
    for now in times:
        while last + 1 < len(samples) and samples[last + 1][0].t_ns <= now:
            last += 1
        seen = samples[last] if last >= 0 and now - samples[last][0].t_ns <= _STALE_S * _NS else []
        doing = {(team, robot): name.removeprefix("Robot ") for team, robot, start, end, name in doings
                 if start <= now < end}
        past = [event for event in events if event[0] <= now]
        scores = [(home, away) for _, _, _, home, away in past if home is not None or away is not None]
        goals = [team or "" for t_ns, event, team, _, _ in past
                 if event == "goal" and now - t_ns < _GOAL_S * _NS]
        yield Snapshot(
            clock="goal!" if goals else clock(now / _NS), score=scores[-1] if scores else first_score,
            trail=_trail(samples[:last + 1], now) if seen else [],
            robots=[Robot(body.team, body.robot, (body.x, body.y), body.theta,
                          doing.get((body.team, body.robot), ""))
                    for body in seen if body.robot is not None],
            scorer=goals[-1] if goals else None,
        )  # fmt: skip


def _trail(samples: Sequence[Sequence[_Body]], now: int) -> list[Point]:
    """The ball's recent places in the present stretch of play, the present one last, m."""
    found: list[Point] = []
    segment = None
    for sample in reversed(samples):
        ball = next((body for body in sample if body.team == "ball"), None)
        if ball is None or now - ball.t_ns > _TRAIL_S * _NS:
            break
        if found and (ball.suspect or ball.segment != segment):
            break
        found.append((ball.x, ball.y))
        segment = ball.segment
    return found[::-1]


def _pictures(moments: Sequence[Snapshot], pitch: Pitch, names: tuple[str, str]) -> Iterator[painting.Canvas]:
    """The moments, and under the pitch the situation of each robot."""
    lines = max(len({robot.number for m in moments for robot in m.robots if robot.team == team})
                for team in ("home", "away"))
    lines = lines if lines <= _LISTED else 0
    grass = pitch.width * (WIDTH - 2 * painting.MARGIN) / (pitch.length + 2 * pitch.goal_depth)
    top = painting.HEAD + grass + _FOOT
    size = (WIDTH, math.ceil(top + lines * _LINE + _FOOT))
    painter = Painter(pitch, MARKINGS[pitch.kind], names, size, size[1] - painting.HEAD - grass,
                      square=pitch.kind is Kind.VSSS)
    for moment in moments:
        picture = painter.paint(moment)
        with painting.part(picture, (0, top), size) as brush:
            for team, left in (("home", painting.MARGIN), ("away", (WIDTH + painting.MARGIN) / 2)):
                mine = [robot for robot in moment.robots if robot.team == team]
                for line, robot in enumerate(mine[:lines]):
                    _list(brush, robot, left, top + (line + 0.5) * _LINE)
        yield picture


def _list(brush: painting.Brush, robot: Robot, left: float, middle: float) -> None:
    """Number and situation of a robot."""
    brush.box((left, middle - 6), (left + 14, middle + 6), painting.TEAMS[robot.team], radius=3)
    brush.write(str(robot.number), (left + 7, middle), 9, painting.WHITE)
    room = WIDTH / 2 - painting.MARGIN - 22
    brush.write(robot.doing, (left + 19, middle), 10.5, painting.INK, "lm", room)
