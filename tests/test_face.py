"""The face: what ``import pitchlore`` shows, over a match in memory and over a data folder."""

import doctest
import inspect
import shutil
import subprocess
import sys

import duckdb
import polars as pl
import pytest
from conftest import ROOT, clip
from docstring_parser import parse
from football.skillcorner import FILES
from support.football import NEEDS_KLOPPY, SKILLCORNER
from support.league import bring
from support.outputs import written
from support.sessions import once

import pitchlore
from pitchlore.pipeline.base.errors import BadQuery, BadRecording, BadSettings, NotFound
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.tables import TableOf
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.settings import RunSettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.tables import from_parquet, scan, to_parquet
from pitchlore.schemas import PUBLIC, Goals

pytestmark = pytest.mark.slow

TABLES = [name for name, it in inspect.getmembers(pitchlore.Match) if isinstance(it, TableOf)]


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """The sample's first minute as a CSV file."""
    file = tmp_path_factory.mktemp("sample") / "derby.csv"
    clip(0.0, 60.0).write_csv(file)
    return file


@pytest.fixture(scope="module")
def data(tmp_path_factory, sample):
    """A data folder with this match alone, taken through all stages."""

    def make(folder):
        store = Store(folder)
        take_in(store, Recording(file=sample))
        bring(store)

    return once(tmp_path_factory, "face", make)


@pytest.fixture(scope="module")
def m(sample):
    return pitchlore.read(sample)


@pytest.fixture(scope="module")
def league(data):
    return pitchlore.open(data)


def test_names():
    """At most fifteen names; each is there, and none is loaded before it is asked for."""
    assert len(pitchlore.__all__) <= 15
    assert {name for name in pitchlore.__all__ if not hasattr(pitchlore, name)} == set()
    assert set(pitchlore.__all__) <= set(dir(pitchlore))
    with pytest.raises(AttributeError, match="no attribute 'reed'"):
        pitchlore.reed  # noqa: B018
    code = "import sys, pitchlore; print({'polars', 'numba', 'duckdb', 'pydantic'} & set(sys.modules))"
    said = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "set()"


def test_one_match_in_memory_and_in_a_folder(m, league):
    """A match has the same tables, whether it is read from its recording or from a data folder."""
    (name,) = league.matches
    stored = league.matches["derby"]
    assert (m.name, m.home, m.away, m.score) == (name, "blue", "yellow", (2, 0))
    assert (stored.name, stored.home, stored.away, stored.score) == (name, "blue", "yellow", (2, 0))
    assert repr(m) == repr(stored)
    assert {"trajectories", "situations", "goals", "passes", "shots", "values", "quality", "decisions"} <= set(TABLES)
    for table in TABLES:
        assert m.table(table).equals(stored.table(table)), table
    for table in set(TABLES) & set(PUBLIC):
        rows = league.ask(f"select count(*) as n from {table}")["n"][0]
        assert rows == m.table(table).height, table
        assert m.table(table).columns == league.ask(f"describe {table}")["column_name"].to_list()
    assert m.trajectories is m.trajectories
    assert stored.trajectories is stored.trajectories
    with pytest.raises(BadSettings, match="has no table 'knowledge'"):
        m.table("knowledge")
    assert m.info == stored.info


def test_views_are_the_same(m, league, tmp_path):
    """Page, commentary, film and exports of a match in memory are those of the data folder, byte for byte."""
    stored = league.match(m.name)
    assert m.page() == stored.page()
    assert str(m.commentary()) == str(stored.commentary())
    assert "GOAL for blue, 1 : 0!" in str(m.commentary())
    assert m.replay(tmp_path / "here.html").read_text() == stored.page()
    film, theirs = (it.film(tmp_path / f"{i}.gif", seconds=0.5).read_bytes() for i, it in enumerate((m, stored)))
    assert film == theirs
    for form in ("csv", "kloppy", "foxglove"):
        one, other = (it.export(form, tmp_path / str(i)) for i, it in enumerate((m, stored)))
        assert [path.name for path in one] == [path.name for path in other]
        assert [path.read_bytes() for path in one] == [path.read_bytes() for path in other]
    again = pitchlore.read(tmp_path / "0" / f"{m.name}.csv")
    assert again.goals.height == m.goals.height
    with pytest.raises(BadSettings, match="no form 'docx'"):
        m.export("docx")


def test_files_go_where_the_match_is(m, league, tmp_path, monkeypatch):
    """Without a path a league's files are in its folder, those of a match in memory are here."""
    monkeypatch.chdir(tmp_path)
    assert m.replay() == (tmp_path / f"{m.name}.html").relative_to(tmp_path)
    assert (tmp_path / f"{m.name}.html").exists()
    assert league.match(m.name).export("csv") == [league.store.root / "exports" / f"{m.name}.csv"]


