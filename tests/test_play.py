"""Matches that are played: the loop, what it logs, and what a learned team decides."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.played import logged, policy
from support.played import starting as match

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.controllers import controller_of
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.arena import Arena
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.game.bodies import BALL
from pitchlore.pipeline.matches.frame import home_attacks
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES, Referee

MINUTE = 3600


def recipe(home="static", away="static", seed=1, seconds=20.0, **more):
    return Recipe(
        home=TeamSettings(kind=home), away=TeamSettings(kind=away), seed=seed,
        referee=RefereeSettings(duration_s=seconds), **more,
    )


@pytest.fixture(scope="module")
def short():
    """20 seconds of static against static, as they are read."""
    return log.read(logged(recipe()), where="here")


def test_frames_and_events(short):
    """A match has a frame each sixtieth of a second, a kick-off, one half-time and the end; the score counts the goals."""
    assert len(short.frames) == 20 * 60 + 1
    assert short.frames.t_ns[[0, 60]].tolist() == [0, 1_000_000_000]
    assert short.info.complete
    assert (short.frames.counts() == 6).all()
    events = short.referee["event"].to_list()
    assert (events[0], events[-1], events.count("half")) == ("kick-off", "end", 1)
    assert [p.home_attacks for p in short.info.periods] == [1, -1]
    goals = short.referee.filter(pl.col("event") == "goal")
    for team in ("home", "away"):
        assert short.referee[f"score_{team}"][-1] == goals.filter(pl.col("team") == team).height


def test_derived():
    """A played match is derived as an imported one is: play lies between a restart and the next call, and sides change."""
    played = log.read(logged(recipe("static", "random", seed=1, seconds=90.0)), where="here")
    table, quality = trajectories(played, TrajectorySettings())
    assert quality.is_empty()  # bodies are put elsewhere only where play is cut
    Referee.validate(played.referee)
    assert {"goal", "stop", "fault", "half"} <= set(played.referee["event"])
    number, since = -1, {}
    for t_ns, event in played.referee.select("t_ns", "event").iter_rows():
        number += event in ("kick-off", "fault")
        since[t_ns] = number if event in ("kick-off", "fault") else None
    ball = table.filter(pl.col("team") == "ball").sort("t_ns")
    begun = np.array(list(since))
    expected = [since[begun[begun <= t_ns][-1]] for t_ns in ball["t_ns"]]
    assert ball["segment"].to_list() == expected
    half = played.referee.filter(event="half")["t_ns"].item()
    assert ball["turned"].to_list() == (ball["t_ns"] >= half).to_list()
    assert (home_attacks(played.info.periods, played.frames.t_ns) == np.where(played.frames.t_ns < half, 1, -1)).all()
    # home attacks +x throughout the table
    goals = ball.join(played.referee.filter(event="goal"), on="t_ns")
    assert (goals["x"] > 0).to_list() == (goals["team_right"] == "home").to_list()
    row = log.row(played).row(0, named=True)
    assert (row["duration_s"], row["frames"], row["robots_per_team"]) == (90.0, 5401, 3)
    assert [row["score_home"], row["score_away"]] == [(goals["team_right"] == side).sum() for side in ("home", "away")]


def test_rest_after_goal():
    """After a goal the robots stand, and play restarts half a second later."""
    played = match(recipe("static", "random", seconds=60.0))
    played.advance(MINUTE + 1)
    part = played.take()
    goal = part.referee.filter(pl.col("event") == "goal")["t_ns"][0]
    again = part.referee.filter(pl.col("event") == "kick-off", pl.col("t_ns") > goal)["t_ns"][0]
    rows = part.frames.robots[part.frames.offsets[int(np.searchsorted(part.frames.t_ns, again)) - 1]:][:6]
    assert np.hypot(rows["vx"], rows["vy"]).max() < 0.05
    assert again - goal == 500_000_000


#: Records a match into the folder in which it runs, and says where its log is.
ELSEWHERE = """
from pathlib import Path
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.store import Store
from test_play import recipe
receipt, _ = record(Store(Path.cwd()), recipe("learned", "human-like", seed=5, seconds=10.0))
print(receipt.files["log"].path)
"""


@pytest.mark.slow
def test_same_recipe_elsewhere(tmp_path):
    """The same recipe gives the same bytes in another process and another folder."""
    here, there = tmp_path / "here", tmp_path / "there"
    there.mkdir()
    receipt, _ = record(Store(here), recipe("learned", "human-like", seed=5, seconds=10.0))
    seen = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path]), "PYTHONHASHSEED": "1"}
    said = subprocess.run([sys.executable, "-c", ELSEWHERE], cwd=there, env={**os.environ, **seen}, check=True,
                          stdout=subprocess.PIPE, text=True, timeout=120).stdout.strip()
    one, other = (here / receipt.files["log"].path).read_bytes(), (there / said).read_bytes()
    assert one == other
    played = log.read(one, where="there")
    assert len(played.frames) == 601
    assert len(played.decisions) > 60


def test_part_length():
    """How many frames are handed over at once changes nothing that is read, nor does a match that is not logged."""
    one, other = (log.read(logged(recipe(seed=5), part=part), where="here") for part in (1000, 7))
    assert one.frames.robots.tobytes() == other.frames.robots.tobytes()
    assert one.referee.equals(other.referee)
    one, other = match(recipe(seed=3)), match(recipe(seed=3), logged=False)
    one.advance(600)
    other.advance(600)
    assert one.bodies.tobytes() == other.bodies.tobytes()
    assert len(other.take().frames) == 0


def test_other_seed():
    """Another seed gives another match with another id."""
    assert logged(recipe(seed=5)) != logged(recipe(seed=6))
    assert recipe(seed=5).match_id != recipe(seed=6).match_id


def test_separate_chance():
    """A team's random moves do not depend on the other team, until that touches it or the ball."""
    one, other = (match(recipe("random", away, seconds=1.0)) for away in ("static", "human-like"))
    one.advance(12)
    other.advance(12)
    assert (one.bodies[1:4] == other.bodies[1:4]).all()


