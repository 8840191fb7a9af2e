"""The commentary: what is reported of hand-made scenes, and what a reader relies on in a recording."""

import functools
import re

import polars as pl
import pytest
from golden.cases import _log
from support.handmade import derived, handmade
from support.logs import referee_rows, swapped
from support.scenes import film, goes, stands

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.settings import EventSettings
from pitchlore.pipeline.stages.events.derive import events as found_in
from pitchlore.pipeline.views.commentary import CommentarySettings, commentary
from pitchlore.pipeline.views.commentary.moments import of_the_referee
from pitchlore.pipeline.views.commentary.spells import spells
from pitchlore.pipeline.views.commentary.summary import heading
from pitchlore.pipeline.views.commentary.words import (
    enumerated,
    in_digits,
    metres,
    percent,
    restart_sentence,
    story,
    time_elapsed,
)
from pitchlore.schemas import Goals, Matches, Situations

VSSS = PITCHES[Kind.VSSS]
KEEPER = {"away-0": stands(0.70, 0.0), "home-1": stands(-0.06, 0.0)}
ROLES_ = {"away-0": "goalkeeper", "home-1": "striker", "home-2": "midfield"}
S = 1_000_000_000


def about(**values):
    """A row of schema Matches."""
    row = dict.fromkeys(Matches.dtypes())
    row |= {"match_id": "scene", "home": "us", "away": "them", "duration_s": 4.0, "score_home": 0, "score_away": 0}
    return pl.DataFrame([row | values], schema=Matches.dtypes())


def scored(*rows):
    """Rows of schema Goals from (seconds, team, robot, kind)."""
    rows = [("scene", round(t * S), *rest, "referee", None) for t, *rest in rows]
    return pl.DataFrame(rows, schema=Goals.dtypes(), orient="row")


def done(*rows):
    """Rows of schema Situations from (team, robot, role, code, start, end in seconds)."""
    rows = [("scene", team, robot, role, code, "name", round(a * S), round(b * S), None, None, 0)
            for team, robot, role, code, a, b in rows]
    return pl.DataFrame(rows, schema=Situations.dtypes(), orient="row")


def events_of(bodies, referee=None):
    """Possession, passes and shots of a table of trajectories."""
    return found_in(bodies, referee_rows() if referee is None else referee, VSSS, EventSettings())[:3]


def tell(bodies, *, seconds=4.0, events=(), goals=(), situations=(), match=None, **changes):
    seen, referee = film(bodies, seconds, roles=ROLES_), referee_rows(*events)
    held, passed, shot = events_of(seen, referee)
    return commentary(handmade(
        VSSS, matches=about() if match is None else match, referee=referee, goals=scored(*goals),
        situations=done(*situations), trajectories=seen, possession=held, passes=passed, shots=shot,
    ), CommentarySettings(**changes))


def of_kind(reported, *kinds):
    return [moment.text for moment in reported.moments if moment.kind in kinds]


def rolls(to_x, to_y=0.0, *, leaves=1.0, speed=1.0):
    """The ball at the centre, that rolls to a place from a second on."""
    arrives = leaves + (to_x**2 + to_y**2) ** 0.5 / speed
    return goes((0, 0, 0, 0), (leaves, 0, 0, 0), (arrives, to_x, to_y, 0))


def test_human_like_note():
    """A human-like team is said to be a second script."""
    reported = tell({"ball": rolls(0.1), **KEEPER}, match=about(away="human-like"))
    assert "a second script" in reported.summary.note
    assert heading(reported.summary)[1] == f"{reported.summary.note}."
    reported = tell({"ball": rolls(0.1), **KEEPER})
    assert reported.summary.note is None
    assert len(heading(reported.summary)) == 1


@pytest.mark.parametrize(("ball", "in_the_way", "said", "counts"), [
    (rolls(0.64), {}, "us 1 (striker) shoots from 0.75 m; them 0 (goalkeeper) saves.", (1, 1, 1)),
    (rolls(0.44), {"away-1": stands(0.5, 0.0)}, "us 1 (striker) shoots from 0.75 m; them 1 (midfield) is in the way.", (1, 1, 0)),
    (rolls(0.75, 0.3), {}, "us 1 (striker) shoots from 0.75 m, wide.", (1, 0, 0)),
    # nobody stops it, and it does not go in
    (goes((0, -0.3, 0, 0), (1, 0, 0, 0), (1.25, 0.2, 0, 0), (4, 0.2, 0.3, 0)), {}, "us 1 (striker) shoots from 0.75 m at the goal.", (1, 1, 0)),
])
def test_shot(ball, in_the_way, said, counts):
    """A shot is reported with what came of it, and is on target unless it is wide; a goalkeeper alone saves."""
    reported = tell({"ball": ball, **in_the_way, **KEEPER}, play_apart_s=0)
    assert of_kind(reported, "shot", "save") == [said]
    assert (reported.summary.home.shots, reported.summary.home.on_target, reported.summary.away.saves) == counts


