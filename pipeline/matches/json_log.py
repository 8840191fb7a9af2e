"""MCAP of JSON messages, for viewers that know their schemas by name."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from io import BytesIO
from typing import Any, NamedTuple

from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import CompressionType, Writer


class JsonTopic(NamedTuple):
    """A topic, the name of its messages' schema, and that schema as JSON Schema."""

    topic: str
    schema: str
    definition: Mapping[str, Any]


class JsonMessage(NamedTuple):
    """A message of a topic: time, ns, and its content."""

    topic: str
    t_ns: int
    content: Mapping[str, Any]


def json_log(
    topics: Iterable[JsonTopic], messages: Iterable[JsonMessage], about: Mapping[str, str]
) -> bytes:
    """An MCAP file; the same messages give the same bytes.

    Args:
        topics: all topics, each once. A schema that several topics have is declared once.
        messages: messages of these topics, in order of time.
        about: metadata of the file, kept under the name ``match``.
    """
    out = BytesIO()
    writer = Writer(out, compression=CompressionType.ZSTD)
    writer.start(profile="", library="pitchlore")
    schemas: dict[str, int] = {}
    channels = {}
    for topic, schema, definition in topics:
        if schema not in schemas:
            data = json.dumps(definition, sort_keys=True).encode()
            schemas[schema] = writer.register_schema(schema, SchemaEncoding.JSONSchema, data)
        channels[topic] = writer.register_channel(topic, MessageEncoding.JSON, schemas[schema])
    for number, (topic, t_ns, content) in enumerate(messages):
        data = json.dumps(content, separators=(",", ":")).encode()
        writer.add_message(channels[topic], log_time=t_ns, publish_time=t_ns, data=data, sequence=number)
    writer.add_metadata("match", dict(about))
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()
