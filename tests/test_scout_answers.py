"""A coach's questions answered in small tables: losses, goals, halves, passes, shots, danger, and who is counted."""

import json
import re
from html import unescape

import numpy as np
import polars as pl
import pytest

from pitchlore.pipeline.views.commentary.words import side_names
from pitchlore.pipeline.views.scout.changes import change, change_of_count, reported_changes
from pitchlore.pipeline.views.scout.content.answers import goals_of, kept, of_match, scores_by
from pitchlore.pipeline.views.scout.content.danger import dangerous, of_keeper
from pitchlore.pipeline.views.scout.content.opponent import _within, saves
from pitchlore.pipeline.views.scout.content.sources import against_itself, matches_in_words, played, team_name
from pitchlore.pipeline.views.scout.content.teams import LEAST_S, _led
from pitchlore.pipeline.views.scout.facts import ByLead
from pitchlore.pipeline.views.scout.leadup import lead_ups
from pitchlore.pipeline.views.scout.restarts import Share
from pitchlore.pipeline.views.scout.scored import Scored, again, lost_before, scored, summary
from pitchlore.pipeline.views.scout.shooting import MEANS, shooting
from pitchlore.pipeline.views.scout.words import went_with
from pitchlore.pipeline.views.scout.zones import RobotNumbers, losses, one_role, passing, samples, third
from pitchlore.pipeline.views.scout.zones import robot_numbers as played_by
from pitchlore.schemas import SIDES, Goals, Passes, Possession, Referee, Shots, Situations, Trajectories

MATCH, S = "m", 10**9


def rows(schema, *given):
    """Rows of a schema of which a test says only some columns."""
    return pl.DataFrame([{"match_id": MATCH} | each for each in given], schema=schema.dtypes())


# ---- who loses the ball, and to whom it passes


def test_third():
    """A border belongs to the third ahead; behind a goal line is the third next to it."""
    table = pl.DataFrame({"x": [-0.9, -0.3, -0.25, 0.24, 0.25, 0.9]})
    assert table.select(third("x", 1.5))["x"].to_list() == [0, 0, 1, 1, 2, 2]


def test_losses():
    """Losses only, by the robot that touched last and the third of its match's pitch where they end; a robot without one has zeros."""
    held = rows(Possession, *(
        {"team": "home", "robot": 9, "last_robot": robot, "end_x": x, "ended": ended} for robot, x, ended in (
            (1, -0.7, "lost"), (1, 0.0, "lost"), (1, 0.7, "shot"), (2, 0.7, "lost"), (1, 0.0, "stopped"))))
    one, two, three = losses(held, {MATCH: 1.5}, {1: RobotNumbers("striker", 1.0, 5.0), 3: RobotNumbers("midfield", 0.5, 5.0)})
    assert (one.robot, one.role, one.thirds, one.n, one.per_ten) == (1, "striker", (1, 1, 0), 2, 4.0)
    assert (two.thirds, two.per_ten) == ((0, 0, 1), None), "a robot that is not seen has no rate"
    assert (three.n, three.per_ten, three.role) == (0, 0.0, "midfield for 50 %")
    held = pl.concat([rows(Possession, {"match_id": name, "team": "home", "last_robot": 1, "end_x": 0.5, "ended": "lost"})
                      for name in ("small", "large")])
    assert losses(held, {"small": 1.5, "large": 9.0}, {})[0].thirds == (0, 1, 1)


def test_roles():
    """A robot's role is its commonest, over the matches in which it is seen."""
    found = played_by([({1: {"striker": 6, "midfield": 4}}, 4.0), ({1: {"midfield": 10}, 2: {"striker": 1}}, 6.0)])
    assert found == {1: RobotNumbers("midfield", 0.7, 10.0), 2: RobotNumbers("striker", 1.0, 6.0)}


def test_one_role_of_a_robot():
    """A sentence calls a robot by its longest role in the match, and adds the one that it had then if it is another."""
    robots = {1: RobotNumbers("goalkeeper", 0.7, 1.0), 2: RobotNumbers("striker", 1.0, 1.0)}
    sides = {"Foxes": robots, "Red Foxes": {1: RobotNumbers("midfield", 1.0, 1.0)}}
    assert one_role("Foxes 1 (striker) shoots; Red Foxes 1 (midfield) saves; Foxes 2 (striker) looks; Foxes 3 (midfield), too.", sides) == (
        "Foxes 1 (goalkeeper, here striker) shoots; Red Foxes 1 (midfield) saves; Foxes 2 (striker) looks; Foxes 3 (midfield), too.")