def test_lead():
    """A lead counts from the start."""
    played = match(recipe(seconds=1.0, score=(7, 0)))
    played.advance(100)
    assert played.score == (7, 0)
    assert played.take().referee["score_home"].to_list()[0] == 7


@settings(max_examples=5, deadline=None)
@given(robots=st.integers(1, 5), seed=st.integers(0, 1000))
def test_robot_counts(robots, seed):
    """Any number of robots from one to five a team can play."""
    played = match(recipe("static", "human-like", seed=seed, seconds=3.0, robots=robots))
    played.advance(1000)
    assert played.over
    assert np.isfinite(played.bodies).all()
    assert (played.take().frames.counts() == 2 * robots).all()


def test_person():
    """A person has no controller, and the error names the command that lets one play."""
    of = recipe("human")
    with pytest.raises(BadSettings, match="pitchlore play"):
        controller_of(of.home, of, 0)


# --- the learned team ----------------------------------------------------------------------------


def learned(seconds=10.0, **home):
    """A recipe of a learned team against static."""
    return recipe("learned", seconds=seconds).model_copy(update={"home": TeamSettings(kind="learned", **home)})


def known_to_all(*values):
    """A policy that has behaviours and their values, and evidence if any, in all states of all roles."""
    return policy(*((role, 0, *value) for role in ROLES for value in values))


def decided(of, known):
    """Decisions of the whole match."""
    played = match(of, known)
    played.advance(round(of.referee.duration_s * 60) + 1)
    return played.take().decisions


def test_no_knowledge():
    """A learned team that knows nothing moves randomly."""
    made = decided(learned(), None)
    assert made["behaviour_id"].null_count() == made.height > 60
    assert made["random"].all()
    assert (made["team"] == "home").all()
    assert made["chosen"].all()
    # 194 lasts 0.4 s unless play stops
    assert ((made["end_ns"] - made["t_ns"]) <= 400_000_001).all()


def test_best_behaviour():
    """The best behaviour is taken, and the decision names it."""
    made = decided(learned(), known_to_all(("046-044-021", 0.5), ("194", 0.1)))
    assert set(made["behaviour_id"]) == {f"{role}-046-044-021" for role in ROLES}
    assert not made["random"].any()


def test_ties():
    """Ties are broken by chance."""
    made = decided(learned(20.0), known_to_all(*((codes, 0.5) for codes in ("184", "057", "078"))))
    shares = made["behaviour_id"].str.slice(-3).value_counts(normalize=True)
    assert shares.height == 3
    assert shares["proportion"].min() > 0.1


def test_exploration():
    """Exploration takes any behaviour that is known in the state."""
    made = decided(learned(20.0, explore=0.5), known_to_all(("184", 0.5), ("057", 0.1)))
    assert 0.3 < made["random"].mean() < 0.7
    assert 0.1 < (made["behaviour_id"].str.ends_with("057")).mean() < 0.45


