"""Recordings in MCAP that others wrote: our messages without our metadata, and topics that a map names."""

import contextlib
import random
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from math import cos, sin
from typing import Any

import numpy as np
import polars as pl
import pytest
from support.mcap_logs import match as a_log
from support.mcap_logs import rows_of, written
from support.recordings import read
from support.topics import Mcap, rewritten

from pitchlore.pipeline.base.errors import BadRecording, BadSettings, NotFound, PitchloreError
from pitchlore.pipeline.importers.tracking.mapping import load_map
from pitchlore.pipeline.matches.frame import MatchLog

# --- our messages without our metadata ----------------------------------------------------------------

LOG = a_log([2, 3, 0, 2] * 12)
DATA = written(LOG)


def flaws(match: MatchLog) -> list[tuple[str, int]]:
    """Kind and count of each flaw, but for those of the direction of attack, which nothing tells here."""
    return [row for row in match.quality.select(pl.col("flaw").cast(pl.String), "count").rows()
            if not row[0].startswith(("direction", "off the pitch"))]


def numbered(messages: list) -> list:
    """Messages with their topics' own sequence numbers."""
    counts: dict[str, int] = {}
    return [(topic, _next(counts, topic), t, data) for topic, _, t, data in messages]


def _next(counts: dict[str, int], topic: str) -> int:
    counts[topic] = counts.get(topic, -1) + 1
    return counts[topic]


def counted(messages: list) -> list:
    """Messages with one count for all topics."""
    return [(topic, number, t, data) for number, (topic, _, t, data) in enumerate(messages)]


def without(*places: int) -> Callable[[list], list]:
    """Leaves out these messages on /frame."""
    def left(messages: list) -> list:
        frames = [message for message in messages if message[0] == "/frame"]
        gone = [frames[place] for place in places]
        return [message for message in messages if message not in gone]
    return left


def shuffled(messages: list) -> list:
    return random.Random(1).sample(messages, len(messages))


@pytest.mark.parametrize("channels", [1, 2, 3])
@pytest.mark.parametrize("order", [list, shuffled, lambda messages: messages[::-1], lambda messages: sorted(messages, key=lambda m: m[2] % 7)],
                         ids=["as it was", "shuffled", "backwards", "in sevenths"])
def test_order(order: Callable[[list], list], channels: int) -> None:
    """Frames come in order of log time, however they lie in the file, and on however many channels of the topic."""
    match = read(rewritten(DATA, order, channels=channels), "final.mcap")
    assert rows_of(match.frames) == rows_of(LOG.frames)
    assert match.info.match_id.startswith("final-")
    assert (match.info.home, match.info.away, match.info.complete) == ("home", "away", True)
    assert match.referee.drop("match_id").equals(LOG.referee.drop("match_id"))
    assert flaws(match) == []


@pytest.mark.parametrize(("change", "found", "says"), [
    (lambda m: without(7, 8, 20)(m), [("gap", 2)], "3 frames are missing"),
    (lambda m: without(7, 8, 20)(numbered(m)), [("gap", 2), ("gap", 2)], "3 messages on /frame are missing"),
    (lambda m: without(5)(counted(m)), [("gap", 1), ("gap", 1)], "1 messages are missing"),
    (numbered, [], None),
    (counted, [], None),
    (lambda m: [(topic, t, t, data) for topic, _, t, data in m], [], None),  # times are no counts
], ids=["frames", "numbered", "counted", "whole", "whole, counted together", "times"])
def test_holes(change: Callable[[list], list], found: list, says: str | None) -> None:
    """Numbers that are missing are holes in quality, and the match is not complete."""
    match = read(rewritten(DATA, change), "final.mcap")
    assert flaws(match) == found
    assert match.info.complete == (says is None)
    assert (match.info.incomplete_reason or "").startswith(says or "")
    assert all(0 <= row["start_ns"] < row["end_ns"] for row in match.quality.filter(flaw="gap").iter_rows(named=True))


@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize("later", [0, 1_000_000])
def test_recorded_twice(channels: int, later: int) -> None:
    """Messages that two channels have, or two recorders, count once: no goal is doubled."""
    match = read(rewritten(DATA, lambda messages: [
        (topic, number, t + later * again, data) for topic, number, t, data in messages for again in (0, 1)], channels=channels), "final.mcap")
    assert rows_of(match.frames) == rows_of(LOG.frames)
    assert match.referee["event"].to_list() == LOG.referee["event"].to_list()
    assert flaws(match) == [("skipped", len(LOG.frames))]


