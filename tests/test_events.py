"""Possession, passes, shots and pressure: worked examples, what holds on recordings, and a server's word."""

import math

import numpy as np
import polars as pl
import pytest
from support.logs import make_log, ns, still, swapped
from support.recordings import ALL, INSPER, bodies_of, imported

from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import EventSettings, TrajectorySettings
from pitchlore.pipeline.stages.events.derive import Events, events
from pitchlore.pipeline.stages.events.shots import ROLLING
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import AWAY, HOME, Passes, Possession, Pressure, Restarts, Shots


def found(log: MatchLog, **changes: float) -> Events:
    """The events of a log, checked against their schemas."""
    table, _ = trajectories(log, TrajectorySettings())
    it = events(table, log.referee, log.info.pitch, EventSettings(**changes))
    return Events(Possession.validate(it.possession), Passes.validate(it.passes), Shots.validate(it.shots),
                  Pressure.validate(it.pressure), Restarts.validate(it.restarts))


def rolls(t, *points):
    """The ball's way through (time, x, y), in straight lines."""
    at, x, y = zip(*points, strict=True)
    return np.stack((np.interp(t, at, x), np.interp(t, at, y)), axis=1)


def match(ball, robots, seconds=4.0, referee=((0, "kick-off", "home"),), kind=Kind.VSSS):
    t = np.arange(round(seconds * 60)) / 60
    bodies = {"ball": rolls(t, *ball)} | {key: still(len(t), *place) for key, place in robots.items()}
    return make_log(t, bodies, referee=list(referee))


#: Home 1 passes to home 2 at 1 s, who has it at 2 s; away 1 has it at 3 s.
GIVE = {(HOME, 1): (-0.06, 0.0), (HOME, 2): (0.35, 0.0), (AWAY, 1): (0.3, 0.56)}
PASS = [(0, 0, 0), (1, 0, 0), (2, 0.3, 0), (2.2, 0.3, 0), (3, 0.3, 0.5), (4, 0.3, 0.5)]


def test_pass():
    """The ball goes from a robot to its mate, whom it reaches, and then to the adversary."""
    it = found(match(PASS, GIVE))
    (row,) = it.passes.iter_rows(named=True)
    assert (row["team"], row["robot"], row["receiver"], row["direction"]) == ("home", 1, 2, "front")
    assert ns(1.0) <= row["t_ns"] < row["received_ns"] <= ns(2.0)
    assert row["x"] < 0.03
    assert 0.25 < row["to_x"] <= 0.3
    assert it.possession.select("team", "robot", "last_robot", "touches", "passes", "ended").rows() == [
        ("home", 1, 2, 2, 1, "lost"), ("away", 1, 1, 1, 0, "end")]
    (first, second) = it.possession.iter_rows(named=True)
    assert first["end_ns"] == second["start_ns"]
    assert second["y"] < -0.4, "away sees the pitch turned by half a turn"


@pytest.mark.parametrize(("way", "direction"), [
    ((0.3, 0.0), "front"), ((0.0, 0.3), "left"), ((-0.3, 0.0), "back"), ((0.0, -0.3), "right"),
    ((0.2, 0.19), "front"), ((0.19, 0.2), "left"), ((-0.2, 0.19), "back"),
])
def test_direction(way, direction):
    """A pass has the direction in which its team sees it go."""
    x, y = way
    length = math.hypot(x, y)
    there = (x * (1 + 0.05 / length), y * (1 + 0.05 / length))
    back = (-x * 0.06 / length, -y * 0.06 / length)
    it = found(match([(0, 0, 0), (1, 0, 0), (2, x, y), (4, x, y)], {(HOME, 1): back, (HOME, 2): there}))
    assert it.passes["direction"].to_list() == [direction]


def test_no_pass():
    """Two that push the ball together pass nothing, nor does a robot to itself, nor through an adversary."""
    together = {(HOME, 1): (-0.06, 0.0), (HOME, 2): (0.06, 0.0)}
    assert found(match([(0, 0, 0), (4, 0, 0)], together)).passes.is_empty()
    itself = [(0, 0, 0), (1, 0, 0), (2, 0.3, 0), (3, 0, 0), (4, 0, 0)]
    assert found(match(itself, {(HOME, 1): (-0.06, 0.0)})).passes.is_empty()
    between = {(HOME, 1): (-0.06, 0.0), (HOME, 2): (0.35, 0.0), (AWAY, 1): (0.15, 0.05)}
    assert found(match(PASS, between)).passes.is_empty()


