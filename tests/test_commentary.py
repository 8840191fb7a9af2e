"""The commentary: what is told of hand-made scenes, and what a reader relies on in a recording."""

from __future__ import annotations

import functools

import numpy as np
import polars as pl
import pytest
from golden.cases import _log
from support.logs import referee_rows
from support.scenes import film, goes, stands

from pipeline import matches
from pipeline.goals import attribute
from pipeline.pitch import PITCHES, Kind
from pipeline.settings import Settings
from pipeline.situations.recognise import recognise
from pipeline.trajectories.derive import trajectories
from pipeline.views.commentary import CommentarySettings, commentary
from pipeline.views.commentary.moments import of_the_referee
from pipeline.views.commentary.summary import heading
from pipeline.views.commentary.touches import spells, touches
from pipeline.views.commentary.words import clock, listed, metres, restart, story
from schemas import Goals, Matches, Situations

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
    rows = [("scene", round(t * S), *rest) for t, *rest in rows]
    return pl.DataFrame(rows, schema=Goals.dtypes(), orient="row")


def done(*rows):
    """Rows of schema Situations from (team, robot, role, code, start, end in seconds)."""
    rows = [("scene", team, robot, role, code, "name", round(a * S), round(b * S), None, None, 0)
            for team, robot, role, code, a, b in rows]
    return pl.DataFrame(rows, schema=Situations.dtypes(), orient="row")


def tell(bodies, *, seconds=4.0, events=(), goals=(), situations=(), **changes):
    seen = film(bodies, seconds, roles=ROLES_)
    return commentary(about(), referee_rows(*events), scored(*goals), done(*situations), seen, VSSS,
                      CommentarySettings(**changes))


def of_kind(told, *kinds):
    return [moment.text for moment in told.moments if moment.kind in kinds]


def rolls(to_x, to_y=0.0, *, leaves=1.0, speed=1.0):
    """The ball at the centre, that rolls to a place from a second on."""
    arrives = leaves + (to_x**2 + to_y**2) ** 0.5 / speed
    return goes((0, 0, 0, 0), (leaves, 0, 0, 0), (arrives, to_x, to_y, 0))


def test_human_like_note():
    """A human-like team is said to stand in for people."""
    told = commentary(about(away="human-like"), referee_rows(), scored(), done(), film({"ball": rolls(0.1), **KEEPER}, 4.0, roles=ROLES_), VSSS)
    assert "stands in for people" in told.summary.note
    assert heading(told.summary)[1] == f"{told.summary.note}."
    told = tell({"ball": rolls(0.1), **KEEPER})
    assert told.summary.note is None
    assert len(heading(told.summary)) == 1


def test_save():
    """A goalkeeper saves a ball that would have gone in."""
    told = tell({"ball": rolls(0.64), **KEEPER})
    assert of_kind(told, "save") == ["home 1 (striker) shoots from 0.75 m; away 0 (goalkeeper) saves."]
    assert (told.summary.home.shots, told.summary.home.on_target, told.summary.away.saves) == (1, 1, 1)


def test_blocked_shot():
    """Any robot but the goalkeeper is in the way of a shot."""
    told = tell({"ball": rolls(0.44), "away-1": stands(0.5, 0.0), **KEEPER})
    assert of_kind(told, "shot") == ["home 1 (striker) shoots from 0.75 m; away 1 (midfield) is in the way."]
    assert told.summary.away.saves == 0


@pytest.mark.parametrize(("to_y", "said"), [(0.3, ["home 1 (striker) shoots from 0.75 m, wide."]), (0.5, [])])
def test_wide_shot(to_y, said):
    """A ball beside the goal is a wide shot up to a goal width from its centre."""
    told = tell({"ball": rolls(0.75, to_y), **KEEPER})
    assert of_kind(told, "shot", "save") == said
    assert told.summary.home.on_target == 0


