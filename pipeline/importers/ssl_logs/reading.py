"""Matches of SSL game logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Literal, NamedTuple

import numpy as np

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.game.pitch import Kind, Pitch
from pitchlore.pipeline.importers.directions import infer_periods, unsure
from pitchlore.pipeline.importers.rows import Event, referee
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.ssl_logs import commands, damage
from pitchlore.pipeline.importers.ssl_logs.bodies import (
    Chosen,
    choose_source,
    kicks_of,
    seen_by_cameras,
    seen_by_tracker,
)
from pitchlore.pipeline.importers.ssl_logs.clock import times
from pitchlore.pipeline.importers.ssl_logs.colours import Names, follow
from pitchlore.pipeline.importers.ssl_logs.container import MAGIC, ORDER, RECEIVED, WHOLE, Span
from pitchlore.pipeline.importers.ssl_logs.coverage import half_a_pitch
from pitchlore.pipeline.importers.ssl_logs.division import Stretch, divide
from pitchlore.pipeline.importers.ssl_logs.home import HomeColour
from pitchlore.pipeline.importers.ssl_logs.referee import RefereeReport
from pitchlore.pipeline.importers.ssl_logs.samples import Gathered
from pitchlore.pipeline.importers.ssl_logs.survey import Survey, survey
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, YELLOW
from pitchlore.pipeline.importers.tracking.ball_restarts import CENTRE
from pitchlore.pipeline.importers.tracking.guesses import guess_pitch
from pitchlore.pipeline.importers.tracking.mapping import PitchMap, TeamNames, TrackingMap
from pitchlore.pipeline.importers.tracking.scoring import Lack, scoring
from pitchlore.pipeline.importers.tracking.states import Course, referee_events
from pitchlore.pipeline.matches.frame import Frames, MatchInfo, MatchLog, Period, home_attacks
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.schemas import SIDES

#: Times before this are not of a clock that knows the date, Unix time in seconds: the year 2000.
_DATED_S = 946_684_800.0
#: What a log lacks that has bodies only.
_UNREFEREED = Lack(
    "no packets of a game controller", "record them, too: by default they come to 224.5.23.1:10003"
)
#: Columns of what is told that depend on where home attacks.
_TURNED = frozenset(("x", "y", "vx", "vy", "from_x", "from_y", "stop_x", "stop_y"))
_COLOURS = ("yellow", "blue")


def detects(head: bytes) -> bool:
    """True if the content begins like an SSL log."""
    return head.startswith(MAGIC)


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of an SSL game log; blue is home unless the map names the home team.

    Of the map, ``pitch``, ``teams`` and ``ssl`` are used. Bodies come from a tracker or from vision (see
    ``settings.SslMap``). The clock is that of the source. Without a referee, events are inferred as for a
    table.

    Raises:
        BadRecording: if its version is unknown, if it has no frames of bodies, or exceeds a limit.
    """
    part = _part(source)
    found, span = part.found, part.span
    chosen = choose_source(found, mapping.ssl, source)
    told_pitch = _told_pitch(found, mapping.pitch)
    teams = follow(found.reported)
    first, names = _teams(teams.names, mapping.teams, source)
    home = HomeColour(first, teams.switches)
    kicks = kicks_of(source, found, chosen, span)
    if chosen is None:
        samples, flaws = seen_by_cameras(source, found, mapping.ssl, told_pitch, home, span)
    else:
        samples, flaws = seen_by_tracker(source, mapping.ssl, chosen, home, span, kicks)
    if not len(samples.captured):
        raise BadRecording("has no frame that can be decoded", where=source.name, next_step="Copy it again")
    t_ns, jumps = times(samples.captured, samples.packets[:, RECEIVED])
    frames = replace(samples.frames, t_ns=t_ns)
    pitch = told_pitch or _guessed_pitch(frames, mapping.pitch)
    flaws += jumps
    if told_pitch is not None:
        flaws += half_a_pitch(frames, told_pitch)
    at = _Times(samples.packets[:, ORDER], t_ns, samples.captured)
    course = commands.command_events(teams.reported, home, lambda now: at.of(now.order), source)
    events = course.events
    periods, inferred = _periods(found.reported, home, at, events, frames, mapping.teams)
    flaws += [*inferred, *course.flaws, *_switches(home, names, at)]
    goals: dict[str, object] = {"from": "referee"}
    if not found.reported:
        events, more, goals = _inferred(frames, periods, unsure(periods, inferred), pitch, mapping, source)
        flaws += more
    damaged, reasons = damage.container_flaws(
        found, source, at.received(samples.packets[:, RECEIVED]), whole=part.of == 1,
        last=part.number == part.of)
    told = {"game_events": _turned([row for log in found.events for row in log.rows(home, at.of)], periods),
            "kicks": _turned(kicks.rows(home, at.clock), periods)}
    shot = {} if course.shoot_out is None else {"shoot_out": dict(zip(SIDES, course.shoot_out, strict=True))}
    info = MatchInfo(
        match_id=source.match_id, source=source.name, format="ssl-log", home=names[0], away=names[1],
        started_at=_started(samples), pitch=pitch, periods=periods,
        settings=_settings(found, chosen, mapping, told_pitch) | {"goals": goals} | part.settings() | shot
        | ({"told": told} if any(told.values()) else {}),
        software=RELEASE, complete=not reasons,
        incomplete_reason="; ".join(reasons) or None,
    )
    return MatchLog(
        info=info, frames=frames, referee=referee(source.match_id, events),
        quality=quality_table(source.match_id, [*damaged, *flaws, *part.flaws(int(t_ns.max()))]),
    )