def test_through():
    """A pass behind the adversary's last robot but the goalkeeper, deep in its half, is a through pass."""
    ball = [(0, 0, 0), (1, 0, 0), (2, 0.4, 0), (4, 0.4, 0)]
    robots = {(HOME, 1): (-0.06, 0.0), (HOME, 2): (0.46, 0.0), (AWAY, 0): (0.72, 0.1), (AWAY, 1): (0.2, 0.4)}
    assert found(match(ball, robots)).passes["through"].to_list() == [True]
    behind = robots | {(AWAY, 1): (0.5, 0.4)}
    assert found(match(ball, behind)).passes["through"].to_list() == [False]


def test_contested():
    """While both touch, nobody has the ball."""
    both = {(HOME, 1): (-0.06, 0.0), (AWAY, 1): (0.06, 0.0)}
    assert found(match([(0, 0, 0), (4, 0, 0)], both)).possession.is_empty()
    comes = [(0, -0.3, 0), (1, -0.3, 0), (2, 0, 0), (4, 0, 0)]
    it = found(match(comes, both | {(HOME, 2): (-0.36, 0.0)}))
    assert it.possession.select("team", "ended").rows()[0] == ("home", "contested")


@pytest.mark.parametrize(("scorer", "ended"), [("home", "goal"), ("away", "conceded"), (None, "stopped")])
def test_stopped(scorer, ended):
    """A possession that lasts until play stops says how it stopped."""
    event = (2.0, "goal", scorer) if scorer else (2.0, "stop", None)
    it = found(match([(0, 0, 0), (4, 0, 0)], {(HOME, 1): (-0.06, 0.0)}, referee=[(0, "kick-off", "home"), event]))
    assert it.possession["ended"].to_list() == [ended]


def test_possession_ends_with_a_shot():
    """A shot that an adversary touches is no lost ball; that of a mate goes on; a goal is a goal."""
    saved = SHOOTER | {(AWAY, 0): (0.68, 0.0)}
    it = found(match(SHOT, saved, referee=[(0, "kick-off", "home")]))
    assert (it.shots["outcome"][0], it.possession["ended"][0]) == ("saved", "shot")
    mate = SHOOTER | {(HOME, 2): (0.68, 0.0)}
    it = found(match(SHOT, mate, referee=[(0, "kick-off", "home")]))
    assert (it.shots["outcome"][0], it.possession["ended"].to_list()) == ("own", ["end"])
    assert found(match(SHOT, SHOOTER, referee=SCORED)).possession["ended"].to_list() == ["goal"]


#: Home 1 brings the ball to the centre and shoots at 1 s, at 0.8 m/s.
SHOT = [(0, -0.3, 0), (1, 0, 0), (2, 0.8, 0), (4, 0.8, 0)]
SHOOTER = {(HOME, 1): (-0.06, 0.0), (HOME, 2): (-0.5, 0.3), (AWAY, 0): (0.7, 0.4), (AWAY, 1): (0.3, 0.4)}
SCORED = [(0, "kick-off", "home"), (1.97, "goal", "home")]


def shot(ball=SHOT, robots=SHOOTER, referee=SCORED, **changes):
    return found(match(ball, robots, referee=referee), **changes).shots


def test_shot():
    """A touch after which the ball rolls into the goal is a shot."""
    (row,) = shot().iter_rows(named=True)
    assert (row["team"], row["robot"], row["role"], row["outcome"]) == ("home", 1, "striker", "goal")
    assert row["speed"] == pytest.approx(0.8, abs=0.1)
    assert row["distance"] == pytest.approx(0.75, abs=0.03)
    assert row["angle"] == pytest.approx(2 * math.atan(0.2 / 0.75), abs=0.03)