def test_in_a_notebook(m, league, tmp_path):
    """A match is shown as a picture with teams, score and flaws, a league's matches as a table."""
    shown = m._repr_html_()
    assert "<b>blue 2 : 0 yellow</b>" in shown
    assert "direction of attack inferred" in shown
    assert 'src="data:image/png;base64,iVBOR' in shown
    assert league.match(m.name)._repr_html_() == shown
    assert "derby" in league.matches._repr_html_()
    assert repr(league).endswith("1 matches>")
    store = Store(tmp_path)
    clip(0.0, 5.0).with_columns(pl.col("team").replace("blue", "<b>")).write_csv(tmp_path / "x.csv")
    take_in(store, Recording(file=tmp_path / "x.csv"))
    bare = pitchlore.open(tmp_path).matches["x"]
    assert "Its stages have not run." in bare._repr_html_()
    assert "&lt;b&gt;" in bare._repr_html_()
    with pytest.raises(NotFound, match=r"x-\w+ has no situations yet. Run `pitchlore run` first"):
        bare.situations  # noqa: B018


def test_recordings(tmp_path, sample):
    """A map is taken from beside the recording or as named; what cannot be read is refused as by `import`."""
    renamed = clip(0.0, 5.0).rename({"t": "zeit"})
    renamed.write_csv(tmp_path / "a.csv")
    with pytest.raises(BadRecording):
        pitchlore.read(tmp_path / "a.csv")
    (tmp_path / "words.toml").write_text('[columns]\nt = "zeit"\n')
    assert pitchlore.read(tmp_path / "a.csv", map=tmp_path / "words.toml").info["duration_s"] > 4
    (tmp_path / "a.csv.toml").write_text('[columns]\nt = "zeit"\n')
    assert pitchlore.read(tmp_path / "a.csv").info["duration_s"] > 4
    with pytest.raises(NotFound, match="cannot be read"):
        pitchlore.read(tmp_path / "none.csv")
    with pytest.raises(BadSettings, match="only if a provider is named"):
        pitchlore.read(sample, sample)
    with pytest.raises(NotFound, match="names no source"):
        pitchlore.read(sample, provider="kloppy:nobody")
    small = RunSettings.model_validate({"imports": {"rows": 10}})
    with pytest.raises(BadRecording, match="more than the limit rows = 10"):
        pitchlore.read(sample, settings=small)


def test_settings(sample, m):
    """Settings of the stages are those of a run."""
    strict = Settings.model_validate({"situations": {"longest_s": 0.5}})
    lasts = (pl.col("end_ns") - pl.col("start_ns")).filter(pl.col("code") != 194).max()
    assert pitchlore.read(sample, settings=strict).situations.select(lasts).item() < m.situations.select(lasts).item()


def test_sql(league, tmp_path):
    """A relation can only read, and reads the catalogue's files alone."""
    found = league.sql("select team, count(*) as n from goals where t_ns > ? group by all order by team", 0)
    assert isinstance(found, duckdb.DuckDBPyRelation)
    assert found.pl()["n"].sum() == 2
    with pytest.raises(BadQuery):
        league.sql("copy goals to 'x.csv'")
    with pytest.raises(BadQuery):
        league.sql("from nowhere")
    with pytest.raises(duckdb.Error):
        found.write_csv(str(tmp_path / "x.csv"))
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize("table", ["trajectories", "goals", "decisions", "behaviours", "paradigms", "matches", "quality"])
def test_lazy(league, table):
    """A lazy frame has the rows, columns and types of the table, over the files of receipts alone."""
    frame = league.lazy(table).collect()
    assert dict(frame.schema) == PUBLIC[table].dtypes()
    assert frame.height == league.ask(f"select count(*) as n from {table}")["n"][0]
    (league.store.root / table).mkdir(exist_ok=True)
    stray = league.store.root / table / "stray.parquet"
    frame.write_parquet(stray)
    try:
        assert league.lazy(table).collect().equals(frame)
    finally:
        stray.unlink()


def test_lazy_over_earlier_versions(m, tmp_path):
    """Files of an earlier version of a table are scanned as they are read: columns that are newer are null."""
    now, earlier = tmp_path / "now.parquet", tmp_path / "earlier.parquet"
    now.write_bytes(to_parquet(m.goals, Goals, where=""))
    earlier.write_bytes(written(m.goals.drop("origin", "confidence"), "goals/1"))
    read = pl.concat(from_parquet(path.read_bytes(), Goals, where="") for path in (now, earlier))
    assert scan([str(earlier), str(now)], Goals).collect().equals(read)
    assert read["origin"].null_count() == m.goals.height
    assert scan([], Goals).collect().equals(Goals.empty())


