"""The stages' floor: they are strangers to each other, and every room has its floor."""

from __future__ import annotations

import tomllib

import grimp
import pytest
from conftest import ROOT

from pitchlore.pipeline.engine.stages import STAGES

CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
LAYERS = next(c for c in CONTRACTS if c["name"] == "floors: in pipeline")["layers"]
FLOORS = [[room.strip() for room in layer.split("|")] for layer in LAYERS]
#: Rooms that stages stand on: all from the log down.
BELOW = {room for floor in FLOORS[FLOORS.index(["sequences"]):] for room in floor}


@pytest.fixture(scope="module")
def graph():
    return grimp.build_graph("pitchlore")


def room(module: str) -> str:
    """The room of a module of pipeline: its first folder or file."""
    return module.split(".")[2]


@pytest.fixture(scope="module")
def rooms(graph) -> set[str]:
    return {child.removeprefix("pitchlore.pipeline.") for child in graph.find_children("pitchlore.pipeline")}


def stage_rooms(rooms: set[str]) -> set[str]:
    return (rooms & set(STAGES)) - {room for floor in FLOORS for room in floor}


def test_every_room_has_a_floor(rooms):
    """A room of pipeline is named in the floors of pyproject.toml, or it is a stage's."""
    assert rooms - {room for floor in FLOORS for room in floor} - set(STAGES) == set()


def test_stages_are_strangers(graph, rooms):
    """A stage imports what is below its floor, and no other stage."""
    strange = [
        f"{module} imports {imported}"
        for stage in stage_rooms(rooms)
        for module in {f"pitchlore.pipeline.{stage}", *graph.find_descendants(f"pitchlore.pipeline.{stage}")}
        for imported in graph.find_modules_directly_imported_by(module)
        if imported.startswith("pitchlore.pipeline.") and room(imported) not in {stage, *BELOW}
    ]
    assert strange == []


def test_nothing_below_knows_a_stage(graph, rooms):
    """The modules that stages stand on import none of them."""
    upward = [
        f"{module} imports {imported}"
        for below in BELOW & rooms
        for module in {f"pitchlore.pipeline.{below}", *graph.find_descendants(f"pitchlore.pipeline.{below}")}
        for imported in graph.find_modules_directly_imported_by(module)
        if imported.startswith("pitchlore.pipeline.") and room(imported) in stage_rooms(rooms)
    ]
    assert upward == []


def test_one_place_reads_tables():
    """Tables are read through inputs and `table_of`: `read_table` stands at most ten times above the store."""
    rooms = [ROOT / "flows", *(ROOT / "pipeline" / name for name in ("engine", "views", "face"))]
    found = [f"{path.relative_to(ROOT)}: {line.strip()}" for folder in rooms for path in folder.rglob("*.py")
             for line in path.read_text().splitlines() if "read_table(" in line]
    assert 1 <= len(found) <= 10, "\n".join(found)
