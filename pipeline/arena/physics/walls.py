"""Walls of a pitch, goals with sides and a back, and cut corners, as convex polygons."""

from __future__ import annotations

from pitchlore.pipeline.game.pitch import MARKINGS, Pitch

Polygon = list[tuple[float, float]]


def walls(pitch: Pitch) -> list[Polygon]:
    """The solid parts around the pitch, corners counter-clockwise, metres.

    They are a third of the pitch's length thick, so no body passes through one.
    Blocks beside each goal end at its posts, so the goal has sides; a block closes it ``goal_depth``
    behind the line.
    """
    end, side, post = pitch.goal_x, pitch.width / 2, pitch.goal_width / 2
    net = end + pitch.goal_depth
    thick = pitch.length / 3
    solid = [
        _box(-net - thick, side, net + thick, side + thick),
        _box(end, post, net + thick, side),
        _box(net, -post, net + thick, post),
        _box(-net - thick, post, -end, side),
    ]
    if corner := MARKINGS[pitch.kind].corner:
        solid += [
            [(end, side), (end - corner, side), (end, side - corner)],
            [(-end, side), (-end, side - corner), (-end + corner, side)],
        ]
    return solid + [_turned(polygon) for polygon in solid]


def _box(left: float, low: float, right: float, high: float) -> Polygon:
    return [(left, low), (right, low), (right, high), (left, high)]


def _turned(polygon: Polygon) -> Polygon:
    """The same shapes after half a turn about the centre: both teams meet equal walls."""
    return [(-x, -y) for x, y in polygon]
