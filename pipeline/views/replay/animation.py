"""The replay as a film: some seconds of a match as one animated GIF, for places that cannot open a page."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import polars as pl

from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.drawing import painting
from pitchlore.pipeline.drawing.painting import ListPainter, Robot, Snapshot, clock, gif, png
from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.game.pitch import Pitch

#: GIF counts in hundredths of a second: 12.5 pictures a second.
STEP_MS = 80
WIDTH = 400
#: Longest film, seconds; for whole matches there is the page.
LONGEST_S = 120.0

#: Ages up to which a body, the ball's trail and a goal are shown, ns.
_STALE_NS, _TRAIL_NS, _GOAL_NS = 500_000_000, 700_000_000, 1_600_000_000
#: Most robots a side whose situations are listed.
_LISTED = 5
_NS = 1_000_000_000


def animation(match: MatchTables, *, start_s: float, seconds: float) -> bytes:
    """Some seconds of a match as GIF; the same tables give the same bytes.

    Each picture shows the last sample before it. Equal pictures become one that stays longer.

    Args:
        match: its samples, situations and referee's events are shown.
        start_s: where the film begins, seconds since the first sample; at least 0.
        seconds: how long it is at most, above 0 and at most :data:`LONGEST_S`; it ends with the match.

    Raises:
        BadSettings: if start or length are out of their bounds.
        NotFound: if nothing is recorded in that time.
    """
    if not (0 < seconds <= LONGEST_S and 0 <= start_s < _NS):
        raise BadSettings(f"cannot show {seconds:g} s from {start_s:g} s on", where="replay", next_step=(
            f"Begin at 0 or later and show up to {LONGEST_S:g} s"))
    lasts = seconds_shown(match, start_s, seconds)
    shown = list(_shown(match, start_s, lasts))
    if not any(moment.robots or moment.trail for moment in shown):
        name, length = match.matches.select("match_id", "duration_s").row(0)
        raise NotFound(f"has nothing to show from {start_s:g} s on", where=str(name),
                       next_step=f"It is {length:.1f} s long; begin earlier")
    return gif(list(_pictures(shown, match.pitch, match.matches.select("home", "away").row(0))), STEP_MS)


def still(match: MatchTables, at_s: float) -> bytes:
    """One picture of a match as PNG; the same tables give the same bytes.

    Args:
        match: its samples, situations and referee's events are shown.
        at_s: time of the picture, seconds since the first sample; it shows the last sample before it.
    """
    (shown,) = _shown(match, at_s, STEP_MS / 1000)
    (picture,) = _pictures([shown], match.pitch, match.matches.select("home", "away").row(0))
    return png(picture)


def seconds_shown(match: MatchTables, start_s: float, seconds: float) -> float:
    """Duration of a film that ends with the match, s; not above 0 after its end."""
    return min(seconds, float(match.matches["duration_s"].item()) - start_s)


def _shown(match: MatchTables, start_s: float, seconds: float) -> Iterator[Snapshot]:
    """The pictures' contents, one every :data:`STEP_MS`."""
    start, stop = round(start_s * _NS), round((start_s + seconds) * _NS)
    t_ns, sample, segment = pl.col("t_ns"), pl.col("sample"), pl.col("segment")
    bodies = (
        match.trajectories.filter(t_ns.is_between(start - _TRAIL_NS, stop)).sort("t_ns", "team", "robot")
        .with_columns(pl.col("theta").fill_nan(None), sample=t_ns.rle_id())
    )
    # the trail does not lead over a restart, a jump or a sample without the ball
    cut = pl.col("suspect").shift() | segment.ne_missing(segment.shift()) | (sample.diff() > 1)
    balls = bodies.filter(team="ball").with_columns(stretch=cut.fill_null(value=True).cum_sum())
    situations, events = match.situations, match.referee.sort("t_ns", maintain_order=True)
    unknown = match.matches.select("score_home", "score_away").row(0) == (None, None)
    first = (None, None) if unknown else (0, 0)
    for now in range(start, stop, STEP_MS * 1_000_000):
        last = max(bodies.filter(t_ns.is_between(now - _STALE_NS, now))["sample"], default=-1)
        stretch = max(balls.filter(sample == last)["stretch"], default=-1)
        trail = balls.filter(t_ns.is_between(now - _TRAIL_NS, now), pl.col("stretch") == stretch)
        seen = bodies.filter(sample == last).drop_nulls("robot").select("team", "robot", "x", "y", "theta")
        done = situations.filter(pl.col("start_ns") <= now, pl.col("end_ns") > now)
        doing = dict(zip(done.select("team", "robot").iter_rows(), done["name"], strict=True))
        past = events.filter(t_ns <= now)
        scores = past.select("score_home", "score_away").filter(~pl.all_horizontal(pl.all().is_null()))
        goals = past.filter(pl.col("event") == "goal", t_ns > now - _GOAL_NS)["team"].to_list()
        yield Snapshot(
            "goal!" if goals else clock(now / _NS), [first, *scores.iter_rows()][-1],
            trail.select("x", "y").rows(),
            [Robot(team, robot, (x, y), theta, doing.get((team, robot), "").removeprefix("Robot "))
             for team, robot, x, y, theta in seen.iter_rows()],
            scorer=(goals[-1] or "") if goals else None,
        )


def _pictures(moments: Sequence[Snapshot], pitch: Pitch, names: tuple[str, str]) -> Iterator[painting.Canvas]:
    """The moments, and under the pitch the situation of each robot."""
    lines = max(len({robot.number for m in moments for robot in m.robots if robot.team == team})
                for team in ("home", "away"))
    lines = lines if lines <= _LISTED else 0
    grass = pitch.width * (WIDTH - 2 * painting.MARGIN) / (pitch.length + 2 * pitch.goal_depth)
    top = painting.HEAD + grass
    size = (WIDTH, math.ceil(top + lines * painting.LINE + 2 * painting.FOOT))
    painter = ListPainter(pitch, names, size, size[1] - top)
    return map(painter.paint, moments)