def test_slow_ball():
    """A ball that would not arrive in time is no shot."""
    slow = {"ball": rolls(0.64, speed=0.5), **KEEPER}
    assert tell(slow).summary.home.shots == 0
    assert tell(slow, shot_s=2.0).summary.home.shots == 1


def test_pass():
    """A pass goes some way to a team-mate."""
    mate = {"home-2": stands(0.36, 0.0), "home-1": stands(-0.06, 0.0), "away-0": stands(0.7, 0.5)}
    told = tell({"ball": rolls(0.3), **mate}, shot_s=0.1, play_apart_s=0)
    assert of_kind(told, "pass") == ["home 1 (striker) passes forward to home 2 (midfield)."]
    near = {**mate, "home-2": stands(0.2, 0.0)}
    assert of_kind(tell({"ball": rolls(0.14), **near}, shot_s=0.1, play_apart_s=0), "pass") == []


def test_possession():
    """The ball belongs to the team that touched it last."""
    bodies = film({"ball": rolls(0.64, leaves=2.0), **KEEPER}, 4.0, roles=ROLES_)
    found = touches(bodies, VSSS, CommentarySettings())
    assert [(touch.team, touch.robot) for touch in found] == [("home", 1), ("away", 0)]
    first, second = spells(found, bodies)
    # rolls 0.64 m at 1 m/s from 2 s; within 0.0775 m of x = 0.70 from x = 0.6225 on
    assert first.end_ns == second.start_ns == 2.625 * S
    assert first.seconds == pytest.approx(2.625)
    assert tell({"ball": rolls(0.64, leaves=2.0), **KEEPER}).summary.home.possession == pytest.approx(
        2.625 / 3.975, abs=1e-9)


#: Distances of home 1 and away 1 to the ball: one nearer (h, a), one alone (H, A), neither (.).
DUEL = {"h": (0.06, 0.07), "a": (0.07, 0.06), "H": (0.06, 0.10), "A": (0.10, 0.06), ".": (0.10, 0.10)}


def duel(steps, **changes):
    """Who touched the ball with how many samples of 25 ms, one letter of ``DUEL`` a sample."""
    home, away = np.array([DUEL[step] for step in steps]).T
    bodies = {
        "ball": stands(0, 0), "home-1": lambda t: (-home, 0 * t, 0 * t), "away-1": lambda t: (away, 0 * t, 0 * t + np.pi),
    }
    found = touches(film(bodies, len(steps) / 40, roles=ROLES_), VSSS, CommentarySettings(**changes))
    return [(touch.team, round((touch.end_ns - touch.start_ns) * 40e-9) + 1) for touch in found]


@pytest.mark.parametrize(("steps", "touched"), [
    ("hhhhhhaahhahhh", [("home", 14)]),  # nearer for less than 0.1 s
    ("hhhhhhaaaaaaaa", [("home", 6), ("away", 8)]),  # nearer for 0.1 s or more
    ("hhhhhaaaaahhhhh", [("home", 5), ("away", 5), ("home", 5)]),
    ("hhhhhaaaahhhhh", [("home", 14)]),
    ("hhhhhaAahhhhh", [("home", 5), ("away", 3), ("home", 5)]),  # home 1 was off the ball meanwhile
    ("hhhhhaaAAAAA", [("home", 5), ("away", 7)]),  # and so it is when it does not come back
    ("hhhhh..aahhhhh", [("home", 5), ("away", 2), ("home", 5)]),  # after a pause nobody has the ball
    ("aahhhhhh", [("away", 2), ("home", 6)]),  # the first has nobody to take it from
])
def test_duel(steps, touched):
    """In a duel, being nearer for a moment does not take the ball."""
    assert duel(steps) == touched


def test_duel_without_hold():
    """Without `hold_s` the nearest robot always has the ball."""
    assert duel("hhhhaahhaaaa", hold_s=0) == [("home", 4), ("away", 2), ("home", 2), ("away", 4)]


