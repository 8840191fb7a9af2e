"""The referee: where restarts put the bodies, and its marks on pitches of any size."""

import math
from collections import Counter
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.refereed import EPS, LAWS, RESTARTS, VSSS, first, in_play, scene

from pitchlore.pipeline.arena.physics.laws import (
    FOUL,
    FREE_BALL,
    GOAL_KICK,
    HALF,
    KICK_OFF,
    PENALTY,
    Marks,
    RefereeSettings,
)
from pitchlore.pipeline.arena.physics.referee import (
    NOBODY,
    Laws,
    begin,
)
from pitchlore.pipeline.arena.physics.restarts import restart
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, X, Y, see
from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.schemas import AWAY, HOME

# ---- restarts


def put(call, laws=LAWS, *, robots=3, team=HOME, quarter=0, half=0, seed=0):
    """The bodies after a restart."""
    state = begin(team)
    state["opener"], state["team"] = team, NOBODY if call == FREE_BALL else team
    state["quarter"], state["halves_over"] = quarter, half
    bodies = np.full((1 + 2 * robots, 6), 9.0)
    restart(bodies, call, state, laws, np.random.default_rng(seed))
    return bodies


@given(
    st.sampled_from(RESTARTS), st.sampled_from(list(Kind)), st.integers(1, 11), st.sampled_from([HOME, AWAY]),
    st.integers(0, 3), st.integers(0, 1), st.sampled_from([0.0, 0.1, 0.15]), st.integers(0, 2**32),
)
@settings(max_examples=150)
def test_every_restart_is_legal(call, kind, robots, team, quarter, half, scatter, seed):
    """Every restart puts the bodies at rest, apart and where the rules allow."""
    pitch, scales = PITCHES[kind], SCALES[kind]
    laws = Laws.of(pitch, RefereeSettings(scatter=scatter), 60.0)
    marks = laws.marks
    placed = put(call, laws, robots=robots, team=team, quarter=quarter, half=half, seed=seed)
    assert np.isfinite(placed).all()
    assert not placed[:, [VX, VY, OMEGA]].any()
    assert (np.abs(placed[:, THETA]) <= math.pi).all()

    bodies = np.zeros_like(placed)  # as the taker's team sees it
    see(placed, team, 1.0 if (team == HOME) == (half == 0) else -1.0, bodies)
    xy = bodies[:, [X, Y]]
    around = math.sqrt(2) * scales.robot_radius  # a square robot's corners
    ours, theirs = np.arange(1, robots + 1), np.arange(robots + 1, 2 * robots + 1)

    # inside the pitch, its cut-off corners left out; none overlap
    assert (np.abs(xy[1:, 0]) + around <= pitch.goal_x + EPS).all()
    assert (np.abs(xy[1:, 1]) + around <= pitch.width / 2 + EPS).all()
    to_corner = pitch.goal_x - np.abs(xy[1:, 0]) + pitch.width / 2 - np.abs(xy[1:, 1])
    assert ((to_corner - marks.corner) / math.sqrt(2) >= around - EPS).all()
    apart = np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1))
    reach = np.array([scales.ball_radius, *[around] * (2 * robots)])
    assert (apart + 9 * pitch.length * np.eye(len(xy)) >= reach[:, None] + reach[None] - EPS).all()

    to_ball = apart[0]
    at_ball = {KICK_OFF: [robots], PENALTY: [robots], GOAL_KICK: [1], FREE_BALL: [robots, 2 * robots]}[call]
    keepers = [row for row in (1, robots + 1) if row not in at_ball]
    players = [row for row in range(1, 2 * robots + 1) if row not in at_ball + keepers]
    assert (to_ball[players] >= marks.circle + around - EPS).all()
    outside = (np.abs(xy[:, 0]) <= marks.area_x) | (np.abs(xy[:, 1]) >= marks.area_y)
    assert outside[players].all()
    for row in at_ball:  # behind the ball, and facing it
        bearing = math.atan2(xy[0, 1] - xy[row, 1], xy[0, 0] - xy[row, 0])
        assert abs(math.remainder(bodies[row, THETA] - bearing, 2 * math.pi)) < 0.5
        assert (xy[row, 0] < xy[0, 0]) == (row <= robots)
    if call == PENALTY:
        assert (xy[players, 0] + around <= EPS).all()
        if robots > 1:
            assert xy[1, 0] < -marks.area_x
        assert (xy[robots + 1, 0] + around >= pitch.goal_x - 4 * scatter * scales.robot_radius - EPS)
    elif call != FREE_BALL:
        assert (xy[ours, 0] + around <= EPS).all()
        assert (xy[theirs, 0] - around >= -EPS).all()
    if call == KICK_OFF:
        assert (to_ball[theirs] >= marks.circle + around - EPS).all()


