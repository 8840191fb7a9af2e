"""The command line: commands that read a data folder."""

import json
import re

import pytest

from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import PUBLIC


def test_sql_output(call, finished):
    """`sql` prints a table for people, and JSON for programs."""
    query = "select code, name, count(*) n from situations group by all order by n desc, code limit 3"
    code, out, _ = call("sql", query, "--data", finished)
    assert code == 0
    assert "3 rows" in out
    code, out, _ = call("sql", query, "--json", "--data", finished)
    rows = json.loads(out)
    assert code == 0
    assert len(rows) == 3
    assert rows[0]["n"] >= rows[1]["n"] >= rows[2]["n"] > 0
    assert set(rows[0]) == {"code", "name", "n"}


def test_large_answer(call, finished):
    """The table shows the beginning of a large answer, and JSON has all rows."""
    _, out, _ = call("sql", "select frame from trajectories order by frame limit 1200", "--data", finished)
    assert "the first 1,000 of 1,200 rows; --json or --csv prints all" in out
    assert 1_000 < out.count("\n") < 1_010
    _, out, _ = call("sql", "select frame from trajectories limit 1200", "--json", "--data", finished)
    assert len(json.loads(out)) == 1200


def test_sql_binds_parameters(call, finished):
    _, out, _ = call("sql", "select count(*) n from situations where team = ? and code = ?::int", "home", "184",
                     "--json", "--data", finished)
    assert json.loads(out)[0]["n"] > 0


def test_sql_as_csv(call, finished):
    """`sql --csv` prints all rows, nested values as JSON, and does not go with --json."""
    query = """select 'a, "b"' as said, [1, 2] xs, {'d': date '2008-06-01'} s, null::integer nothing, 1.5 x,
        'ab'::blob b union all select null, null, null, 7, null, null"""
    code, out, _ = call("sql", query, "--csv", "--data", finished)
    assert (code, out) == (0, 'said,xs,s,nothing,x,b\n"a, ""b""","[1, 2]","{""d"": ""2008-06-01""}",,1.5,6162\n,,,7,,\n')
    _, out, _ = call("sql", "select '=1+1' as '@a', -1.5 as b", "--csv", "--data", finished)
    assert out == "'@a,b\n'=1+1,-1.5\n"
    _, out, _ = call("sql", "select frame from trajectories limit 1200", "--csv", "--data", finished)
    assert out.count("\n") == 1201
    code, out, err = call("sql", "select 1", "--csv", "--json", "--data", finished)
    assert (code, out) == (1, "")
    assert err == "pitchlore: --json and --csv: are two ways to print one answer. Leave one out.\n"


def test_sql_tables(call, tmp_path):
    """`sql --tables` lists all public tables and columns."""
    _, out, _ = call("sql", "--tables", "--json", "--data", tmp_path)
    listed = {(row["table"], row["column"]) for row in json.loads(out)}
    assert listed == {(name, column) for name, schema in PUBLIC.items() for column in schema.dtypes()}


@pytest.mark.parametrize(("query", "said"), [
    ("selec 1", "Parser Error"),
    ("selec 1", "--tables"),
    ("select interval 1 day", "::varchar"),
    ("select * from situation", "situation"),
    ("select * from read_csv('/etc/passwd')", "read_csv may not be called"),
    ("select * from '/etc/passwd.csv'", "disabled"),
])
def test_refused_query(call, finished, query, said):
    """A refused query is one line of error."""
    code, out, err = call("sql", query, "--data", finished)
    assert code == 1
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith("pitchlore: ")
    assert said in err


def test_sql_json_values(call, finished):
    """`sql --json` prints valid JSON, whatever the values."""
    query = """select 'nan'::double x, ['-infinity'::float, 1.5] xs, date '2008-06-01' d, time '12:30' t,
        timestamp '2008-06-01 12:30:00' at_, {'a': timestamptz '2008-06-01 12:30:00+00'} s, 'ab'::blob b,
        sum(range) n, 1.25::decimal(9, 2) q, map {2: 'two'} m from range(4)"""
    code, out, _ = call("sql", query, "--json", "--data", finished)
    assert code == 0
    assert json.loads(out) == [{
        "x": None, "xs": [None, 1.5], "d": "2008-06-01", "t": "12:30:00", "at_": "2008-06-01T12:30:00",
        "s": {"a": "2008-06-01T12:30:00+00:00"}, "b": "6162", "n": 6, "q": 1.25, "m": {"2": "two"},
    }]


def test_situations_command(call):
    """`situations` prints the 32 rules, and with --terms the terms of each league."""
    code, out, _ = call("situations", "--json")
    rules = json.loads(out)
    assert code == 0
    assert {int(rule["code"]) for rule in rules} >= {1, 11, 21, 22, 23, 33, 34, 44, 45, 46, 47, 57, 184}
    assert len({int(rule["code"]) for rule in rules}) == 32
    contact = {}
    for kind in Kind:
        _, out, _ = call("situations", "--terms", "--json", "--kind", kind.value)
        terms = json.loads(out)
        assert len({term["variable"] for term in terms}) == 5
        contact[kind] = next(t["d"] for t in terms if t["term"].upper() == "CONTACT")
    assert contact[Kind.VSSS] == pytest.approx(0.085)
    assert contact[Kind.VSSS] < contact[Kind.SSL] < contact[Kind.SIM2D] < contact[Kind.HUMAN]
    assert "Robot kicks the ball" in call("situations")[1]


