"""Matches of topics that a map names."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from math import nan
from typing import Any

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import BadRecording, in_one_line
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.topics.bodies import BodyFinder, SeenBody, number_at, value_at
from pitchlore.pipeline.importers.topics.decoding import decoder_of, encodings
from pitchlore.pipeline.importers.topics.sampling import nearest_messages, sample_times, usual_step
from pitchlore.pipeline.importers.topics.settings import TopicMap
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.importers.tracking.match import match_of
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.holes import holes_in
from pitchlore.pipeline.matches.mcap_file import McapFile
from pitchlore.pipeline.matches.messages import log_times, sequence_numbers
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.matches.records import ADDRESS_BYTES, MESSAGE
from pitchlore.pipeline.numbers.arrays import F64, I64

#: Topics that a refusal names.
_SHOWN = 12
_UNITS_NS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
#: Log times from here on are Unix times, ns.
_EPOCH_NS = 1_000_000_000_000_000_000
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
#: A body whose messages are rarer by this factor stays where it was between them.
_RARER = 1.5
_STATES = ("game_state", "score_home", "score_away")


class _Topics:
    """The channels of a file, by id, and its messages."""

    def __init__(self, source: SourceFile) -> None:
        self.channels: dict[int, tuple[Any, Any]] = {}
        self.file = McapFile(source.content, source.name, self._declare)

    def _declare(self, channel: Any, schema: Any) -> None:
        if self.channels.setdefault(channel.id, (channel, schema))[1] is None:
            self.channels[channel.id] = channel, schema  # the summary may have had no definition

    def listed(self) -> str:
        """Topics, types and encodings, for messages."""
        names = sorted({encodings(*channel) for channel in self.channels.values()})
        more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
        return ", ".join(names[:_SHOWN]) + more


def unnamed(source: SourceFile) -> BadRecording | None:
    """The refusal of a recording of other programs' topics that no map names; None if it has none."""
    found = _Topics(source)
    if all(schema and schema.name.startswith("pitchlore/") for _, schema in found.channels.values()):
        return None  # a log of ours without frames
    return BadRecording(
        f"has no match of ours, but these topics: {found.listed()}", where=source.name,
        next_step="Say in a map which topic is what (docs/how-to/ros.md), as in topics = ["
        '{topic = "/ball", body = "ball"}, {topic = "/blue/poses", bodies = ["blue 1", "blue 2"]}]',
    )


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of the topics that a map names.

    Messages come in order of time, which is their log time unless the map says otherwise. A sample has of
    each body the message that is nearest in time (``sampling``). Damaged parts are left out and said.

    Raises:
        NotFound: if a decoder is needed that is not installed.
        BadRecording: if a topic is not there or cannot be decoded, or if no body is found.
    """
    found = _Topics(source)
    reading = _Reading(source, mapping, found)
    reading.take_all()
    table, flaws = reading.table()
    units = mapping.units.model_copy(update={"time": "s"})
    mapping = mapping.model_copy(update={"units": units})
    match = match_of(table, source, mapping, flaws=[*reading.flaws, *flaws])
    origin, lasting = reading.origin, int(match.frames.t_ns.max())
    spans = ([_since(at, origin, lasting) for at in (f.start_ns, f.end_ns)] for f in found.file.flaws)
    damage = [replace(flaw, start_ns=start, end_ns=end)
              for flaw, (start, end) in zip(found.file.flaws, spans, strict=True)]
    reasons = [reason for reason in (match.info.incomplete_reason, *found.file.reasons) if reason]
    fields = {entry.topic: finder.fields for entry, finder in reading.finders if finder.fields}
    unix = origin >= _EPOCH_NS
    info = match.info.model_copy(update={
        "format": "mcap", "complete": not reasons, "incomplete_reason": "; ".join(reasons) or None,
        "started_at": _EPOCH + timedelta(microseconds=origin // 1000) if unix else None,
        "settings": {**match.info.settings, "fields": fields},
    })
    quality = pl.concat([match.quality, quality_table(info.match_id, damage)])
    return replace(match, info=info, quality=quality)


def _since(t_ns: int | None, origin: int, lasting: int) -> int | None:
    """A log time since the first sample; None for one outside the match."""
    return t_ns - origin if t_ns is not None and 0 <= t_ns - origin <= lasting + 1 else None


class _Reading:
    """Messages of the named topics, on their way to a table.

    Attributes:
        finders: each entry of the map, and what finds its bodies.
        flaws: flaws of messages and bodies that are left out.
        origin: time of the first sample, ns.
    """

    def __init__(self, source: SourceFile, mapping: TrackingMap, found: _Topics) -> None:
        self._source, self._mapping, self._found = source, mapping, found
        ball = mapping.teams.ball
        for entry in mapping.topics:
            for body in (entry.body, *entry.bodies, *entry.frames.values()):
                if body is not None and body != ball and not all(body.rpartition(" ")):
                    raise BadRecording(
                        f"has a map whose {body!r} is neither a team and a player nor the ball {ball!r}",
                        where=source.name, next_step='Name bodies like "blue 1"')
        in_degrees = mapping.units.angle == "deg"
        self.finders = [(entry, BodyFinder(entry, ball, in_degrees=in_degrees)) for entry in mapping.topics]
        self.flaws: list[Flaw] = []
        self.origin = 0
        self._entries: dict[int, list[tuple[TopicMap, BodyFinder]]] = {}
        for entry, finder in self.finders:
            for channel in self._channels(entry):
                self._entries.setdefault(channel, []).append((entry, finder))
        self._decoders = {
            channel: decoder_of(*found.channels[channel], source.name) for channel in self._entries}
        self._rows: list[tuple[int, SeenBody]] = []
        self._states: list[tuple[int, list[Any]]] = []
        self._wrong: dict[str, list[str]] = {}

    def _channels(self, entry: TopicMap) -> list[int]:
        """The channels of a topic; it may have several."""
        ids = [i for i, (channel, _) in self._found.channels.items() if channel.topic == entry.topic]
        if not ids:
            raise BadRecording(
                f"has no topic {entry.topic}, which the map names; it has {self._found.listed() or 'none'}",
                where=self._source.name, next_step="Mend the map's [[topics]]")
        return ids

    def take_all(self) -> None:
        """Decode all messages of the named topics."""
        seen = 0
        numbers: dict[int, list[tuple[I64, I64]]] = {channel: [] for channel in self._entries}
        for content, records in self._found.file.contents():
            messages = records.keep(records.opcodes == MESSAGE)
            seen += len(messages.bodies)
            for channel, entries in self._entries.items():
                own = messages.keep(messages.channels == channel)
                times = log_times(content, own)
                numbers[channel].append((sequence_numbers(content, own), times))
                bounds = np.stack((own.bodies + ADDRESS_BYTES, own.bodies + own.lengths, times), axis=1)
                for start, end, t_ns in bounds.tolist():
                    self._message(channel, content[start:end].tobytes(), t_ns, entries)
        self._found.file.check(seen)
        self._note_left_out()
        self._note_holes(numbers)

    def _message(
        self, channel: int, payload: bytes, t_ns: int, entries: list[tuple[TopicMap, BodyFinder]]
    ) -> None:
        """Take the bodies, states and scores of a message."""
        topic = self._found.channels[channel][0].topic
        try:
            message = self._decoders[channel](payload)
        except Exception as error:  # whatever a damaged or hostile message makes a decoder raise
            self._wrong.setdefault(topic, []).append(in_one_line(error))
            return
        for entry, finder in entries:
            fields, at = entry.columns, t_ns
            if fields.t is not None:
                stamp = _time_of(value_at(message, fields.t), _UNITS_NS[self._mapping.units.time])
                if stamp is None:
                    self._wrong.setdefault(topic, []).append(f"no time at {fields.t}")
                    continue
                at = stamp
            state = [_stated(message, entry, name) for name in _STATES]
            if any(value is not None for value in state):
                self._states.append((at, state))
            if entry.body or entry.bodies or entry.frames or entry.team or fields.team:
                self._rows += [(at, body) for body in finder.bodies(message)]
        if len(self._rows) > self._source.limits.rows:
            raise self._source.too_much(f"{len(self._rows)} bodies", "rows")

    def _note_left_out(self) -> None:
        """Note messages that could not be read, and items that the map does not name."""
        for topic, errors in self._wrong.items():
            note = f"messages on {topic} that cannot be read ({errors[0]}): left out"
            self.flaws.append(Flaw("skipped", note, len(errors)))
        for entry, finder in self.finders:
            if finder.lost:
                note = f"bodies on {entry.topic} that the map does not name"
                self.flaws.append(Flaw("skipped", note, finder.lost))

    def _note_holes(self, numbers: dict[int, list[tuple[I64, I64]]]) -> None:
        """Note messages that are missing, unless the writer counts those of all topics together."""
        columns = {channel: [np.concatenate(part) for part in zip(*parts, strict=True)]
                   for channel, parts in numbers.items() if parts}
        every = np.concatenate([np.empty(0), *(column[0] for column in columns.values())])
        if len(columns) > 1 and len(np.unique(every)) == len(every):
            return
        for channel, column in columns.items():
            holes = holes_in(*column)
            if holes is not None:
                topic = self._found.channels[channel][0].topic
                note = f"{holes.missing} messages on {topic} are missing: their numbers have holes"
                self._found.file.flaws.append(Flaw("gap", note, holes.holes, holes.start_ns, holes.end_ns))
                self._found.file.reasons.append(note)

    def table(self) -> tuple[pl.DataFrame, list[Flaw]]:
        """The samples as a tracking table (``tracking.match.match_of``), and what was assumed of them."""
        if not self._rows:
            what = "has no body with x and y on the topics that the map names"
            for topic, errors in self._wrong.items():
                what = f"has no message on {topic} that can be read ({errors[0]})"
            raise BadRecording(what, where=self._source.name, next_step=(
                'Name the fields in the map, as in columns = {x = "pose.position.x", y = "pose.position.y"}'))
        whose = sorted({body[:2] for _, body in self._rows}, key=str)
        index = {body: i for i, body in enumerate(whose)}
        of_row = np.array([index[body[:2]] for _, body in self._rows], dtype=np.int64)
        at = np.array([t_ns for t_ns, _ in self._rows], dtype=np.int64)
        values = np.array([body[2:] for _, body in self._rows], dtype=np.float64)
        tracks: dict[int, tuple[I64, F64]] = {}
        for i in range(len(whose)):
            own = np.flatnonzero(of_row == i)
            times, first = np.unique(at[own], return_index=True)
            tracks[i] = times, _aimed(values[own[first]])
        samples, step = sample_times(
            {i: times for i, (times, _) in tracks.items()}, index.get((self._mapping.teams.ball, None)))
        self.origin = int(samples[0])
        parts, flaws = [], []
        for i, (team, player) in enumerate(whose):
            times, theirs = tracks[i]
            chosen = nearest_messages(samples, times, step)
            there = np.flatnonzero(chosen >= 0)
            if len(times) > 1 and usual_step(times) > _RARER * step:
                name = team if player is None else f"{team} {player}"
                flaws.append(Flaw("slow sampling", (
                    f"{name} has a message each {usual_step(times) / 1e9:.3g} s: it stays where it was in "
                    f"the samples between, each {step / 1e9:.3g} s"), len(times)))
            parts.append(pl.DataFrame({
                "frame": there, "t": (samples[there] - self.origin) / 1e9,
                "team": [team] * len(there), "player": pl.Series([player] * len(there), dtype=pl.String),
                **{name: theirs[chosen[there], column]
                   for column, name in enumerate(SeenBody._fields[2:])},
            }))
        table = pl.concat(parts).with_columns(pl.col(pl.Float64).fill_nan(None)).sort(
            "frame", maintain_order=True)
        table = table.select(name for name in table.columns
                             if name in ("player", "x", "y") or table[name].null_count() < len(table))
        return self._with_states(table), flaws

    def _with_states(self, table: pl.DataFrame) -> pl.DataFrame:
        """The table with the states and scores that hold at each sample."""
        told = sorted(self._states, key=lambda state: state[0])
        for column, name in enumerate(_STATES):
            rows = [((at - self.origin) / 1e9, values[column]) for at, values in told
                    if values[column] is not None]
            if rows:
                kind = pl.String if name == "game_state" else pl.Int64
                states = pl.DataFrame(rows, schema={"t": pl.Float64, name: kind}, orient="row")
                table = table.join_asof(states, on="t", strategy="backward")
        return table


def _aimed(values: F64) -> F64:
    """A body's values, without a heading of exactly 0 in all messages: nobody set it."""
    if not values[:, 2].any():
        values[:, 2] = nan
    return values


def _stated(message: Any, entry: TopicMap, name: str) -> Any:
    """A state or a score that a message tells; None if it does not."""
    path = getattr(entry.columns, name)
    if path is None:
        return None
    if name == "game_state":
        word = value_at(message, path)
        return None if word is None else str(word)
    score = number_at(message, path)
    return int(score) if score is not None and abs(score) < 2**31 else None


def _time_of(value: Any, unit: int) -> int | None:
    """A time in ns: a number in the unit, or seconds and nanoseconds by the names of ROS and protobuf."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return round(value * unit) if value == value and abs(value) * unit < 2**62 else None
    for whole, part in (("sec", "nanosec"), ("sec", "nsec"), ("seconds", "nanos")):
        seconds, rest = value_at(value, whole), value_at(value, part)
        if seconds is not None or rest is not None:
            try:
                t_ns = int(seconds or 0) * 1_000_000_000 + int(rest or 0)
            except (TypeError, ValueError, OverflowError):
                return None
            return t_ns if abs(t_ns) < 2**62 else None
    return None
