"""The referee: crowds in a goal area, stalemates there, and how long it remembers them."""


import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import literal_referee
from support.refereed import ASIDE, LAWS, RESTARTS, VSSS, calls, first, in_play, scene, score

from pitchlore.pipeline.arena.physics.laws import (
    FOUL,
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
    Laws,
    call_events,
    referee_call,
)
from pitchlore.pipeline.game.bodies import BALL, VX, X, Y
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.schemas import AWAY, HOME

# ---- goal areas

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