def test_roles_agree_on_a_page(store, pages):
    """On a match's page a robot has one role in the sentences, which is that of the tables."""
    for match in played(store):
        shown = unescape((pages.first.parent / "matches" / f"{match.name}.html").read_text())
        names = side_names(match.home.name, match.away.name)
        for side, robots in samples(match.trajectories).items():
            for number, seen in played_by([(robots, 1.0)]).items():
                said = set(re.findall(rf"{re.escape(names[side])} {number} \((\w+)[,)]", shown))
                assert said <= {seen.role}


def test_passing():
    """A pass is counted once from third to third, and once from robot to robot."""
    given = rows(Passes, *(
        {"team": "home", "robot": a, "receiver": b, "x": x, "to_x": to, "direction": way} for a, b, x, to, way in (
            (1, 2, -0.7, 0.7, "front"), (1, 2, -0.7, 0.0, "left"), (2, 5, 0.0, 0.0, "right"))))
    found = passing(given, {MATCH: 1.5})
    assert found.ways == [[1, 1, 0], [0, 1, 0], [0, 0, 0]], "forward, sideways, back"
    assert found.thirds == [[0, 1, 1], [0, 1, 0], [0, 0, 0]]
    assert (found.robots, found.pairs, found.n) == ([1, 2, 5], [[0, 2, 0], [0, 0, 1], [0, 0, 0]], 3)


# ---- shots


def test_shooting():
    """Totals by outcome, every outcome with its meaning; expected goals only of shots that have some."""
    given = rows(Shots, *({"team": "home", "outcome": outcome, "distance": far} for outcome, far in (
        ("goal", 0.2), ("goal", 0.4), ("wide", 1.0)))).with_columns(xg=pl.Series([0.5, None, 0.1]))
    found = shooting(given)
    assert [row.outcome for row in found.rows] == list(MEANS)
    assert {row.outcome: row.n for row in found.rows if row.n} == {"goal": 2, "wide": 1}
    assert (found.n, found.on_target, found.known, found.scored) == (3, 2, 2, 1)
    assert (found.xg, found.distance) == (pytest.approx(0.6), pytest.approx(0.4))
    none = shooting(given.clear())
    assert (none.n, none.xg, none.distance) == (0, None, None)


@pytest.mark.parametrize(("outcomes", "says"), [
    (["saved", "saved", "goal", "blocked", "own", "missed", "wide"],
     "Of 6 shots on target, other robots blocked 1, after 1 the attackers kept the ball and 1 reached nobody. Of 3 that reached it, it saved 2 (67 %), and 1 went in."),
    (["blocked"], "Of 1 shot on target, other robots blocked 1. None reached it."),
])
def test_saves(outcomes, says):
    """Shots that others block, that a mate receives or that nobody touches are none that a goalkeeper could save."""
    assert saves(rows(Shots, *({"team": "home", "outcome": outcome} for outcome in outcomes))) == says


# ---- goals


GOALS = (
    {"t_ns": 10 * S, "team": "home", "robot": 1, "kind": "direct"},
    {"t_ns": 20 * S, "team": None, "robot": None, "kind": None},
    {"t_ns": 30 * S, "team": "home", "robot": 2, "kind": "error"},
    {"t_ns": 40 * S, "team": "home", "robot": 1, "kind": "indirect"},
    {"t_ns": 50 * S, "team": "home", "robot": None, "kind": None})


def made():
    shots = rows(Shots, *({"team": team, "t_ns": t, "outcome": outcome, "distance": 0.3, "x": 0.6}
                          for team, t, outcome in (("home", 9 * S, "goal"), ("away", 29 * S, "goal"),
                                                   ("home", 39 * S, "saved"))))
    situations = rows(Situations, *({"team": team, "robot": robot, "code": code, "start_ns": t * S, "segment": segment}
                                    for team, robot, code, t, segment in (
        ("home", 1, 1, 7, 0), ("home", 1, 21, 8, 0), ("home", 1, 46, 9.5, 0), ("away", 1, 99, 8, 0),
        ("home", 2, 5, 25, 1), ("home", 2, 6, 26, 1), ("home", 1, 1, 37, 2), ("home", 1, 21, 39, 2))))
    return scored(rows(Goals, *GOALS), shots, situations, 1.5)