def test_said_by_a_map() -> None:
    """A map gives teams, pitch and direction of a log that does not say them; one that does keeps its own."""
    said = load_map('[teams]\nnames = {home = "Lions", away = "Tigers"}\nhome_attacks = "left"\n[pitch]\nkind = "ssl"\n')
    match = read(rewritten(DATA), "final.mcap", said)
    assert (match.info.home, match.info.away, match.info.pitch.kind.value) == ("Lions", "Tigers", "ssl")
    assert match.info.periods[0].home_attacks == -1
    assert read(DATA, "final.mcap", said).info == LOG.info


# --- topics that a map names --------------------------------------------------------------------------

F = 24
STEP = 20_000_000
#: Body, and its place and heading at time t, s.
BODIES: dict[str, Callable[[float], tuple[float, float, float]]] = {
    "ball": lambda t: (0.5 * t, 0.1, 0.0),
    "blue 1": lambda t: (-0.6, 0.3 * t, 0.5 + t),
    "blue 2": lambda t: (-0.2 + 0.1 * t, -0.2, -1.5),
    "red 1": lambda t: (0.6, 0.2, 3.0 - t),
    "red 2": lambda t: (0.3 - 0.2 * t, -0.3, 2.0),
}
ROBOTS = [body for body in BODIES if body != "ball"]
EPOCH = 1_700_000_000_000_000_000