class _Part(NamedTuple):
    """A match of a log: its number from 1, the number of matches, messages, survey, and what is beside it.

    Attributes:
        before, after: stretches just before and after it that are of no match.
    """

    number: int
    of: int
    span: Span
    found: Survey
    before: Stretch | None = None
    after: Stretch | None = None

    def settings(self) -> dict[str, object]:
        """Number as JSON values; nothing where there is one match."""
        return {} if self.of == 1 else {"match": {"number": self.number, "of": self.of}}

    def flaws(self, end_ns: int) -> list[Flaw]:
        """Flaws of what is beside it."""
        rows = []
        if self.of > 1:
            rows.append(Flaw("several matches", (
                f"the recording has {self.of} matches one after the other, this is number {self.number}: an "
                "import makes each a match of its own"), self.of))
        if self.before is not None:
            rows.append(Flaw("skipped", "messages before the match, of another one that is not in the log",
                             self.before.end - self.before.first))
        if self.after is not None:
            note = f"messages after the match: {self.after.why}, and nothing was played after that"
            rows.append(Flaw("skipped", note, self.after.end - self.after.first, end_ns, end_ns + 1))
        return rows


def _part(source: SourceFile) -> _Part:
    """The match of a log that is asked for.

    Raises:
        BadRecording: if it has fewer matches.
    """
    whole = survey(source)
    stretches = divide(whole.reported, whole.parts)
    if len(stretches) <= 1:
        return _only(_Part(1, 1, WHOLE, whole), source)
    surveys = [survey(source, Span(stretch.first, stretch.end)) for stretch in stretches]
    seen = [i for i, found in enumerate(surveys) if found.vision.frames or found.trackers]
    played = [i for i in seen if stretches[i].played] or sorted(
        seen, key=lambda i: stretches[i].end - stretches[i].first)[-1:]
    if not played:
        return _only(_Part(1, 1, WHOLE, whole), source)
    if source.number > len(played):
        return _only(_Part(1, len(played), WHOLE, whole), source)
    i = played[source.number - 1]
    before, after = (stretches[j] if 0 <= j < len(stretches) and j not in played else None
                     for j in (i - 1, i + 1))
    span = Span(stretches[i].first, stretches[i].end)
    return _Part(source.number, len(played), span, surveys[i], before, after)


