"""Analysts' tables: worked examples by hand, and what holds on recordings."""

import numpy as np
import polars as pl
import pytest
from support.logs import make_log, ns, still
from support.recordings import ALL, bodies_of, imported
from test_events import GIVE, PASS, SHOOTER, SHOT, match, rolls

from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.settings import AnalysisSettings, EventSettings, TrajectorySettings
from pitchlore.pipeline.stages.analysis.derive import Analysis, analysis
from pitchlore.pipeline.stages.analysis.paces import paces
from pitchlore.pipeline.stages.events.derive import events
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import AWAY, HOME, SIDES, Efforts, PassAttempts, Phases, Pressing, Space


def found(log, **changes) -> Analysis:
    """The tables of a log, checked against their schemas."""
    table, _ = trajectories(log, TrajectorySettings())
    it = analysis(table, log.referee, events(table, log.referee, log.info.pitch, EventSettings()), log.info.pitch,
                  AnalysisSettings(**changes))
    return Analysis(*(schema.validate(own) for own, schema in zip(
        it, (PassAttempts, Efforts, Phases, Pressing, Space), strict=True)))


OUT = ((0, "kick-off", "home"), (2.5, "stop", None))


@pytest.mark.parametrize(("ball", "robots", "referee", "tried"), [
    pytest.param(PASS, GIVE, OUT[:1], [("home", 1, 2, "arrives"), ("home", 2, 1, "intercepted")], id="to a mate, then lost"),
    pytest.param(PASS, {**GIVE, (HOME, 2): (0.35, 0.03), (AWAY, 2): (0.35, -0.03)}, OUT[:1],
                 [("home", 1, None, "contested"), ("home", 2, 1, "intercepted")],
                 id="a mate and an adversary touch at once"),
    pytest.param([(0, 0, 0), (1, 0, 0), (2, 0, 0.3), (4, 0, 0.3)], {(HOME, 1): (-0.06, 0.0)}, OUT,
                 [("home", 1, None, "out")], id="out"),
    pytest.param([(0, 0, 0), (1, 0, 0), (2, 0.025, 0), (4, 0.025, 0)], {(HOME, 1): (-0.06, 0.0), (HOME, 2): (0.1, 0.0)},
                 OUT[:1], [], id="too short"),
    pytest.param(SHOT, SHOOTER, [(0, "kick-off", "home"), (1.97, "goal", "home")], [], id="a shot, a goal"),
])
def test_tried(ball, robots, referee, tried):
    """The next touch decides; shots and short ways are no passes."""
    rows = found(match(ball, robots, referee=referee)).pass_attempts
    assert rows.select("team", "robot", "next_robot", "came").rows() == tried
    if len(tried) == 2:
        assert rows["length"].to_list() == pytest.approx([0.2725 - 0.0175, 0.4825 - 0.0592], abs=0.02), "robots touch within 0.0775 m"


def test_efforts():
    """One robot stands, one covers 2 m at 1 m/s, 1 s of it in play, one sprints twice: by hand."""
    t = np.arange(240) / 60
    assert (*paces(Kind.VSSS), *paces(Kind.HUMAN)) == pytest.approx((0.72, 1.08, 5.5, 7.0))
    runs = rolls(t, (0, -0.6, 0.3), (1, -0.6, 0.3), (1.5, 0.0, 0.3), (2.5, 0.0, 0.3), (3.2, 0.7, 0.3), (4, 0.7, 0.3))
    log = make_log(t, {"ball": still(240, 0, 0), (HOME, 1): still(240, -0.5, 0.0), (HOME, 2): runs,
                       (AWAY, 1): rolls(t, (0, 0.7, -0.3), (2, -0.7, -0.3), (4, 0.7, -0.3))},
                   referee=[(0, "kick-off", "home"), (3.0, "stop", None)])
    rows = {(row["team"], row["robot"]): row for row in found(log, sprint=0.32).efforts.iter_rows(named=True)}
    one, two, three = rows["home", 1], rows["home", 2], rows["away", 1]
    assert one["seconds"] == pytest.approx(3.0, abs=0.05)
    assert (one["distance"], one["sprints"], one["top_speed"]) == (0, 0, 0)
    # 0.6 m at 1.2 m/s is a sprint; the half second at 1 m/s that play has left is fast and no sprint
    assert (two["sprints"], two["sprinted"]) == (1, pytest.approx(0.55, abs=0.06)), "speeds are smoothed over 0.1 s"
    assert two["distance"] == pytest.approx(0.6 + 0.5, abs=0.05)
    assert two["fast"] == pytest.approx(two["distance"], abs=0.1)
    # 1.4 m in 2 s, 0.7 m/s, is not fast
    assert (three["distance"], three["fast"]) == (pytest.approx(2.1, abs=0.05), pytest.approx(0, abs=0.05))


