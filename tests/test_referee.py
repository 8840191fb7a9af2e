"""The referee: goals, stuck balls, the clock, properties of whole matches, and their events."""

import math
from collections import Counter
from itertools import pairwise

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.refereed import EPS, LAWS, RESTARTS, VSSS, calls, first, in_play, scene, score

from pitchlore.pipeline.arena.physics.laws import (
    END,
    FOUL,
    FREE_BALL,
    GOAL,
    HALF,
    KICK_OFF,
    PLAY_ON,
    RefereeSettings,
)
from pitchlore.pipeline.arena.physics.referee import (
    NOBODY,
    STATE,
    Laws,
    begin,
    call_events,
    event_rows,
    referee_call,
)
from pitchlore.pipeline.arena.physics.restarts import restart
from pitchlore.pipeline.game.bodies import BALL, VX, X, Y, see
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