def _only(part: _Part, source: SourceFile) -> _Part:
    """The part, if it is asked for.

    Raises:
        BadRecording: if another one is.
    """
    if source.number > part.of:
        raise BadRecording(f"has no match number {source.number}: it has {part.of}", where=source.name,
                           next_step="Import it again")
    return part


def _turned(rows: list[dict[str, object]], periods: Sequence[Period]) -> list[dict[str, object]]:
    """Rows of what is told, their places and speeds in the axes of trajectories: home attacks +x."""
    signs = home_attacks(tuple(periods), np.array([row["t_ns"] for row in rows], np.int64)).tolist()
    return [{name: sign * value if name in _TURNED and isinstance(value, float) else value
             for name, value in row.items()} for row, sign in zip(rows, signs, strict=True)]


def _switches(home: HomeColour, names: tuple[str, str], at: _Times) -> list[Flaw]:
    """A flaw for each change of the teams' colours."""
    rows = []
    for order in home.switches:
        t_ns, colour = at.of(order), home.now(order)
        note = (f"from {t_ns / 1e9:.1f} s on {names[0]} is {_COLOURS[colour]} and {names[1]} is "
                f"{_COLOURS[1 - colour]}: teams are followed by name")
        rows.append(Flaw("colours switched", note, start_ns=t_ns))
    return rows


class _Times:
    """Times of what is in the log besides samples: those of the next sample in the log, else of the last one.

    Args:
        order: int64 [F], number of the first packet of each sample.
        t_ns: int64 [F], time of each sample.
        captured: float64 [F], when it was captured, seconds of the source's clock.
    """

    def __init__(self, order: I64, t_ns: I64, captured: F64) -> None:
        self._order, self._t_ns, self._captured = order, t_ns, captured

    def of(self, order: int) -> int:
        """Time of a message by its number."""
        at = int(np.searchsorted(self._order, order))
        return int(self._t_ns[min(at, len(self._t_ns) - 1)])

    def clock(self, order: int, captured: float) -> int:
        """Time of a moment by the source's clock, seconds, which a message tells."""
        at = min(int(np.searchsorted(self._order, order)), len(self._t_ns) - 1)
        return int(self._t_ns[at]) + round((captured - float(self._captured[at])) * 1e9)

    def received(self, received: I64) -> damage.When:
        """Function from the time at which a packet was received to its time in the match."""
        def when(ns: int | None) -> int | None:
            if ns is None:
                return 0
            at = int(np.argmin(np.abs(received - ns)))
            return int(self._t_ns[at])
        return when


def _told_pitch(found: Survey, given: PitchMap) -> Pitch | None:
    """Pitch by the log's geometry and the map; None if neither gives its size."""
    if not found.sizes:
        if given.length is None or given.width is None:
            return None
        base, _ = guess_pitch(np.array([given.length / 2]), PitchMap(kind=Kind.SSL), corner=False)
        return _with(base, given)
    size = max(found.sizes, key=lambda size: (found.sizes[size], size))
    return _with(Pitch(kind=Kind.SSL, **size.metres()), given)


def _guessed_pitch(frames: Frames, given: PitchMap) -> Pitch:
    """Pitch by how far the bodies reach, and the map."""
    x = frames.robots["x"].astype(np.float64)
    pitch, _ = guess_pitch(x, PitchMap(), corner=False)
    if pitch.kind is not Kind.SSL:
        pitch, _ = guess_pitch(x, PitchMap(kind=Kind.SSL), corner=False)
    return _with(pitch, given)


def _with(pitch: Pitch, given: PitchMap) -> Pitch:
    """The pitch with what a map says of it."""
    return Pitch.model_validate({**pitch.model_dump(), **given.model_dump(exclude_none=True)})