@pytest.mark.parametrize("call", RESTARTS)
@pytest.mark.parametrize("robots", [1, 3, 5])
def test_mirrored_restarts(call, robots):
    """Restarts are mirrored for teams and halves."""
    for team in (HOME, AWAY):
        for half in (0, 1):
            same = team == HOME and half == 0
            # a free ball is nobody's: only the halves turn it
            if call == FREE_BALL and team == AWAY:
                continue
            quarter = 1 if half == 0 else 2
            bodies = put(call, robots=robots, team=team, quarter=quarter, half=half, seed=5)
            view = np.zeros_like(bodies)
            see(bodies, team, 1.0 if (team == HOME) == (half == 0) else -1.0, view)
            reference = put(call, robots=robots, quarter=1, seed=5)
            view[BALL, THETA] = 0.0  # which the view turns, too
            assert np.allclose(view, reference, atol=1e-12)
            assert same or not np.allclose(bodies, reference)


def test_negative_zeros():
    """Half a turn leaves no negative zeros."""
    # the same bytes whichever way a team plays
    for call in RESTARTS:
        bodies = put(call, team=AWAY)
        assert not np.signbit(bodies[bodies == 0]).any()


def test_new_half():
    """A new half places the bodies as a kick-off does."""
    assert put(HALF, team=AWAY, half=1, seed=3).tolist() == put(KICK_OFF, team=AWAY, half=1, seed=3).tolist()


EXACT = Laws.of(VSSS, RefereeSettings(scatter=0.0), 60.0)


def test_league_places():
    """Without scatter the places at restarts are the league's."""
    kick_off = put(KICK_OFF, EXACT)
    assert kick_off[[0, 1, 3, 4], :3].round(6).tolist() == [
        [0, 0, 0], [-0.675, 0, 1.570796], [-0.1125, 0, 0], [0.675, 0, -1.570796]
    ]
    assert kick_off[[2, 5, 6], :2].round(6).tolist() == [[-0.4, 0], [0.4, 0], [0.275, 0]]
    free_ball = put(FREE_BALL, EXACT, quarter=2)
    assert free_ball[[0, 3, 6], :3].round(6).tolist() == [
        [-0.375, 0.4, 0], [-0.575, 0.4, 0], [-0.175, 0.4, 3.141593]
    ]
    penalty = put(PENALTY, EXACT, team=AWAY)
    assert penalty[[0, 6], :3].round(6).tolist() == [[-0.375, 0, 0], [-0.2625, 0, 3.141593]]
    assert penalty[1, X] == pytest.approx(-0.75 + 0.0375 * math.sqrt(2))
    goal_kick = put(GOAL_KICK, EXACT)
    assert goal_kick[0, X] == pytest.approx(-0.6)
    assert abs(goal_kick[0, Y]) == pytest.approx(0.35)
    assert np.hypot(*(goal_kick[1, :2] - goal_kick[0, :2])) == pytest.approx(0.1125)