def test_phases():
    """The ball is lost at 2.2 s to away, which has a transition until it has had it for a second, then attacks."""
    rows = found(match(PASS, GIVE, seconds=6.0), transition=0.8).phases
    first, *rest = rows.iter_rows(named=True)
    assert (first["team"], first["phase"]) == ("home", "middle")
    assert [row["phase"] for row in rest if row["team"] == "home"] == ["attack"]
    won, then = (row for row in rest if row["team"] == "away")
    assert (won["phase"], won["end_ns"] - won["start_ns"]) == ("transition", pytest.approx(ns(1.0), abs=2e7))
    assert (then["phase"], then["start_ns"]) == ("build-up", won["end_ns"])


def test_pressing():
    """Away wins one ball where home builds up, after one tried pass there; home presses nobody."""
    it = found(match([(at, x - 0.4, y) for at, x, y in PASS], {
        key: (x - 0.4, y) for key, (x, y) in GIVE.items()}))
    rows = {row["team"]: row for row in it.pressing.iter_rows(named=True)}
    assert (rows["away"]["passes"], rows["away"]["actions"], rows["away"]["ppda"]) == (2, 1, 2.0)
    assert (rows["home"]["passes"], rows["home"]["actions"], rows["home"]["ppda"]) == (0, 0, None)
    assert (rows["home"]["lost"], rows["home"]["regained"], rows["away"]["lost"]) == (1, 0, 0)


def test_space():
    """Each of two robots has its half; one that drives ahead has more; a team alone has no row."""
    it = found(match([(0, 0, 0), (4, 0, 0)], {(HOME, 1): (-0.4, 0.0), (AWAY, 1): (0.4, 0.0)}))
    assert it.space["share"].to_list() == [0.5] * it.space.height
    assert it.space.height == 8
    assert it.efforts["space"].to_list() == [0.5, 0.5]
    t = np.arange(60) / 60
    bodies = {"ball": still(60, 0, 0), (HOME, 1): rolls(t, (0, -0.4, 0), (1, 0.0, 0)), (AWAY, 1): still(60, 0.4, 0.0)}
    first = found(make_log(t, bodies, referee=[(0, "kick-off", "home")]), reaction=0.4).space.row(0, named=True)
    assert first["share"] == pytest.approx((0.75 + 0.1) / 1.5, abs=0.03), "the line is half way from -0.2 to 0.4"
    assert found(match([(0, 0, 0), (4, 0, 0)], {(HOME, 1): (-0.4, 0.0)})).space.is_empty()


@pytest.mark.parametrize("name", ALL)
def test_recordings(name):
    """On recordings the tables agree with those that they are made beside."""
    log = imported(name)
    table = bodies_of(name)
    it = events(table, log.referee, log.info.pitch, EventSettings())
    mine = found(log)
    arrived = mine.pass_attempts.filter(pl.col("came") == "arrives").select("t_ns", "robot", receiver="next_robot")
    assert arrived.equals(it.passes.select(arrived.columns))
    held, split = (rows.group_by("team").agg((pl.col("end_ns") - pl.col("start_ns")).sum()).sort("team")
                   for rows in (it.possession, mine.phases))
    assert held.equals(split)
    assert mine.space.group_by("t_ns").agg(pl.col("share").sum())["share"].to_list() == pytest.approx(
        [1.0] * (mine.space.height // 2))
    assert (mine.efforts["fast"] <= mine.efforts["distance"]).all()
    assert mine.pressing["team"].to_list() == list(SIDES)
