from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from support.logs import make_log, ns, still, swapped

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.settings import GoalSettings, TrajectorySettings
from pitchlore.pipeline.stages.goals import attribute
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import AWAY, HOME, SIDES, Goals, Situations

VSSS = PITCHES[Kind.VSSS]


def situations(*rows):
    """Rows of schema Situations from (team, robot, code, start, end in seconds)."""
    return pl.DataFrame([{"team": team, "robot": robot, "code": code, "start_ns": int(ns(start)), "end_ns": int(ns(end))}
                         for team, robot, code, start, end in rows], schema=Situations.dtypes())


def judge(log, *done, **changes):
    table, _ = trajectories(log, TrajectorySettings())
    found = attribute(log.referee, table, situations(*done), log.info.pitch, GoalSettings(**changes))
    return Goals.validate(found)


def verdict(log, *done, **changes):
    row = judge(log, *done, **changes).row(0, named=True)
    return row["robot"], row["kind"]


def shot(*, speed=1.0, aside=0.0, kick=2.0, goal=None, others=None, turns_at=9.0):
    """Home 1 holds the ball at the centre until the kick; it rolls to the goal, in at the end.

    ``aside`` is the y at which the straight line crosses the goal line; at x = ``turns_at`` the
    ball turns towards the middle of the goal.
    """
    goal = goal or kick + 0.75 / speed + 0.05
    t = np.arange(round(goal * 60) + 12) / 60
    x = np.clip((t - kick) * speed, 0, None)
    slope = aside / 0.75
    y = np.where(x < turns_at, slope * x, slope * turns_at * (0.75 - x) / (0.75 - turns_at))
    bodies = {"ball": np.stack((x, y), axis=1), (HOME, 1): still(len(t), -0.06, 0), (AWAY, 0): still(len(t), 0.5, -0.4)}
    bodies |= {key: still(len(t), *place) for key, place in (others or {}).items()}
    return make_log(t, bodies, referee=[(0, "kick-off", "home"), (goal, "goal", "home")])


KICK = ("home", 1, 21, 1.9, 2.3)
BESIDE_THE_PATH = {(AWAY, 2): (0.4, 0.06)}


# ---- rule 1 and 2: last touch by the scoring team


@pytest.mark.parametrize(("done", "kind"), [
    *(([("home", 1, code, 1.9, 2.3)], "direct") for code in (21, 11, 1)),
    *(([("home", 1, code, 1.9, 2.3)], "indirect") for code in (47, 194)),
    ([], "indirect"),
    ([("home", 3, 21, 1.9, 2.3)], "indirect"),  # of another robot
    ([("away", 1, 21, 1.9, 2.3)], "indirect"),
    ([("home", 1, 21, 0.5, 1.9)], "indirect"),  # over before the last touch
    ([("home", 1, 21, 2.2, 2.6)], "indirect"),  # begun after it
])
def test_direct(done, kind):
    """An own action on a line into the goal is direct, any other last touch by the scoring team indirect."""
    assert verdict(shot(), *done) == (1, kind)


def test_off_the_line():
    """An own action off a line into the goal is indirect."""
    assert verdict(shot(aside=0.19), KICK) == (1, "direct")
    assert verdict(shot(aside=0.3, turns_at=0.3), KICK) == (1, "indirect")


@pytest.mark.parametrize(("team", "robot", "kind"), [(HOME, 1, "direct"), (AWAY, 3, "error")])
def test_pushed_ball(team, robot, kind):
    """A ball that is pushed over the line is direct, and an own goal without the scoring team an error."""
    t = np.arange(180) / 60
    x = 0.25 * t
    bodies = {"ball": np.stack((x, 0 * x), axis=1), (team, robot): np.stack((x - 0.06, 0 * x, 0 * x), axis=1)}
    log = make_log(t, bodies, referee=[(0, "kick-off", "home"), (2.9, "goal", "home")])
    assert verdict(log, (SIDES[team], robot, 11, 1.0, 2.9)) == (robot, kind)


def test_touch_behind_line():
    """A ball last touched behind the line is in, even if it comes back."""
    t = np.arange(210) / 60
    x = np.where(t < 3.04, 0.25 * t, 0.76 - 0.1 * (t - 3.04))
    robot = np.where(t < 3.04, x - 0.06, 0.7 - (t - 3.04))
    bodies = {"ball": np.stack((x, 0 * x), axis=1), (HOME, 1): np.stack((robot, 0 * x, 0 * x), axis=1)}
    log = make_log(t, bodies, referee=[(0, "kick-off", "home"), (3.2, "goal", "home")])
    assert verdict(log, ("home", 1, 11, 1.0, 3.2)) == (1, "direct")


