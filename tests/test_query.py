"""Queries only read: statements that write, in every form and place that DuckDB's grammar has for them."""

from collections.abc import Iterator
from itertools import cycle, product
from pathlib import Path

import duckdb
import polars as pl
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from support.outputs import put_goal

from pitchlore.pipeline.base.errors import BadQuery
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask

#: What a person asks of the catalogue, in the forms that DuckDB's grammar has for it.
READING = [
    "from goals", "select * from goals where match_id = 'm-1'", "values (1), (2)", "table goals",
    "with a as (select robot from goals) select * from a",
    "with recursive c(n) as (select 1 union all select n + 1 from c where n < 5) from c",
    "select * from goals union all by name select * from goals", "(select 1) except (select 2)",
    "describe goals", "show tables", "show all tables", "summarize goals", "from (describe goals)",
    "pivot goals on kind in ('direct', 'error') using count(*)", "unpivot (select 1 a, 2 b) on a, b",
    "select robot, row_number() over (order by t_ns) r from goals qualify r = 1",
    "select list_transform([1, 2], lambda x: x + 1) l", "select unnest([1, 2]) u", "from range(3)",
    "from generate_series(1, 3)", "from json_each('[1]')", "select * from duckdb_columns()",
    "select * from pragma_table_info('goals')", "from query_table('goals')", "explain select * from goals",
    "explain with a as (from goals) from a", "EXPLAIN\nfrom goals;", "from goals -- a comment",
    "/* a comment */ from goals;", "select * from goals, lateral (select robot + 1 as next)",
    "select columns('.*_id') from goals", "select robot from goals tablesample 1 rows",
]

#: What writes, or has an effect outside the query.
WRITING = [
    "copy goals to '{file}'", "copy (from goals) to '{file}' (use_tmp_file false)",
    "copy (from goals) to '{file}' (format parquet, use_tmp_file false)",
    "copy (from goals) to '{folder}' (partition_by (match_id), overwrite)",
    "copy goals to '{output}' (use_tmp_file false)", "copy goals from '{output}'",
    "copy from database catalog to memory", "export database '{folder}'", "import database '{folder}'",
    "insert into goals values ('m', 1, 'away', 1, 'error')", "insert or replace into goals from goals",
    "update goals set robot = 1", "delete from goals", "truncate goals",
    "merge into goals using goals as g on goals.robot = g.robot when matched then delete",
    "create table t as from goals", "create or replace temp table t as select 1", "create view v as from goals",
    "create macro m(a) as a", "create schema s", "create sequence s", "create type e as enum ('a')",
    "create index i on goals(robot)", "create secret (type s3)", "create persistent secret (type s3)",
    "drop view goals", "drop table if exists t", "alter table goals add column a integer",
    "comment on view goals is 'x'", "attach '{file}'", "attach '{file}' as a (read_only)", "detach catalog",
    "use memory", "checkpoint", "force checkpoint", "vacuum", "analyze", "vacuum analyze", "install httpfs", "load json",
    "update extensions", "set threads = 1", "set variable a = 1", "reset threads", "pragma enable_profiling",
    "pragma database_list", "pragma profiling_output = '{file}'", "call enable_logging()",
    "call force_checkpoint()", "prepare p as select 1", "execute p", "deallocate p", "begin", "commit",
    "rollback", "pivot goals on kind", "select * from checkpoint()", "select * from force_checkpoint()",
    "select * from query('copy goals to ''{file}''')", "select * from query('select 1')",
    "from enable_logging(storage = 'file', storage_path = '{folder}')",
    "from json_execute_serialized_sql(json_serialize_sql('select 1'))",
    "from enable_profiling(save_location = '{file}')", "from truncate_duckdb_logs()",
    "from read_csv('/etc/passwd')", "from read_text('{output}')", "from read_blob('{output}')", "from glob('/*')",
    "from read_parquet('{output}')", "from goals, read_parquet('{output}')", "from parquet_scan('{foreign}')",
    "from read_parquet('{foreign}')", "from '{foreign}'", "select * from goals where robot in (from '{foreign}')",
    "explain analyze select 1", "explain (analyze) select 1", "set enable_external_access = true",
    "from own_frame", "selec",
]
#: What a `with` may hold that writes.
STEPS = [
    "copy goals to '{file}'", "copy (from goals) to '{output}' (use_tmp_file false)", "copy goals from '{output}'",
    "insert into goals from goals returning *", "update goals set robot = 1 returning *",
    "delete from goals returning *", "create table t as select 1",
    "merge into goals using goals as g on goals.robot = g.robot when matched then delete returning *",
]
#: Where a statement stands. DuckDB's parser refuses most of it; what it takes must not run.
PLACES = [
    "{0}", "explain {0}", "explain analyze {0}", "explain (analyze) {0}", "explain (format json) {0}",
    "explain (analyze, format json) {0}", "EXPLAIN/**/ANALYZE {0}", "/* explain select 1 */ {0}",
    "/* /* */ explain select 1 -- */ {0}", "-- explain\n {0}", "describe {0}", "summarize {0}", "show {0}", "({0})",
    "prepare p as {0}", "create view v as {0}", "select 1; {0}", "{0}; select 1", "; {0}", "{0} -- select",
    "pivot ({0}) on a", "from query($${0}$$)", "execute immediate $${0}$$", "begin; {0}", "\ufeff{0}",
]
WITHIN = [
    "with w as ({0}) select 1", "with w as materialized ({0}) from w", "with a as (select 1), w as ({0}) from a",
    "select * from (with w as ({0}) select 1)", "select (with w as ({0}) select 1)",
    "select exists(with w as ({0}) select 1)", "select 1 union all (with w as ({0}) select 1)",
    "with recursive c as (select 1 union all (with w as ({0}) from c where false)) from c",
    "from (describe with w as ({0}) select 1)", "summarize with w as ({0}) select 1",
    "describe with w as ({0}) select 1", "explain with w as ({0}) select 1",
    "explain analyze with w as ({0}) select 1", "from query('with w as ({0}) select 1')",
    "values ((with w as ({0}) select 1))", "select 1 order by (with w as ({0}) select 1)",
    "select 1 where exists (with w as ({0}) select 1)", "select list_transform([1], lambda x: (with w as ({0}) select 1))",
    "pivot (with w as ({0}) select 1 a) on a in (1)", "from range((with w as ({0}) select 1))",
    "select 1 limit (with w as ({0}) select 1)", "select 1 from goals join (with w as ({0}) select 1) on true",
    "from (values (1)) v(a), lateral (with w as ({0}) select a)", "copy (with w as ({0}) select 1) to '{file}'",
]