def test_duel_across_restart():
    """A duel begins anew in a new segment."""
    bodies = {"ball": stands(0, 0), "home-1": stands(-0.06, 0), "away-1": stands(0.07, 0, np.pi)}
    table = film(bodies, 0.4, roles=ROLES_)
    nearer = pl.col("x") - 0.01 * ((pl.col("frame") >= 8) & (pl.col("team") != "ball"))
    later = table.with_columns(nearer.cast(pl.Float32), segment=(pl.col("frame") >= 8).cast(pl.Int32))
    found = touches(later.filter(pl.col("frame") < 10), VSSS, CommentarySettings())
    assert [(touch.team, touch.segment) for touch in found] == [("home", 0), ("away", 1)]


def test_goal():
    """A goal is told with its maker, its kind and what led to it."""
    bodies = {"ball": rolls(0.64), **KEEPER}
    events = [(0, "kick-off", "home"), (3.0, "goal", "home"), (3.0, "kick-off", "away")]
    led = [("home", 1, "striker", 44, 0.2, 0.5), ("home", 1, "striker", 21, 0.9, 1.1), ("home", 1, "striker", 57, 1.2, 1.4)]
    told = tell(bodies, events=events, goals=[(3.0, "home", 1, "indirect")], situations=led)
    assert of_kind(told, "goal") == [
        ("GOAL for home! home 1 (striker), indirect action: reaches the ball, kicks it;"
        " it goes in off away 0 (goalkeeper).")
    ]
    assert told.summary.home.scorers == {1: 1}
    wrong = tell(bodies, events=events, goals=[(3.0, "home", 0, "error")], situations=led)
    assert of_kind(wrong, "goal") == [
        ("GOAL for home! Error of away 0 (goalkeeper): home 1 (striker) reaches the ball, kicks it;"
        " it goes in off away 0 (goalkeeper).")
    ]
    assert wrong.summary.home.scorers == {}
    assert wrong.summary.home.goals == {"direct": 0, "indirect": 0, "error": 1}


def test_unknown_goal():
    """Of a goal that nobody is known to have made, nothing but the goal is said."""
    told = tell({"ball": stands(0, 0.5), **KEEPER}, events=[(3.0, "goal", None)], goals=[(3.0, None, None, None)])
    assert of_kind(told, "goal") == ["GOAL!"]


