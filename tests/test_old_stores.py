"""Data folders with knowledge whose behaviours have no intervals: shown, compared, asked, added to."""

import io
import json

import polars as pl
import pyarrow.parquet
import pytest
from support.outputs import written
from support.seasons import evaluation, season

from pitchlore.pipeline.base.errors import CorruptFile, SchemaMismatch
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.engine.knowledge import describe
from pitchlore.pipeline.engine.stage import Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.settings import KnowledgeSettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.store.receipts import FileRecord, Manifest
from pitchlore.pipeline.store.tables import SCHEMA_KEY, from_parquet, in_pieces, joined, to_parquet
from pitchlore.pipeline.store.verification import verify
from pitchlore.pipeline.store.work import Made
from pitchlore.schemas import (
    ROLES,
    Behaviours,
    Decisions,
    Evaluations,
    Games,
    Growth,
    Occasions,
    Patterns,
    Sides,
)

ADDS_UP = KnowledgeSettings(accumulate=True)
NEW = {"low", "high", "mean", "error", "family", "family_spread", "family_size", "paper", "x", "y", "team", "kind", "q"}
FILLED = {"pays", "kept"}
ROWS = [  # support and mean
    ("striker-046", [46], 4, 0.25), ("striker-011", [11], 8, 0.5),
]


def patterns() -> pl.DataFrame:
    """Behaviours that the selection finds in the next match."""
    found = [{
        "behaviour_id": "striker-046", "role": "striker", "codes": [46], "n": 1, "support": 12, "value": 0.375,
        "spread": 0.25, "neuron": 1, "low": 0.25, "high": 0.5, "mean": 0.5, "error": 0.125, "family": 0.0,
        "family_spread": 0.2, "family_size": 9, "paper": 0.75, "x": 0.125, "y": -0.25, "team": None, "kind": None,
        "pays": "+", "q": 0.01, "kept": True,
    }]
    return Patterns.validate(pl.DataFrame(found, schema=Patterns.dtypes()))


@pytest.fixture
def old(tmp_path) -> Store:
    """A data folder with knowledge version 1, as it was written before behaviours had intervals."""
    store = Store(tmp_path)
    before = pl.DataFrame([
        {"behaviour_id": name, "role": "striker", "codes": codes, "n": 1, "support": support, "value": mean, "spread": 0.1,
         "neuron": 0, "version": 1} for name, codes, support, mean in ROWS
    ], schema={name: dtype for name, dtype in Behaviours.dtypes().items() if name not in NEW | FILLED})
    roles = {role: {"behaviours": 0, "states": 0, "occasions": 0} for role in ROLES}
    details = {"matches": 1, "behaviours": 2, "occasions": 0, "roles": roles}
    stage = STAGES["knowledge"]
    work = stage.work("knowledge", ADDS_UP, {"decisions/first/decisions": "0" * 64}, seed=0)
    store.commit_version(work, Made([(Behaviours.empty(), Behaviours), (Occasions.empty(), Occasions)], details=details),
                         1, parent=None)
    folder = store.version_folder("knowledge", 1)
    file = folder / "behaviours.parquet"
    file.write_bytes(written(before, "behaviours/1"))
    manifest = store.manifest("knowledge", 1)
    record = FileRecord.of(file.name, file.read_bytes(), table="behaviours/1", rows=before.height)
    changed = Manifest.model_validate(manifest.model_dump() | {"files": {**manifest.files, "behaviours": record}})
    (folder / "manifest.json").write_text(changed.model_dump_json())
    assert verify(store, (), [("knowledge", 1)]).problems == []
    return store


def add(store: Store) -> Manifest:
    """The next version: of another match, added to what is there."""
    settings = Settings()
    for noun, name, table in (
        ("behaviours", "second", (patterns(), Patterns)), ("decisions", "second", (Decisions.empty(), Decisions)),
        ("sides", "second", (Sides.empty(), Sides)),
    ):
        details = {"matches": {"second": {"sha256": "1" * 64, "choosing": []}}} if noun == "decisions" else {}
        store.commit(STAGES[noun].work(name, STAGES[noun].settings(settings), {}), Made([table], details=details))
    scope = Scope(matches=("second",), group="second")
    manifest, new = emit(store, STAGES["knowledge"], ADDS_UP, scope)
    assert (manifest.version, manifest.parent, new) == (2, 1, True)
    return manifest


def test_read(old):
    """Newer columns are null; what was selected then paid, and is kept."""
    found = old.read_table(old.manifest("knowledge", 1), "behaviours", Behaviours)
    Behaviours.validate(found)
    assert {name for name in found.columns if found[name].null_count()} == NEW
    assert found.select("pays", "kept").rows() == [("+", True)] * 2
    assert "not known" in describe(old, old.manifest("knowledge", 1))