class Folder:
    """A data folder, a file beside it, and what it looked like at first."""

    def __init__(self, root: Path) -> None:
        self.root = root
        store = Store(root / "data")
        self.output = put_goal(store, "m-1", 1)
        self.foreign = root / "foreign.parquet"
        pl.DataFrame({"robot": [1]}).write_parquet(self.foreign)
        self.catalogue = refresh(store)[0]
        self.before = self.look()

    def look(self) -> dict[str, bytes]:
        return {str(path.relative_to(self.root)): path.read_bytes() for path in self.root.rglob("*") if path.is_file()}

    def filled(self, text: str) -> str:
        names = {"file": self.root / "new.csv", "folder": self.root / "new", "output": self.output, "foreign": self.foreign}
        for name, path in names.items():
            text = text.replace(f"{{{name}}}", str(path))
        return text


@pytest.fixture(scope="module")
def folder(tmp_path_factory, request) -> Iterator[Folder]:
    monkeypatch = pytest.MonkeyPatch()
    root = tmp_path_factory.mktemp("query")
    monkeypatch.chdir(root)
    yield Folder(root)
    monkeypatch.undo()


def answered(folder: Folder, sql: str) -> str:
    """Refusal of a query; empty if it is answered."""
    try:
        ask(folder.catalogue, sql)
    except BadQuery as refused:
        return str(refused)
    return ""


@pytest.mark.parametrize("sql", READING)
def test_reading(folder, sql):
    """Every form of statement that only reads is answered."""
    ask(folder.catalogue, sql)
    assert folder.look() == folder.before


@pytest.mark.parametrize("sql", WRITING)
def test_writing(folder, sql):
    """Every other form is refused in one line, and writes nothing; a frame of the program is no table."""
    own_frame = pl.DataFrame({"a": [1]})
    with pytest.raises(BadQuery) as refused:
        ask(folder.catalogue, folder.filled(sql))
    assert "\n" not in str(refused.value)
    assert folder.look() == folder.before
    assert own_frame.height == 1


@pytest.mark.parametrize(("within", "step"), [*zip(WITHIN, cycle(STEPS)), *product(WITHIN[:1], STEPS[1:])])
def test_step_that_writes(folder, within, step):
    """A step of a `with` that writes is refused wherever a `with` may stand; the type of it all is SELECT."""
    with pytest.raises(BadQuery):
        ask(folder.catalogue, folder.filled(within.replace("{0}", step)))
    assert folder.look() == folder.before


def test_such_a_step_would_write(folder):
    """The danger is real: DuckDB itself runs such a step, in a statement that it types as SELECT."""
    sql = folder.filled("with w as (copy (select 1 a) to '{file}') select 1")
    try:
        with duckdb.connect() as connection:
            (statement,) = connection.extract_statements(sql)
            assert statement.type == duckdb.StatementType.SELECT
            connection.execute(sql).fetchall()
        assert folder.look() != folder.before
    finally:
        (folder.root / "new.csv").unlink(missing_ok=True)


PIECES = st.sampled_from([*WRITING, *STEPS, *READING])


@given(st.lists(st.sampled_from([*PLACES, *WITHIN]), max_size=3), PIECES)
@example(["/* /* */ explain select 1 -- */ {0}", "explain analyze {0}"], "copy goals to '{file}'")
def test_nothing_is_written(folder, places, sql):
    """However statements are put into each other, nothing is written, and only BadQuery is raised."""
    for place in places:
        sql = place.replace("{0}", sql)
    assert "\n" not in answered(folder, folder.filled(sql))
    assert folder.look() == folder.before


@pytest.mark.parametrize("sql", [
    "select " + "(" * 900 + "1" + ")" * 900, "select " + "-" * 5_000 + "1", "select 1" + " + 1" * 5_000,
    "from " + "(from " * 400 + "goals" + ")" * 400, "select '" + "x" * 1_000_000 + "'",
])
def test_deep_and_long(folder, sql):
    """A query that is very deep or long is answered or refused."""
    assert "\n" not in answered(folder, sql)


def test_no_temporary_files(folder):
    """A query that would need temporary files has no folder for them."""
    assert ask(folder.catalogue, "select current_setting('temp_directory') t").item() == ""
    assert folder.look() == folder.before
