"""Matches, their referee events, and their flaws."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import BODIES, SIDES, STAND_IN, Table, match_id, unit

EVENTS = ("kick-off", "goal", "fault", "stop", "play", "half", "end")
FLAWS = (
    "duplicate frame", "reordered frame", "clock jump back", "clock leap ahead", "gap", "ball jump",
    "robot jump", "damaged chunk", "damaged record", "truncated", "ball lost", "not a number",
    "direction inferred", "direction unknown", "skipped", "slow sampling",
    "off the pitch", "scorer unknown", "goals inferred", "goals unknown", "unit of angle", "text encoding", "unmatched map",
    "half a pitch", "poor recognition", "assumed", "home inferred", "several matches", "colours switched",
    "score corrected", "implausible",
)


class Matches(Table):
    """One recorded match."""

    NAME: ClassVar[str] = "matches"
    VERSION: ClassVar[int] = 2
    SINCE: ClassVar[int] = 1

    match_id = match_id()
    source = dy.String(description="name of the file the match was recorded in or imported from")
    home = dy.String(description=f"name of the home team; in a match played here, its kind. {STAND_IN}")
    away = dy.String(description="name of the away team; in a match played here, its kind")
    started_at = dy.Datetime(
        nullable=True, time_unit="us", time_zone="UTC",
        description="wall-clock time of the first sample; else the date in the name of its file; else null",
    )
    duration_s = dy.Float64(min=0, description="first to last sample", metadata=unit("s"))
    hz = dy.Float64(nullable=True, min=0, description="1 / median sampling interval", metadata=unit("1/s"))
    robots_per_team = dy.Int16(min=0, description="most robots a team had on the pitch at once")
    score_home = dy.Int16(nullable=True, min=0, description="final goals of home, null where unknown")
    score_away = dy.Int16(nullable=True, min=0, description="final goals of away, null where unknown")
    shoot_out_home = dy.Int16(nullable=True, min=0, description="goals of home in a shoot-out, which its score does not count; null without one")
    shoot_out_away = dy.Int16(nullable=True, min=0, description="goals of away in a shoot-out; null without one")
    complete = dy.Bool(description="whether the log has everything that the recorder wrote")
    incomplete_reason = dy.String(nullable=True, description="why the log is not complete")
    kind = dy.String(description="league: vsss, ssl, 2d or human")
    pitch_length = dy.Float64(min=0, description="goal line to goal line", metadata=unit("m"))
    pitch_width = dy.Float64(min=0, description="side line to side line", metadata=unit("m"))
    goal_width = dy.Float64(min=0, description="post to post", metadata=unit("m"))
    frames = dy.Int64(min=0, description="number of samples")
    format = dy.String(description="format of the source, as its importer names it; world if it was played here")
    direction_inferred = dy.Bool(description="whether a team's direction of attack had to be inferred")


class Sides(Table):
    """One side of a match: the team that plays it, and the team whose knowledge it makes.

    Sorted by match_id, side.
    """

    NAME: ClassVar[str] = "sides"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    side = dy.Enum(SIDES, description="home or away, as the column team of other tables names it")
    team = dy.String(description="the team's name")
    kind = dy.String(description="league: vsss, ssl, 2d or human")
    counts_as = dy.String(nullable=True, description=(
        "team or pool of teams that the side counts for in behaviours and knowledge; null if it does not count"
    ))
    goals = dy.Int16(nullable=True, min=0, description="final goals of the side, null where unknown")
    against = dy.Int16(nullable=True, min=0, description="final goals of the other side, null where unknown")


class Referee(Table):
    """One event of a match's referee."""

    NAME: ClassVar[str] = "referee"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    t_ns = dy.Int64(description="time since the first sample", metadata=unit("ns"))
    event = dy.Enum(EVENTS, description=(
        "kick-off, fault: play restarts here; goal, half, end, stop: play stops here; "
        "play: play goes on"
    ))
    team = dy.Enum(SIDES, nullable=True, description="who scored, or who restarts; null where unknown")
    score_home = dy.Int16(nullable=True, min=0, description="goals of home after the event, null where unknown")
    score_away = dy.Int16(nullable=True, min=0, description="goals of away after the event, null where unknown")
    note = dy.String(nullable=True, description="the source's own word for the event")


class Quality(Table):
    """One flaw of a recording: flagged, never silently repaired."""

    NAME: ClassVar[str] = "quality"
    VERSION: ClassVar[int] = 6
    SINCE: ClassVar[int] = 1

    match_id = match_id()
    flaw = dy.Enum(FLAWS, description="kind of flaw")
    start_ns = dy.Int64(nullable=True, description="begin of the flaw, null where it has no time", metadata=unit("ns"))
    end_ns = dy.Int64(nullable=True, description="end of the flaw (exclusive), null where it has none", metadata=unit("ns"))
    team = dy.Enum(BODIES, nullable=True, description="team of the body that it concerns, null for all bodies")
    robot = dy.Int16(nullable=True, description="number of the robot that it concerns, null for all or the ball")
    count = dy.Int64(min=1, description="number of samples, messages or lines that it concerns")
    note = dy.String(nullable=True, description="detail, and the action taken")
