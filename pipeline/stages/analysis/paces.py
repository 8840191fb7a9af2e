"""Paces of a league: how fast is fast, and how long a moment lasts."""

from __future__ import annotations

from pitchlore.pipeline.game.pitch import SCALES, Kind, Pitch

#: Least speeds of people who run fast, and who sprint, m/s: football's usual 19.8 and 25.2 km/h.
_PEOPLE = (5.5, 7.0)
#: Those of robots, as shares of the top cruising speed of their league; that of VSSS is 1.2 m/s.
_ROBOTS, _CRUISING = (0.6, 0.9), 1.2


def paces(kind: Kind) -> tuple[float, float]:
    """Least speeds of running fast and of sprinting in a league, m/s."""
    fast, sprint = (share * _CRUISING * SCALES[kind].speed for share in _ROBOTS)
    return _PEOPLE if kind is Kind.HUMAN else (fast, sprint)


def crossings_ns(pitch: Pitch, crossings: float) -> int:
    """A time in crossings, ns: one is a run along the pitch at the league's top cruising speed."""
    return round(crossings * pitch.length / (_CRUISING * SCALES[pitch.kind].speed) * 1e9)
