"""Recordings of other programs' topics: messages of ROS 2, JSON and protobuf in MCAP, as rosbag2 and Foxglove write."""

import io
import json
from collections.abc import Callable, Iterable
from typing import Any

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2._dynamic import serialize_dynamic

#: Definitions of ROS 2 (ros2/common_interfaces, ros2/geometry2), without their comments.
PARTS = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/Pose2D": "float64 x\nfloat64 y\nfloat64 theta",
    "geometry_msgs/PoseArray": "std_msgs/Header header\ngeometry_msgs/Pose[] poses",
    "geometry_msgs/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose",
    "geometry_msgs/PointStamped": "std_msgs/Header header\ngeometry_msgs/Point point",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "nav_msgs/Odometry": "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped": "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "std_msgs/String": "string data",
    "team_msgs/Score": "int32 home\nint32 away",
}


def definition(kind: str) -> str:
    """A definition with all that it refers to, as rosbag2 writes it."""
    needed = [kind]
    for name in needed:
        needed += [part for part in PARTS if part not in needed and part in PARTS[name].replace("[]", "")]
    return ("\n" + "=" * 80 + "\n").join(
        PARTS[name] if name == kind else f"MSG: {name}\n{PARTS[name]}" for name in needed)


class Mcap:
    """A recording that grows by messages of any topic."""

    def __init__(self, library: str = "rosbag2_storage_mcap", **options: Any) -> None:
        self._out = io.BytesIO()
        self._writer = Writer(self._out, compression=CompressionType.ZSTD, **options)
        self._writer.start("ros2", library=library)
        self._channels: dict[str, tuple[int, Callable[[Any], bytes]]] = {}

    def ros(self, topic: str, kind: str, t_ns: int, message: Any, sequence: int = 0) -> None:
        """A message of ROS 2 in CDR."""
        if topic not in self._channels:
            package, name = kind.split("/")
            full = f"{package}/msg/{name}"
            schema = self._writer.register_schema(full, "ros2msg", definition(kind).encode())
            channel = self._writer.register_channel(topic, "cdr", schema)
            self._channels[topic] = channel, serialize_dynamic(full, definition(kind))[full]
        channel, encode = self._channels[topic]
        self._writer.add_message(channel, t_ns, encode(message), t_ns, sequence)

    def other(self, topic: str, encoding: str, schema: tuple[str, str, bytes] | None, t_ns: int, data: Any) -> None:
        """A message of another encoding; ``data`` is JSON if it is not bytes."""
        if topic not in self._channels:
            number = 0 if schema is None else self._writer.register_schema(*schema)
            self._channels[topic] = self._writer.register_channel(topic, encoding, number), bytes
        payload = data if isinstance(data, bytes) else json.dumps(data).encode()
        self._writer.add_message(self._channels[topic][0], t_ns, payload, t_ns)

    def bytes(self) -> bytes:
        """The whole file."""
        self._writer.finish()
        return self._out.getvalue()


def rewritten(
    data: bytes, change: Callable[[list[tuple[str, int, int, bytes]]], Iterable[tuple[str, int, int, bytes]]] = list,
    *, channels: int = 1, library: str = "mcap-cli",
) -> bytes:
    """A log as another program writes it, without our metadata.

    Args:
        data: the log.
        change: topic, sequence number, time and payload of its messages, to those that are written.
        channels: channels that each topic is spread over, message by message.
        library: the program.
    """
    reader = make_reader(io.BytesIO(data))
    schemas = {channel.topic: schema for schema, channel, _ in reader.iter_messages()}
    messages = [(channel.topic, message.sequence, message.log_time, message.data)
                for _, channel, message in reader.iter_messages(log_time_order=False)]
    out = io.BytesIO()
    writer = Writer(out, chunk_size=20_000)
    writer.start("", library=library)
    ids = {topic: [writer.register_channel(topic, "cdr", writer.register_schema(schema.name, schema.encoding, schema.data), {"n": str(n)})
                   for n in range(channels)] for topic, schema in schemas.items()}
    for place, (topic, sequence, t_ns, payload) in enumerate(change(messages)):
        writer.add_message(ids[topic][place % channels], t_ns, payload, t_ns, sequence)
    writer.finish()
    return out.getvalue()