def test_goals():
    """A goal has its own shot and what its scorer did up to it; an error has no scorer of the team."""
    direct, error, indirect, unknown = made()
    assert (direct.distance, direct.third, direct.run) == (pytest.approx(0.3), 2, (1, 21)), "not what came after the shot"
    assert (error.distance, error.run, error.clip.team, error.clip.robot) == (None, (), "away", 2)
    assert (indirect.distance, indirect.run) == (None, (1, 21))
    assert (indirect.clip.says, indirect._replace(t_ns=2 * S).clip.start_s) == ("indirect goal", 0.0)
    assert (unknown.kind, unknown.run) == ("unknown", ())


def test_before_goals():
    """A sentence has the last time that the conceding team held the ball, where, and by whom; a touch is none; else the restart."""
    held = rows(Possession, *(
        {"team": team, "start_ns": round(a * S), "end_ns": round(b * S), "segment": segment, "robot": robot, "last_robot": robot,
         "end_x": x, "ended": ended, "passes": passes} for team, a, b, segment, robot, x, ended, passes in (
            ("away", 1, 3, 0, 2, -0.7, "lost", 0), ("home", 3, 6, 0, 1, 0.7, "lost", 2), ("away", 6, 6.1, 0, 3, -0.7, "lost", 0),
            ("home", 6.1, 9, 0, 1, 0.7, "goal", 0), ("home", 12, 15, 1, 1, 0.7, "goal", 0),
            ("away", 21, 23, 2, 2, -0.7, "conceded", 0), ("away", 31, 32, 3, 2, 0.0, "shot", 0), ("home", 32, 39, 3, 1, 0.0, "lost", 0))))
    goals = rows(Goals, *({"t_ns": t * S, "team": team} for t, team in ((10, "home"), (16, "home"), (18, None), (24, "home"), (40, "home"), (50, "home"))))
    told = rows(Referee, {"t_ns": 11 * S, "event": "kick-off", "team": "away"})
    found = lead_ups(goals, held, told, Trajectories.empty(), {"home": "A", "away": "B"}, 1.5)
    assert [each.says for each in found] == [
        "B 2 lost the ball in its own third 7.0 s before; A 1 got it; it passed 2 times.",
        "Kick-off of B 5.0 s before; A 1 got the ball 4.0 s before.",
        "B 2 had the ball for 2.0 s in its own third.",
        "B 2 shot, without a goal, 8.0 s before; A 1 got it.",
        "B 2 shot, without a goal, 18.0 s before; A 1 got it."]
    assert found[0][1:] == (2, 0, 7.0)
    told = rows(Referee, {"t_ns": 11 * S, "event": "fault", "team": "home", "note": "penalty: found from the ball"})
    found_from_ball = lead_ups(goals, held, told, Trajectories.empty(), {"home": "A", "away": "B"}, 1.5)[1]
    assert found_from_ball.says == "Penalty of A 5.0 s before; A 1 got the ball 4.0 s before."
    assert {each.lost_by for each in found[1:]} == {None}
    goal = Scored(MATCH, "home", 10 * S, 1, "direct", None, None, (), found[0])
    (lost,) = lost_before([goal, goal._replace(before=found[1])], {2: "midfield"})
    assert (lost.robot, lost.role, lost.thirds, lost.n, lost.since_s) == (2, "midfield", (1, 0, 0), 1, 7.0)
    assert lead_ups(goals, held.clear(), told, Trajectories.empty(), {}, 1.5)[0].says == ""


