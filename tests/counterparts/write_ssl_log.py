"""Write an SSL log with the messages of the package sslclient, from JSON on standard input.

It runs in the environment that ``make counterparts`` makes, and imports nothing of ours. A line is one vision
packet: ``received`` (ns), ``frame``, ``camera``, ``t`` (s), ``balls`` [[x, y, confidence]], ``yellow`` and ``blue``
[[number, x, y, orientation, confidence]], lengths in millimetres; perhaps ``geometry`` [length, width, goal width,
goal depth, boundary]; ``legacy`` says that the form is that of before 2014. The log goes to the file that is named.
"""

import json
import struct
import sys
from pathlib import Path

import sslclient

sys.path.insert(0, str(Path(sslclient.__file__).parent))  # its legacy messages import each other without a package
from messages_robocup_ssl_wrapper_legacy_pb2 import SSL_WrapperPacket as Legacy
from sslclient.messages_robocup_ssl_wrapper_pb2 import SSL_WrapperPacket


def packet(line):
    """The packet of a line."""
    wrapper = (Legacy if line["legacy"] else SSL_WrapperPacket)()
    frame = wrapper.detection
    frame.frame_number, frame.camera_id = line["frame"], line["camera"]
    frame.t_capture, frame.t_sent = line["t"], line["t"] + 0.004
    for x, y, confidence in line["balls"]:
        frame.balls.add(x=x, y=y, confidence=confidence, pixel_x=1, pixel_y=2, area=90)
    for colour, robots in (("yellow", frame.robots_yellow), ("blue", frame.robots_blue)):
        for number, x, y, theta, confidence in line[colour]:
            robots.add(robot_id=number, x=x, y=y, orientation=theta, confidence=confidence, pixel_x=1, pixel_y=2, height=140)
    if line.get("geometry"):
        length, width, goal_width, goal_depth, boundary = line["geometry"]
        field = wrapper.geometry.field
        field.field_length, field.field_width, field.boundary_width = length, width, boundary
        field.goal_width, field.goal_depth = goal_width, goal_depth
        if line["legacy"]:
            field.line_width, field.referee_width, field.goal_wall_width = 10, 425, 20
            field.center_circle_radius = field.defense_radius = 500
            field.defense_stretch = field.free_kick_from_defense_dist = 350
            field.penalty_spot_from_field_line_dist = field.penalty_line_from_spot_dist = 400
    return wrapper.SerializeToString()


with Path(sys.argv[1]).open("wb") as out:
    out.write(b"SSL_LOG_FILE" + struct.pack(">i", 1))
    for text in sys.stdin:
        line = json.loads(text)
        content = packet(line)
        out.write(struct.pack(">qii", line["received"], 2 if line["legacy"] else 4, len(content)) + content)