def test_posterior_draws():
    """A team in doubt draws its values at each restart and keeps them while play is on."""
    made = decided(learned(120.0, posterior_std=1.0), known_to_all(*((codes, 0.5) for codes in ("184", "057", "078"))))
    a_role = made.group_by("episode", "role").agg(pl.col("behaviour_id").n_unique())
    assert (a_role["behaviour_id"] == 1).all()
    assert made["behaviour_id"].n_unique() == 3 * len(ROLES)
    assert not made["random"].any()


def test_evidence():
    """The more evidence a value has, the narrower its interval."""
    # the worse one is believed to be the better one where N(.2, 1 + 1 / 9) > 0: 57 %; and 0 % once it is known
    for evidence, least, most in ((1.0, 0.35, 0.65), (1e6, 0.0, 0.0)):
        known = known_to_all(("184", 0.2, 9 * evidence), ("057", 0.0, evidence))
        made = decided(learned(240.0, posterior_std=1.0), known)
        first = made.group_by("episode", "role").agg(pl.col("behaviour_id").first().str.ends_with("057").alias("worse"))
        assert least <= first["worse"].mean() <= most


def test_caution():
    """A cautious team prefers a well-known behaviour to a better one that it hardly knows."""
    known = known_to_all(("184", 0.5, 1.0), ("057", 0.1, 100.0))
    for lcb_weight, codes in ((0.0, "184"), (0.4, "184"), (0.5, "057")):  # .5 - c against .1 - c / 10
        made = decided(learned(lcb_weight=lcb_weight), known)
        assert set(made["behaviour_id"]) == {f"{role}-{codes}" for role in ROLES}


def test_key_order():
    """A finer key goes first, and a coarser one is the fallback."""
    one = decided(learned(), None).filter(pl.col("t_ns") == 0).row(0, named=True)
    made = decided(learned(), pl.concat([
        policy((one["role"], one["state"], "184", 0.5), key="full36"), known_to_all(("057", 0.1))]))
    same = made.filter(pl.col("t_ns") == 0, pl.col("role") == one["role"])
    assert same["behaviour_id"].to_list() == [f"{one['role']}-184"]
    assert (made["behaviour_id"].str.ends_with("057")).mean() > 0.9


def test_episode_decisions():
    """The decisions of an episode follow each other, only the last can have a reward, and a team sees one state at a time."""
    made = decided(learned(60.0), None)
    for _, own in made.group_by("robot", "episode"):
        rows = own.sort("t_ns")
        assert (rows["end_ns"].to_list()[:-1]) == rows["t_ns"].to_list()[1:]
        assert rows["ends"].to_list() == [None] * (rows.height - 1) + ["terminal"]
        assert (rows["reward"][:-1] == 0).all()
    assert made["reward"].min() == -1.0  # static scores within a minute
    assert made["state"].min() >= 0
    assert (made.group_by("t_ns").agg(pl.col("state").n_unique())["state"] == 1).all()


@pytest.mark.parametrize(("ball", "robots", "pair"), [
    # two of a team side by side, askew: each bends round the other, both push on and creep
    ((0.1, 0.1), [(0.047, 0.328, 0.748), (-0.017, 0.288, 0.744), (-0.7, 0.193, 1.571),
                  (0.7, 0.0, 1.57), (0.5, -0.5, 0.0), (0.3, -0.55, 0.0)], (1, 2)),
    # the attacker against an opponent who stands before the ball
    ((0.52, 0.162), [(-0.7, 0.145, -1.571), (-0.248, 0.04, -1.69), (0.484, -0.087, -1.345),
                     (0.702, 0.047, 1.54), (0.494, -0.008, -1.35), (0.537, -0.166, 1.231)], (3, 5)),
])  # fmt: skip
def test_touching_robots(ball, robots, pair):
    """Static robots that touch come apart within 2.5 s.

    Home plays, the other team stands; robots of 7.5 cm whose middles are 11 cm apart cannot touch.
    """
    of = recipe()
    arena, controller = Arena(of.pitch, of.robots, of.physics), controller_of(of.home, of, 0)
    bodies, wheels = np.zeros_like(arena.bodies), np.zeros((2 * of.robots, 2))
    bodies[BALL, :2] = ball
    bodies[1:, :3] = robots
    arena.place(bodies)
    one, other = pair
    for frame in range(150):
        if np.hypot(*(arena.bodies[one, :2] - arena.bodies[other, :2])) > 0.11:
            return
        controller.think(frame, arena.bodies, wheels[: of.robots])
        arena.frame(wheels)
    pytest.fail("they touch for 2.5 s")
