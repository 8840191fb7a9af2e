"""Decoders of other programs' messages: CDR by ROS 2 definitions, protobuf by its descriptors, and JSON."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib import import_module
from typing import Any

from pitchlore.pipeline.base.errors import BadRecording, NotFound, in_one_line

Decoder = Callable[[bytes], Any]

#: The modules that decode, by the encodings of messages and of their definitions.
_MODULES = {("cdr", "ros2msg"): "mcap_ros2.decoder", ("protobuf", "protobuf"): "mcap_protobuf.decoder"}
#: Advice for encodings that are not read.
_ADVICE = {
    "ros1": "Convert it to ROS 2, for example with rosbags-convert",
    "cdr": "Record it with definitions in ros2msg, as rosbag2 does, or export a table",
}


def encodings(channel: Any, schema: Any) -> str:
    """Topic, type and encodings of a channel, in words."""
    encoding = channel.message_encoding or "no encoding"
    if schema is None:
        return f"{channel.topic} no definition ({encoding})"
    also = f" by {schema.encoding}" if schema.encoding != encoding else ""
    return f"{channel.topic} {schema.name} ({encoding}{also})"


def decoder_of(channel: Any, schema: Any, where: str) -> Decoder:
    """The decoder of a channel's messages.

    Raises:
        NotFound: if the extra ``ros`` is needed and not installed.
        BadRecording: if nothing decodes them.
    """
    if channel.message_encoding == "json":
        return json.loads
    module = _MODULES.get((channel.message_encoding, schema.encoding if schema is not None else ""))
    if module is None:
        advice = _ADVICE.get(channel.message_encoding, "Read are cdr with ros2msg, protobuf and json")
        what = f"messages on {encodings(channel, schema)} are not read"
        raise BadRecording(what, where=where, next_step=advice)
    try:
        factory = import_module(module).DecoderFactory()
    except ImportError as error:
        raise NotFound(
            f"{module.split('.')[0]}, which decodes {channel.topic}, cannot be loaded ({in_one_line(error)})",
            next_step="Install the extra pitchlore[ros]",
        ) from error
    try:
        decoder: Decoder = factory.decoder_for(channel.message_encoding, schema)
    except Exception as error:  # whatever a stranger's definition makes it raise
        raise BadRecording(
            f"the definition of {encodings(channel, schema)} cannot be used ({in_one_line(error)})",
            where=where, next_step="Record it again, or leave the topic out of the map",
        ) from error
    return decoder
