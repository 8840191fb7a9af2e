"""The transition graph as a picture: behaviours on a ring, role by role, and what followed what as arrows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from pitchlore.pipeline.numbers.arrays import F64

#: Radius of the ring, of a node on it, and of the roles' names about it; half the width of the picture.
_RING, _NODE, _NAMES, _EDGE = 84.0, 9.0, 101.0, 107.0
#: Length of an arrow's head.
_HEAD = 5.0
#: Places left free on the ring between two roles.
_FREE = 0.7


class Node(NamedTuple):
    """A behaviour on the ring.

    Attributes:
        key: id of its panel in the page.
        label: text in it, two or three letters.
        role: nodes of one role are neighbours.
        says: description, in words.
    """

    key: str
    label: str
    role: str
    says: str


class Edge(NamedTuple):
    """An arrow from one node to another, or to itself.

    Attributes:
        start: place of the node in the list.
        end: place of the node that follows.
        share: share of the starts of the first, 0 to 1.
        says: the numbers, in words.
    """

    start: int
    end: int
    share: float
    says: str


def ring(nodes: Sequence[Node], edges: Sequence[Edge], label: str) -> Markup:
    """The graph as SVG. The layout depends on the order of the nodes alone.

    Args:
        nodes: at least one; those of a role one after the other.
        edges: between these.
        label: description for readers of the page.
    """
    angles = _angles([node.role for node in nodes])
    places = _RING * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    parts = [Markup('<svg class="ring" role="group" aria-label="{}" viewBox="{:.4g} {:.4g} {:.4g} {:.4g}">')
             .format(label, -_EDGE, -_EDGE, 2 * _EDGE, 2 * _EDGE)]
    for role in dict.fromkeys(node.role for node in nodes):
        own = [angle for angle, node in zip(angles, nodes, strict=True) if node.role == role]
        parts.append(_name(role, float(np.mean(own))))
    parts += [_arrow(edge, nodes, places) for edge in sorted(edges, key=lambda each: each.share)]
    parts += [
        Markup('<a href="#{0}" data-place="{0}" aria-label="{1}"><circle cx="{2:.4g}" cy="{3:.4g}" r="{4}"/>'
               '<text x="{2:.4g}" y="{3:.4g}">{5}</text><title>{1}</title></a>').format(
            node.key, node.says, place[0], place[1], _NODE, node.label)
        for node, place in zip(nodes, places, strict=True)]
    return Markup("").join([*parts, Markup("</svg>")])


def _angles(roles: Sequence[str]) -> F64:
    """Where each node is on the ring, from the top clockwise, radians, with gaps between roles."""
    new = np.array([at > 0 and role != roles[at - 1] for at, role in enumerate(roles)])
    place = np.arange(len(roles)) + _FREE * np.cumsum(new)
    whole = len(roles) + _FREE * (new.sum() + 1)
    found: F64 = 2 * np.pi * (place + (1 + _FREE) / 2) / whole - np.pi / 2
    return found


def _name(role: str, angle: float) -> Markup:
    """A role's name, along the ring and never upside down."""
    turn = np.degrees(angle) + 90
    if np.sin(angle) > 0:
        turn += 180
    return Markup('<text class="role" transform="translate({:.4g} {:.4g}) rotate({:.4g})">{}</text>').format(
        _NAMES * np.cos(angle), _NAMES * np.sin(angle), turn, role)


def _arrow(edge: Edge, nodes: Sequence[Node], places: F64) -> Markup:
    """One arrow, as wide as its share, bent towards the middle; back and forth are apart."""
    start, end = places[edge.start], places[edge.end]
    if edge.start == edge.end:
        out, side = start / _RING, np.array([-start[1], start[0]]) / _RING
        start, end = start + _NODE * (0.5 * side - out), start - _NODE * (0.5 * side + out)
        bends = [start - 13 * out + 9 * side, end - 13 * out - 9 * side]
    else:
        across = np.array([start[1] - end[1], end[0] - start[0]])
        bend = 0.3 * (start + end) / 2 + 7 * across / np.hypot(*across)
        start, end = (place + _NODE * _unit(bend - place) for place in (start, end))
        bends = [bend]
    along = _unit(end - bends[-1])
    neck, side = end - _HEAD * along, np.array([-along[1], along[0]])
    wide = 0.5 + 4.5 * edge.share
    half = 1.6 + wide / 2
    path = f"M{_at(start)}{'Q' if len(bends) == 1 else 'C'}{' '.join(map(_at, [*bends, neck]))}"
    head = f"M{_at(end)}L{_at(neck + half * side)} {_at(neck - half * side)}Z"
    return Markup(
        '<g class="edge" data-from="{}" data-to="{}"><path class="line" d="{}" stroke-width="{:.3g}"/>'
        '<path class="head" d="{}"/><title>{}</title></g>').format(
            nodes[edge.start].key, nodes[edge.end].key, path, wide, head, edge.says)


def _at(point: F64) -> str:
    return f"{point[0]:.4g} {point[1]:.4g}"


def _unit(vector: F64) -> F64:
    found: F64 = vector / max(float(np.hypot(*vector)), 1e-9)
    return found