@pytest.mark.parametrize(("ball", "robots", "outcome", "by"), [
    ([*SHOT[:2], (1.75, 0.6, 0), (4, 0.6, 0)], {(AWAY, 0): (0.67, 0.0)}, "saved", 0),
    ([*SHOT[:2], (1.25, 0.2, 0), (4, 0.2, 0)], {(AWAY, 1): (0.26, 0.0)}, "blocked", 1),
    ([*SHOT[:2], (1.25, 0.2, 0), (4, 0.2, 0)], {(HOME, 2): (0.26, 0.0)}, "own", None),
    ([*SHOT[:2], (1.25, 0.2, 0), (4, 0.2, 0.3)], {}, "missed", None),
])
def test_outcome(ball, robots, outcome, by):
    """The outcome of a shot is what happened next; one that an adversary stops has its number."""
    assert shot(ball, SHOOTER | robots, SCORED[:1]).select("outcome", "by").row(0) == (outcome, by)


#: Home 1 takes a kick-off at 1 s, at 0.8 m/s.
KICKS_OFF = [(0, 0, 0), (1, 0, 0)]


@pytest.mark.parametrize(("ball", "robots", "referee", "outcomes"), [
    pytest.param([(2, 0.8, 0)], {}, SCORED, ["goal"], id="a goal"),
    pytest.param([(2, 0.8, 0)], {(AWAY, 1): (0.3, 0.07)}, SCORED, ["goal"], id="a goal off an adversary"),
    pytest.param([(1.75, 0.6, 0)], {(AWAY, 0): (0.67, 0.0)}, SCORED[:1], ["saved"], id="the goalkeeper saves it"),
    pytest.param([(1.25, 0.2, 0)], {(AWAY, 1): (0.26, 0.0)}, SCORED[:1], [], id="blocked at once"),
    pytest.param([(1.5, 0.4, 0)], {(AWAY, 1): (0.46, 0.0)}, SCORED[:1], [], id="blocked just before half of its way"),
    pytest.param([(1.5, 0.4, 0)], {(AWAY, 0): (0.7, 0.1), (AWAY, 1): (0.473, 0.0)}, SCORED[:1], ["blocked"],
                 id="and just after"),
    pytest.param([(1.25, 0.2, 0)], {(HOME, 2): (0.26, 0.0)}, SCORED[:1], [], id="a pass"),
    pytest.param([(1.0, 0, 0), (2, 0.8, 0.28)], {}, SCORED[:1], ["wide"], id="past the post"),
    pytest.param([(1.125, 0.1, 0), (1.4, 0, 0), (1.525, 0.1, 0)], {(AWAY, 1): (0.16, 0.0)}, SCORED[:1], ["blocked"],
                 id="the touch after it is a shot"),
])
def test_kick_off(ball, robots, referee, outcomes):
    """The first touch of a kick-off is a shot if it becomes a goal, or comes half of its way to the goal line."""
    way = [*KICKS_OFF, *ball, (4, *ball[-1][1:])]
    assert shot(way, SHOOTER | robots, referee)["outcome"].to_list() == outcomes


@pytest.mark.parametrize("begins", [(-0.14, 0), (0.14, 0)])
def test_no_kick_off(begins):
    """The control: play that begins outside the centre circle (0.13 m) begins with a shot."""
    x, y = begins
    blocked = [(0, x, y), (1, x, y), (1.25, x + 0.2, y), (4, x + 0.2, y)]
    robots = SHOOTER | {(HOME, 1): (x - 0.06, y), (AWAY, 0): (0.7, 0.1), (AWAY, 1): (x + 0.26, y)}
    assert shot(blocked, robots, SCORED[:1])["outcome"].to_list() == ["blocked"]


def test_deflected():
    """A shot that goes in off an adversary is the goal's shot, if it is soon enough."""
    robots = SHOOTER | {(AWAY, 1): (0.3, 0.07)}
    assert shot(robots=robots)["outcome"].to_list() == ["goal"]
    assert shot(robots=robots, deflected_s=0.5)["outcome"].to_list() == ["blocked"]
    # its robot still pushes when an adversary is at the ball
    assert shot(robots=SHOOTER | {(AWAY, 1): (0.05, 0.06)})["outcome"].to_list() == ["goal"]


