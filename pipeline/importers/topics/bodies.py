"""Bodies in a decoded message: where they are, whose they are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, degrees, nan
from typing import Any, NamedTuple

from pitchlore.pipeline.importers.topics.settings import TopicMap

#: Parents of a body's x and y, from an item down, and beside each the parents of its orientation.
PLACES = {
    "": "", "position.": "", "point.": "", "pose.": "pose.", "pose.position.": "pose.",
    "pose.pose.position.": "pose.pose.", "transform.translation.": "transform.", "translation.": "",
}
#: Names of a quaternion, and of a heading.
_QUATERNIONS = ("orientation", "rotation")
_HEADINGS = ("theta", "heading", "yaw", "orientation", "angle")
_CHILD = "child_frame_id"


class SeenBody(NamedTuple):
    """One body in one message; what is not known is NaN. ``heading`` is in the map's unit."""

    team: str
    player: str | None
    x: float
    y: float
    heading: float
    vx: float
    vy: float
    omega: float


class BodyFinder:
    """Finds the bodies in the messages of one topic.

    Args:
        topic: the topic's entry in the map.
        ball: the ball's name.
        in_degrees: whether headings are degrees in the map.

    Attributes:
        fields: paths that were found and not given, for the match's settings.
        lost: number of items that the map names no body for.
    """

    def __init__(self, topic: TopicMap, ball: str, *, in_degrees: bool) -> None:
        self._topic, self._ball, self._degrees = topic, ball, in_degrees
        self.fields: dict[str, str] = {}
        self.lost = 0

    def bodies(self, message: Any) -> Iterator[SeenBody]:
        """The bodies of a message."""
        topic, fields = self._topic, self._topic.columns
        for place, item in enumerate(self._items(message)):
            whose = self._whose(item, place)
            if whose is None:
                self.lost += not topic.body  # the items after the first are not asked for
                continue
            x, y = (self._number(item, name) for name in ("x", "y"))
            heading = self._number(item, "heading") if fields.heading or not fields.orientation else nan
            if heading != heading:
                heading = self._turn(item)
            speeds = (self._number(item, name) for name in ("vx", "vy", "omega"))
            yield SeenBody(*whose, x, y, heading, *speeds)

    def _items(self, message: Any) -> Sequence[Any]:
        """The message itself, or the items of its list."""
        each = self._topic.each or self.fields.get("each")
        if each is None:
            if self._has_place(message):
                return [message]
            lists = (name for name in names_of(message) if _is_list(value_at(message, name)))
            each = next((name for name in lists if self._items_have_places(value_at(message, name))), None)
            if each is None:
                return []
            self.fields["each"] = each
        items = value_at(message, each)
        return items if _is_list(items) and self._items_have_places(items) else []

    def _items_have_places(self, items: Sequence[Any]) -> bool:
        """True if one of the items has a place; where they have it is kept."""
        return any(map(self._has_place, items))

    def _has_place(self, item: Any) -> bool:
        """True if an item has a place; where it has it is kept."""
        path = self._topic.columns.x or self.fields.get("x")
        if path is not None:
            return number_at(item, path) is not None
        for parent, turn in PLACES.items():
            if all(number_at(item, parent + axis) is not None for axis in "xy"):
                self.fields |= {"x": f"{parent}x", "y": f"{parent}y"}
                for name in _HEADINGS:
                    if number_at(item, turn + name) is not None:
                        self.fields.setdefault("heading", turn + name)
                for name in _QUATERNIONS:
                    if number_at(item, f"{turn}{name}.w") is not None:
                        self.fields.setdefault("orientation", turn + name)
                return True
        return False

    def _whose(self, item: Any, place: int) -> tuple[str, str | None] | None:
        """Team and player of an item; None if the map does not name it."""
        topic, fields = self._topic, self._topic.columns
        if topic.body:
            return self._named(topic.body) if place == 0 else None
        if topic.bodies:
            return self._named(topic.bodies[place]) if place < len(topic.bodies) else None
        if topic.frames:
            name = topic.frames.get(str(value_at(item, fields.player or _CHILD)))
            return None if name is None else self._named(name)
        team = topic.team or (value_at(item, fields.team) if fields.team else None)
        player = value_at(item, fields.player) if fields.player else place
        if team is None or (player is None and str(team) != self._ball):
            return None
        return str(team), None if str(team) == self._ball else str(player)

    def _named(self, body: str) -> tuple[str, str | None]:
        """Team and player of a body's name in the map."""
        if body == self._ball:
            return body, None
        team, _, player = body.rpartition(" ")
        return team, player

    def _number(self, item: Any, name: str) -> float:
        path = getattr(self._topic.columns, name) or self.fields.get(name)
        value = None if path is None else number_at(item, path)
        return nan if value is None else value

    def _turn(self, item: Any) -> float:
        """Heading of a quaternion; NaN if there is none, or if it is all zeros."""
        path = self._topic.columns.orientation or self.fields.get("orientation")
        if path is None:
            return nan
        x, y, z, w = (number_at(item, f"{path}.{name}") or 0.0 for name in "xyzw")
        if x == y == z == w == 0.0:
            return nan
        yaw = atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return degrees(yaw) if self._degrees else yaw


def value_at(value: Any, path: str) -> Any:
    """The value at a path of names and places, such as ``robots.0.pose``; None if it is not there."""
    for part in path.split("."):
        if isinstance(value, dict):
            value = value.get(part)
        elif _is_list(value):
            value = value[int(part)] if part.isdigit() and int(part) < len(value) else None
        elif hasattr(value, "DESCRIPTOR"):
            field = value.DESCRIPTOR.fields_by_name.get(part)
            absent = field is None or (field.has_presence and not value.HasField(part))
            value = None if absent else getattr(value, part)
        else:
            value = getattr(value, part, None)
        if value is None:
            return None
    return value


def number_at(value: Any, path: str) -> float | None:
    """The number at a path; None if there is none."""
    found = value_at(value, path)
    if isinstance(found, bool) or not isinstance(found, (int, float)):
        return None
    try:
        return float(found)
    except OverflowError:  # JSON has whole numbers of any size
        return None


def names_of(value: Any) -> list[str]:
    """Names of a message's fields."""
    if isinstance(value, dict):
        return list(value)
    if hasattr(value, "DESCRIPTOR"):
        return [field.name for field in value.DESCRIPTOR.fields]
    return [*getattr(value, "__slots__", ()), *getattr(value, "__dict__", ())]


def _is_list(value: Any) -> bool:
    """True for lists, arrays, and protobuf's repeated fields."""
    return not isinstance(value, (str, bytes, dict)) and hasattr(value, "__getitem__")
