"""The unit of a table's headings: given by a map, or by the headings, and never taken for another silently."""

import io

import numpy as np
import polars as pl
import pytest
from support.recordings import RSIM, recording
from support.tracking import flaws, parquet, read

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.forms.angles import angle_unit
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap, load_map

DEGREES = load_map('[units]\nangle = "deg"\n')


HEADING = pl.col("heading")


def clip(heading: pl.Expr = HEADING) -> bytes:
    """Twelve seconds of a recording, its headings changed."""
    table = pl.read_parquet(io.BytesIO(recording(RSIM))).filter(pl.col("frame") < 480)
    return parquet(table.with_columns(heading.alias("heading")))


@pytest.mark.parametrize("turn", [0.0, 360.0])
def test_degrees_without_a_map(turn: float) -> None:
    """Headings in degrees, from -180 or from 0 on, are those of the same match in radians, and a flaw says so."""
    radians = read(clip())
    degrees = pl.col("heading").degrees()
    match = read(clip(degrees if not turn else degrees % turn))
    assert np.allclose(np.exp(1j * match.frames.robots["theta"]), np.exp(1j * radians.frames.robots["theta"]), atol=1e-5)
    assert flaws(match) == [("unit of angle", 480 * 6, None, None)]
    note = match.quality.filter(flaw="unit of angle")["note"][0]
    assert "are no radians: taken for degrees; if they are not, say so in a map: [units] angle =" in note


def test_turn_rates_follow() -> None:
    """Angular velocities have the unit of the headings, per second."""
    rows = "".join(f"{i},{i / 10},{team},1,{x},0,{9 * i + 90},90\n" for i in range(20)
                   for team, x in (("a", 0.7), ("b", -0.7)))
    match = read(f"frame,t,team,player,x,y,heading,omega\n{rows}")
    assert match.frames.robots["omega"] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("key", ["angle", "angle_unit"])
def test_degrees_by_the_map(key: str) -> None:
    """A map names the unit, under either name; nothing is a flaw then."""
    match = read(clip(pl.col("heading").degrees()), load_map(f'[units]\n{key} = "deg"\n'))
    assert flaws(match) == []
    assert match.info.settings["map"] == {"units": {"angle": "deg"}}


def test_radians_by_a_map_of_degrees() -> None:
    """A map that says degrees of radians is contradicted."""
    assert flaws(read(clip(), DEGREES)) == [("unit of angle", 480 * 6, None, None)]


def test_neither() -> None:
    """Headings that count turns are refused without a map, in one line that says what to do, and read with one."""
    turning = pl.col("heading") + pl.col("t") * 2
    with pytest.raises(BadRecording, match=(
        r"^game.csv: has headings up to \d+\.\d+, \d+% of them beyond 2 pi, so that nothing tells their unit\. "
        r'Say their unit in a map: \[units\] angle = "deg" or "rad"\.$'
    )):
        read(clip(turning))
    match = read(clip(turning), TrackingMap.model_validate({"units": {"angle": "rad"}}))
    assert flaws(match) == []


def test_stray_values() -> None:
    """A few headings beyond a turn do not make degrees of radians; they are counted."""
    heading = np.linspace(-3, 3, 1000)
    heading[:10] = 7.0
    unit, found = angle_unit(heading, None, "x.csv")
    assert (unit, [(flaw.flaw, flaw.count) for flaw in found]) == ("rad", [("unit of angle", 10)])
    heading[:11] = 7.0
    with pytest.raises(BadRecording, match="1% of them beyond 2 pi"):
        angle_unit(heading, None, "x.csv")


@pytest.mark.parametrize("heading", [np.array([]), np.full(3, np.nan), np.array([np.pi, -np.pi, 2 * np.pi])])
def test_nothing_to_tell(heading: np.ndarray) -> None:
    assert angle_unit(heading, None, "x.csv") == ("rad", [])
    assert angle_unit(heading, "deg", "x.csv") == ("deg", [])  # too few to contradict