def test_one_shot_a_goal():
    """The last of the shots off adversaries is the goal's; a slow one that is aimed at the goal is one, too."""
    push = [*SHOT[:2], (1.3, 0.015, 0), (2.3, 0.815, 0), (4, 0.815, 0)]
    robots = SHOOTER | {(AWAY, 1): (0.0075, 0.0772)}
    scored = [SCORED[0], (2.2, "goal", "home")]
    (row,) = shot(push, robots, scored).iter_rows(named=True)
    assert (row["outcome"], row["t_ns"] > ns(1.25)) == ("goal", True)
    slow = [*SHOT[:2], (1.5, 0.1, 0.03), (2.4, 0.8, 0), (4, 0.8, 0)]
    robots = SHOOTER | {(AWAY, 1): (0.14, 0.08)}
    assert shot(slow, robots, scored)["outcome"].to_list() == ["goal"]
    assert shot(slow, robots, SCORED[:1]).is_empty(), "the control: without a goal it is no shot"


def past(to_y, seconds=1.0, **changes):
    """The outcome of a shot that crosses the goal line so far from the goal's middle, if it is one."""
    x, y = 0.8, to_y * 0.8 / 0.75
    robots = {(HOME, 1): (-0.06, 0.0), (AWAY, 0): (0.7, 0.0)}
    return shot([*SHOT[:2], (1 + seconds, x, y), (4, x, y)], robots, SCORED[:1], **changes)["outcome"].to_list()


@pytest.mark.parametrize("side", [1, -1])
def test_wide(side):
    """A ball past the post is a wide shot, up to a goal width from the goal's middle, if it is fast and soon there."""
    assert past(0.19 * side) == ["missed"]
    assert past(0.25 * side) == past(0.38 * side) == ["wide"]
    assert past(0.42 * side) == []
    assert past(0.42 * side, wide=1.5) == ["wide"]
    assert past(0.3 * side, seconds=1.5) == past(0.3 * side, seconds=1.5, wide_s=2.0, wide_speed=0.6) == []
    assert past(0.3 * side, seconds=1.5, wide_s=2.0) == ["wide"]


def test_wide_arrives():
    """A ball past the post that is stopped before the goal line is no shot, and one that goes in is a goal."""
    stopped, blocker = [*SHOT[:2], (1.5, 0.4, 0.16), (4, 0.4, 0.16)], SHOOTER | {(AWAY, 1): (0.46, 0.18)}
    assert shot(stopped, blocker, SCORED[:1]).is_empty()
    back = found(match([*SHOT[:2], (1.95, 0.745, 0.26), (3, 0.3, 0.3), (4, 0.3, 0.3)], SHOOTER | {(HOME, 2): (0.24, 0.3)}))
    assert (back.shots["outcome"].to_list(), back.passes.height) == (["wide"], 0), "nor is it a pass to who collects it"
    turns = [*SHOT[:2], (1.5, 0.4, 0.16), (2, 0.8, 0), (4, 0.8, 0)]
    assert shot(turns, blocker)["outcome"].to_list() == ["goal"]


def test_no_shot():
    """Too far past the post, too slow, backwards, or followed up by the same robot: no shot."""
    assert shot([*SHOT[:2], (2, 0.8, 0.6), (4, 0.8, 0.6)], referee=SCORED[:1]).is_empty()
    assert shot([*SHOT[:2], (4, 0.4, 0)], referee=SCORED[:1]).is_empty(), "0.13 m/s stop after 3 cm"
    assert shot([*SHOT[:2], (2, -0.8, 0), (4, -0.8, 0)], referee=SCORED[:1]).is_empty()
    follows = [(0, 0, 0), (1, 0, 0), (1.2, 0.16, 0), (1.5, 0, 0), (4, 0, 0)]
    assert shot(follows, referee=SCORED[:1]).is_empty()


@pytest.mark.parametrize("kind", list(Kind))
def test_rolling(kind):
    """A ball slows down on its way; a faster one is faster everywhere."""
    way = np.linspace(0, 20, 200)
    slow, fast = (ROLLING[kind].at(np.full(200, speed), way) for speed in (3.0, 6.0))
    assert slow[0] == 3.0
    assert (np.diff(fast) <= 0).all()
    assert (fast >= slow).all()
    assert fast[-1] == 0.0 or fast[-1] > slow[-1]


