"""JSON logs of rcssserver, in the words of its text logs.

Source: rcssserver's ``serializermonitor.cpp`` and ``initsenderlogger.cpp``, tags 17.0.0 to 19.0.0
(``server::game_log_version`` is 6 in version 17, -1 from version 18 on). The array has one object a line: to
version 18 ``{"type": "show", …}``, from version 19 on ``{"show": {…}}``. ``std::quoted`` escapes quotes and
backslashes only, so that texts may have control characters.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from pitchlore.pipeline.base.errors import BadRecording

#: Counters in the order of a text log.
_COUNTERS = (
    "kick", "dash", "turn", "catch", "move", "turn_neck", "change_view", "say", "tackle", "pointto",
    "attentionto",
)
_PLACE = ("x", "y", "vx", "vy")
_BODY = (*_PLACE, "body", "neck")
_STAMINA = ("stamina", "effort", "recovery", "capacity")
_PARAMS = ("goal_width", "half_time", "simulator_step")
_DECODER = json.JSONDecoder(strict=False)
#: Most characters of an object (the server's have some thousands), and most objects that are damaged: of each
#: as much is looked at.
_LONGEST, _PLACES = 1 << 16, 1_000
#: Digits of a number: the server writes six.
_DIGITS = ".9g"
#: Line that is none of a text log: it is counted and skipped there.
_WRONG = "(wrong"


def text_lines(log: bytes, where: str) -> str:
    """Lines of a text log that say the same as a JSON log, as far as that is whole.

    Raises:
        BadRecording: if it is damaged at too many places.
    """
    lines, places = [], 0
    for value in _objects(log.decode("utf-8", "replace")):
        places += value is None
        if places > _PLACES:
            what = f"is damaged at more than {_PLACES} places"
            raise BadRecording(what, where=where, next_step="Copy it again")
        lines.append(_line(value))
    return "\n".join(filter(None, lines))


def timestamp_of(log: bytes) -> str | None:
    """The time at which the server was started, as its first objects tell it."""
    for value, _ in zip(_objects(log[:1 << 16].decode("utf-8", "replace")), range(8), strict=False):
        if isinstance(value, dict) and isinstance(value.get("timestamp"), str):
            return str(value["timestamp"])
    return None


def _objects(text: str) -> Iterator[Any]:
    """The objects of an array, however it is laid out; None in the place of one that cannot be parsed."""
    at, begin, part = text.find("{"), 0, ""
    while at >= 0:
        if at + _LONGEST > begin + len(part):
            begin, part = at, text[at:at + 2 * _LONGEST]
        try:
            value, end = _DECODER.raw_decode(part, at - begin)
        except (ValueError, RecursionError):
            yield None
            at = text.find("\n{", at + 1)  # the next line that begins an object
            at += at >= 0
            continue
        yield value
        at = text.find("{", begin + end)


def _line(value: Any) -> str:
    """The line of a text log for an object; empty for one that it has no use for."""
    try:
        kind, said = _unwrapped(value)
        if kind == "show":
            return _show(said)
        if kind == "playmode":
            return f"(playmode {said['time']} {said['mode']})"
        if kind == "team":
            return _team(said)
        if kind == "server_param":
            return f"(server_param {''.join(f'({name} {said[name]})' for name in _PARAMS if name in said)})"
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
        return _WRONG
    return ""


def _unwrapped(value: Mapping[str, Any]) -> tuple[str, Mapping[str, Any]]:
    """Kind and content of an object."""
    if "type" in value:
        return value["type"], value.get("params", value)
    return next(((kind, said) for kind, said in value.items() if isinstance(said, dict)), ("", value))


def _team(said: Mapping[str, Any]) -> str:
    """The line of names and score."""
    given = said.get("teams", (said.get("l"), said.get("r")))
    names = ['"' + (team["name"] or "null").replace('"', "'") + '"' for team in given]
    return f"(team {said['time']} {' '.join(names)} {' '.join(str(team['score']) for team in given)})"


def _show(said: Mapping[str, Any]) -> str:
    """The line of a cycle."""
    ball = said["ball"]
    players = "".join(map(_player, said["players"]))
    place = " ".join([format(ball[name], _DIGITS) for name in _PLACE])
    return f"(show {said['time']} ((b) {place}){players})"


def _player(said: Mapping[str, Any]) -> str:
    """The group of a player, without what is not read."""
    counts = said.get("count", said)
    counted = f" (c {' '.join(str(counts[name]) for name in _COUNTERS)})" if "kick" in counts else ""
    body = " ".join([format(said[name], _DIGITS) for name in _BODY])
    spent = " ".join([format(said[name], _DIGITS) for name in _STAMINA if name in said])
    counted = f" (s {spent}){counted}" if spent else counted
    return f" (({said['side']} {said['unum']}) {said['type']} {said['state']} {body}{counted})"
