"""The referee: goals, stuck balls, the clock, crowds in a goal area, restarts, and properties of whole matches."""

import math
from collections import Counter
from itertools import pairwise, product

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import literal_referee
from support.refereed import ASIDE, EPS, LAWS, RESTARTS, VSSS, calls, first, in_play, scene, score

from pitchlore.pipeline.arena.physics.laws import (
    END,
    FOUL,
    FREE_BALL,
    GOAL,
    GOAL_KICK,
    HALF,
    KICK_OFF,
    PENALTY,
    PLAY_ON,
    Marks,
    RefereeSettings,
)
from pitchlore.pipeline.arena.physics.referee import (
    ATTACKERS,
    DEFENDERS,
    NOBODY,
    REASONS,
    STATE,
    Laws,
    begin,
    call_events,
    event_rows,
    referee_call,
)
from pitchlore.pipeline.arena.physics.restarts import restart
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, X, Y, see
from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.schemas import AWAY, HOME, SIDES

# ---- goals


@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("end", [-1, 1])
@pytest.mark.parametrize("side", [-1, 1])
def test_goal_line(half, end, side):
    """A goal is the whole ball past the line between the posts."""
    line = 0.75 + 0.02135
    for x, y, goal in (
        (line + EPS, 0.0, True), (line, 0.0, False), (0.76, 0.0, False),
        (line + EPS, 0.20 - EPS, True), (line + EPS, 0.20, False), (line + EPS, 0.20 + EPS, False),
    ):
        state = in_play(half)
        found = calls([scene(ball=(end * x, side * y))], state=state)
        scorer = HOME if (end > 0) == (half == 0) else AWAY  # home attacks +x first, then -x
        assert [call for _, call in found] == [GOAL] * goal
        assert score(state) == [goal * (scorer == HOME), goal * (scorer == AWAY)]
        if goal:
            assert state["due"] == KICK_OFF
            assert state["team"] == 1 - scorer


# ---- the stuck ball


def test_stuck_ball():
    """A ball is stuck when it was slow for five seconds."""
    slow = scene(speed=0.0999)
    state = in_play()
    assert calls([slow] * 300, state=state) == []  # 299 intervals
    assert calls([slow], state=state) == [(301, FOUL)]
    assert state["due"] == FREE_BALL
    assert calls([slow] * 29, state=state) == []
    assert calls([slow], state=state) == [(331, FREE_BALL)]
    assert calls([slow] * 300, state=state) == []  # counted anew from the restart
    assert calls([slow], state=state) == [(632, FOUL)]


@pytest.mark.parametrize(("x", "y"), [(-0.2, -0.3), (0.2, -0.3), (-0.2, 0.3), (0.2, 0.3)])
@pytest.mark.parametrize("half", [0, 1])
def test_free_ball_quarter(x, y, half):
    """A free ball is in the quarter where the ball was."""
    state = in_play(half)
    assert first(scene(ball=(x, y), speed=0.0), state) == (301, FOUL)
    assert call_events(FOUL, state, LAWS)[0][1:] == ("stop", None, 0, 0, "free ball: stuck ball")
    bodies = scene()
    state["frame"] = state["resume"]
    ((_, call),) = calls([bodies], state=state)
    restart(bodies, call, state, LAWS, np.random.default_rng(0))
    assert bodies[BALL, [X, Y]].tolist() == pytest.approx([math.copysign(0.375, x), math.copysign(0.4, y)])


# ---- the clock


def test_clock():
    """Eight minutes are 28,800 frames with the half in the middle."""
    state = begin(AWAY)
    moving = scene()
    assert calls([moving] * 28_805, state=state) == [(0, KICK_OFF), (14_400, HALF), (28_800, END)]
    assert LAWS.duration == 28_800
    assert LAWS.t_ns(LAWS.duration) == 480_000_000_000
    assert [(p.start_ns, p.end_ns, p.home_attacks) for p in LAWS.periods()] == [
        (0, 240_000_000_000, 1), (240_000_000_000, 480_000_000_001, -1)
    ]


def test_after_the_end():
    """After the end the state stays as it is."""
    short = Laws.of(VSSS, RefereeSettings(duration_s=1.0), 60.0)
    state = begin()
    calls([scene()] * 61, short, state)
    ended = state.copy()
    assert calls([scene(ball=(0.8, 0.0))] * 10, short, state) == []
    assert state.tolist() == ended.tolist()
    assert call_events(END, state, short) == ((1_000_000_000, "end", None, 0, 0, "end"),)