def test_show(old, call):
    """`kb show` shows a version without intervals."""
    code, out, err = call("kb", "show", "--support", 1, "--data", old.root)
    assert (code, err) == (0, "")
    assert "striker-046" in out
    _, out, _ = call("kb", "show", "1", "--support", 1, "--json", "--data", old.root)
    shown = json.loads(out)["behaviours"]
    assert [(row["behaviour_id"], row["value"], row["low"]) for row in shown] == [
        ("striker-046", 0.25, None), ("striker-011", 0.5, None)]


def test_diff(old, call):
    """`kb diff` compares it with a later one."""
    add(old)
    code, out, err = call("kb", "diff", "1", "2", "--data", old.root)
    assert (code, err) == (0, "")
    assert "striker-046" in out
    code, out, _ = call("kb", "diff", "1", "2", "--json", "--data", old.root)
    (changed,) = json.loads(out)["behaviours"]
    assert {name: changed[name] for name in (
        "behaviour_id", "change", "support_before", "support_after", "value_before", "value_after", "low_before")} == {
        "behaviour_id": "striker-046", "change": "changed", "support_before": 4, "support_after": 16,
        "value_before": 0.25, "value_after": 0.4375, "low_before": None}


def test_sql(old, call):
    """The view of behaviours has the rows of both, in the order of the columns; the mean is that of all instances."""
    names = list(Behaviours.dtypes())
    assert ask(refresh(old)[0], "from behaviours").columns == names, "of old files alone, too"
    add(old)
    found = ask(refresh(old)[0], "from behaviours order by version, behaviour_id")
    assert found.columns == names
    assert found.select("version", "behaviour_id", "support", "value", "mean", "low", "x", "q", "pays", "kept").rows() == [
        (1, "striker-011", 8, 0.5, None, None, None, None, "+", True), (1, "striker-046", 4, 0.25, None, None, None, None, "+", True),
        (2, "striker-011", 8, 0.5, 0.5, None, None, None, "+", True), (2, "striker-046", 16, 0.4375, 0.4375, None, None, 0.01, "?", True)]
    code, out, err = call("sql", "from behaviours", "--json", "--data", old.root)
    assert (code, len(json.loads(out)), err) == (0, 4, "")


def test_older_evaluations():
    """An evaluation of version 2 is read; it says nothing about fouls."""
    now = evaluation("best-static-1")
    old = written(now[:, : now.columns.index("fouls_for")], "evaluations/2")
    assert from_parquet(old, Evaluations, where="old").equals(now)


def test_in_pieces():
    """A large table is read a row group at a time; what is no table of its schema is refused as ever."""
    now = season(last=4)[0].pipe(Games.validate)
    table = now.to_arrow().replace_schema_metadata({SCHEMA_KEY: Games.tag()})
    pyarrow.parquet.write_table(table, data := io.BytesIO(), row_group_size=3)
    pieces = list(in_pieces(data.getvalue(), Games, where="games"))
    assert [piece.height for piece in pieces] == [3] * (now.height // 3) + [now.height % 3] * (now.height % 3 > 0)
    assert pl.concat(pieces).equals(now)
    assert [piece.height for piece in in_pieces(to_parquet(now.clear(), Games, where=""), Games, where="")] == [0]
    with pytest.raises(SchemaMismatch, match="holds table games"):
        list(in_pieces(data.getvalue(), Growth, where="growth"))
    with pytest.raises(CorruptFile, match="is not Parquet"):
        list(in_pieces(data.getvalue()[:-9], Games, where="games"))


def test_earlier_enumerations(tmp_path):
    """A word of few in an earlier version may be any now; newer columns are null; other enumerations are refused."""
    now, growth = (table.validate(rows) for table, rows in zip((Games, Growth), season(last=2), strict=True))
    old = written(now.drop("left").with_columns(pl.col("opponent").cast(pl.Enum(["static", "random"]))), "games/1")
    assert from_parquet(old, Games, where="old").equals(now)
    assert joined([old, to_parquet(now, Games, where="new")], Games, where=["old", "new"]).equals(pl.concat([now, now]))
    assert [piece.equals(now) for piece in in_pieces(old, Games, where="old")] == [True]
    strange = growth.with_columns(pl.col("role").cast(pl.String).cast(pl.Enum([*ROLES, "nobody"])))
    with pytest.raises(SchemaMismatch, match="role"):
        from_parquet(written(strange, "growth/1"), Growth, where="old")
    with pytest.raises(SchemaMismatch, match="missing role"):
        from_parquet(written(growth.drop("role"), "growth/1"), Growth, where="lacking")
