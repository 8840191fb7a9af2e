"""Units and origin of a table's places: as a map says, else recognised, else refused with a map's lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.quality import Flaw

#: Metres of each unit of length, ...
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
#: ... and how much of each unit a whole pitch is.
WHOLE = {"share": 1.0, "percent": 100.0, "half": 2.0}
#: Pitches whose bodies tell the unit by how far they reach, metres.
_PITCHES = ((1.5, 1.3), (2.2, 1.8), (9.0, 6.0), (12.0, 9.0), (105.0, 68.0))
#: Bodies reach so much of a pitch at least, and at most, along and across.
_LEAST, _MOST = 0.9, 1.15
#: Places that reach so far across, as a share of how far they reach along, are parts of a pitch: none is so
#: wide.
_SQUARE = 0.88
#: Share of places that may be elsewhere, and part of the reach that places may be beyond an axis.
_STRAY, _BEYOND = 0.001, 0.03
#: Bodies that reach so far along, metres, may be on a pitch of 2.2 m, or at shares from -1 to 1 of another.
_AS_SHARES = (0.87, 1.03)
#: Bodies that reach further than so many lengths of the largest pitch are in another unit.
_LARGEST = 1.1
#: Rows that are looked at, evenly over the table.
_LOOK = 50_000
#: Larger places are damage.
_NUMBERS = 1e6
#: Samples from which on a match that is in one quarter is refused.
_TELLING = 100
_SPOKEN = (
    '[units] length = "share" (or "percent", or "half" from -1 to 1) and [pitch] kind = "human" or another')


class Lengths(NamedTuple):
    """How a table's places become metres.

    Attributes:
        metres: metres of a unit along and across.
        centre: file's place of the pitch's centre, where a map gives it; else (0, 0).
        corner: whether places are counted from the corner where x and y are smallest.
        flaws: a note if that was found from the places.
    """

    metres: tuple[float, float]
    centre: tuple[float, float]
    corner: bool
    flaws: list[Flaw]


class _Reach(NamedTuple):
    """Least and greatest x and y, but for strays."""

    low_x: float
    high_x: float
    low_y: float
    high_y: float

    def __str__(self) -> str:
        return f"x from {self.low_x:.4g} to {self.high_x:.4g}, y from {self.low_y:.4g} to {self.high_y:.4g}"


def lengths_of(table: pl.DataFrame, mapping: TrackingMap, name: str) -> Lengths:
    """Units and origin of a table's places.

    A map's are taken. Without them, places are metres from the centre, unless all bodies are in one quarter
    of the axes, or further out than on any pitch: then they are those of the one league and unit whose pitch
    they fill.

    Args:
        table: ``x``, ``y`` Float64 in the file's units, ``t_ns``.
        mapping: the map.
        name: the file's name, for messages.

    Raises:
        BadRecording: if places are shares of a pitch that nobody names; or if all bodies are in one quarter,
            or reach as far across as along, and nothing tells more.
    """
    unit, axes = mapping.units.length, mapping.axes
    centre = axes.centre or (0.0, 0.0)
    told = bool({"origin", "centre"} & axes.model_fields_set)
    if mapping.units.metres is not None:
        return Lengths(mapping.units.metres, centre, axes.origin == "corner", [])
    if unit in WHOLE:
        if mapping.pitch.kind is None:
            raise BadRecording("has places that the map calls shares of a pitch", where=name,
                               next_step='Say whose in the map: [pitch] kind = "human" (or vsss, ssl, 2d)')
        usual = PITCHES[mapping.pitch.kind]
        length, width = mapping.pitch.length or usual.length, mapping.pitch.width or usual.width
        corner = axes.origin == "corner" if told else unit != "half"
        return Lengths((length / WHOLE[unit], width / WHOLE[unit]), centre, corner, [])
    metres = METRES[unit]
    reach = None if told else _reach(table)
    if reach is None:
        return Lengths((metres, metres), centre, axes.origin == "corner", [])
    given = metres if "length" in mapping.units.model_fields_set else None
    found, corner, flaws = _found(reach, given, mapping, table["t_ns"], name)
    return Lengths((found, found), centre, corner, flaws)


def _reach(table: pl.DataFrame) -> _Reach | None:
    some = table.select("x", "y").gather_every(max(1, len(table) // _LOOK))
    axes = [some[axis].filter(some[axis].abs() < _NUMBERS).to_numpy() for axis in ("x", "y")]
    if not all(len(values) for values in axes):
        return None
    return _Reach(*(float(np.quantile(values, share)) for values in axes for share in (_STRAY, 1 - _STRAY)))


def _found(
    reach: _Reach, given: float | None, mapping: TrackingMap, t_ns: pl.Series, name: str
) -> tuple[float, bool, list[Flaw]]:
    """Metres of a unit and whether the origin is a corner, by how far bodies reach."""
    size = max(reach.high_x - reach.low_x, reach.high_y - reach.low_y)
    near = reach.low_x >= -_BEYOND * size, reach.low_y >= -_BEYOND * size
    far = reach.high_x <= _BEYOND * size, reach.high_y <= _BEYOND * size
    across = max(-reach.low_x, reach.high_x), max(-reach.low_y, reach.high_y)
    pitch = mapping.pitch
    pitches = ((pitch.length, pitch.width),) if pitch.length and pitch.width else _PITCHES
    units = METRES.values() if given is None else (given,)
    quarter = size > 0 and all(n or f for n, f in zip(near, far, strict=True))
    if not quarter:
        _check_square(across, reach, t_ns, name)
        largest = PITCHES[Kind.SIM2D]
        if given is not None or pitch.kind is not None or across[0] <= _LARGEST * largest.goal_x:
            doubt = given is None and pitch.kind is None and _AS_SHARES[0] < across[0] <= _AS_SHARES[1]
            note = f"bodies reach {reach}: taken for metres; if they are shares, say in a map {_SPOKEN}"
            return given or 1.0, False, [Flaw("assumed", note, t_ns.n_unique())] if doubt else []
    half, samples = 1 if quarter else 2, t_ns.n_unique()
    fits = {(unit, length, width) for unit in units for length, width in pitches
            if all(_LEAST <= half * far * unit / whole <= _MOST
                   for far, whole in zip(across, (length, width), strict=True))}
    if len(fits) == 1 and (all(near) or not quarter):
        unit, length, width = next(iter(fits))
        word = next(word for word, metres in METRES.items() if metres == unit)
        where, key = ("a corner", "corner") if quarter else ("the centre", "centre")
        note = (f"bodies reach {reach}: read as {word} from {where} of a pitch of {length:g} x {width:g} m, "
                f'y up; a map settles it, [units] length = "{word}" and [axes] origin = "{key}"')
        return unit, quarter, [Flaw("assumed", note, samples)]
    if not quarter:
        note = f"bodies reach {reach}: taken for metres; if they are others, say so in a map, [units] length"
        return 1.0, False, [Flaw("assumed", note, samples)]
    what = f"has all bodies in one quarter of the pitch ({reach})"
    middle = (reach.low_x + reach.high_x) / 2, (reach.low_y + reach.high_y) / 2
    cure = f"[axes] centre = [{middle[0]:.3g}, {middle[1]:.3g}], the place of the pitch's centre"
    if all(near):
        cure = f'[axes] origin = "corner" and [units] length = "m", "cm" or "mm"; or {_SPOKEN}; or {cure}'
    if samples < _TELLING:
        note = f"the table {what}; if its origin is not the centre, say in a map {cure}"
        return given or 1.0, False, [Flaw("assumed", note, samples)]
    raise BadRecording(what, where=name, next_step=f"Say in a map {cure}")


def _check_square(across: tuple[float, float], reach: _Reach, t_ns: pl.Series, name: str) -> None:
    """Refuse places that reach as far across as along, as shares of the pitch from its centre do."""
    if across[1] < _SQUARE * across[0] or t_ns.n_unique() < _TELLING:
        return
    for whole in WHOLE.values():
        if all(_LEAST <= 2 * far / whole <= _MOST for far in across):
            what = f"has bodies that reach as far across as along ({reach}), as shares of the pitch do"
            cure = f'Say in a map {_SPOKEN}, with [axes] origin = "centre"; or that alone, if they are metres'
            raise BadRecording(what, where=name, next_step=cure)