def test_shot_before_the_end():
    """A blocked shot just before the end is left out, a save is not."""
    assert of_kind(tell({"ball": rolls(0.44), "away-1": stands(0.5, 0.0), **KEEPER}), "shot") == []
    assert len(of_kind(tell({"ball": rolls(0.64), **KEEPER}), "save")) == 1


@pytest.mark.parametrize(("gives", "to", "said"), [
    ((-0.6, 0), (-0.2, 0), "passes forward"), ((-0.2, 0), (-0.6, 0), "passes back"), ((-0.2, 0), (-0.2, 0.4), "passes"),
    ((0, 0.5), (0.4, 0.5), "plays a through pass"),
])
def test_pass(gives, to, said):
    """A pass is reported with its direction, if it goes some way."""
    mates = {"home-1": stands(*gives), "home-2": stands(*to), "away-0": stands(0.7, -0.5), "away-1": stands(0.1, -0.5)}
    way = {"ball": goes((0, *gives, 0), (1, *gives, 0), (2, *to, 0), (4, *to, 0)), **mates}
    assert of_kind(tell(way, play_apart_s=0), "pass") == [f"us 1 (striker) {said} to us 2 (midfield)."]
    assert of_kind(tell(way, play_apart_s=0, pass_m=2.5), "pass") == []


def test_possession():
    """The share of possession is that of the time in which a team has the ball."""
    # rolls 0.64 m at 1 m/s from 2 s; within 0.0775 m of x = 0.70 from x = 0.6225 on
    reported = tell({"ball": rolls(0.64, leaves=2.0), **KEEPER})
    assert reported.summary.home.possession == pytest.approx(2.625 / 3.975, abs=1e-6)


#: Where home 1 touches the ball alone, where away 1 does, and where home 2 and away 2 press it between them.
PLACES = {"h": (0.0, -0.3), "a": (0.0, 0.3), "d": (0.4, 0.0)}
BETWEEN = {"home-1": stands(0.0, -0.36), "away-1": stands(0.0, 0.36), "home-2": stands(0.34, 0.0),
           "away-2": stands(0.46, 0.0)}


def goes_between(places):
    """The ball, for half a second each at one of the places, half a second on its way to the next."""
    return goes(*((i + t, *PLACES[place], 0) for i, place in enumerate(places) for t in (0, 0.5)))


def test_spells():
    """A team's time on the ball goes on over a duel after which it has it again, and ends with the other's touch."""
    bodies = film({"ball": goes_between("hdhdad"), **BETWEEN}, 6.0, roles=ROLES_)
    possession, passes, _ = events_of(bodies)
    first, second, third = spells(possession, passes, bodies, {"home": "us", "away": "them"})
    assert (first.team, first.robots, first.lost_by) == ("home", (1, 2), None)
    assert (second.team, second.robots, second.lost_by) == ("away", (1,), ("home", 2, "us 2 (midfield)"))
    assert (third.team, third.robots) == ("home", (2,))
    assert first.held_s < first.seconds, "the duel is left out"
    assert first.end_ns == first.until_ns == second.start_ns
    assert third.end_ns < third.until_ns == bodies["t_ns"].max(), "a duel goes on until the end"
    assert first.held_s + second.held_s + third.held_s == pytest.approx(
        (possession["end_ns"] - possession["start_ns"]).sum() / 1e9)


def test_kept():
    """A long time on the ball is reported with the robots that had it and where it came from."""
    ball = goes((0, 0.4, 0.3, 0), (1, 0.4, 0.3, 0), (2, -0.3, 0.3, 0), (3, -0.3, 0.3, 0), (4, 0.3, 0.3, 0), (5, 0.3, 0.3, 0),
                (6, -0.3, 0.3, 0))
    bodies = {"ball": ball, "away-1": stands(0.46, 0.3), "home-1": stands(-0.36, 0.3), "home-2": stands(0.3, 0.36)}
    said = [text for text in of_kind(tell(bodies, seconds=7, play_apart_s=0), "possession") if "keeps" in text]
    assert said == ["us 2 (midfield) gets the ball from them 1 (goalkeeper) and keeps it with 1 for 6 s."]
    lost = [("away", 1, "midfield", 22, 0.9, 1.3)]
    assert "takes the ball from" in of_kind(
        tell(bodies, seconds=7, play_apart_s=0, situations=lost), "possession")[0]


