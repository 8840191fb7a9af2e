"""Units and origin of a table's places: as a map says, else recognised, else refused with a map's lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from math import copysign
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
#: Those who reach further leave it. Where places are on one side of an axis, their middle is no further from
#: its centre. Both are shares of it.
_LEAVES, _OFF = 1.06, 0.02
#: Places that reach so far across, as a share of how far they reach along, are parts of a pitch: none is so
#: wide.
_SQUARE = 0.88
#: Share of places that may be elsewhere, and part of the reach that places may be beyond an axis.
_STRAY, _BEYOND = 0.001, 0.03
#: Bodies that reach so far along, metres, may be on a pitch of 2.2 m, or at shares from -1 to 1 of another.
_AS_SHARES = (0.87, 1.03)
#: Bodies that reach further than so many lengths of the largest pitch are in another unit.
_LARGEST = 1.1
#: Places that reach no further on an axis, as a share of their reach on the other, are on a line.
_WIDE = 0.3
#: Rows that are looked at, evenly over the table.
_LOOK = 20_000
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

    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Least and greatest along and across."""
        return (self.low_x, self.high_x), (self.low_y, self.high_y)

    def __str__(self) -> str:
        return f"x from {self.low_x:.4g} to {self.high_x:.4g}, y from {self.low_y:.4g} to {self.high_y:.4g}"


def lengths_of(table: pl.DataFrame, mapping: TrackingMap, name: str) -> Lengths:
    """Units and origin of a table's places.

    A map's are taken. Without them, places are metres from the centre, unless all bodies are in one quarter
    or half of the axes, or further out than on any pitch: then they are those of the one league and unit
    whose pitch they fill.

    Args:
        table: ``x``, ``y`` Float64 in the file's units, ``t_ns``.
        mapping: the map.
        name: the file's name, for messages.

    Raises:
        BadRecording: if places are shares of a pitch that nobody names; or if all bodies are in one quarter,
            or further out than on any pitch, or reach as far across as along, and nothing tells more.
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
    found, place, flaws = _found(reach, given, mapping, table["t_ns"], name)
    return Lengths((found, found), place or centre, place is None, flaws)


def _reach(table: pl.DataFrame) -> _Reach | None:
    some = table.select("x", "y").gather_every(max(1, len(table) // _LOOK))
    axes = [some[axis].filter(some[axis].abs() < _NUMBERS).to_numpy() for axis in ("x", "y")]
    if not all(len(values) for values in axes):
        return None
    return _Reach(*(float(end) for values in axes for end in np.quantile(values, (_STRAY, 1 - _STRAY))))


def _found(
    reach: _Reach, given: float | None, mapping: TrackingMap, t_ns: pl.Series, name: str
) -> tuple[float, tuple[float, float] | None, list[Flaw]]:
    """Metres of a unit and place of the pitch's centre, by how far bodies reach; None if a corner is at 0."""
    ends = reach.ends()
    size = max(high - low for low, high in ends)
    one_sided = [size > 0 and (low >= -_BEYOND * size or high <= _BEYOND * size) for low, high in ends]
    if not all(one_sided):  # bodies on one line are in no half
        one_sided = [one and high - low > _WIDE * size
                     for one, (low, high) in zip(one_sided, ends, strict=True)]
    far = [max(-low, high) for low, high in ends]
    samples, here = t_ns.n_unique(), (0.0, 0.0)
    largest = _LARGEST * PITCHES[Kind.SIM2D].goal_x
    if not any(one_sided):
        _check_square((far[0], far[1]), reach, t_ns, name)
        known = given is not None or mapping.pitch.kind is not None
        if known or far[0] <= largest:
            doubt = not known and _AS_SHARES[0] < far[0] <= _AS_SHARES[1]
            note = f"bodies reach {reach}: taken for metres; if they are shares, say in a map {_SPOKEN}"
            return given or 1.0, here, [Flaw("assumed", note, samples)] if doubt else []
    fit = _fit(reach, one_sided, METRES.values() if given is None else (given,), mapping)
    if fit is not None:
        return fit.unit, None if fit.corner else fit.centre, [
            Flaw("assumed", f"bodies reach {reach}: read as {fit}", samples)]
    middle = [(low + high) / 2 for low, high in ends]
    cure = f"[axes] centre = [{middle[0]:.3g}, {middle[1]:.3g}], the place of the pitch's centre"
    part = {0: "", 1: "half", 2: "quarter"}[sum(one_sided)]
    what = f"has all bodies in one {part} of the pitch" if part else "has bodies further out than any pitch"
    what = f"{what} ({reach})"
    if part != "quarter" or min(middle) > 0:
        cure = f'[axes] origin = "corner" and [units] length = "m", "cm" or "mm"; or {_SPOKEN}; or {cure}'
    if samples < _TELLING or (part == "half" and far[0] <= 2 * largest):  # one play may be in one half
        note = f"the table {what}; if the centre is no origin, or metres are no unit, say in a map {cure}"
        return given or 1.0, here, [Flaw("assumed", note, samples)]
    raise BadRecording(what, where=name, next_step=f"Say in a map {cure}")