def test_server_ball():
    """In 2D the ball rolls as the server moves it: by its speed, which decays by 0.94 a cycle."""
    x, u = 0.0, 2.5  # metres, metres a cycle
    for _ in range(20):
        x, u = x + u, u * 0.94
    assert ROLLING[Kind.SIM2D].at(np.array([25.0]), np.array([x]))[0] / 10 == pytest.approx(u)


def test_pressure():
    """A robot close to an adversary that touches the ball presses; it wins the ball if its team has it soon."""
    near = {(HOME, 1): (-0.06, 0.0), (HOME, 2): (0.35, 0.0), (AWAY, 1): (0.3, 0.15), (AWAY, 2): (-0.06, -0.6)}
    it = found(match([(0, 0, 0), (1, 0, 0), (2, 0.3, 0), (2.2, 0.3, 0), (2.4, 0.3, 0.09), (4, 0.3, 0.09)], near))
    (row,) = it.pressure.filter(pl.col("team") == "away").iter_rows(named=True)
    assert (row["robot"], row["carrier"], row["won"]) == (1, 2, True)
    assert ns(1.7) <= row["start_ns"] < row["end_ns"] <= ns(2.5)
    assert not found(match(PASS, GIVE)).pressure["won"].any()


def test_nothing():
    """A match without play, and one in which nobody touches, have no events."""
    for log in (match([(0, 0, 0), (1, 0, 0)], {(HOME, 1): (0.5, 0.5)}, 1.0),
                match([(0, 0, 0), (1, 0, 0)], {(HOME, 1): (-0.06, 0)}, 1.0, referee=[(0, "stop", None)])):
        assert [table.height for table in found(log)[:4]] == [0, 0, 0, 0]


@pytest.mark.parametrize("name", ALL)
def test_on_recordings(name):
    """Possessions do not overlap and lie in play; passes and shots lie in possessions of their team."""
    log = imported(name)
    it = found(log)
    assert not it.possession.is_empty()
    start, end = (it.possession[name].to_numpy() for name in ("start_ns", "end_ns"))
    assert (start[1:] >= end[:-1]).all()
    assert it.possession["passes"].sum() == it.passes.height
    owners = it.passes.join_where(
        it.possession.select(own="team", start_ns="start_ns", end_ns="end_ns"),
        pl.col("t_ns") >= pl.col("start_ns"), pl.col("received_ns") < pl.col("end_ns"))
    assert owners.height == it.passes.height
    assert (owners["team"] == owners["own"]).all()
    assert (it.passes["robot"] != it.passes["receiver"]).all()
    assert (it.shots["x"] <= log.info.pitch.goal_x).all()


@pytest.mark.parametrize("name", ALL)
def test_turned(name):
    """Where home and away change places, and the pitch is turned, the events do, too."""
    log, table = imported(name), bodies_of(name)
    turned = swapped(table.with_columns(-pl.col("x", "y", "vx", "vy"))).sort("team", "robot", "t_ns")
    one, two = (events(rows, referee, log.info.pitch, EventSettings()) for rows, referee in (
        (table, log.referee), (turned, swapped(log.referee))))
    for ours, theirs in zip(one[:3], two[:3], strict=True):
        assert swapped(theirs).equals(ours)


def test_server_kicks():
    """The passes of a 2D match are those that the server's counters of kicks give by loganalyzer3's rule."""
    log, table = imported(INSPER), bodies_of(INSPER)
    in_play = table.filter(pl.col("team") == "ball", pl.col("segment").is_not_null()).select("t_ns", "segment")
    kicks = log.commands.filter(pl.col("command").is_in(["kick", "tackle"])).join(in_play, on="t_ns").sort("t_ns")
    sole = kicks.filter(pl.col("team").n_unique().over("t_ns") == 1)
    before = sole.select("team", "robot", "segment").shift()
    passed = (sole["team"] == before["team"]) & (sole["robot"] != before["robot"]) & (
        sole["segment"] == before["segment"])
    counted = sole.with_columns(passer=before["robot"]).filter(passed)
    ours = found(log).passes
    assert counted.height == 9
    assert ours.select("team", "robot", "receiver").rows() == counted.select("team", "passer", "robot").rows()
    late = counted["t_ns"] - ours["received_ns"]
    assert late.is_between(0, ns(0.2)).all(), "the counter rises in the cycle after the touch"