def pose(body: str, t: float) -> dict:
    x, y, turn = BODIES[body](t)
    return {"position": {"x": x, "y": y, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": sin(turn / 2), "w": cos(turn / 2)}}


def flat(body: str, t: float) -> dict:
    return dict(zip(("x", "y", "theta"), BODIES[body](t), strict=True))


def header(t_ns: int) -> dict:
    return {"stamp": {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}, "frame_id": "field"}


def transform(body: str, t: float, t_ns: int) -> dict:
    place = pose(body, t)
    return {"header": header(t_ns), "child_frame_id": body.replace(" ", "_"),
            "transform": {"translation": place["position"], "rotation": place["orientation"]}}


def pose_arrays(out: Mcap, t: float, t_ns: int) -> None:
    for team in ("blue", "red"):
        poses = [pose(body, t) for body in ROBOTS if body.startswith(team)]
        out.ros(f"/{team}/poses", "geometry_msgs/PoseArray", t_ns, {"header": header(t_ns), "poses": poses})
    out.ros("/ball", "geometry_msgs/PoseStamped", t_ns, {"header": header(t_ns), "pose": pose("ball", t)})


def odometry(out: Mcap, t: float, t_ns: int) -> None:
    for body in ROBOTS:
        out.ros(f"/{body.replace(' ', '')}/odom", "nav_msgs/Odometry", t_ns, {
            "header": header(t_ns), "child_frame_id": "base_link", "pose": {"pose": pose(body, t), "covariance": [0.0] * 36}})
    out.ros("/ball", "geometry_msgs/PointStamped", t_ns, {"header": header(t_ns), "point": pose("ball", t)["position"]})


def tf(out: Mcap, t: float, t_ns: int) -> None:
    out.ros("/tf", "tf2_msgs/TFMessage", t_ns, {"transforms": [transform(body, t, t_ns) for body in BODIES]})


def tf_each(out: Mcap, t: float, t_ns: int) -> None:
    for body in BODIES:
        out.ros("/tf", "tf2_msgs/TFMessage", t_ns, {"transforms": [transform(body, t, t_ns)]})


def pose2d(out: Mcap, t: float, t_ns: int) -> None:
    for body in ROBOTS:
        out.ros(f"/{body.replace(' ', '')}", "geometry_msgs/Pose2D", t_ns, flat(body, t))
    out.ros("/ball", "geometry_msgs/Point", t_ns, pose("ball", t)["position"])


FOXGLOVE = ("foxglove.PosesInFrame", "jsonschema", b"{}")


def foxglove_json(out: Mcap, t: float, t_ns: int) -> None:
    stamp = {"sec": t_ns // 10**9, "nsec": t_ns % 10**9}
    out.other("/poses", "json", FOXGLOVE, t_ns, {"timestamp": stamp, "frame_id": "field", "poses": [pose(body, t) for body in BODIES]})


def own_json(out: Mcap, t: float, t_ns: int) -> None:
    robots = [{"team": body[:-2], "id": int(body[-1]), **flat(body, t)} for body in ROBOTS]
    out.other("/world", "json", None, t_ns, {"stamp": round((t_ns - EPOCH) / 1e9, 6), "ball": flat("ball", t), "robots": robots})


def protobuf(out: Mcap, t: float, t_ns: int) -> None:
    schema, message = _proto()
    world = message(ball=_xy(flat("ball", t)))
    for body in ROBOTS:
        world.robots.add(team=body[:-2], id=int(body[-1]), place=_xy(flat(body, t)), yaw=BODIES[body](t)[2])
    world.robots.add(team="red", id=3)  # it was not seen: no place, and so no robot at 0, 0
    out.other("/world", "protobuf", schema, t_ns, world.SerializeToString())


def _xy(place: dict) -> dict:
    return {"x": place["x"], "y": place["y"]}


def _proto() -> tuple[tuple[str, str, bytes], Callable]:
    """A team's own protobuf messages, with their descriptors."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    double, text, number, message, repeated = 1, 9, 5, 11, 3
    file = descriptor_pb2.FileDescriptorProto(name="world.proto", package="team", syntax="proto3")
    fields = {
        "Xy": [("x", double, 1, ""), ("y", double, 1, "")],
        "Robot": [("team", text, 1, ""), ("id", number, 1, ""), ("place", message, 1, ".team.Xy"), ("yaw", double, 1, "")],
        "World": [("ball", message, 1, ".team.Xy"), ("robots", message, repeated, ".team.Robot")],
    }
    for name, parts in fields.items():
        kind = file.message_type.add(name=name)
        for i, (field, type_, label, of) in enumerate(parts, 1):
            kind.field.add(name=field, number=i, type=type_, label=label, **({"type_name": of} if of else {}))
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    described = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    return ("team.World", "protobuf", described), message_factory.GetMessageClass(pool.FindMessageTypeByName("team.World"))


def per_robot(suffix: str) -> str:
    return "".join(f'[[topics]]\ntopic = "/{body.replace(" ", "")}{suffix}"\nbody = "{body}"\n' for body in ROBOTS)


BALL = '[[topics]]\ntopic = "/ball"\nbody = "ball"\n'
FRAMES = ", ".join(f'{body.replace(" ", "_")} = "{body}"' for body in BODIES)
FORMS: dict[str, tuple[Callable[[Mcap, float, int], None], str]] = {
    "PoseArray": (pose_arrays, BALL + "".join(
        f'[[topics]]\ntopic = "/{team}/poses"\nbodies = ["{team} 1", "{team} 2"]\n' for team in ("blue", "red"))),
    "Odometry": (odometry, BALL + per_robot("/odom")),
    "tf": (tf, f'[[topics]]\ntopic = "/tf"\nframes = {{{FRAMES}}}\n'),
    "tf, a message each": (tf_each, f'[[topics]]\ntopic = "/tf"\nframes = {{{FRAMES}}}\n'),
    "Pose2D": (pose2d, BALL + per_robot("")),
    "stamps": (odometry, (BALL + per_robot("/odom")).replace("body =", 'columns = {t = "header.stamp"}\nbody =')),
    "foxglove json": (foxglove_json, f'[[topics]]\ntopic = "/poses"\nbodies = {list(BODIES)}\n'),
    "own json": (own_json, ('[[topics]]\ntopic = "/world"\nbody = "ball"\ncolumns = {x = "ball.x", y = "ball.y", t = "stamp"}\n'
                 '[[topics]]\ntopic = "/world"\neach = "robots"\ncolumns = {team = "team", player = "id", t = "stamp"}\n')),
    "protobuf": (protobuf, ('[[topics]]\ntopic = "/world"\nbody = "ball"\ncolumns = {x = "ball.x", y = "ball.y"}\n'
                 '[[topics]]\ntopic = "/world"\neach = "robots"\n'
                 'columns = {team = "team", player = "id", x = "place.x", y = "place.y", heading = "yaw"}\n')),
}
TEAMS = '[teams]\nhome = "blue"\naway = "red"\nhome_attacks = "right"\n'


def recorded(form: Callable[[Mcap, float, int], None], frames: range = range(F)) -> bytes:
    out = Mcap()
    for i in frames:
        form(out, i * STEP / 1e9, EPOCH + i * STEP)
    return out.bytes()


def needs(form: str) -> None:
    if form == "protobuf":
        pytest.importorskip("mcap_protobuf", reason="needs the extra ros")


@pytest.mark.parametrize("form", FORMS)
def test_forms(form: str) -> None:
    """Bodies are where the messages have them, in every form."""
    needs(form)
    write, topics = FORMS[form]
    match = read(recorded(write), "training.mcap", load_map(topics + TEAMS))
    assert (match.info.home, match.info.away, match.info.complete, match.info.format) == ("blue", "red", True, "mcap")
    assert match.frames.t_ns.tolist() == [i * STEP for i in range(F)]
    assert match.info.started_at == (None if form == "own json" else datetime(2023, 11, 14, 22, 13, 20, tzinfo=UTC))
    assert flaws(match) in ([("goals unknown", F)], [("skipped", F), ("goals unknown", F)])
    for i in range(F):
        place = {("ball", 0): match.frames.ball[i]} | {
            (("blue", "red")[robot["team"]], robot["id"]): robot
            for robot in match.frames.robots[match.frames.offsets[i]:match.frames.offsets[i + 1]]}
        assert len(place) == 5
        for body, at in BODIES.items():
            team, _, number = body.rpartition(" ")
            x, y, turn = at(i * STEP / 1e9)
            found = place[team or "ball", int(number) if team else 0]
            assert (found["x"], found["y"]) == pytest.approx((x, y), abs=1e-6)
            if team:
                assert found["theta"] == pytest.approx(turn, abs=1e-6)


def test_degrees_and_corner() -> None:
    """Units and axes of the map hold for topics, too; a quaternion has no unit."""
    write, topics = FORMS["PoseArray"]
    units = '[units]\nlength = "cm"\nangle = "deg"\n[axes]\ny = "down"\n[pitch]\nkind = "vsss"\n'
    match = read(recorded(write), "training.mcap", load_map(topics + TEAMS + units))
    robot = match.frames.robots[0]
    assert (robot["x"], robot["y"], robot["theta"]) == pytest.approx((-0.006, 0.0, 0.5), abs=1e-6)


@pytest.mark.parametrize(("every", "samples"), [({"ball": 1, "robots": 2}, F // 2), ({"ball": 2, "robots": 1}, F // 2)])
def test_rates(every: dict[str, int], samples: int) -> None:
    """Topics with other rates meet at the slower one's times; who is rarer still stays where it was, which is said."""
    out = Mcap()
    for i in range(F):
        t, t_ns = i * STEP / 1e9, EPOCH + i * STEP
        if i % every["ball"] == 0:
            out.ros("/ball", "geometry_msgs/Point", t_ns, pose("ball", t)["position"])
        for body in ROBOTS:
            if i % (4 if body == "red 2" else every["robots"]) == 0:
                out.ros(f"/{body.replace(' ', '')}", "geometry_msgs/Pose2D", t_ns + 3_000_000, flat(body, t))
    match = read(out.bytes(), "training.mcap", load_map(FORMS["Pose2D"][1] + TEAMS))
    assert abs(len(match.frames) - samples) <= 1
    assert set(np.diff(match.frames.t_ns).tolist()) == {2 * STEP}
    assert match.frames.counts()[1:-2].tolist() == [4] * (len(match.frames) - 3)
    assert ("slow sampling", 6) in flaws(match)
    assert "red 2 has a message each 0.08 s" in match.quality.filter(flaw="slow sampling")["note"][0]


def test_lost_bodies() -> None:
    """A body that is lost is absent, and time goes on without the ball."""
    out = Mcap()
    for i in range(60):
        t, t_ns = i * STEP / 1e9, EPOCH + i * STEP
        if not 20 <= i < 40:
            out.ros("/ball", "geometry_msgs/Point", t_ns, pose("ball", t)["position"])
        for body in ROBOTS:
            if body != "red 1" or i < 30:
                out.ros(f"/{body.replace(' ', '')}", "geometry_msgs/Pose2D", t_ns, flat(body, t))
    match = read(out.bytes(), "training.mcap", load_map(FORMS["Pose2D"][1] + TEAMS))
    assert np.diff(match.frames.t_ns).tolist() == [STEP] * 59
    assert np.isnan(match.frames.ball["x"]).sum() == pytest.approx(20, abs=2)
    assert match.frames.counts().tolist() == [4] * 31 + [3] * 29


def test_score_and_state() -> None:
    """A topic of the referee gives states and the score from its message on."""
    out = Mcap()
    for i in range(F):
        pose_arrays(out, i * STEP / 1e9, EPOCH + i * STEP)
        if i in (0, 5, 12):
            out.ros("/referee", "std_msgs/String", EPOCH + i * STEP, {"data": {0: "KICKOFF", 5: "PLAY", 12: "GOAL"}[i]})
        if i in (0, 12):
            out.ros("/score", "team_msgs/Score", EPOCH + i * STEP, {"home": i // 12, "away": 0})
    said = (FORMS["PoseArray"][1] + '[[topics]]\ntopic = "/referee"\ncolumns = {game_state = "data"}\n'
            '[[topics]]\ntopic = "/score"\ncolumns = {score_home = "home", score_away = "away"}\n' + TEAMS +
            '[states]\nKICKOFF = "kick-off"\nPLAY = "play"\nGOAL = "goal"\n')
    match = read(out.bytes(), "training.mcap", load_map(said))
    assert ("goal", "home", 1, 0) in match.referee.select(
        pl.col("event", "team").cast(pl.String), "score_home", "score_away").rows()


def damaged(out: Mcap, t: float, t_ns: int) -> None:
    own_json(out, t, t_ns)
    if t_ns % 3 == EPOCH % 3:
        out.other("/world", "json", None, t_ns + 1, b'{"robots": ')


@pytest.mark.parametrize("topic", [
    'topic = "/world"\neach = "robots"\ncolumns = {team = "team", player = "id"}\n',
    'topic = "/world"\nbody = "ball"\ncolumns = {x = "x", y = "y", t = "stamp"}\n',
    'topic = "/world"\ncolumns = {score_home = "x", score_away = "y"}\n',
])
@pytest.mark.parametrize("number", [10**400, -10**30, 1e400, "x", [1], {"sec": "x"}, {"sec": 10**30}, {"seconds": [1]}], ids=lambda number: repr(number)[:20])
def test_absurd_numbers(topic: str, number: Any) -> None:
    """Messages with numbers that no clock, place or score has are left out, or refused in one line."""
    out = Mcap()
    for i in range(F):
        own_json(out, i * STEP / 1e9, EPOCH + i * STEP)
    said = {"stamp": number, "x": number, "y": number, "robots": [{"team": "blue", "id": number, "x": number, "y": number}]}
    out.other("/world", "json", None, EPOCH + F * STEP, said)
    with contextlib.suppress(BadRecording):
        read(out.bytes(), "training.mcap", load_map(FORMS["own json"][1] + "[[topics]]\n" + topic + TEAMS))


def numbered_poses(out: Mcap, t: float, t_ns: int) -> None:
    number = (t_ns - EPOCH) // STEP
    if number not in (5, 6, 9):
        out.ros("/all", "geometry_msgs/PoseArray", t_ns, {"header": header(t_ns), "poses": [pose(body, t) for body in BODIES]}, number + 1)


def unset(out: Mcap, t: float, t_ns: int) -> None:
    for body in ROBOTS:
        x, y, _ = BODIES[body](t)
        out.ros(f"/{body.replace(' ', '')}", "geometry_msgs/Pose2D", t_ns, {"x": x, "y": y, "theta": 0.0})
    out.ros("/ball", "geometry_msgs/Point", t_ns, pose("ball", t)["position"])


@pytest.mark.parametrize(("write", "topics", "found", "complete"), [
    (damaged, FORMS["own json"][1], "messages on /world that cannot be read", True),
    (numbered_poses, f'[[topics]]\ntopic = "/all"\nbodies = {list(BODIES)}\n', "3 messages on /all are missing", False),
    (pose_arrays, FORMS["PoseArray"][1].replace(', "red 2"', ""), "bodies on /red/poses that the map does not name", True),
])
def test_flawed(write: Callable[[Mcap, float, int], None], topics: str, found: str, complete: bool) -> None:
    """Left out or missing is said, and the rest is read."""
    match = read(recorded(write), "training.mcap", load_map(topics + TEAMS))
    assert any(found in note for note in match.quality["note"])
    assert match.info.complete == complete


def test_orientation_that_nobody_set() -> None:
    """A heading of exactly 0 in every message is none."""
    match = read(recorded(unset), "training.mcap", load_map(FORMS["Pose2D"][1] + TEAMS))
    assert np.isnan(match.frames.robots["theta"]).all()


def hostile(out: Mcap, t: float, t_ns: int) -> None:
    pose_arrays(out, t, t_ns)
    own = "team_msgs/Own"
    out.other("/itself", "cdr", (own, "ros2msg", f"{own} own".encode()), t_ns, bytes(8))
    out.other("/long", "cdr", (own, "ros2msg", f"{own}s[] own\n{'=' * 80}\nMSG: {own}s\n".encode()), t_ns, bytes([0, 1, 0, 0, 255, 255, 255, 255]))
    out.other("/deep", "json", None, t_ns, b"[" * 100_000)


def test_hostile_messages() -> None:
    """Definitions that refer to themselves, lists that lie about their length, and nesting are left out at once."""
    topics = "".join(f'[[topics]]\ntopic = "/{name}"\nbody = "ball"\n' for name in ("itself", "long", "deep"))
    begun = time.perf_counter()
    match = read(recorded(hostile), "training.mcap", load_map(FORMS["PoseArray"][1] + topics + TEAMS))
    assert len(match.frames) == F
    assert ("skipped", F) in flaws(match)
    assert [note.split()[2] for note in match.quality["note"] if "cannot be read" in note] == ["/itself", "/long", "/deep"]
    assert time.perf_counter() - begun < 20


def silent(out: Mcap, t: float, t_ns: int) -> None:
    out.ros("/chatter", "std_msgs/String", t_ns, {"data": "hello"})
    out.other("/lidar", "ros1", ("sensor_msgs/LaserScan", "ros1msg", b"float32 x"), t_ns, b"1234")
    out.other("/camera", "cdr", ("team_msgs/Img", "ros2idl", b"struct Img {};"), t_ns, b"1234")
    out.other("/bad", "cdr", ("team_msgs/Bad", "ros2msg", b"no such type"), t_ns, b"1234")
    out.other("/text", "json", None, t_ns, b"not json")


@pytest.mark.parametrize(("write", "topics", "says"), [
    (pose_arrays, "", (r"has no match of ours, but these topics: /ball geometry_msgs/msg/PoseStamped \(cdr by ros2msg\), "
     r".*/red/poses .*PoseArray.*Say in a map which topic is what")),
    (foxglove_json, "", r"/poses foxglove.PosesInFrame \(json by jsonschema\)"),
    (own_json, "", r"/world no definition \(json\)"),
    (pose_arrays, '[[topics]]\ntopic = "/boll"\nbody = "ball"\n', r"has no topic /boll, which the map names; it has /ball "),
    (silent, '[[topics]]\ntopic = "/chatter"\nbody = "ball"\n', r"no body with x and y.*Name the fields"),
    (silent, '[[topics]]\ntopic = "/lidar"\nbody = "ball"\n', r"/lidar sensor_msgs/LaserScan \(ros1 by ros1msg\) are not read.*rosbags-convert"),
    (silent, '[[topics]]\ntopic = "/camera"\nbody = "ball"\n', r"\(cdr by ros2idl\) are not read\. Record it with definitions in ros2msg"),
    (silent, '[[topics]]\ntopic = "/bad"\nbody = "ball"\n', r"the definition of /bad .* cannot be used"),
    (silent, '[[topics]]\ntopic = "/text"\nbody = "ball"\n', r"has no message on /text that can be read"),
    (pose_arrays, '[[topics]]\ntopic = "/ball"\nbody = "blue"\n', r"'blue' is neither a team and a player nor the ball 'ball'"),
])
def test_refusals(write: Callable[[Mcap, float, int], None], topics: str, says: str) -> None:
    """A recording that the map does not fit is refused in a line that says what is there."""
    with pytest.raises(PitchloreError, match=says) as error:
        read(recorded(write), "training.mcap", load_map(topics + (TEAMS if topics else "")))
    assert isinstance(error.value, BadRecording)
    assert str(error.value).startswith("training.mcap: ")
    assert "\n" not in str(error.value)


def test_entries() -> None:
    """An entry says one thing of its topic."""
    for entry in ('topic = "/a"', 'topic = "/a"\nbody = "ball"\nteam = "blue"', 'body = "ball"'):
        with pytest.raises(BadSettings):
            load_map(f"[[topics]]\n{entry}\n")


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the decoders are not installed, the refusal names the extra; JSON needs none."""
    monkeypatch.setitem(sys.modules, "mcap_ros2.decoder", None)
    write, topics = FORMS["PoseArray"]
    with pytest.raises(NotFound, match=r"mcap_ros2, which decodes /.*Install the extra pitchlore\[ros\]"):
        read(recorded(write), "training.mcap", load_map(topics + TEAMS))
    write, topics = FORMS["own json"]
    assert len(read(recorded(write), "training.mcap", load_map(topics + TEAMS)).frames) == F