def _teams(told: Names, given: TeamNames, source: SourceFile) -> tuple[int, tuple[str, str]]:
    """The colour with which home begins, and the names of home and away.

    Names are the last ones that the referee reported of the teams that begin as yellow and as blue, else the
    colours; a colour is added to a name that both have.

    Raises:
        BadRecording: if the map names a team that the log does not have.
    """
    names = [name or colour for name, colour in zip(told, _COLOURS, strict=True)]
    if names[YELLOW] == names[BLUE]:
        names = [f"{name} ({colour})" for name, colour in zip(names, _COLOURS, strict=True)]
    home = BLUE
    for wanted, others in ((given.home, 0), (given.away, 1)):
        if wanted is None:
            continue
        fits = [team for team in (YELLOW, BLUE) if wanted.lower() in (names[team].lower(), _COLOURS[team])]
        if not fits:
            raise BadRecording(
                f"has no team {wanted!r}; it has {names[YELLOW]} (yellow) and {names[BLUE]} (blue)",
                where=source.name, next_step="Mend the map's [teams] table",
            )
        home = fits[0] if others == 0 else 1 - fits[0]
    known = [given.names.get(colour, given.named(name)) for colour, name in zip(_COLOURS, names, strict=True)]
    return home, (known[home], known[1 - home])


def _inferred(
    frames: Frames, periods: tuple[Period, ...], unknown: list[tuple[int, int]], pitch: Pitch,
    mapping: TrackingMap, source: SourceFile,
) -> tuple[list[Event], list[Flaw], dict[str, object]]:
    """Events of a match without a referee, flaws, and what tells goals: the ball, as in a table."""
    order = np.argsort(frames.t_ns, kind="stable")
    course = Course(frames.t_ns[order], None, None, None, frames.ball["x"][order].astype(np.float64),
                    frames.ball["y"][order].astype(np.float64))
    reported = scoring(course, {}, periods, unknown, pitch, mapping.goals, _UNREFEREED)
    events, flaws = referee_events(
        course, {}, CENTRE * pitch.length, source, reported.found, by_ball=reported.origin == "ball"
    )
    return events, [*reported.flaws, *flaws], reported.settings()


def _periods(
    reported: list[RefereeReport], home: HomeColour, at: _Times, events: list[Event], frames: Frames,
    given: TeamNames
) -> tuple[tuple[Period, ...], list[Flaw]]:
    """Periods by what the referee says of the sides, else inferred from where the robots stand."""
    first: Literal[1, -1] | None = None
    if given.home_attacks is not None:
        first = 1 if given.home_attacks == "right" else -1
    sides = [(at.of(now.order), now.blue_on_positive == (home.now(now.order) == BLUE))
             for now in reported if now.blue_on_positive is not None]
    if first is not None or not sides:
        return infer_periods(frames, [event.t_ns for event in events if event.event == "half"], first)
    end = int(frames.t_ns.max()) + 1
    signs: dict[int, Literal[1, -1]] = {}
    for index, (t_ns, on_positive) in enumerate(sides):
        # a team attacks the half that is not its own
        signs[0 if index == 0 else t_ns] = -1 if on_positive else 1
    starts = [t for t in sorted(signs) if t == 0 or t < end]
    changes = [t for i, t in enumerate(starts) if i == 0 or signs[t] != signs[starts[i - 1]]]
    return tuple(
        Period(start_ns=start, end_ns=stop, home_attacks=signs[start], inferred=False)
        for start, stop in zip(changes, [*changes[1:], end], strict=True)
    ), []


def _started(samples: Gathered) -> datetime | None:
    """When the first sample was captured; None if the clock does not know the date."""
    first = float(samples.captured[0])
    return datetime.fromtimestamp(first, UTC) if _DATED_S <= first < 2 * 2.0**31 else None


def _settings(
    found: Survey, chosen: Chosen | None, mapping: TrackingMap, told_pitch: Pitch | None
) -> dict[str, object]:
    """Settings and sources that the match was read by, as JSON values."""
    return {
        "map": mapping.settings(),
        "version": found.damage.versions[0],
        "source": {"vision": f"{len(found.cameras)} cameras"} if chosen is None else chosen.settings(),
        "trackers": [{"tracker": uuid, "name": name, "frames": span.frames}
                     for (uuid, name), span in sorted(found.trackers.items())],
        "referee packets": found.referee_packets,
        "guessed": {} if told_pitch else {"pitch": "how far the bodies reach"},
    }