@pytest.mark.parametrize(("places", "said"), [
    ("ha" * 9, r"A scramble: in 18 s the ball changes sides 17 times; (us|them) has 5\d % of the possession\."),
    ("hhhha" + "d" * 13, r"A scramble: in 18 s the ball changes sides 2 times, and nobody has it for 1\d s; us has .*"),
    ("h" * 12 + "a" * 6, r"us has 6[67] % of the possession in the next 18 s\."),
    ("a" * 12 + "h" * 6, r"them has 6[67] % of the possession in the next 18 s\."),
])
def test_lull(places, said):
    """When nothing else happens, possession is reported: a scramble if sides change often, or if duels are long."""
    bodies = {"ball": goes_between(places), **BETWEEN}
    reported = tell(bodies, seconds=18, spell_s=20, match=about(duration_s=18.0), events=[(-0.1, "kick-off", "home")])
    (text,) = of_kind(reported, "possession")
    assert re.fullmatch(said, text), text


def test_goal():
    """A goal is reported with its maker, its kind and what led to it."""
    bodies = {"ball": rolls(0.64), **KEEPER}
    events = [(0, "kick-off", "home"), (3.0, "goal", "home"), (3.0, "kick-off", "away")]
    led = [("home", 1, "striker", 44, 0.2, 0.5), ("home", 1, "striker", 21, 0.9, 1.1), ("home", 1, "striker", 57, 1.2, 1.4)]
    reported = tell(bodies, events=events, goals=[(3.0, "home", 1, "indirect")], situations=led)
    assert of_kind(reported, "goal") == [
        ("GOAL for us! us 1 (striker), indirect action: reaches the ball, kicks it;"
        " it goes in off them 0 (goalkeeper).")
    ]
    assert reported.summary.home.scorers == {1: 1}
    changed = [("home", 1, "midfield", 47, 0.2, 0.5), *led[1:]]
    told = tell(bodies, events=events, goals=[(3.0, "home", 1, "indirect")], situations=changed)
    assert "us 1 (striker), indirect action: is hit by the ball, kicks it;" in of_kind(told, "goal")[0]
    wrong = tell(bodies, events=events, goals=[(3.0, "home", 0, "error")], situations=[*led, ("away", 0, "goalkeeper", 21, 2.0, 2.5)])
    assert of_kind(wrong, "goal") == ["GOAL for us! Own goal of them 0 (goalkeeper): kicks the ball; it is in."], "it held the ball"
    off = tell(bodies, events=[(1.7, "goal", "home")], goals=[(1.7, "home", 0, "error")], situations=led)
    assert of_kind(off, "goal") == [
        "GOAL for us! us 1 (striker) reaches the ball, kicks it; it goes in off them 0 (goalkeeper)."], "a touch is no error"
    assert wrong.summary.home.scorers == {}
    assert wrong.summary.home.goals == {"direct": 0, "indirect": 0, "error": 1}


def test_unknown_goal():
    """If no maker of a goal is known, nothing but the goal is said."""
    reported = tell({"ball": stands(0, 0.5), **KEEPER}, events=[(3.0, "goal", None)], goals=[(3.0, None, None, None)])
    assert of_kind(reported, "goal") == ["GOAL!"]


