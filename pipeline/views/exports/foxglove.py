"""A match for Foxglove: MCAP with its well-known schemas in JSON, which its panels draw as they are.

The 3D panel draws the pitch, the bodies with headings and numbers, and each robot's situation over it; the
Log panel lists situations and the referee's events. Names and fields are those of Foxglove's documentation of
``SceneUpdate``, ``FrameTransforms`` and ``Log``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from heapq import merge
from typing import Any

import polars as pl

from pitchlore.pipeline.game.pitch import SCALES
from pitchlore.pipeline.matches.json_log import JsonMessage, JsonTopic, json_log
from pitchlore.pipeline.views.exports.content import BALL, ExportedMatch
from pitchlore.pipeline.views.exports.drawing import COLOURS, outline

#: The frame of everything, and the topics.
PITCH = "pitch"
LINES, BODIES, DOING, FRAMES, LOG = "/pitch", "/bodies", "/situations", "/tf", "/log"
#: Samples of the bodies a second, at most.
HZ = 25.0
_INFO = 2


def _object(**fields: Any) -> dict[str, Any]:
    return {"type": "object", "properties": fields, "required": list(fields)}


def _list(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


_NUMBER, _TEXT, _FLAG, _WHOLE = ({"type": kind} for kind in ("number", "string", "boolean", "integer"))
_TIME = {**_object(sec=_WHOLE, nsec=_WHOLE), "title": "time"}
_SPAN = {**_object(sec=_WHOLE, nsec=_WHOLE), "title": "duration"}
_VECTOR = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_TURN = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object(position=_VECTOR, orientation=_TURN)
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
#: The primitives of an entity that are drawn here; the other kinds are always empty.
_DRAWN = {
    "arrows": _object(pose=_POSE, shaft_length=_NUMBER, shaft_diameter=_NUMBER, head_length=_NUMBER,
                      head_diameter=_NUMBER, color=_COLOUR),
    "spheres": _object(pose=_POSE, size=_VECTOR, color=_COLOUR),
    "cylinders": _object(pose=_POSE, size=_VECTOR, bottom_scale=_NUMBER, top_scale=_NUMBER, color=_COLOUR),
    "lines": _object(type=_WHOLE, pose=_POSE, thickness=_NUMBER, scale_invariant=_FLAG,
                     points=_list(_VECTOR), color=_COLOUR, colors=_list(_COLOUR), indices=_list(_WHOLE)),
    "texts": _object(pose=_POSE, billboard=_FLAG, font_size=_NUMBER, scale_invariant=_FLAG, color=_COLOUR,
                     text=_TEXT),
}
_EMPTY = ("cubes", "triangles", "models")
_ENTITY = _object(
    timestamp=_TIME, frame_id=_TEXT, id=_TEXT, lifetime=_SPAN, frame_locked=_FLAG,
    metadata=_list(_object(key=_TEXT, value=_TEXT)),
    **{name: _list(kind) for name, kind in _DRAWN.items()},
    **{name: _list({"type": "object"}) for name in _EMPTY},
)
#: Foxglove's schemas by name.
SCHEMAS: dict[str, dict[str, Any]] = {
    "foxglove.SceneUpdate": _object(
        deletions=_list(_object(timestamp=_TIME, type=_WHOLE, id=_TEXT)), entities=_list(_ENTITY)),
    "foxglove.FrameTransforms": _object(transforms=_list(_object(
        timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_VECTOR, rotation=_TURN))),
    "foxglove.Log": _object(
        timestamp=_TIME, level=_WHOLE, message=_TEXT, name=_TEXT, file=_TEXT, line=_WHOLE),
}
_SCHEMA_OF = {
    LINES: "foxglove.SceneUpdate", BODIES: "foxglove.SceneUpdate", DOING: "foxglove.SceneUpdate",
    FRAMES: "foxglove.FrameTransforms", LOG: "foxglove.Log",
}


def recording(content: ExportedMatch) -> bytes:
    """The match as MCAP; bodies at ``HZ`` at most, times from the first sample."""
    topics = [
        JsonTopic(topic, schema, {"title": schema, **SCHEMAS[schema]})
        for topic, schema in _SCHEMA_OF.items()
    ]
    info = content.log.info
    about = {"match_id": info.match_id, "home": info.home, "away": info.away, "source": info.source}
    streams = (_pitch(content), _bodies(content), _situations(content), _referee(content))
    return json_log(topics, merge(*streams, key=lambda message: message.t_ns), about)


def _time(t_ns: int) -> dict[str, int]:
    return {"sec": t_ns // 1_000_000_000, "nsec": t_ns % 1_000_000_000}


def _vector(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": round(x, 4), "y": round(y, 4), "z": round(z, 4)}


def _turn(angle: float) -> dict[str, float]:
    """Quaternion of a turn about the vertical axis; none where the angle is not known."""
    half = 0.0 if math.isnan(angle) else angle / 2
    return {"x": 0.0, "y": 0.0, "z": round(math.sin(half), 5), "w": round(math.cos(half), 5)}


def _pose(x: float, y: float, z: float, angle: float = 0.0) -> dict[str, Any]:
    return {"position": _vector(x, y, z), "orientation": _turn(angle)}


def _colour(name: str) -> dict[str, float]:
    r, g, b = COLOURS[name]
    return {"r": r / 255, "g": g / 255, "b": b / 255, "a": 1.0}


def _entity(name: str, t_ns: int, **primitives: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "timestamp": _time(t_ns), "frame_id": PITCH, "id": name, "lifetime": _time(0), "frame_locked": True,
        "metadata": [], **{kind: primitives.get(kind, []) for kind in (*_DRAWN, *_EMPTY)},
    }


def _scene(
    topic: str, t_ns: int, entities: list[dict[str, Any]], gone: list[str] | None = None
) -> JsonMessage:
    deletions = [{"timestamp": _time(t_ns), "type": 0, "id": name} for name in gone or []]
    return JsonMessage(topic, t_ns, {"deletions": deletions, "entities": entities})


def _pitch(content: ExportedMatch) -> Iterator[JsonMessage]:
    """The lines of the pitch, once."""
    pitch = content.log.info.pitch
    lines = [
        {
            "type": 0, "pose": _pose(0, 0, 0), "thickness": max(0.002 * pitch.length, 0.004),
            "scale_invariant": False, "points": [_vector(x, y, 0.0) for x, y in line],
            "color": _colour("chalk"), "colors": [], "indices": [],
        }
        for line in outline(pitch)
    ]
    yield _scene(LINES, 0, [_entity("lines", 0, lines=lines)])


def _bodies(content: ExportedMatch) -> Iterator[JsonMessage]:
    """Bodies and their frames, sample by sample; a body that is not seen is taken away."""
    scales = SCALES[content.log.info.pitch.kind]
    high, wide = 2 * scales.robot_radius, 2 * scales.robot_radius
    shown: set[str] = set()
    for t_ns, rows in _thinned(content.bodies().drop_nulls(["x", "y"])):
        entities, frames, now = [], [], set()
        for row in rows:
            x, y, angle = row["x"], row["y"], float("nan") if row["heading"] is None else row["heading"]
            ball = row["team"] == BALL
            name = BALL if ball else f"{row['team']}-{row['player']}"
            now.add(name)
            if ball:
                z = scales.ball_radius + (row["z"] or 0.0)
                size = _vector(*(2 * max(scales.ball_radius, 0.2 * scales.robot_radius),) * 3)
                parts: dict[str, list[dict[str, Any]]] = {
                    "spheres": [{"pose": _pose(x, y, z), "size": size, "color": _colour(BALL)}]}
            else:
                z = high / 2
                parts = {
                    "cylinders": [{
                        "pose": _pose(x, y, z), "size": _vector(wide, wide, high), "bottom_scale": 1.0,
                        "top_scale": 1.0, "color": _colour(row["team"]),
                    }],
                    "texts": [_text(x, y, 1.2 * high, str(row["player"]), wide)],
                }
                if not math.isnan(angle):
                    parts["arrows"] = [{
                        "pose": _pose(x, y, high, angle), "shaft_length": 0.8 * wide,
                        "shaft_diameter": 0.12 * wide, "head_length": 0.3 * wide,
                        "head_diameter": 0.3 * wide, "color": _colour("chalk"),
                    }]
            entities.append(_entity(name, t_ns, **parts))
            frames.append({
                "timestamp": _time(t_ns), "parent_frame_id": PITCH, "child_frame_id": name,
                "translation": _vector(x, y, z), "rotation": _turn(angle),
            })
        yield _scene(BODIES, t_ns, entities, sorted(shown - now))
        yield JsonMessage(FRAMES, t_ns, {"transforms": frames})
        shown = now


def _text(x: float, y: float, z: float, text: str, size: float) -> dict[str, Any]:
    return {
        "pose": _pose(x, y, z), "billboard": True, "font_size": round(size, 4), "scale_invariant": False,
        "color": _colour("chalk"), "text": text,
    }


def _thinned(bodies: pl.DataFrame) -> Iterator[tuple[int, list[dict[str, Any]]]]:
    """Time and rows of the samples that are shown, at least 1 / ``HZ`` apart."""
    next_ns = -1
    for (t_ns,), rows in bodies.group_by("t_ns", maintain_order=True):
        assert isinstance(t_ns, int)
        if t_ns >= next_ns:
            yield t_ns, rows.to_dicts()
            next_ns = t_ns + int(0.98e9 / HZ)


def _situations(content: ExportedMatch) -> Iterator[JsonMessage]:
    """Situation of each robot, over it and in the log: a text from its start to its end."""
    scales = SCALES[content.log.info.pitch.kind]
    rows = content.match.situations.sort("start_ns", "team", "robot")
    changes = [(row["start_ns"], 1, row) for row in rows.to_dicts()]
    changes += [(row["end_ns"], 0, row) for row in rows.to_dicts()]
    doing: dict[str, str] = {}
    for t_ns, begins, row in sorted(changes, key=lambda change: (change[0], change[1], change[2]["robot"])):
        name, label = f"{row['team']}-{row['robot']}", f"{row['code']:03d} {row['name']}"
        if begins:
            doing[name] = label
            text = _text(0, 0, 3.4 * scales.robot_radius, label, scales.robot_radius)
            entity = {**_entity(name, t_ns, texts=[text]), "frame_id": name}
            yield _scene(DOING, t_ns, [entity])
            yield JsonMessage(LOG, t_ns, _line(t_ns, label, name))
        elif doing.get(name) == label:
            del doing[name]
            yield _scene(DOING, t_ns, [], [name])


def _line(t_ns: int, message: str, name: str) -> dict[str, Any]:
    return {"timestamp": _time(t_ns), "level": _INFO, "message": message, "name": name, "file": "", "line": 0}


def _referee(content: ExportedMatch) -> Iterator[JsonMessage]:
    """The referee's events in the log."""
    for row in content.log.referee.sort("t_ns", maintain_order=True).iter_rows(named=True):
        words = [row["event"], row["team"] or ""]
        if None not in (row["score_home"], row["score_away"]):
            words.append(f"{row['score_home']} : {row['score_away']}")
        yield JsonMessage(LOG, row["t_ns"], _line(row["t_ns"], " ".join(filter(None, words)), "referee"))