def test_kick_offs():
    """The kick-off of a half is told, and the one after a goal is not."""
    events = [(0, "kick-off", "home"), (1, "goal", "home"), (1.5, "kick-off", "away"), (2, "half", None),
              (2, "kick-off", "away"), (4, "end", None)]
    told = tell({"ball": stands(0, 0.5), **KEEPER}, events=events, goals=[(1, "home", None, None)])
    assert [(moment.kind, moment.t_ns // S) for moment in told.moments] == [
        ("kick-off", 0), ("goal", 1), ("half", 2), ("kick-off", 2), ("end", 4)]


def test_chance_near_goal():
    """A chance shortly before a goal is counted, but not told."""
    bodies = {"ball": rolls(0.64), **KEEPER}
    goal = {"events": [(2.5, "goal", "away")], "goals": [(2.5, "away", 0, "direct")]}
    assert of_kind(tell(bodies, **goal), "save") == []
    assert tell(bodies, **goal).summary.away.saves == 1
    assert len(of_kind(tell(bodies, **goal, chances_apart_s=1.0), "save")) == 1


def test_empty_match():
    """A match in which nothing happens is told as that."""
    told = tell({"ball": stands(0, 0.5)})
    assert of_kind(told, "end") == ["The recording ends, 0 : 0."]
    assert told.summary.home.possession is None
    assert told.summary.home.situations == {}


@pytest.mark.parametrize(("t_ns", "said"), [(0, "0:00"), (59_999_999_999, "0:59"), (600 * S, "10:00")])
def test_clock(t_ns, said):
    """The clock shows the seconds that are over."""
    assert clock(t_ns) == said


def test_words():
    """Lengths, lists, restarts and what led to a goal are put into words."""
    assert [metres(x) for x in (0.345, 3.45, 34.5)] == ["0.34 m", "3.5 m", "34 m"]
    assert [listed(x) for x in (["a"], ["a", "b"], ["a", "b", "c"])] == ["a", "a and b", "a, b and c"]
    assert restart("freeball", None) == restart("free ball", None) == "The ball is stuck: free ball."
    assert restart("kick_in_l", "home") == "Kick in for home."
    assert restart("DirectAlly", None) == "Play restarts (DirectAlly)."
    assert restart(None, "away") == "Play restarts for away."
    assert story([("a", 44), ("a", 21), ("b", 45), ("a", 21)]) == (
        "a reaches the ball, kicks it; b receives it; a kicks it")
    assert story([("a", 44), ("b", 45)], named="a") == "reaches the ball; b receives it"


@functools.cache
def recorded():
    log, settings = _log(0.0, 60.0), Settings()
    bodies, _ = trajectories(log, settings.trajectories)
    found = recognise(bodies, log.info.pitch, settings.situations)
    goals = attribute(log.referee, bodies, found, log.info.pitch, settings.goals)
    return matches.row(log), log.referee, goals, found, bodies


def test_recording():
    """Every goal and restart of a recording is told in order."""
    match, referee, goals, found, bodies = recorded()
    told = commentary(match, referee, goals, found, bodies, VSSS)
    times = [moment.t_ns for moment in told.moments]
    assert times == sorted(times)
    assert [m.t_ns for m in told.moments if m.kind == "goal"] == goals["t_ns"].to_list()
    assert sum(m.kind == "restart" for m in told.moments) == (referee["event"] == "fault").sum()
    assert told.summary.home.possession + told.summary.away.possession == pytest.approx(1)
    assert 4 <= len(told.moments) <= 15  # a minute: neither silent nor a dump


def test_annulled_goal():
    """A goal that the referee annuls is told with its reason; another stop is left out."""
    notes = ["goal kick: goal annulled, too many attackers in the area", "goal kick: too many attackers in the area"]
    events = [("stop", notes[0]), ("fault", "goal kick"), ("stop", notes[1]), ("fault", "goal kick"), ("end", "end")]
    rows = pl.DataFrame([
        {"t_ns": at, "event": event, "team": None, "score_home": 0, "score_away": 0, "note": note}
        for at, (event, note) in enumerate(events)
    ])
    told = [(moment.kind, moment.text) for moment in of_the_referee(rows, pl.DataFrame())]
    assert told[0] == ("annulled", "No goal: too many attackers in the area.")
    assert [kind for kind, _ in told[1:]] == ["restart", "restart", "end"]


def test_teams_swapped():
    """Teams swapped and the pitch turned, the commentary is the same with home and away exchanged."""
    match, referee, goals, found, bodies = recorded()
    other = pl.col("team").cast(pl.String).replace({"home": "away", "away": "home"})

    def swapped(table):
        table = table.with_columns(other.cast(table.schema["team"]))
        if {"score_home", "score_away"} <= set(table.columns):
            table = table.with_columns(score_home="score_away", score_away="score_home")
        return table

    turned = swapped(bodies).with_columns(-pl.col("x"), -pl.col("y"))
    mirrored = match.with_columns(home="away", away="home", score_home="score_away", score_away="score_home")
    ours = commentary(match, referee, goals, found, bodies, VSSS)
    theirs = commentary(mirrored, swapped(referee), swapped(goals), swapped(found), turned, VSSS)
    assert theirs.summary.home == ours.summary.away
    assert theirs.summary.away == ours.summary.home

    def without_scores(told, swap):
        words = {"home": "away", "away": "home", "Home": "Away", "Away": "Home"} if swap else {}
        return [(moment.t_ns, moment.kind, [words.get(word.strip(",.;:!"), word.strip(",.;:!"))
                                            for word in moment.text.split() if not word.strip(",.;:!").isdigit()])
                for moment in told.moments]

    assert without_scores(theirs, swap=True) == without_scores(ours, swap=False)
