"""The messages of a file, sorted by topic, as the tables of a match."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
import numpy.typing as npt
import polars as pl
from mcap.records import Channel, Schema
from mcap.well_known import MessageEncoding, SchemaEncoding

from pitchlore.pipeline.matches import cdr
from pitchlore.pipeline.matches.channels import (
    COMMAND,
    DECISION,
    FRAME,
    HEIGHT,
    OPTION,
    REFEREE,
    ROWS,
    TOPICS,
    field_types,
)
from pitchlore.pipeline.matches.frame import Frames, Heights
from pitchlore.pipeline.matches.holes import Holes, holes_in
from pitchlore.pipeline.matches.messages import Collector, Messages, log_times, sequence_numbers
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.matches.records import FRAMING_BYTES, MESSAGE, McapRecords
from pitchlore.pipeline.numbers.arrays import I64, U8, Bools

T = TypeVar("T")


class Inbox:
    """Collects messages by topic in the order of the file; messages of no known topic are counted.

    Attributes:
        seen: messages taken so far, of any kind.
    """

    def __init__(self) -> None:
        self.seen = 0
        self._topics: dict[int, int | str] = {}
        self._collectors: dict[int, Collector] = {}
        self._skipped: dict[str, list[I64]] = {}
        self._numbers: dict[int, list[tuple[I64, I64]]] | None = None

    def declare(self, channel: Channel, schema: Schema | None) -> None:
        """Take up a channel with the schema of its messages; the first declaration, the summary's, counts."""
        if channel.id in self._topics:
            return
        cdr = channel.message_encoding == MessageEncoding.CDR
        ros = schema is not None and cdr and schema.encoding == SchemaEncoding.ROS2
        definition = schema.data.decode(errors="replace") if schema and ros else None
        found: int | str = f"messages on {channel.topic}, which is not of a match"
        for ours, topic in TOPICS.items():
            if topic.name == channel.topic:
                alike = definition is not None and field_types(definition) == field_types(topic.definition())
                found = ours if alike else f"messages on {topic.name}, which are defined otherwise"
        self._topics[channel.id] = found

    def reserve(self, capacity: int, *, numbered: bool) -> None:
        """Make room for message records of ``capacity`` bytes in all; comes before :meth:`take`.

        Args:
            capacity: bytes of all records.
            numbered: whether the writer numbers its messages, as far as is known: ours does not.
        """
        self._numbers = {} if numbered else None
        self._collectors = {i: Collector(topic.head, capacity) for i, topic in TOPICS.items()}

    def take(self, content: U8, records: McapRecords) -> None:
        """Take the messages among the records of ``content`` (uint8), in order."""
        is_message = records.opcodes == MESSAGE
        if not is_message.all():
            records = records.keep(is_message)
        self.seen += len(records.bodies)
        channels = np.flatnonzero(np.bincount(records.channels + 1)) - 1
        for channel in channels:
            own = records if len(channels) == 1 else records.keep(records.channels == channel)
            if self._numbers is not None and channel >= 0:
                numbers = sequence_numbers(content, own), log_times(content, own)
                self._numbers.setdefault(int(channel), []).append(numbers)
            topic = self._topics.get(int(channel), "messages on a channel that is not declared")
            if isinstance(topic, str):
                self._skip(topic, log_times(content, own))
                continue
            whole = own.lengths >= TOPICS[topic].head.itemsize - FRAMING_BYTES
            if not whole.all():
                self._skip(_malformed(topic), log_times(content, own.keep(~whole)))
                own = own.keep(whole)
            self._collectors[topic].take(content, own)

    def frames(self) -> Frames:
        """Samples in the order in which they were taken."""
        messages = self._collectors[FRAME].messages()
        sound = cdr.sound_frames(messages)
        self._skip(_malformed(FRAME), messages.heads["log_time"][~sound])
        return cdr.unpack_frames(messages.keep(sound))

    def referee(self, match_id: str) -> pl.DataFrame:
        """Rows of schema Referee, in order of time."""
        return self._table(REFEREE, match_id)

    def decisions(self, match_id: str) -> pl.DataFrame:
        """Rows of schema Decisions, in its order."""
        return self._table(DECISION, match_id)

    def commands(self, match_id: str) -> pl.DataFrame:
        """Rows of schema Commands, in its order."""
        return self._table(COMMAND, match_id)

    def heights(self) -> Heights:
        """The ball's heights, in order of time."""
        return self._values(HEIGHT, cdr.unpack_heights)

    def options(self) -> npt.NDArray[np.void]:
        """Changes of logged options, OPTION_DTYPE, in order of time."""
        return self._values(OPTION, cdr.unpack_options)

    def holes(self) -> list[tuple[str, Holes]]:
        """Holes in the messages' sequence numbers: of each topic of ours, or of the file if it counts all."""
        found = {channel: tuple(np.concatenate(part) for part in zip(*parts, strict=True))
                 for channel, parts in (self._numbers or {}).items()}
        every = [np.concatenate(part) for part in zip(*found.values(), strict=True)] or [np.empty(0)]
        if len(found) > 1 and len(np.unique(every[0])) == len(every[0]):
            named = {"messages": every}
        else:
            known = {channel: topic for channel, topic in self._topics.items() if isinstance(topic, int)}
            named = {f"messages on {TOPICS[known[channel]].name}": [*columns]
                     for channel, columns in found.items() if channel in known}
        holes = [(name, holes_in(*columns)) for name, columns in named.items()]
        return [(name, hole) for name, hole in holes if hole is not None]

    def skipped(self, where: str) -> list[Flaw]:
        """One flaw for each reason for which messages were left out so far."""
        flaws = []
        for reason, times in sorted(self._skipped.items()):
            t_ns = np.concatenate(times)
            note = f"{where}: {reason}: left out"
            end = min(int(t_ns.max()) + 1, 2**63 - 1)
            flaws.append(Flaw("skipped", note, len(t_ns), int(t_ns.min()), end))
        return flaws

    def _skip(self, reason: str, t_ns: I64) -> None:
        if len(t_ns):
            self._skipped.setdefault(reason, []).append(t_ns)

    def _values(self, topic: int, unpack: Callable[[Messages], tuple[T, Bools]]) -> T:
        messages = self._collectors[topic].messages()
        found, sound = unpack(messages)
        self._skip(_malformed(topic), messages.heads["log_time"][~sound])
        return found

    def _table(self, topic: int, match_id: str) -> pl.DataFrame:
        schema, _, unpack, by = ROWS[topic]
        if not len(self._collectors[topic].messages()):
            return schema.empty()  # most matches log no decisions: polars would take 2 ms over nothing
        rows = self._values(topic, unpack)
        table = rows.with_columns(match_id=pl.lit(match_id)).select(*schema.dtypes())
        if not schema.holds(table):
            table, failure = schema.filter(table)
            broken: I64 = failure.invalid()["t_ns"].to_numpy()
            self._skip(f"messages on {TOPICS[topic].name} that break the rules of {schema.tag()}", broken)
        return table.sort(by, maintain_order=True)


def _malformed(topic: int) -> str:
    return f"malformed messages on {TOPICS[topic].name}"
