"""Decoding of an SSL log, a minute of four cameras: ours to columns, and protobuf's own parser (upb).

Its descriptors are built here, of the fields that robots and balls have.
"""

import struct

import numpy as np
import pytest
from google.protobuf.internal import api_implementation
from support.protobufs import message_class
from support.ssl_long import long_log

from pitchlore.pipeline.importers.ssl_logs.container import HEADER_BYTES, VISION_2014, Container
from pitchlore.pipeline.importers.ssl_logs.vision import detections

SECONDS = 60
MESSAGES = SECONDS * 75 * 4
#: Fields of the messages of the league.
WIRE = {
    "Ball": [("confidence", 1, "float"), ("area", 2, "uint32"), ("x", 3, "float"), ("y", 4, "float"), ("z", 5, "float"),
             ("pixel_x", 6, "float"), ("pixel_y", 7, "float")],
    "Robot": [("confidence", 1, "float"), ("robot_id", 2, "uint32"), ("x", 3, "float"), ("y", 4, "float"),
              ("orientation", 5, "float"), ("pixel_x", 6, "float"), ("pixel_y", 7, "float"), ("height", 8, "float")],
    "Frame": [("frame_number", 1, "uint32"), ("t_capture", 2, "double"), ("t_sent", 3, "double"), ("camera_id", 4, "uint32"),
              ("balls", 5, "*Ball"), ("yellow", 6, "*Robot"), ("blue", 7, "*Robot")],
    "Packet": [("detection", 1, "Frame")],
}


@pytest.fixture(scope="module")
def data():
    return long_log(SECONDS)


@pytest.fixture(scope="module")
def packet():
    """Protobuf's class of a packet."""
    assert api_implementation.Type() == "upb"
    return message_class(WIRE, "Packet")


def contents(data):
    """Contents of the messages."""
    at = HEADER_BYTES
    while at < len(data):
        _, kind, size = struct.unpack_from(">qii", data, at)
        assert kind == VISION_2014
        yield data[at + 16 : at + 16 + size]
        at += 16 + size


def ours(data, packet):
    return sum(len(detections(batch)[0].frames) for batch in Container([data]).batches())


def parsed(data, packet):
    return sum(packet.FromString(content).HasField("detection") for content in contents(data))


def to_columns(data, packet):
    """Our result: a row for each body."""
    bodies, frames = [], []
    for content in contents(data):
        frame = packet.FromString(content).detection
        frames.append((frame.frame_number, frame.t_capture, frame.t_sent, frame.camera_id))
        for team, robots in ((0, frame.yellow), (1, frame.blue)):
            bodies += [(team, r.robot_id, r.x / 1000, r.y / 1000, r.orientation, r.confidence) for r in robots]
        bodies += [(2, 0, b.x / 1000, b.y / 1000, np.nan, b.confidence) for b in frame.balls]
    assert np.array(bodies).shape[1] == 6
    return len(np.array(frames))


@pytest.mark.benchmark(group="decode an SSL log")
@pytest.mark.parametrize(
    ("how", "rounds"),
    [
        pytest.param(ours, 10, id="ours, to columns"),
        pytest.param(to_columns, 3, id="protobuf (upb), to columns"),
        pytest.param(parsed, 10, id="protobuf (upb), parsed and not read"),
    ],
)
def test_decode(timed, how, rounds, data, packet):
    assert timed(MESSAGES, "messages", how, args=(data, packet), rounds=rounds, warmup_rounds=1) == MESSAGES
