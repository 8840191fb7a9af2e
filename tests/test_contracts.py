"""The house, besides the import contracts of pyproject.toml."""

from conftest import ROOT

from pitchlore.pipeline.engine.stages import STAGES


def test_a_noun_has_its_room():
    """Each module and folder of pipeline/stages is that of a noun of STAGES."""
    stages = ROOT / "pipeline" / "stages"
    rooms = {path.stem for path in stages.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert rooms - {"__init__"} <= set(STAGES)


def test_one_place_reads_tables():
    """Tables are read through inputs and `table_of`: `read_table` stands at most ten times above the store."""
    rooms = [ROOT / "flows", *(ROOT / "pipeline" / name for name in ("engine", "views", "face"))]
    found = [f"{path.relative_to(ROOT)}: {line.strip()}" for folder in rooms for path in folder.rglob("*.py")
             for line in path.read_text().splitlines() if "read_table(" in line]
    assert 1 <= len(found) <= 10, "\n".join(found)