def test_summary():
    """Kinds in order, scorers by goals, the commonest run with its n, and up to three clips of each."""
    found = summary(made(), {1: "striker"})
    assert [(line.says, line.n, line.shots) for line in found.kinds] == [
        ("direct", 1, 1), ("indirect", 1, 0), ("error", 1, 0), ("unknown", 1, 0)]
    assert scores_by(made(), {})[0].startswith("4 goals: 1 direct, 1 indirect, 1 by error, 1 unknown.")
    assert _within(Share(8, 140, 0.029, 0.109)) == " (6 % [3, 11])"
    assert (found.scorers[0].says, found.scorers[0].n) == ("robot 1 (striker)", 2)
    assert (found.run.codes, found.run.n, found.run.of) == ((1, 21), 2, 2)
    assert (found.n, found.whole.shots, found.thirds) == (4, 1, (0, 0, 1))
    assert len(found.whole.clips) == 3
    assert summary([], {}).run is None


def test_a_run_in_two_stretches():
    """Situations on both sides of a stop are no run."""
    situations = rows(Situations, *({"team": "home", "robot": 1, "code": 1, "start_ns": t * S, "segment": t} for t in (7, 8)))
    (goal,) = scored(rows(Goals, GOALS[0]), rows(Shots), situations, 1.5)
    assert goal.run == ()


def test_goals_of_a_match(store):
    """Goals from shots are as many as the table shots says; JSON gives them back."""
    for match in played(store):
        goals = goals_of(match)
        assert again(json.loads(json.dumps(goals))) == goals
        answers = of_match(match, kept(match))
        for side in SIDES:
            own = match.shots.filter(team=side)
            assert sum(goal.side == side and goal.distance is not None for goal in goals) == own.filter(outcome="goal").height
            assert answers[side]["shooting"].n == own.height
            assert sum(row.n for row in answers[side]["losses"]) == match.possession.filter(team=side, ended="lost").height
            assert sum(map(sum, answers[side]["passing"].thirds)) == match.passes.filter(team=side).height
            assert samples(match.trajectories)[side].keys() <= {row.robot for row in answers[side]["losses"]}


# ---- halves


def test_change_within_chance():
    """A change of rate that chance gives is not reported as one: 10 to 12 is within, 10 to 40 is beyond."""
    small, great = change_of_count(10, 12, (60.0, 60.0)), change_of_count(10, 40, (60.0, 60.0))
    assert not small.beyond
    assert great.beyond
    assert not change_of_count(50, 100, (60.0, 120.0)).beyond, "the second half is twice as long"
    assert change_of_count(50, 50, (60.0, 120.0)).beyond
    assert (great.low, great.high) == (-14, 14), "binomial of 50 at one half: 18 to 32 lie within 95 %"
    assert reported_changes([("passes", small)]) == "No count changed by more than chance gives."
    assert "passes 10 to 40 (+30; chance gives −14 to +14)" in reported_changes([("passes", great), ("shots", small)])


def test_no_change_is_known():
    """Without a count, or with zero in both, nothing is tested; of shares no chance is said."""
    assert change_of_count(None, 3, (60.0, 60.0)) is None
    assert change_of_count(0, 0, (60.0, 60.0)).low is None
    assert not change(0.1, 0.9).beyond
    assert reported_changes([("goals", None)]) == "No count is known in both halves."


def test_chance_is_held():
    """Control: of counts of one rate, at most 5 % are called larger than chance."""
    pairs = np.random.default_rng(0).poisson(20, (2_000, 2)).tolist()
    assert sum(change_of_count(*pair, (1.0, 1.0)).beyond for pair in pairs) / 2_000 < 0.06


# ---- rates, intervals, danger, matches


def test_short_leads():
    """A match of less than a minute has no rates, but the counts."""
    short = _led("leads", [ByLead(LEAST_S - 1, 5.0, 10.0, 3, 4)])
    assert (short["shots"], short["lost"], short["possession"], short["n"]) == (None, None, None, {"shots": 3, "lost": 4})
    assert _led("leads", [ByLead(LEAST_S, 5.0, 10.0, 3, 4)])["shots"] == 30


def card(name, role, effect, **other):
    low, high = (effect / 20, effect / 5) if effect > 0 else (effect / 5, effect / 20)
    return {"id": name, "role": role, "codes": [44, 21], "support": 10, "effect": effect, "low": low, "high": high} | other