def test_penalty_keeper_on_line():
    """A goalkeeper that faces a penalty touches its goal line if the settings say so; all else is the same."""
    # FIRA, law 11: "one of the sides of the goalkeeper must be in touch with the goal line. The goalkeeper may be
    # oriented in any direction." VSSReferee 2862742, replacements.json: 0.7125, which is 0.75 less half a robot.
    on_line = Laws.of(VSSS, RefereeSettings(scatter=0.0, keeper_on_line=True), 60.0)
    assert put(PENALTY, on_line)[4, [X, Y]] == pytest.approx([0.7125, 0.0])
    on_line = Laws.of(VSSS, RefereeSettings(keeper_on_line=True), 60.0)
    corners = 0.0375 * np.array([1 + 1j, 1 - 1j, -1 + 1j, -1 - 1j])
    for call, seed in product(RESTARTS, range(20)):
        usual, placed = put(call, seed=seed), put(call, on_line, seed=seed)
        if call == PENALTY:
            turned = corners * np.exp(1j * placed[4, THETA])
            assert placed[4, X] + turned.real.max() == pytest.approx(0.75)
            assert 0.010 < 0.75 - (usual[4, X] + turned.real.max()) < 0.031
            usual[4, X] = placed[4, X]
        assert placed.tolist() == usual.tolist()


def test_goal_kick_side():
    """Goal kicks are on either side by chance."""
    sides = Counter(float(np.sign(put(GOAL_KICK, seed=seed)[BALL, Y])) for seed in range(200))
    assert min(sides[-1.0], sides[1.0]) > 70


def test_scatter():
    """Restarts differ by seed and only by seed, within the bounds of the scatter."""
    assert put(KICK_OFF, seed=1).tolist() == put(KICK_OFF, seed=1).tolist()
    places = np.array([put(KICK_OFF, seed=seed) for seed in range(300)])[:, :, :3]
    places[:, :, THETA] = np.angle(np.exp(1j * (places[:, :, THETA] - places[0, :, THETA])))
    widest = np.ptp(places, axis=0)
    assert not widest[BALL].any()
    share = widest[1:] / [2 * 0.1 * 0.075, 2 * 0.1 * 0.075, 2 * 0.1]
    assert (share <= 1 + EPS).all()
    assert (share > 0.9).all()


# ---- pitches


def test_league_marks():
    """The marks are the league's on its pitch."""
    assert Marks.of(VSSS) == pytest.approx(
        Marks(goal_x=0.75, side_y=0.65, goal_line=0.77135, post=0.2, area_x=0.6, area_y=0.35, mark_x=0.375,
              mark_y=0.4, circle=0.2, corner=0.07, near=0.1125, robot=0.0375)
    )


def test_scaled_marks():
    """The marks scale with the pitch, and what depends on the robots does not."""
    twice = VSSS.model_copy(update={"length": 3.0, "width": 2.6, "goal_width": 0.8})
    small, large = Marks.of(VSSS), Marks.of(twice)
    for name in ("area_x", "area_y", "mark_x", "mark_y", "circle", "corner", "post"):
        assert getattr(large, name) == pytest.approx(2 * getattr(small, name))
    assert (large.near, large.robot) == (small.near, small.robot)


@pytest.mark.parametrize("kind", list(Kind))
def test_scaled_speeds(kind):
    """The speed below which a ball is stuck scales with the kind of pitch."""
    laws = Laws.of(PITCHES[kind], RefereeSettings(), 60.0)
    limit = 0.1 * SCALES[kind].speed
    assert first(scene(speed=limit), in_play(laws=laws), laws) == (301, FOUL)
    assert first(scene(speed=1.01 * limit), in_play(laws=laws), laws) is None


def test_unplayable():
    """Pitches and settings that cannot be played are refused."""
    with pytest.raises(BadSettings, match="too shallow for a whole ball"):
        Laws.of(VSSS.model_copy(update={"goal_depth": 0.04}), RefereeSettings(), 60.0)
    with pytest.raises(BadSettings, match=r"is too small for robots of .* Make it at least 1\.\d+ by 1\.2 m"):
        Laws.of(VSSS.model_copy(update={"width": 1.0}), RefereeSettings(), 60.0)
    with pytest.raises(BadSettings, match="3 halves do not fit"):
        Laws.of(VSSS, RefereeSettings(duration_s=0.03, halves=3), 60.0)
    with pytest.raises(BadSettings, match="40 robots a team find no room at a kick-off"):
        put(KICK_OFF, robots=40)