def test_versions(league):
    """Versions are those of the folder, with their tables; a version, table, policy or team that is not there is named."""
    known = league.knowledge()
    assert (known.version, known.parent, league.versions) == (1, None, {"knowledge": [1], "policies": []})
    assert known.behaviours.equals(league.lazy("behaviours").collect())
    assert known.matches == list(league.matches)
    assert known.since(league.knowledge(1)).behaviours.is_empty()
    with pytest.raises(NotFound, match="there is no policy yet"):
        league.policy()
    with pytest.raises(NotFound, match="no version 7"):
        league.knowledge(7)
    with pytest.raises(BadSettings, match="dpi: cannot be 1"):
        known.picture(dpi=1)
    with pytest.raises(BadSettings, match=r"no table 'gols'.*goals"):
        league.lazy("gols")
    with pytest.raises(BadSettings, match="has learned nothing"):
        league.team("static")
    with pytest.raises(NotFound, match="there is no policy to play"):
        league.team("learned")


def test_played_again(tmp_path):
    """A match that is played in memory is that which `record` plays, with all that is made from it."""
    from pitchlore.pipeline.arena.match.recipe import Recipe
    from pitchlore.pipeline.engine.record import record

    ours = pitchlore.play(home="constant:044", away="random", seed=7, minutes=0.2, robots=3)
    recipe = Recipe.model_validate(dict(ours.inputs.settings("matches")))
    store = Store(tmp_path)
    from pitchlore.pipeline.arena.match.controllers import constant_team

    team = constant_team("constant:044")
    record(store, recipe, {team.settings.policy: team.tables})
    STAGES.make(store, Settings(), scope_of(store))
    theirs = pitchlore.open(tmp_path).match(ours.name)
    for table in TABLES:
        assert ours.table(table).equals(theirs.table(table)), table
    assert ours.choices.height
    with pytest.raises(BadSettings, match="'nobody' is no team"):
        pitchlore.play(home="nobody")
    with pytest.raises(BadSettings, match="robots"):
        pitchlore.play(robots=0)


def test_open(tmp_path):
    """A folder that holds nothing is no league."""
    with pytest.raises(NotFound, match="no such folder"):
        pitchlore.open(tmp_path / "none")
    with pytest.raises(NotFound, match="not a data folder"):
        pitchlore.open(tmp_path)


def public():
    """All public functions, classes and methods, by name."""
    for name in sorted(set(pitchlore.__all__) - {"__version__", "MatchSettings", "Settings", "Pitch", "PitchloreError"}):
        thing = getattr(pitchlore, name)
        yield name, thing
        if inspect.isclass(thing):
            for own, member in inspect.getmembers(thing):
                if not own.startswith("_"):
                    yield f"{name}.{own}", member


@pytest.mark.parametrize(("name", "thing"), list(public()), ids=lambda it: it if isinstance(it, str) else "")
def test_documented(name, thing):
    """Each public name has a docstring; each function says what each argument is, and what it raises."""
    text = inspect.getdoc(thing)
    assert text, name
    if isinstance(thing, (property, TableOf)) or name.endswith((".keys", ".items", ".get")):
        return
    found = parse(text)
    if inspect.isclass(thing) or callable(thing):
        wanted = [parameter for parameter in inspect.signature(thing).parameters if parameter != "self"]
        reported = {part.strip() for entry in found.params for part in entry.arg_name.split(",")}
        assert set(wanted) <= reported | {"options"}, name
        assert found.short_description
    if inspect.isfunction(thing) and wanted:
        assert found.raises, name


@pytest.mark.parametrize("name", [name for name, thing in public() if ">>>" in (inspect.getdoc(thing) or "")])
def test_examples(name, sample, data, tmp_path, monkeypatch):
    """The examples of docstrings give what they say."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(sample, "derby.csv")
    shutil.copytree(data, "league")
    test = doctest.DocTestParser().get_doctest(
        inspect.getdoc(dict(public())[name]), {"pitchlore": pitchlore}, name, None, None)
    said = []
    doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert not said, "".join(said)


@NEEDS_KLOPPY
def test_dataset_of_kloppy():
    """A dataset that kloppy has loaded is read as its files are."""
    from kloppy import skillcorner

    files = [FILES / name for name in SKILLCORNER]
    ours = pitchlore.read(skillcorner.load(*(file.read_bytes() for file in files)))
    theirs = pitchlore.read(*files, provider="kloppy:skillcorner")
    assert ours.info["duration_s"] == theirs.info["duration_s"]
    told = {"direction inferred"}  # the files tell directions, the dataset does not
    assert {flaw: count for flaw, count in ours.flaws.items() if flaw not in told} == theirs.flaws
    assert ours.trajectories.height == theirs.trajectories.height > 100