class _Fit(NamedTuple):
    """A pitch that bodies fill: metres of a unit, the file's place of its centre, its length and width."""

    leaves: bool
    unit: float
    centre: tuple[float, float]
    pitch: tuple[float, float]

    @property
    def corner(self) -> bool:
        """True if a corner is at 0, 0 and all places are positive."""
        return min(self.centre) > 0

    def __str__(self) -> str:
        word = next(word for word, metres in METRES.items() if metres == self.unit)
        where, key = f"a centre at {self.centre[0]:g}, {self.centre[1]:g}", f"centre = {list(self.centre)}"
        if self.corner:
            where, key = "a corner", 'origin = "corner"'
        elif not any(self.centre):
            where, key = "the centre", 'origin = "centre"'
        return (f"{word} from {where} of a pitch of {self.pitch[0]:g} x {self.pitch[1]:g} m, y up; "
                f'a map settles it, [units] length = "{word}" and [axes] {key}')


def _fit(
    reach: _Reach, one_sided: Sequence[bool], units: Iterable[float], mapping: TrackingMap
) -> _Fit | None:
    """The one pitch and unit that fit; of several, the one that bodies do not leave."""
    given = mapping.pitch
    pitches = ((given.length, given.width),) if given.length and given.width else _PITCHES
    fits = []
    for unit, pitch in product(units, pitches):
        centre, shares, agree = [], [], True
        for (low, high), one, whole in zip(reach.ends(), one_sided, pitch, strict=True):
            zero = copysign(whole / unit / 2, low + high) if one else 0.0
            agree &= not one or abs((low + high) / 2 - zero) <= _OFF * whole / unit
            shares.append(2 * unit / whole * max(zero - low, high - zero))
            centre.append(zero)
        if agree and all(_LEAST <= share <= _MOST for share in shares):
            fits.append(_Fit(max(shares) > _LEAVES, unit, (centre[0], centre[1]), pitch))
    best = [fit for fit in fits if fit.leaves == min(fits).leaves]
    return best[0] if len(best) == 1 else None


def _check_square(across: tuple[float, float], reach: _Reach, t_ns: pl.Series, name: str) -> None:
    """Refuse places that reach as far across as along, as shares of the pitch from its centre do."""
    if across[1] < _SQUARE * across[0] or t_ns.n_unique() < _TELLING:
        return
    for whole in WHOLE.values():
        if all(_LEAST <= 2 * far / whole <= _MOST for far in across):
            what = f"has bodies that reach as far across as along ({reach}), as shares of the pitch do"
            cure = f'Say in a map {_SPOKEN}, with [axes] origin = "centre"; or that alone, if they are metres'
            raise BadRecording(what, where=name, next_step=cure)