def test_kick_offs():
    """The kick-off of a half is reported, and the one after a goal is not."""
    events = [(0, "kick-off", "home"), (1, "goal", "home"), (1.5, "kick-off", "away"), (2, "half", None),
              (2, "kick-off", "away"), (4, "end", None)]
    reported = tell({"ball": stands(0, 0.5), **KEEPER}, events=events, goals=[(1, "home", None, None)])
    assert [(moment.kind, moment.t_ns // S) for moment in reported.moments] == [
        ("kick-off", 0), ("goal", 1), ("half", 2), ("kick-off", 2), ("end", 4)]


def test_chance_near_goal():
    """A chance shortly before a goal is counted, but not reported."""
    bodies = {"ball": rolls(0.64), **KEEPER}
    goal = {"events": [(2.5, "goal", "away")], "goals": [(2.5, "away", 0, "direct")]}
    assert of_kind(tell(bodies, **goal), "save") == []
    assert tell(bodies, **goal).summary.away.saves == 1
    assert len(of_kind(tell(bodies, **goal, chances_apart_s=1.0), "save")) == 1


def test_empty_match():
    """A match in which nothing happens is reported as that."""
    reported = tell({"ball": stands(0, 0.5)})
    assert of_kind(reported, "end") == ["The recording ends, 0 : 0."]
    assert reported.summary.home.possession is None
    assert reported.summary.home.situations == {}


def test_words():
    """The seconds that are over, lengths, lists, restarts and what led to a goal are put into words."""
    assert [time_elapsed(t_ns) for t_ns in (0, 59_999_999_999, 600 * S)] == ["0:00", "0:59", "10:00"]
    assert [metres(x) for x in (0.345, 3.45, 34.5)] == ["0.34 m", "3.5 m", "34 m"]
    assert [enumerated(x) for x in (["a"], ["a", "b"], ["a", "b", "c"])] == ["a", "a and b", "a, b and c"]
    assert restart_sentence("freeball", None) == restart_sentence("free ball", None) == "The ball is stuck: free ball."
    assert restart_sentence("kick_in_l", "home") == "Kick in for home."
    assert restart_sentence("DirectAlly", None) == "Play restarts (DirectAlly)."
    assert restart_sentence("penalty: found from the ball", "home") == "Penalty for home."
    assert restart_sentence(None, "away") == "Play restarts for away."
    assert story([("a", 44), ("a", 21), ("b", 45), ("a", 21)]) == (
        "a reaches the ball, kicks it; b receives it; a kicks it")
    assert story([("a", 44), ("b", 45)], named="a") == "reaches the ball; b receives it"


@functools.cache
def recorded():
    return derived(_log(0.0, 60.0))


def test_recording():
    """Every goal and restart of a recording is reported in order."""
    tables = recorded()
    referee, goals = tables["referee"], tables["goals"]
    reported = commentary(handmade(VSSS, **tables))
    times = [moment.t_ns for moment in reported.moments]
    assert times == sorted(times)
    assert [m.t_ns for m in reported.moments if m.kind == "goal"] == goals["t_ns"].to_list()
    assert sum(m.kind == "restart" for m in reported.moments) == (referee["event"] == "fault").sum()
    assert reported.summary.home.possession + reported.summary.away.possession == pytest.approx(1)
    assert 4 <= len(reported.moments) <= 15  # a minute: neither silent nor a dump


def test_annulled_goal():
    """A goal that the referee annuls is reported with its reason; another stop is left out."""
    notes = ["goal kick: goal annulled, too many attackers in the area", "goal kick: too many attackers in the area"]
    events = [("stop", notes[0]), ("fault", "goal kick"), ("stop", notes[1]), ("fault", "goal kick"), ("end", "end")]
    rows = pl.DataFrame([
        {"t_ns": at, "event": event, "team": None, "score_home": 0, "score_away": 0, "note": note}
        for at, (event, note) in enumerate(events)
    ])
    reported = [(moment.kind, moment.text) for moment in of_the_referee(rows, pl.DataFrame(), {})]
    assert reported[0] == ("annulled", "No goal: too many attackers in the area.")
    assert [kind for kind, _ in reported[1:]] == ["restart", "restart", "end"]


def test_teams_swapped():
    """Teams swapped and the pitch turned, the commentary is the same: it names the teams."""
    tables = recorded()

    def exchanged(table):
        scores = {"score_home": "score_away", "score_away": "score_home"}
        return swapped(table).with_columns(**scores if "score_home" in table.columns else {})

    other_way = {name: exchanged(table) for name, table in tables.items() if name != "matches"}
    turned = other_way["trajectories"].with_columns(-pl.col("x"), -pl.col("y"))
    mirrored = tables["matches"].with_columns(
        home="away", away="home", score_home="score_away", score_away="score_home")
    ours = commentary(handmade(VSSS, **tables))
    theirs = commentary(handmade(VSSS, **other_way | {"trajectories": turned, "matches": mirrored}))
    assert theirs.summary.home == ours.summary.away
    assert theirs.summary.away == ours.summary.home

    def without_scores(reported):
        return [(moment.t_ns, moment.kind, [word for word in moment.text.split() if not word.strip(",.;:!").isdigit()])
                for moment in reported.moments]

    assert without_scores(theirs) == without_scores(ours)


def test_team_against_itself():
    """A team that plays itself has its side beside its name."""
    reported = tell({"ball": stands(0, 0.5), **KEEPER}, events=[(0, "kick-off", "home")], match=about(away="us"))
    assert of_kind(reported, "kick-off") == ["Kick-off for us (home)."]


def test_numbers_in_words():
    """A share has a space before its sign, a number a minus that is no hyphen, and what rounds to zero has none."""
    assert [percent(share) for share in (None, 0.0, 0.004, 0.626, 0.998, 1.0)] == [
        "–", "0 %", "0.4 %", "63 %", "99.8 %", "100 %"]
    assert [in_digits(value) for value in (None, -1.5, -0.001)] == ["–", "−1.50", "0.00"]