@given(st.integers(1, 400), st.integers(1, 5), st.sampled_from([25.0, 59.94, 60.0, 100.0]))
def test_halves(frames, halves, hz):
    """Halves are whole frames, and begin and end as the match's description says."""
    if frames < halves:
        return
    laws = Laws.of(VSSS, RefereeSettings(duration_s=frames / hz, halves=halves), hz)
    found = calls([scene()] * (frames + 3), laws)
    assert found[-1] == (frames, END)
    starts = [frame for frame, call in found if call in (KICK_OFF, HALF)]
    periods = laws.periods()
    assert [laws.t_ns(frame) for frame in starts] == [p.start_ns for p in periods]
    assert [p.end_ns for p in periods[:-1]] == [p.start_ns for p in periods[1:]]
    assert np.ptp(np.diff([*starts, frames])) <= 1


# ---- properties of whole matches

SHORT = Laws.of(VSSS, RefereeSettings(duration_s=30.0, stuck_s=0.5, crowd_s=0.3, pause_s=0.1), 60.0)


def wild_frames(seed, frames, robots):
    """Bodies that are somewhere else every few frames, mostly at the goals, the ball slow or fast."""
    rng = np.random.default_rng(seed)
    for _ in range(frames // 20 + 1):
        bodies = np.zeros((1 + 2 * robots, 6))
        bodies[:, X] = rng.choice([-1, 1]) * rng.uniform(0.45, 0.85, len(bodies))
        bodies[:, Y] = rng.uniform(-0.4, 0.4, len(bodies))
        bodies[BALL, VX] = rng.choice([0.0, 1.0], p=[0.7, 0.3])
        for _ in range(int(rng.integers(5, 60))):
            yield bodies


@given(st.integers(0, 2**32), st.integers(1, 11), st.sampled_from([HOME, AWAY]))
@settings(max_examples=40)
def test_of_any_match(seed, robots, opener):
    """In any match the calls, restarts, scores and events agree with each other."""
    state, rows, found = begin(opener), [], []
    before = [0, 0]
    for bodies in wild_frames(seed, 10 * SHORT.duration, robots):
        call = referee_call(bodies, state, SHORT.limits)
        rows += call_events(call, state, SHORT)
        after = score(state)
        rise = [a - b for a, b in zip(after, before, strict=True)]
        assert sorted(rise) == ([0, 1] if call == GOAL else [0, 0])
        before = after
        if call != PLAY_ON:
            found.append((int(state["frame"]) - 1, call))
        if call == END:
            break
    assert found[0] == (0, KICK_OFF)
    assert found[-1] == (SHORT.duration, END)
    assert [at for at, call in found if call == HALF] == [SHORT.duration // 2]
    # what stops play is followed by its restart, six frames later, unless time is up before
    for (at, call), (then, next_call) in pairwise(found):
        if call in (GOAL, FOUL):
            assert next_call in (HALF, END) or (then - at == 6 and next_call in RESTARTS)
        else:
            assert next_call in (GOAL, FOUL, HALF, END)
    events = event_rows("match", rows)
    assert list(events["t_ns"]) == sorted(events["t_ns"])
    goals = Counter(events.filter(pl.col("event") == "goal")["team"])
    assert [goals["home"], goals["away"]] == before
    assert events.select("score_home", "score_away").row(-1) == tuple(before)
    # the other team kicks off the second half
    half = [event for _, event, *_ in rows].index("half")
    assert rows[0][1:3] == ("kick-off", SIDES[opener])
    assert rows[half + 1][:3] == (rows[half][0], "kick-off", SIDES[1 - opener])
    # each goal is followed by a kick-off of the team that conceded it, or by half-time or the end
    for (_, event, team, *_), (_, then, taker, *_) in pairwise(rows):
        if event == "goal":
            assert then in ("half", "end") or (then == "kick-off" and {team, taker} == {"home", "away"})


@given(st.integers(0, 2**32), st.integers(1, 6), st.integers(0, 1800))
def test_saved_state(seed, robots, at):
    """A saved state goes on as if nothing had happened."""
    frames = list(wild_frames(seed, SHORT.duration, robots))
    whole = calls(frames, SHORT)
    state = begin()
    before = calls(frames[:at], SHORT, state)
    saved = np.frombuffer(state.tobytes(), dtype=STATE).copy().reshape(())
    assert before + calls(frames[at:], SHORT, saved) == whole


@given(st.integers(0, 2**32), st.integers(1, 6))
def test_fairness(seed, robots):
    """Both teams are judged alike."""
    state, turned = begin(HOME), begin(AWAY)
    other = np.zeros((1 + 2 * robots, 6))
    for bodies in wild_frames(seed, 1000, robots):
        see(bodies, AWAY, -1.0, other)  # teams and ends exchanged
        call = referee_call(bodies, state, SHORT.limits)
        assert referee_call(other, turned, SHORT.limits) == call
        assert score(state) == score(turned)[::-1]
        assert state["team"] == turned["team"] == NOBODY or state["team"] == 1 - turned["team"]
        if call in (FREE_BALL, END):
            assert call == END or state["quarter"] == 3 - turned["quarter"]


# ---- crowds in a goal area, stalemates there, and how long they are remembered


IN = (0.7, 0.1)


def crowd(end, attackers, defenders, half=0, ball=(0.65, -0.2), speed=1.0):
    """Robots and the ball in the goal area at one end; the ball is near nobody."""
    home_attacks_here = (end > 0) == (half == 0)
    inside, away = (end * IN[0], IN[1]), ASIDE
    teams = [[inside] * n + [away] * (3 - n) for n in (attackers, defenders)]
    home, other = teams if home_attacks_here else teams[::-1]
    return scene(ball=(end * ball[0], ball[1]), speed=speed, home=home, away=other)


# ---- crowds that are remembered: a table of scenes

# Places of the ball, as the team sees it that attacks +x: in the area, out of it, in the goal.
AREA, OUT, INTO = (0.65, -0.2), (0.55, -0.2), (0.80, 0.0)

#: Scenes: name; (frames, place of the ball, attackers and defenders in the area); then the last call's restart,
#: reason, and whether a goal was annulled. All frames but the last are without a call.
SCENES = (
    ("goal, nobody too many", [(5, AREA, 1, 1), (1, INTO, 1, 1)], (KICK_OFF, None, False)),
    ("goal, two attackers", [(5, AREA, 2, 1), (1, INTO, 2, 1)], (GOAL_KICK, ATTACKERS, True)),
    ("goal, two attackers for one frame", [(1, AREA, 2, 0), (9, AREA, 1, 0), (1, INTO, 1, 0)],
     (GOAL_KICK, ATTACKERS, True)),
    ("goal, a second attacker arrives with it", [(5, AREA, 1, 1), (1, INTO, 2, 1)], (KICK_OFF, None, False)),
    ("goal, two defenders", [(5, AREA, 1, 2), (1, INTO, 1, 2)], (KICK_OFF, None, False)),
    ("goal, both, attackers first", [(3, AREA, 2, 1), (3, AREA, 2, 2), (1, INTO, 2, 2)], (GOAL_KICK, ATTACKERS, True)),
    ("goal, both, defenders first", [(3, AREA, 1, 2), (3, AREA, 2, 2), (1, INTO, 2, 2)], (PENALTY, DEFENDERS, True)),
    ("goal, both at once", [(3, AREA, 2, 2), (1, INTO, 2, 2)], (PENALTY, DEFENDERS, True)),
    ("goal in one frame from outside", [(5, OUT, 2, 2), (1, INTO, 2, 2)], (KICK_OFF, None, False)),
    ("left, nobody too many", [(5, AREA, 1, 1), (5, OUT, 1, 1)], None),
    ("left, two attackers", [(5, AREA, 2, 1), (1, OUT, 2, 1)], (GOAL_KICK, ATTACKERS, False)),
    ("left, attackers gone before", [(5, AREA, 2, 1), (5, AREA, 0, 1), (1, OUT, 0, 1)], (GOAL_KICK, ATTACKERS, False)),
    ("left, keeper and one defender", [(5, AREA, 0, 2), (1, OUT, 0, 2)], (PENALTY, DEFENDERS, False)),
    ("too many before the ball comes", [(5, OUT, 2, 2), (5, AREA, 1, 1), (5, OUT, 2, 2)], None),
    ("too many that last", [(180, AREA, 2, 1), (1, AREA, 2, 1)], (GOAL_KICK, ATTACKERS, False)),
    ("too many defenders that last", [(180, AREA, 1, 2), (1, AREA, 1, 2)], (PENALTY, DEFENDERS, False)),
    ("too many that last, in the goal at last", [(180, AREA, 2, 1), (1, INTO, 2, 1)], (GOAL_KICK, ATTACKERS, True)),
)


def filmed(stretches, end=1, half=0, missing=False, pitch=VSSS):
    """The frames of a scene on a pitch, at one end; others may have robots that are not seen."""
    scale = np.array([pitch.length / 1.5, pitch.goal_width / 0.4])
    overlap = Marks.of(pitch).goal_line + 0.01 * pitch.length
    for frames, ball, attackers, defenders in stretches:
        bodies = crowd(end, attackers, defenders, half, ball)
        bodies[:, [X, Y]] *= scale
        if ball == INTO:
            bodies[BALL, X] = end * overlap
        if missing:
            bodies[1:][np.abs(bodies[1:, X]) < 0.5 * pitch.goal_x] = np.nan
        for _ in range(frames):
            yield bodies


def end_of(stretches, laws=LAWS, end=1, half=0, **options):
    """The call at the last frame of a scene, and the state after it; frames before it call nothing."""
    state = in_play(half, laws)
    *before, last = filmed(stretches, end, half, **options)
    assert calls(before, laws, state) == []
    found = calls([last], laws, state)
    return (found[0][1] if found else PLAY_ON), state


every_scene = pytest.mark.parametrize(("stretches", "expected"), [scene[1:] for scene in SCENES], ids=[s[0] for s in SCENES])


@every_scene
def test_overlooked_defenders(stretches, expected):
    """Without a share of crowds of defenders that are fouls, only those of attackers are."""
    call, state = end_of(stretches, Laws.of(VSSS, RefereeSettings(penalty_share=0.0), 60.0))
    if expected is None or expected[1] != DEFENDERS:
        assert (call, state["due"]) == ((PLAY_ON, PLAY_ON) if expected is None else (FOUL if expected[1] is not None else GOAL, expected[0]))
    elif any(attackers > 1 for _, _, attackers, _ in stretches):
        assert (call, state["due"], state["reason"], state["annulled"]) == (FOUL, GOAL_KICK, ATTACKERS, 1)
    else:
        assert (call, state["due"], state["defenders"], state["defenders_seen"]) == (PLAY_ON, PLAY_ON, 0, 0)


def test_share_of_defenders():
    """The share of crowds of defenders that are fouls is kept evenly over the frames of a match."""
    laws, called = Laws.of(VSSS, RefereeSettings(penalty_share=0.25), 60.0), []
    for frame in range(400):
        state = in_play(laws=laws)
        state["frame"] = frame
        called.append(len(calls(filmed([(1, AREA, 0, 2), (1, OUT, 0, 2)]), laws, state)))
    assert [sum(called[first : first + 100]) for first in (0, 100, 200, 300)] == pytest.approx([25] * 4, abs=2)


@every_scene
@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("end", [-1, 1])
def test_scene(stretches, expected, half, end):
    """The call when the ball leaves a goal area or is in the goal, by who was too many, and when."""
    call, state = end_of(stretches, end=end, half=half)
    if expected is None:
        assert call == PLAY_ON
        return
    due, reason, annulled = expected
    attackers = HOME if (end > 0) == (half == 0) else AWAY
    assert call == (GOAL if reason is None else FOUL)
    assert state["due"] == due
    assert state["team"] == (attackers if due == PENALTY else 1 - attackers)
    assert score(state) == [int(call == GOAL and attackers == team) for team in (HOME, AWAY)]
    (event,) = call_events(call, state, LAWS)
    if reason is None:
        assert event.event == "goal"
    else:
        words = {GOAL_KICK: "goal kick", PENALTY: "penalty"}[due]
        assert (event.event, event.team) == ("stop", None)
        assert event.note == f"{words}: {'goal annulled, ' * annulled}{REASONS[reason]}"


@every_scene
@pytest.mark.parametrize("kind", [Kind.SSL, Kind.SIM2D])
def test_scene_on_other_pitches(stretches, expected, kind):
    """On other pitches, whose areas are larger, the scenes end alike; so they do if robots are missing."""
    pitch = PITCHES[kind]
    for laws, options in ((Laws.of(pitch, RefereeSettings(), 60.0), {"pitch": pitch}), (LAWS, {"missing": True})):
        call, state = end_of(stretches, laws, **options)
        assert (call == PLAY_ON) == (expected is None)
        if expected:
            assert (state["due"], state["annulled"]) == (expected[0], expected[2])


@pytest.mark.parametrize("over", [FOUL, GOAL, HALF], ids=["foul", "goal", "half"])
def test_forgotten_crowd(over):
    """Memory from before a foul, a goal or half-time is forgotten after it: the next goal counts."""
    state = in_play()
    if over == GOAL:
        calls([crowd(1, 0, 2), scene(ball=INTO)], state=state)
    else:
        calls([crowd(1, 2, 2)], state=state)
        assert state["attackers_seen"] == state["defenders_seen"] == 1
        if over == FOUL:
            assert first(crowd(1, 2, 2), state) == (180, FOUL)
        else:
            state["frame"] = LAWS.duration // 2
            assert first(scene(ball=AREA), state) == (1, HALF)
    if over != HALF:
        state["frame"] = state["resume"]
        assert first(scene(ball=AREA), state)[1] in RESTARTS
    assert state["attackers_seen"] == state["defenders_seen"] == 0
    assert [call for _, call in calls([scene(ball=AREA), scene(ball=INTO)], state=state)] == [GOAL]


@pytest.mark.slow
@given(st.integers(0, 2**32), st.integers(1, 4), st.booleans(), st.booleans(), st.booleans(), st.integers(2, 3))
@settings(max_examples=40)
def test_literal_referee(seed, robots, remember, penalty, goal_kick, least):
    """The referee agrees, frame by frame, with one that looks back over the whole stretch of play."""
    rules = RefereeSettings(duration_s=1000.0, stuck_s=0.2, crowd_s=0.15, pause_s=0.0, crowd=least,
                            remember_crowds=remember, penalty=penalty, goal_kick=goal_kick)
    laws = Laws.of(VSSS, rules, 60.0)
    state, stretch = in_play(laws=laws), []
    for bodies in strolls(seed, 300, robots):
        if state["due"] != PLAY_ON:
            assert calls([bodies], laws, state)[0][1] in RESTARTS
            stretch = []
            continue
        stretch.append(bodies)
        expected, before = literal_referee.verdict(stretch, 1, laws), score(state)
        call = referee_call(bodies, state, laws.limits)
        if expected is None:
            assert call == PLAY_ON
            continue
        due, end, reason, annulled = expected
        attackers = {1: HOME, -1: AWAY, 0: NOBODY}[end]
        assert call == (GOAL if due == KICK_OFF else FOUL)
        taker = NOBODY if end == 0 else attackers if due == PENALTY else 1 - attackers
        assert (state["due"], state["team"]) == (due, taker)
        if call == FOUL:
            assert (state["reason"], bool(state["annulled"])) == (reason, annulled)
        assert sum(score(state)) == sum(before) + (call == GOAL)


def strolls(seed, frames, robots):
    """Bodies that come and go at the goal areas' edges, the ball slow or fast, now and then unseen."""
    rng = np.random.default_rng(seed)
    bodies = np.zeros((1 + 2 * robots, 6))
    end = 1
    for _ in range(frames):
        if rng.random() < 0.02:
            end = -end
        moved = rng.random(1 + 2 * robots) < 0.15
        moved[BALL] = rng.random() < 0.25
        bodies[moved, X] = end * rng.choice([0.55, 0.65, 0.65, 0.76, 0.80], size=moved.sum())
        bodies[moved, Y] = rng.choice([-0.3, 0.0, 0.15, 0.4], size=moved.sum(), p=[0.3, 0.3, 0.3, 0.1])
        bodies[BALL, VX] = rng.choice([0.0, 0.1, 1.0], p=[0.6, 0.2, 0.2])
        shown = bodies.copy()
        if rng.random() < 0.02:
            shown[rng.integers(len(shown))] = np.nan
        yield shown


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
