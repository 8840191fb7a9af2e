"""Acts, what followed them, and what a team is told of them: in SQL, in Python and on the page it is the same."""

import html

import numpy as np
import polars as pl
import pytest

from pitchlore.flows.commands.printing import print_cards
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.settings import ActSettings
from pitchlore.pipeline.stages.acts.derive import ValueCourse, acts
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.views.card import Card, Sentence, _card, cards, lost_most, often
from pitchlore.schemas import Acts, Goals, Passes, Possession, Pressure, Shots, Trajectories, Values

S = 1_000_000_000
#: V to home is .1 until 4 s, .3 from then on, in one segment of ten seconds.
COURSE = ValueCourse(np.arange(0, 10 * S, S // 5), np.zeros(50, np.int64), np.where(np.arange(50) < 20, 0.1, 0.3),
                np.array([5 * S]), np.array([-1.0]))


def rows(schema, *given):
    """Rows of a schema; what is not given is empty, as far as that may be."""
    usual = {"match_id": "m-1", "segment": 0, "robot": 1, "last_robot": 1, "touches": 1, "passes": 0}
    return pl.DataFrame([{name: ({**usual, **row}).get(name) for name in schema.dtypes()} for row in given],
                        schema=schema.dtypes())


def test_by_hand():
    """Home loses the ball before their goal, away wins it and scores a second later; a pass long before is usual."""
    ball = [{"t_ns": int(t), "frame": n, "team": "ball", "x": 0.1, "y": 0.1} for n, t in enumerate(COURSE.t_ns)]
    robots = [{"t_ns": 4 * S, "frame": 20, "team": "home", "role": "striker"}]
    tables = {
        "trajectories": rows(Trajectories, *ball, *robots), "values": rows(Values, *(
            {"t_ns": int(t), "home": v, "away": 0.0} for t, v in zip(COURSE.t_ns, COURSE.value, strict=True))),
        "possession": rows(
            Possession, {"team": "home", "start_ns": 2 * S, "end_ns": 4 * S, "end_x": 0.6, "end_y": 0.0, "ended": "lost"},
            {"team": "away", "start_ns": 4 * S, "end_ns": 5 * S, "x": -0.6, "y": 0.6, "ended": "goal"}),
        "passes": rows(Passes, {"team": "home", "t_ns": S, "x": 0.0, "y": 0.0, "direction": "left"}),
        "pressure": Pressure.empty(), "shots": Shots.empty(), "goals": rows(Goals, {"t_ns": 5 * S, "team": "away"})}
    found = acts(tables, PITCHES[Kind.VSSS], ActSettings())
    assert Acts.holds(found)
    shown = found.select("team", "role", "act", "place", "before", "after", "goal", "goal_ns")
    assert shown.rows() == [
        ("home", None, "passes sideways", "in midfield", pytest.approx(0.1), pytest.approx(0.1), "against", 5 * S),
        ("home", "striker", "loses the ball", "in front of their goal", pytest.approx(0.1), -1.0, "against", 5 * S),
        ("away", None, "wins the ball", "in its own corner", pytest.approx(-0.1), 1.0, "for", 5 * S)]
    before, after = COURSE.change(COURSE.t_ns, np.zeros(50, np.int64), ActSettings())
    assert found["usual"].to_list() == [pytest.approx((after - before).mean()), None, None], "the ball was in midfield"
    assert acts({**tables, "possession": Possession.empty(), "passes": Passes.empty()}, PITCHES[Kind.VSSS],
                ActSettings()).equals(Acts.empty())


def test_course():
    """V at a time is that of the nearest moment of the same segment, and is not known in one without moments."""
    two = COURSE._replace(segment=np.repeat([0, 2], 25), value=np.arange(50.0))
    asked = np.array([0, 4.9 * S, 5.2 * S, 5.2 * S, 99 * S, S], dtype=np.int64)
    np.testing.assert_array_equal(two.at(asked, np.array([0, 0, 0, 2, 2, 1])), [0, 24, 24, 26, 49, np.nan])


def test_answers_are_those_of_the_acts(store):
    """The view gives what polars makes of the same rows, counts each goal once, and calls sure what the docs say."""
    catalogue, _ = refresh(store)
    found, sides = League(store).ask("from answers"), ask(catalogue, "from sides")
    each = ask(catalogue, "from acts").drop_nulls("role").join(
        sides.select("match_id", "kind", own="team", team="side"), on=("match_id", "team"))
    worth, key = pl.col("after") - pl.col("before") - pl.col("usual"), ("own", "kind", "role", "act", "place")
    expected = each.group_by(key).agg(
        n=pl.len(), value=worth.mean(), half=1.96 * worth.std() / worth.count().sqrt(),
        goals=pl.struct("match_id", "goal_ns").filter(pl.col("goal") == "for").n_unique()).rename({"own": "team"})
    both = found.join(expected, on=("team", "kind", "role", "act", "place"), how="full", suffix="_2")
    assert both.height == found.height == expected.height > 20
    assert both.select(
        n=pl.col("n") == pl.col("n_2"), goals=pl.col("goals_for") == pl.col("goals"),
        value=(pl.col("value") - pl.col("value_2")).abs().fill_null(0) < 1e-9,
        low=(pl.col("value") - pl.col("half") - pl.col("low")).abs().fill_null(0) < 1e-9,
        few=(pl.col("n") >= 5) | (pl.col("says") == "too few"),
        apart=(pl.col("says") == "too few") | (pl.col("low") * pl.col("high") > 0),
        effect=(pl.col("effect") - pl.col("value") * pl.col("each_match")).abs().fill_null(0) < 1e-9,
    ).select(pl.all().all()).row(0) == (True,) * 7
    assert League(store).lazy("answers").collect().equals(found)


def test_lost_balls_before_goals():
    """The lost ball that most goals against followed is told though V may have fallen by chance, with the count; a team of few goals tells none."""
    usual = {"team": "a", "kind": "vsss", "role": "striker", "act": "loses the ball", "place": "in midfield", "n": 40, "each_match": 6.0,
             "effect": -0.1, "goals_for": 1, "goals_against": 4, "says": "too few"}
    answers = pl.DataFrame([
        usual, usual | {"role": "goalkeeper", "place": "in its own corner", "goals_against": 11},
        usual | {"role": "midfield", "act": "presses", "goals_against": 30}, usual | {"place": "on the wing", "effect": 0.2, "says": "sure", "goals_against": 20},
        usual | {"act": "passes back", "effect": -2.0, "says": "sure"}])
    assert lost_most(answers, 34)["role"].to_list() == ["goalkeeper"]
    assert lost_most(answers, 60).is_empty(), "less than a fifth of the goals"
    assert lost_most(answers.with_columns(goals_against=2), 4).is_empty(), "two goals are few"
    clips = pl.DataFrame([{"team": "a", "kind": "vsss", "role": row["role"], "act": row["act"], "place": row["place"], "match_id": "m", "side": side,
                           "robot": 1, "t_ns": 9 * S} for row in answers.iter_rows(named=True) for side in ("home", "away")])
    counts = pl.DataFrame({"match_id": ["m"], "duration_s": [60.0], "act": ["shoots"], "n": [1]})
    told = _card("a", "vsss", answers, pl.DataFrame({"scored": [9], "conceded": [34]}), clips, counts)
    assert [(it.says, it.goals, it.sure, it.team) for it in told.loses] == [
        ("Striker passes back in midfield", "4 of 34 goals against it followed", "sure", "home"),
        ("Goalkeeper loses the ball in its own corner", "11 of 34 goals against it followed", "too few", "home")]
    assert [(it.says, it.team) for it in told.wins] == [("Striker loses the ball on the wing", "away")], "where V rose most"


def test_the_card_names_the_newest_match(capsys):
    """The end of a run says which match is the newest, and what it changed."""
    told = Sentence("Goalkeeper loses the ball", "often", "11 of 34 goals against it followed", "too few", -0.1, "m", "home", 1, 0, 1, 0.5)
    print_cards([Card("a", "vsss", [], [told], ["Presses less often"], newest="foxes-wolves-1"), Card("b", "vsss", [], [], [], newest="bears-1")])
    assert capsys.readouterr().out.splitlines() == [
        "a: what went with winning", "  too few matches tell yet", "a: what went with losing",
        "  Goalkeeper loses the ball, often; 11 of 34 goals against it followed (may be chance)",
        "  newest match: foxes-wolves-1", "    Presses less often",
        "b: what went with winning", "  too few matches tell yet", "b: what went with losing", "  too few matches tell yet", "  newest match: bears-1"]


def test_answer(copied, call):
    """A run with nothing new says the answer again, as it was kept; a team that is not there is refused, once."""
    first, again = (call("run", "--data", copied)[1] for _ in range(2))
    card = first[first.index("blue: what went with winning"):]
    assert again.endswith(f"As before:\n{card}")
    (settings := copied.parent / "s.toml").write_text('[scout]\nmine = "yellow"\n')
    out = call("run", "--settings", settings, "--data", copied)[1]
    assert "blue: what" not in out
    assert "Other teams: blue. `pitchlore scout --mine blue`\n" in out
    for pages in ("false", "true"):
        settings.write_text(f'[scout]\nmine = "bleu"\nrefresh = {pages}\n')
        code, out, err = call("run", "--settings", settings, "--data", copied)
        assert (code, (out + err).count("no team of the league has this name (did you mean blue?)")) == (1, 1)


def test_card(store, pages, call):
    """The first page begins with what the view says of the newest match's teams; an unknown team is refused."""
    told = cards(store)
    assert len(told) == 2
    text = html.unescape(pages.first.read_text())
    for card in told:
        own = League(store).ask("from answers where team = ? and kind = ? and says <> 'too few'", card.team, card.kind)
        best = own.filter(pl.col("effect") > 0).sort("effect", descending=True).head(3)
        assert [it.effect for it in card.wins] == best["effect"].to_list()
        for it in (*card.wins, *card.loses):
            assert len(it.says.split()) <= 10
            assert it.says in text
            assert it.often in text
    assert [card.team for card in cards(store, told[0].team)] == [told[0].team]
    with pytest.raises(NotFound, match="no team of the league"):
        cards(store, "nobody")
    code, _, err = call("scout", "--mine", "nobody", "--data", str(store.root))
    assert (code, "nobody: no team of the league has this name (there are: " in err) == (1, True)
    assert (often(3.4), often(0.3)) == ("3 times a match", "0.3 times a match")
