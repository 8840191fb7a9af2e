"""The unit of a table's angles: as the map gives it, else found from the headings themselves."""

from __future__ import annotations

from typing import Literal

import numpy as np

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import F64

Unit = Literal["rad", "deg", "grad", "turn"]

#: Radians of a unit.
RADIANS: dict[Unit, float] = {"rad": 1.0, "deg": np.pi / 180, "grad": np.pi / 200, "turn": 2 * np.pi}
#: Greatest size of an angle in radians, and in degrees, with what rounding adds.
_TURN = {"rad": 2 * np.pi + 0.01, "deg": 360.5}
#: Share of the headings beyond a turn of radians up to which they are stray values, ...
_STRAY = 0.01
#: ... and from which on they are degrees: of headings in degrees 98 in 100 are.
_DEGREES = 0.5
#: Headings in degrees reach so far: a robot looks back. Turns that are counted in radians seldom do.
_BACK = 170.0
#: Least number of headings that tell that a map's unit is wrong.
_TELLING = 100
#: Greatest size of an angle in gradians, the smallest unit.
_LARGEST = 400.5
_SAY = 'in a map: [units] angle = "deg" or "rad"'


def is_within_a_turn(angle: float, others: F64) -> bool:
    """True if a number is within a turn of the unit that others are in, [N], as headings are."""
    return abs(angle) <= (_TURN["rad"] if np.abs(others).max(initial=0.0) <= _TURN["rad"] else _LARGEST)


def angle_unit(heading: F64, given: Unit | None, name: str) -> tuple[Unit, list[Flaw]]:
    """Unit of a table's headings, and a flaw if it was found from them, or if they contradict the map.

    Without a map they are radians, if at most a hundredth of them is beyond 2 pi. They are degrees, if at
    least half of them are beyond 2 pi, one beyond 170, and all but a hundredth within 360. Otherwise nothing
    tells.

    Args:
        heading: [N], in the file's unit; NaN where unknown.
        given: the map's unit.
        name: the file's name, for messages.

    Raises:
        BadRecording: if nothing tells the unit.
    """
    size = np.abs(heading[np.isfinite(heading)])
    beyond = {unit: int(np.count_nonzero(size > turn)) for unit, turn in _TURN.items()}
    if given == "deg" and len(size) >= _TELLING and not beyond["rad"]:
        note = f"the map says degrees, but no heading is beyond {size.max():.4g}; if they are radians, say so"
        return given, [Flaw("unit of angle", f"{note} {_SAY}", len(size))]
    if given is not None or not beyond["rad"]:
        return given or "rad", []
    if beyond["rad"] <= _STRAY * len(size):
        note = f"headings beyond 2 pi, taken for radians as the others are; if they are not, say so {_SAY}"
        return "rad", [Flaw("unit of angle", note, beyond["rad"])]
    most = float(size.max())
    if most >= _BACK and beyond["rad"] >= _DEGREES * len(size) and beyond["deg"] <= _STRAY * len(size):
        note = f"headings up to {most:.4g} are no radians: taken for degrees; if they are not, say so {_SAY}"
        return "deg", [Flaw("unit of angle", note, len(size))]
    share = beyond["rad"] / len(size)
    raise BadRecording(
        f"has headings up to {most:.4g}, {share:.0%} of them beyond 2 pi, so that nothing tells their unit",
        where=name, next_step=f"Say their unit {_SAY}",
    )
