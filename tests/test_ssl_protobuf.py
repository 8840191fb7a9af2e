"""The packets of SSL's game controller and trackers, as protobuf's own library writes and reads them.

The fields are those of RoboCup-SSL/ssl-game-controller at 671c293: ``proto/state/ssl_gc_referee_message.proto`` and
``proto/tracker/ssl_vision_*_tracked.proto``. No package of theirs is on PyPI. Other tests write such packets with an
encoder of their own (``support.ssl_messages``), which is held to the same fields here.
"""

import math

import numpy as np
import pytest
from support import ssl_messages as ssl
from support.protobufs import message_class

from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import channels
from pitchlore.pipeline.importers.ssl_logs import tracker
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, YELLOW
from pitchlore.pipeline.live.bodies import ssl_batch
from pitchlore.pipeline.live.referee import RefereePacket, said_in

TEAM = [("name", 1, "!string"), ("score", 2, "!uint32"), ("red_cards", 3, "!uint32"), ("yellow_cards", 5, "!uint32"),
        ("timeouts", 6, "!uint32"), ("timeout_time", 7, "!uint32"), ("goalkeeper", 8, "!uint32")]
REFEREE = message_class({
    "Team": TEAM, "Point": [("x", 1, "!float"), ("y", 2, "!float")],
    "Referee": [
        ("packet_timestamp", 1, "!uint64"), ("stage", 2, "!uint32"), ("stage_time_left", 3, "sint64"), ("command", 4, "!uint32"),
        ("command_counter", 5, "!uint32"), ("command_timestamp", 6, "!uint64"), ("yellow", 7, "!Team"), ("blue", 8, "!Team"),
        ("designated_position", 9, "Point"), ("blue_team_on_positive_half", 10, "bool"),
        ("current_action_time_remaining", 15, "int64"), ("source_identifier", 18, "string")],
}, "Referee")
WRAPPER = message_class({
    "Vector3": [("x", 1, "!float"), ("y", 2, "!float"), ("z", 3, "!float")], "Vector2": [("x", 1, "!float"), ("y", 2, "!float")],
    "Ball": [("pos", 1, "!Vector3"), ("vel", 2, "Vector3"), ("visibility", 3, "float")],
    "RobotId": [("id", 1, "!uint32"), ("team", 2, "!uint32")],
    "Robot": [("robot_id", 1, "!RobotId"), ("pos", 2, "!Vector2"), ("orientation", 3, "!float"), ("vel", 4, "Vector2"),
              ("vel_angular", 5, "float"), ("visibility", 6, "float")],
    "Frame": [("frame_number", 1, "!uint32"), ("timestamp", 2, "!double"), ("balls", 3, "*Ball"), ("robots", 4, "*Robot"),
              ("capabilities", 6, "*uint32")],
    "Wrapper": [("uuid", 1, "!string"), ("source_name", 2, "string"), ("tracked_frame", 3, "Frame")],
}, "Wrapper")
CHANNELS = channels("ssl")


@pytest.mark.parametrize("left_us", [None, 300_000_000, -5_000_000])
@pytest.mark.parametrize("turned", [None, False, True])
def test_we_read_a_referee(left_us: int | None, turned: bool | None) -> None:
    """Messages as the game controller sends them are decoded: stage, command, time left, names, goals, sides."""
    sent = REFEREE(packet_timestamp=1, stage=4, command=9, command_counter=17, command_timestamp=2, source_identifier="gc")
    for team, name, score in ((sent.yellow, "TIGERs", 3), (sent.blue, "RoboCIn", 12)):
        team.name, team.score, team.red_cards, team.yellow_cards = name, score, 1, 2
        team.timeouts, team.timeout_time, team.goalkeeper = 4, 300_000_000, 0
    if left_us is not None:
        sent.stage_time_left = left_us
    if turned is not None:
        sent.blue_team_on_positive_half = turned
    heard = said_in(Packet(CHANNELS["referee"], 0, sent.SerializeToString()))
    assert heard == RefereePacket(4, 9, left_us, ("TIGERs", "RoboCIn"), (3, 12), turned)


