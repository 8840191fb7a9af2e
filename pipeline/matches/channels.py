"""The channels of a log and the definitions of their messages."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from importlib import resources
from typing import NamedTuple

import numpy as np
import polars as pl
from mcap.records import Channel, Schema
from mcap.well_known import MessageEncoding, SchemaEncoding

from pitchlore.pipeline.matches import cdr
from pitchlore.pipeline.matches.messages import Messages
from pitchlore.pipeline.numbers.arrays import Bools
from pitchlore.schemas import Commands, Decisions, Referee, Table

#: Ids of the log's channels, and of their schemas.
FRAME, REFEREE, DECISION, COMMAND, HEIGHT, OPTION = 1, 2, 3, 4, 5, 6
#: The channels of every log; a log declares another one when it has a message on it.
ALWAYS = (FRAME, REFEREE, DECISION)


class Topic(NamedTuple):
    """Name and message definition of a channel.

    Attributes:
        name: name of the channel.
        message: name of its definition in ``schemas/``.
        parts: names of the definitions that it refers to.
        head: layout of the fixed part of its messages.
    """

    name: str
    message: str
    parts: tuple[str, ...]
    head: np.dtype[np.void]

    @cache  # noqa: B019 - there are six topics
    def definition(self) -> str:
        """Definition with those it refers to, in MCAP's ``ros2msg`` encoding."""
        folder = resources.files("pitchlore.schemas")
        text = folder.joinpath(f"{self.message}.msg").read_text(encoding="utf-8")
        for part in self.parts:
            text += "=" * 80 + f"\nMSG: pitchlore/{part}\n"
            text += folder.joinpath(f"{part}.msg").read_text(encoding="utf-8")
        return text


TOPICS = {
    FRAME: Topic("/frame", "Frame", ("Robot",), cdr.FRAME_HEAD),
    REFEREE: Topic("/referee", "RefereeEvent", (), cdr.REFEREE_HEAD),
    DECISION: Topic("/decision", "Decision", (), cdr.DECISION_HEAD),
    COMMAND: Topic("/command", "Commands", ("Command",), cdr.COMMANDS_HEAD),
    HEIGHT: Topic("/ball_height", "BallHeight", (), cdr.HEIGHT_HEAD),
    OPTION: Topic("/option", "Option", (), cdr.OPTION_HEAD),
}


class Rows(NamedTuple):
    """Rows of a table as messages: their schema, to messages and back (with a mask), and their order."""

    schema: type[Table]
    pack: Callable[[pl.DataFrame, int], Messages]
    unpack: Callable[[Messages], tuple[pl.DataFrame, Bools]]
    by: tuple[str, ...]


ROWS = {
    REFEREE: Rows(Referee, cdr.pack_referee, cdr.unpack_referee, ("t_ns",)),
    DECISION: Rows(Decisions, cdr.pack_decisions, cdr.unpack_decisions, ("team", "robot", "t_ns")),
    COMMAND: Rows(Commands, cdr.pack_commands, cdr.unpack_commands, ("team", "robot", "t_ns", "command")),
}


def declarations(ids: Iterable[int]) -> tuple[list[Schema], list[Channel]]:
    """The schema and channel records that declare these channels."""
    topics = [(i, TOPICS[i]) for i in ids]
    schemas = [
        Schema(
            id=i, name=f"pitchlore/msg/{topic.message}", encoding=SchemaEncoding.ROS2,
            data=topic.definition().encode(),
        )
        for i, topic in topics
    ]
    channels = [
        Channel(id=i, topic=topic.name, message_encoding=MessageEncoding.CDR, metadata={}, schema_id=i)
        for i, topic in topics
    ]
    return schemas, channels


def field_types(definition: str) -> list[tuple[str, str]]:
    """Type and name of each field, which decide the layout of a message.

    Comments, constants and the package of a part do not.
    """
    lines = (line.split("#")[0].split() for line in definition.splitlines())
    kept = [line for line in lines if len(line) >= 2 and "=" not in "".join(line)]
    return [(kind.split("/")[-1], name.split("/")[-1]) for kind, name, *_ in kept]