def test_terms_can_be_plotted(call, tmp_path):
    code, out, _ = call("situations", "--terms", "--plot", tmp_path / "terms.png")
    assert code == 0
    assert "terms.png" in out
    assert (tmp_path / "terms.png").read_bytes().startswith(b"\x89PNG")


def test_kb_commands(call, copied):
    """`kb` lists, shows and compares versions of the knowledge."""
    _, out, _ = call("kb", "list", "--json", "--data", copied)
    (version,) = json.loads(out)
    assert version["version"] == 1
    assert version["parent"] is None
    _, out, _ = call("kb", "show", "1", "--support", 1, "--json", "--data", copied)
    assert sum(row["kept"] for row in json.loads(out)["behaviours"]) == version["behaviours"] > 0
    assert "same behaviours" in call("kb", "diff", "1", "1", "--data", copied)[1]
    teams = {row["team"] for row in json.loads(out)["behaviours"]}
    for team in teams:
        code, out, _ = call("kb", "show", "--team", team, "--kind", "vsss", "--json", "--data", copied)
        assert (code, {row["team"] for row in json.loads(out)["behaviours"]}) == (0, {team})
        assert f"{team} (vsss), by effect" in call("kb", "show", "--data", copied)[1]
    assert version["imitates"] in {f"{team} (vsss)" for team in teams}
    for words, kept in ((["--role", "striker"], lambda row: row["role"] == "striker"),
                        ([], lambda row: row["support"] >= 5)):
        _, every, _ = call("kb", "show", "1", "--support", 1, "--json", "--data", copied)
        _, some, _ = call("kb", "show", "1", *(words and (*words, "--support", 1)), "--json", "--data", copied)
        rows = json.loads(every)["behaviours"]
        assert json.loads(some)["behaviours"] == [row for row in rows if kept(row)]
        assert 0 < len(json.loads(some)["behaviours"]) < len(rows)
    code, _, err = call("kb", "show", "--team", "nobody", "--data", copied)
    assert (code, f"no behaviour of team 'nobody' (there are: {', '.join(sorted(teams))})" in err) == (1, True)


@pytest.mark.parametrize("words", [("show", "0"), ("verify", "0"), ("diff", "1", "0"), ("diff", "0", "1")])
def test_kb_version_0(call, finished, words):
    """There is no version 0, and the error says which versions there are."""
    code, out, err = call("kb", *words, "--data", finished)
    assert code == 1
    assert out == ""
    assert "no version 0 (there are: 1)" in err


def test_kb_without_knowledge(call, tmp_path):
    """Without knowledge `kb` says what to run."""
    (tmp_path / "inbox").mkdir()
    assert "pitchlore run" in call("kb", "list", "--data", tmp_path)[1]
    code, _, err = call("kb", "show", "--data", tmp_path)
    assert code == 1
    assert "Run `pitchlore run` first" in err


def test_commentary_output(call, finished):
    """`commentary` prints text for people, and JSON for programs."""
    code, out, _ = call("commentary", "early", "--data", finished)
    assert code == 0
    assert "GOAL for blue, 1 : 0!" in out
    assert "possession" in out
    code, out, _ = call("commentary", "early", "--goals", "--json", "--data", finished)
    reported = json.loads(out)
    assert code == 0
    assert {moment["kind"] for moment in reported["moments"]} == {"goal"}
    assert len(reported["moments"]) == reported["summary"]["home"]["score"] + reported["summary"]["away"]["score"]
    code, _, err = call("commentary", "nobody", "--data", finished)
    assert code == 1
    assert "there is no such match" in err


def test_replay_film(call, finished, tmp_path):
    """`replay --gif` writes a small film."""
    film = tmp_path / "film.gif"
    code, out, _ = call("replay", "early", "--gif", film, "--from", "2", "--seconds", "4", "--data", finished)
    assert code == 0
    assert "4 s from 2 s on" in out
    assert film.read_bytes().startswith(b"GIF89a")
    assert 10_000 < film.stat().st_size < 4 * 50_000  # 20 s are at most 1 MB
    assert not (finished / "replays").exists()
    code, _, err = call("replay", "early", "--gif", film, "--from", "9999", "--data", finished)
    assert (code, err.count("\n")) == (1, 1)


def test_replay_writes_one_page(call, copied):
    """`replay` writes one HTML page and says where it is."""
    code, out, _ = call("replay", "early", "--data", copied)
    assert code == 0
    page = next((copied / "replays").glob("early-*.html"))
    assert str(page) in out
    text = page.read_text(encoding="utf-8")
    assert text.lower().startswith("<!doctype html>")
    assert set(re.findall(r"https?://[^/\"' ]+", text)) <= {"http://www.w3.org"}
    code, _, err = call("replay", "nobody", "--data", copied)
    assert code == 1
    assert "there is no such match (there are: early-" in err


def test_match_of_season(call, tmp_path):
    """For a match of a season the error names the season's data folder."""
    own = tmp_path / "seasons" / "club-static-1"
    Store(tmp_path).commit(Work("seasons", own.name, {}, version=1), Made(details={"store": f"seasons/{own.name}"}))
    Store(own).commit(Work("matches", "learned-static-7-0123456789ab", {}, version=1), Made())
    code, _, err = call("replay", "learned-static-7", "--data", tmp_path)
    assert code == 1
    assert f"learned-static-7: is a match of the season club-static-1. Add `--data {own}`." in err