def test_ball_put_elsewhere():
    """A shot's line does not reach to where the ball was put."""
    log = shot()
    t = log.frames.t_ns / 1e9
    put = t > 2.05
    log.frames.ball["x"][put] = (0.3 + 0.45 / 0.75 * (t - 2.05))[put]
    log.frames.ball["y"][put] = (-0.5 + 0.5 / 0.75 * (t - 2.05))[put]
    assert trajectories(log, TrajectorySettings())[0]["segment"].max() == 1  # a new one where it was put
    assert verdict(log, KICK) == (1, "direct")


def test_nearest_of_two():
    """If two robots touch the ball at once, the goal is the nearest one's."""
    log = shot(others={(HOME, 5): (-0.065, 0.0)})
    assert verdict(log) == (1, "indirect")
    log = shot(others={(HOME, 5): (-0.05, 0.0)})
    assert verdict(log) == (5, "indirect")


# ---- rule 3: last touch by the defending team


def test_deflected_shot():
    """A deflected shot is indirect, and the goal is the shooter's."""
    assert verdict(shot(others=BESIDE_THE_PATH), KICK) == (1, "indirect")
    assert verdict(shot(others=BESIDE_THE_PATH)) == (1, "indirect")  # by its line alone


def wide(aside, **changes):
    """A shot that would cross the goal line so far from its middle; away 2 turns it in from 0.35 m before it."""
    return shot(aside=aside, turns_at=0.4, others={(AWAY, 2): (0.4, aside * 0.4 / 0.75 + 0.05)}, **changes)


@pytest.mark.parametrize(("aside", "changes", "by"), [
    (0.19, {}, 1), (0.46, {}, 1), (0.48, {}, 2), (0.6, {}, 2),
    (0.19, {"beside": 1.0}, 1), (0.39, {"beside": 1.0}, 2), (0.6, {"beside": 3.5}, 1),
])
def test_turned_in(aside, changes, by):
    """A ball turned in is the shooter's if it would pass the goal's middle at 0.4 m, else the adversary's error.

    The setting `beside` says how far beside the goal a shot may be aimed.
    """
    assert verdict(wide(aside), KICK, **changes) == (by, "indirect" if by == 1 else "error")
    assert verdict(wide(aside), **changes) == (by, "indirect" if by == 1 else "error")  # it need not be a kick


def test_back_pass():
    """A ball that came away from the goal and is turned in is the adversary's error."""
    t = np.arange(240) / 60
    x, y = np.interp(t, (0, 2, 2.5, 3.5), (0.5, 0.5, 0.0, 0.8)), np.interp(t, (2.5, 3.5), (0.0, -0.15))
    bodies = {"ball": np.stack((x, y), axis=1), (HOME, 1): still(len(t), 0.56, 0), (AWAY, 2): still(len(t), -0.06, 0)}
    log = make_log(t, bodies, referee=[(0, "kick-off", "home"), (3.5, "goal", "home")])
    assert verdict(log, KICK) == (2, "error")


def test_line_to_touch():
    """A shot's line ends at the adversary's touch."""
    # aside until away 2, close by, turns it: too soon for the whole of line_s
    log = shot(aside=0.5, turns_at=0.05, others={(AWAY, 2): (0.1, 0.05)})
    assert verdict(log) == (2, "error")
    assert verdict(shot(aside=0.3, turns_at=0.05, others={(AWAY, 2): (0.1, 0.05)})) == (1, "indirect")


def pressed(*, leaves, dropped=0):
    """Away 3 has the ball all the time, home 1 as well until it leaves; the ball moves across, then in.

    Away 3 has so many samples without contact from 2.0 s on.
    """
    t = np.arange(240) / 60
    x, y = np.interp(t, (0, 2.5, 3.6), (0.3, 0.3, 0.75)), np.interp(t, (0, 2.5), (-0.4, 0.0))
    there = np.minimum(t, leaves)
    home = np.stack((np.interp(there, t, x) - 0.07, np.interp(there, t, y), 0 * t), axis=1)
    off = np.where((t >= 2.0) & (t < 2.0 + (dropped - 0.5) / 60), 0.09, 0.05)
    bodies = {"ball": np.stack((x, y), axis=1), (HOME, 1): home, (AWAY, 3): np.stack((x + off, y, 0 * t), axis=1)}
    return make_log(t, bodies, referee=[(0, "kick-off", "home"), (3.6, "goal", "home")])


def test_pressed_together():
    """A goal that both pressed in is the scoring team's, whatever way the ball went."""
    assert verdict(pressed(leaves=3.6)) == (1, "indirect")
    assert verdict(pressed(leaves=1.7)) == (1, "indirect")
    assert verdict(pressed(leaves=1.0)) == (3, "error")  # home 1 was there too long ago


@pytest.mark.parametrize(("dropped", "by"), [(2, 1), (3, 3)])
def test_touch_over_gap(dropped, by):
    """A touch goes on over two samples without contact, but not over three."""
    # over three, away 3 took the ball anew after home 1 had left it, and it did not come towards the goal
    robot, kind = verdict(pressed(leaves=1.7, dropped=dropped))
    assert (robot, kind) == (by, "indirect" if by == 1 else "error")


