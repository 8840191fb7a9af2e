"""States of the match in sentences and in pictures: what an encoded state says, and nothing finer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, pi, radians, sin
from typing import Any

import numpy as np
from markupsafe import Markup

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.state import BinEdges
from pitchlore.pipeline.views.scout.pictures import on_pitch
from pitchlore.schemas import ROLES

#: Rows of the raster that a zone of the ball is drawn on.
_ROWS = 60
#: Radii in the picture of what is around the ball, in its own units: too close, near, far.
_RINGS = {"too close": (0.0, 26.0), "near": (26.0, 46.0), "far": (46.0, 66.0)}
_SIDES = {"own": "our", "adversary's": "their"}
_LETTERS = {"goalkeeper": "G", "midfield": "M", "striker": "S"}
_DIRECTIONS = (
    "ahead", "ahead to the left", "to the left", "back to the left", "back", "back to the right",
    "to the right", "ahead to the right",
)
_DISTANCES = {"too close": "is at the ball", "near": "is near the ball", "far": "is far from the ball"}
_SPEEDS = {"slow": "slow", "medium": "at medium speed", "fast": "fast"}
_SCORES = {"losing": "We trail.", "drawing": "It is level.", "winning": "We lead."}
_PLAY = {"normal": "Play is on.", "fault": "Play is stopped.", "goal": "Play is stopped after a goal."}
_ORIENTED = {"front": "faces it", "side": "has it at its side", "back": "has it behind",
             "side or back": "does not face it"}


def sentences(state: Mapping[str, str], role: str) -> list[str]:
    """A state in sentences: the ball, each robot that the key keeps something of, score and play.

    Args:
        state: name of each element to its level (:func:`pipeline.state.words.levels_in_words`).
        role: role of the robot that decides; it is named first.
    """
    ours = [role, *(other for other in ROLES if other != role)]
    robots = [*(("own", own) for own in ours), *(("adversary's", other) for other in ROLES)]
    found = [said for said in (_ball(state), *(
        _robot(state, side, each, decides=(side, each) == ("own", role)) for side, each in robots)) if said]
    for name, words in (("score", _SCORES), ("game situation", _PLAY)):
        if name in state:
            found.append(words[state[name]])
    return found or ["Any state: the key keeps nothing of it."]


def _ball(state: Mapping[str, str]) -> str:
    parts = []
    near = [f"{_to_goal(level)} {whose} goal" for side, whose in _SIDES.items()
            if (level := state.get(f"distance of ball to {side} goal")) is not None]
    if near:
        parts.append("is " + " and ".join(near))
    if (speed := state.get("ball velocity")) is not None:
        parts.append(f"is {_SPEEDS[speed]}")
    if (direction := state.get("ball direction")) is not None:
        ahead = _DIRECTIONS[int(direction.split()[0]) // 45]
        parts.append(f"last moved {ahead}" + (", or has not moved yet" if ahead == "ahead" else ""))
    return f"The ball {', '.join(parts)}." if parts else ""


def _to_goal(level: str) -> str:
    return "far from" if level == "far" else f"{level} to"


def _robot(state: Mapping[str, str], side: str, role: str, *, decides: bool) -> str:
    """Words of a state for one robot; empty if it says nothing."""
    slot, parts = f"{side} {role}", list[str]()
    if (distance := state.get(f"distance of {slot} to ball")) is not None:
        parts.append(_DISTANCES[distance])
    if (place := state.get(f"{slot} in relation to ball and its own goal")) is not None:
        parts.append("is goal-side of it" if place == "before" else "is beyond it")
    if (oriented := state.get(f"orientation of {slot} to ball")) is not None:
        parts.append(_ORIENTED[oriented])
    goals = {goal: state.get(f"orientation of {slot} to {goal} goal")
             for goal in ("its own", "its adversary's")}
    parts += [f"points at {goal} goal" for goal, level in goals.items() if level == "pointing"]
    if not parts and all(level is None for level in goals.values()):
        return ""
    who = f"{_SIDES[side].capitalize()} {role}{' (decides)' if decides else ''}"
    return f"{who} {', '.join(parts) or 'points at no goal'}."


def zone(state: Mapping[str, str], pitch: Pitch) -> Markup | None:
    """Where the ball may be, on the pitch; None if the state says nothing of it.

    The team attacks to the right. The zone is what the two distances to the goals leave of the pitch, on a
    raster of 60 rows.
    """
    levels = [state.get(f"distance of ball to {goal} goal") for goal in _SIDES]
    if None in levels:
        return None
    return on_pitch(pitch, "the zone in which the ball is", under=shaded(pitch, levels, 0.75))


def shaded(pitch: Pitch, levels: list[str | None], opacity: float, says: str = "") -> Markup:
    """The zone of the ball with some levels of its distance to our goal and to theirs, as a path."""
    edges = BinEdges.of(pitch)
    high = pitch.width / _ROWS
    columns = round(pitch.length / high)
    wide = pitch.length / columns
    x = -pitch.length / 2 + wide * (np.arange(columns) + 0.5)
    y = -pitch.width / 2 + high * (np.arange(_ROWS) + 0.5)
    inside = np.ones((_ROWS, columns), dtype=bool)
    for goal, level in zip((-1, 1), levels, strict=True):
        distance = np.hypot(x[None] - goal * pitch.goal_x, y[:, None])
        low, top = {"very close": (-1.0, edges.very_close), "close": (edges.very_close, edges.close),
                    "far": (edges.close, np.inf)}[str(level)]
        inside &= (distance > low) & (distance <= top)
    runs = []
    for row in range(_ROWS):
        steps = np.flatnonzero(np.diff(np.concatenate(([0], inside[row].astype(np.int8), [0]))))
        for first, last in steps.reshape(-1, 2).tolist():
            runs.append(f"M{first * wide - pitch.length / 2:.3f} {row * high - pitch.width / 2:.3f}"
                        f"h{(last - first) * wide:.3f}v{high:.3f}h{(first - last) * wide:.3f}z")
    return Markup('<path class="zone" opacity="{:.2f}" d="{}"><title>{}</title></path>').format(
        opacity, "".join(runs), says or "the ball is here") + (
        _spot(pitch, opacity, says) if is_spot(levels) else Markup(""))


def is_spot(levels: Sequence[str | None]) -> bool:
    """True if a zone is the centre spot: close is half the pitch, so only that is close to both goals."""
    return list(levels) == ["close", "close"]


def _spot(pitch: Pitch, opacity: float, says: str) -> Markup:
    """The zone that is a point, as a dot with a ring."""
    shape = Markup('<g class="zone spot"><circle r="{:.4g}" opacity="{:.2f}"/>'
                   '<circle class="rim" r="{:.4g}"/><title>{}</title></g>')
    return shape.format(0.018 * pitch.length, opacity, 0.03 * pitch.length, says or "the ball is here")


def around_ball(state: Mapping[str, str], role: str, pitch: Pitch) -> Markup | None:
    """Robots around the ball, as areas: a ring is a distance, a half the side of the ball.

    The ball is in the middle, the team attacks to the right. It is no map: rings have one width each. None if
    the state says nothing of distances.
    """
    areas: dict[tuple[str, int], list[tuple[str, str]]] = {}
    for side in _SIDES:
        for own in ROLES:
            distance = state.get(f"distance of {side} {own} to ball")
            place = state.get(f"{side} {own} in relation to ball and its own goal")
            if distance is not None and place is not None:
                half = (1 if place == "after" else -1) * (1 if side == "own" else -1)
                team = "home" if side == "own" else "away"
                areas.setdefault((distance, half), []).append((team, _LETTERS[own]))
    if not areas:
        return None
    mine = (state.get(f"distance of own {role} to ball"),
            1 if state.get(f"own {role} in relation to ball and its own goal") == "after" else -1)
    parts = [Markup('<svg class="pitch around" role="img" aria-label="robots around the ball" '
                    'viewBox="-75 -75 150 150" style="--unit:1">')]
    for (name, (inner, outer)) in _RINGS.items():
        for half in (-1, 1):
            style = "area mine" if mine == (name, half) else "area"
            parts.append(Markup('<path class="{}" d="{}"/>').format(style, _half_ring(inner, outer, half)))
    parts.append(Markup('<path class="chalk" d="M0 -66V66"/>'))
    if "ball direction" in state:
        parts.append(_course(float(state["ball direction"].split()[0])))
    parts.append(Markup('<circle class="ball" r="3"/>'))
    edges = BinEdges.of(pitch)
    for at, says in ((26, f"{edges.too_close:.2g} m"), (46, f"{edges.near:.2g} m")):
        parts.append(Markup('<text class="scale" x="0" y="{}">{}</text>').format(at + 4, says))
    parts += [_letters(area, robots) for area, robots in sorted(areas.items())]
    return Markup("").join([*parts, Markup("</svg>")])


def _half_ring(inner: float, outer: float, half: int) -> str:
    """The half of a ring to the right (1) or the left (-1), as a path."""
    sweep = 1 if half > 0 else 0
    back = f"L0 {inner}A{inner} {inner} 0 0 {1 - sweep} 0 {-inner}" if inner else ""
    return f"M0 {-outer}A{outer} {outer} 0 0 {sweep} 0 {outer}{back}z"


def _course(degrees: float) -> Markup:
    """The eighth of the circle into which the ball last moved, at the rim."""
    corners = [(radius * cos(radians(angle)), -radius * sin(radians(angle)))
               for radius, angle in ((68, degrees - 22.5), (68, degrees + 22.5), (74, degrees + 22.5),
                                     (74, degrees - 22.5))]
    (a, b), (c, d), (e, f), (g, h) = corners
    return Markup('<path class="course" d="M{:.1f} {:.1f}A68 68 0 0 0 {:.1f} {:.1f}L{:.1f} {:.1f}'
                  'A74 74 0 0 1 {:.1f} {:.1f}z"><title>the ball last moved this way</title></path>').format(
                      a, b, c, d, e, f, g, h)


def _letters(area: tuple[str, int], robots: list[tuple[str, str]]) -> Markup:
    """The robots of an area, spread over it: they are somewhere in it."""
    (name, half) = area
    inner, outer = _RINGS[name]
    radius = 17.0 if inner == 0 else (inner + outer) / 2
    step = min(pi / (len(robots) + 1), 14 / radius)
    parts = []
    for place, (team, letter) in enumerate(robots):
        angle = (place - (len(robots) - 1) / 2) * step
        parts.append(Markup('<text class="{}" x="{:.1f}" y="{:.1f}">{}</text>').format(
            team, half * radius * cos(angle), radius * sin(angle), letter))
    return Markup("").join(parts)


def facts_of(state: Mapping[str, str], role: str, pitch: Pitch) -> dict[str, Any]:
    """A state as a page shows it: sentences, the ball's zone, and who is around the ball."""
    levels = [state.get(f"distance of ball to {goal} goal") for goal in _SIDES]
    return {"sentences": sentences(state, role), "zone": zone(state, pitch), "spot": is_spot(levels),
            "around": around_ball(state, role, pitch)}