def test_our_encoder_of_the_referee() -> None:
    """The packets of other tests are whole messages of the game controller's."""
    data = ssl.referee(2, 14, 5, ssl.Team("TIGERs", 3, 1, 2), ssl.Team("RoboCIn", 1), t=7.5, blue_on_positive=True, source="gc")
    read = REFEREE.FromString(data)
    assert (read.stage, read.command, read.command_counter, read.stage_time_left) == (2, 14, 5, 300)
    assert [(team.name, team.score, team.red_cards, team.yellow_cards) for team in (read.yellow, read.blue)] == [
        ("TIGERs", 3, 1, 2), ("RoboCIn", 1, 0, 0)]
    assert (read.packet_timestamp, read.blue_team_on_positive_half, read.source_identifier) == (7_500_000, True, "gc")


def test_we_read_a_tracker() -> None:
    """Messages as a tracker sends them are decoded: frame, time, the first ball, robots with their speeds."""
    sent = WRAPPER(uuid="u-1", source_name="TIGERs")
    frame = sent.tracked_frame
    frame.frame_number, frame.timestamp = 42, 1_700_000_000.25
    for x in (1.5, -3.0):
        ball = frame.balls.add(visibility=1.0)
        ball.pos.x, ball.pos.y, ball.pos.z = x, -0.5, 0.1
        ball.vel.x, ball.vel.y, ball.vel.z = 2.0, 0.25, 0.0
    for number, team in ((7, 1), (0, 2)):
        robot = frame.robots.add(orientation=math.pi / 2, vel_angular=-1.5, visibility=1.0)
        robot.robot_id.id, robot.robot_id.team = number, team
        robot.pos.x, robot.pos.y, robot.vel.x, robot.vel.y = 0.5, 1.25, 0.75, -0.125
    batch = ssl_batch([Packet(CHANNELS["tracker"], 5, sent.SerializeToString())])
    assert tracker.trackers_of(batch)[0] == [("u-1", "TIGERs")]
    seen, unused = tracker.tracker_samples(batch, "u-1", 0.0)
    assert tuple(unused) == (0, 0, 0)
    assert (seen.number.tolist(), seen.captured.tolist()) == ([42], [1_700_000_000.25])
    assert seen.ball.tolist() == [[1.5, -0.5, 2.0, 0.25]]
    pose = [0.5, 1.25, np.float32(math.pi / 2), 0.75, -0.125, -1.5]
    assert sorted(seen.robots.tolist()) == sorted([[YELLOW, 7, *pose], [BLUE, 0, *pose]])


def test_our_encoder_of_trackers() -> None:
    """The packets of other tests are whole messages of a tracker's."""
    data = ssl.tracked(3, 2.5, [ssl.Tracked(0.5, -0.25, 1.0, 0.0)],
                       [ssl.Tracked(1.0, 2.0, 0.5, 0.25, team=2, number=4, theta=0.75, omega=-2.0)], uuid="u-9")
    read = WRAPPER.FromString(data)
    (ball,), (robot,) = read.tracked_frame.balls, read.tracked_frame.robots
    assert (read.uuid, read.source_name, read.tracked_frame.frame_number, read.tracked_frame.timestamp) == ("u-9", "TIGERs", 3, 2.5)
    assert (ball.pos.x, ball.pos.y, ball.vel.x, ball.visibility) == (0.5, -0.25, 1.0, 1.0)
    assert (robot.robot_id.id, robot.robot_id.team, robot.pos.x, robot.pos.y) == (4, 2, 1.0, 2.0)
    assert (robot.orientation, robot.vel.x, robot.vel.y, robot.vel_angular) == (0.75, 0.5, 0.25, -2.0)