# ---- rule 4, and what does not count


@pytest.mark.parametrize(("others", "before_s", "by", "kind"), [
    ({}, 0.5, 1, "direct"),  # nobody touched the ball lately: the last toucher's
    # after a shot longer ago, the adversary's touch, 0.4 m at 0.3 m/s later, is an error
    (BESIDE_THE_PATH, 3.0, 1, "indirect"), (BESIDE_THE_PATH, 1.5, 2, "error"),
    (BESIDE_THE_PATH, 1.0, 2, "error"),  # the window is empty, so all touches count
])
def test_old_touch(others, before_s, by, kind):
    """A touch that is older than the window counts only if there is none in it, nor a newer one."""
    assert verdict(shot(speed=0.3, others=others), KICK, before_s=before_s) == (by, kind)


@pytest.mark.parametrize(("t", "goal"), [(np.arange(120) / 60, 1.6), (np.array([1.0, 1.1]), 0.0)])
def test_untouched_goal(t, goal):
    """A goal that nobody touched, or that came before the first sample, is nobody's."""
    assert verdict(make_log(t, {"ball": np.stack((t / 2, 0 * t), axis=1)}, referee=[(goal, "goal", "home")])) == (None, None)


def test_touch_before_restart():
    """Touches before the restart do not count."""
    t = np.arange(240) / 60
    ball = np.stack((np.where(t < 2, 0.0, 0.3 + (t - 2) * 0.3), 0 * t), axis=1)
    bodies = {"ball": ball, (HOME, 1): still(len(t), -0.06, 0)}
    log = make_log(t, bodies, referee=[(0, "kick-off", "home"), (2, "fault", None), (3.6, "goal", "home")])
    assert verdict(log, KICK) == (None, None)


def test_bodies_put_back():
    """Bodies that are put back on the goal's own frame touch nothing."""
    log = shot()
    goal = int(log.referee["t_ns"][-1])
    back = log.frames.t_ns >= goal
    log.frames.ball["x"][back] = 0.5
    log.frames.ball["y"][back] = -0.4  # on away 0
    assert verdict(log, KICK) == (1, "direct")


def test_touch_while_stopped():
    """Touches while play is stopped do not count."""
    log = shot(others={(AWAY, 3): (0.70, 0.0)})  # the ball rolls into away 3 at 2.62 s
    assert verdict(log, KICK) == (1, "indirect")
    stop = make_log([], {}, referee=[(2.5, "stop", None)]).referee
    stopped = replace(log, referee=pl.concat([log.referee, stop]).sort("t_ns"))
    assert verdict(stopped, KICK) == (1, "direct")


def test_suspect_ball():
    """A suspect position of the ball touches nobody."""
    log = shot(others={(AWAY, 3): (-0.6, -0.5)})
    log.frames.ball["x"][150], log.frames.ball["y"][150] = -0.6, -0.5
    assert verdict(log, KICK) == (1, "direct")


def test_unknown_team():
    """Each goal has a row, and a goal of unknown team is nobody's."""
    log = shot()
    extra = [(2.7, "goal", None), (2.75, "goal", "away")]
    referee = pl.concat([log.referee, make_log([], {}, referee=extra).referee]).sort("t_ns")
    table, _ = trajectories(log, TrajectorySettings())
    found = Goals.validate(attribute(referee, table, Situations.empty(), VSSS, GoalSettings()))
    assert found["t_ns"].to_list() == [int(ns(2.7)), int(ns(2.75)), int(ns(2.8))]
    assert found["team"].to_list() == [None, "away", "home"]
    assert judge(make_log([0.0, 0.1], {"ball": np.zeros((2, 2))})).is_empty()
    assert found.row(0)[3:5] == (None, None)  # although away 0 or home 1 touched the ball


@pytest.mark.parametrize(
    ("scene", "done"),
    [
        ({}, [KICK]),
        ({"aside": 0.3, "turns_at": 0.3}, [KICK]),
        ({"others": BESIDE_THE_PATH}, []),
        ({"aside": 0.4, "turns_at": 0.4, "others": {(AWAY, 2): (0.4, 0.25)}}, [KICK]),
    ],
)
def test_teams_alike(scene, done):
    """Both teams are treated alike."""
    log = shot(**scene)
    kinds = judge(log, *done).select("robot", "kind").rows()
    for body in (log.frames.ball, log.frames.robots):
        body["x"] *= -1
        body["y"] *= -1
    log.frames.robots["team"] = 1 - log.frames.robots["team"]
    other = {"home": "away", "away": "home"}
    table, _ = trajectories(log, TrajectorySettings())
    mirrored = situations(*((other[team], *rest) for team, *rest in done))
    found = attribute(swapped(log.referee), table, mirrored, VSSS, GoalSettings())
    assert found["team"].to_list() == ["away"]
    assert found.select("robot", "kind").rows() == kinds