def test_danger():
    """By what V changed with them in all; one that is rare, unsure, without an interval or without the ball is left out."""
    cards = [card("a", "goalkeeper", 0.5), card("b", "striker", 9.0), card("c", "striker", -1.0), card("d", "striker", 8, low=None),
             card("e", "striker", 8.0, support=4), card("f", "goalkeeper", 8.0, codes=[184]), card("g", "striker", 8.0, low=-0.1)]
    found = dangerous(cards, 3)
    assert [(each["id"], each["per_match"]) for each in found] == [("b", 3.0), ("a", pytest.approx(1 / 6))]
    assert [each["id"] for each in dangerous(cards, 3, worse=True)] == ["c"]
    assert of_keeper(found) == ""
    assert "2 of these 3" in of_keeper([card("a", "goalkeeper", 1), card("b", "goalkeeper", 1), card("c", "striker", 1)])


@pytest.mark.parametrize(("row", "says"), [
    ({"value": 0.5}, "better chances: sure"), ({"value": 0.5, "q": 0.06}, "better chances: likely"), ({"value": 0.5, "q": None}, "better chances: likely"),
    ({"value": -0.5, "low": -0.6, "high": -0.4}, "worse chances: sure"), ({"value": 0.5, "support": 4}, "better chances: too few"),
    ({"value": -0.1, "low": -0.3}, "worse chances: too few"), ({"value": 0.5, "low": None, "high": None}, "better chances: too few"),
])
def test_went_with(row, says):
    """How sure it is that a behaviour went with better or worse chances."""
    assert went_with({"support": 5, "low": 0.4, "high": 0.6, "q": 0.05} | row) == f"went with {says}"


def test_counted():
    """Matches of a team against itself are said."""
    assert matches_in_words(1, 0) == "1 match"
    assert matches_in_words(14, 3) == "14 matches, 3 of them against itself, which count from both sides"
    assert matches_in_words(2, 1) == "2 matches, 1 of them against itself, which counts from both sides"
    assert against_itself(team_name("a", "vsss"), []) == 0


# ---- in a browser


def test_filter_finds_words_of_the_behaviour(pages, page):
    """The filter looks at what a behaviour is, on its card and in the table of all; the table sorts."""
    gallery = max((pages.first.parent / "behaviours").iterdir(), key=lambda path: path.stat().st_size)
    page.goto(gallery.as_uri())
    page.fill("[data-least]", "1")
    names = page.locator(".card").evaluate_all("cards => cards.map(card => card.dataset.words)")
    assert page.locator("#rows tr").count() >= len(names)
    name = page.locator("#rows tr").last.locator("td").nth(1).inner_text()
    page.fill("[data-filter]", name)
    shown = page.locator("#rows tr:visible")
    assert shown.first.locator("td").nth(1).inner_text().startswith(name)
    lengths = page.locator(".card").evaluate_all("cards => cards.map(card => Number(card.dataset.length))")
    assert lengths == sorted(lengths), "while words are typed, the plainest behaviour comes first"
    page.fill("[data-filter]", "")
    assert page.locator(".card").evaluate_all("cards => cards.map(card => card.dataset.words)") == names
    page.fill("[data-filter]", "best")
    assert page.locator(".card:visible").count() == 0, "what a clip says is no word of the behaviour"
    page.fill("[data-filter]", "")
    page.locator("th", has_text="Support").click()
    supports = page.locator("#rows tr").evaluate_all("rows => rows.map(row => Number(row.dataset.support))")
    assert supports == sorted(supports)


def test_differences_are_compared(pages, page):
    """A match is headed by its link, a difference is second less first, and leagues are one where they can be."""
    page.goto((pages.first.parent / "compare.html").as_uri())
    matches = page.locator("#matches .found")
    assert matches.locator("thead a").count() == 2
    cells = matches.locator("tbody tr").nth(3).locator("td").all_inner_texts()
    assert int(cells[4].replace("−", "-")) == int(cells[2]) - int(cells[0])
    assert "two leagues" not in page.locator("#teams .found").first.inner_text()
    page.locator("#behaviours .found tbody tr").first.wait_for()
    versions = [page.locator(f"[data-version='{side}']").input_value() for side in (0, 1)]
    teams = [page.locator(f"#behaviours [data-side='{side}']").input_value() for side in (0, 1)]
    assert versions[0] == versions[1]
    assert teams[0] != teams[1]
