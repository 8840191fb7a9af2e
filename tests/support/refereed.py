"""Hand-made frames for the referee, and its calls at them."""

import numpy as np

from pitchlore.pipeline.arena.physics.laws import (
    FREE_BALL,
    GOAL_KICK,
    HALF,
    KICK_OFF,
    PENALTY,
    PLAY_ON,
    RefereeSettings,
)
from pitchlore.pipeline.arena.physics.referee import (
    Laws,
    begin,
    referee_call,
)
from pitchlore.pipeline.game.bodies import BALL, VY, X, Y
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.schemas import HOME

VSSS = PITCHES[Kind.VSSS]
LAWS = Laws.of(VSSS, RefereeSettings(), 60.0)
RESTARTS = (KICK_OFF, FREE_BALL, PENALTY, GOAL_KICK)
EPS = 1e-9

#: Stands nowhere in particular: in no goal area, near no ball of these tests.
ASIDE = (0.0, -0.6)


def scene(ball=(0.1, 0.0), speed=1.0, home=(ASIDE,) * 3, away=(ASIDE,) * 3):
    """Bodies of which only places and the ball's speed matter."""
    bodies = np.zeros((1 + len(home) + len(away), 6))
    bodies[BALL, [X, Y]], bodies[BALL, VY] = ball, speed
    bodies[1:, [X, Y]] = [*home, *away]
    return bodies


def calls(frames, laws=LAWS, state=None):
    """(number of the frame, call) of every call at these frames."""
    state = begin() if state is None else state
    found = []
    for bodies in frames:
        call = referee_call(bodies, state, laws.limits)
        if call != PLAY_ON:
            found.append((int(state["frame"]) - 1, call))
    return found


def score(state):
    """Goals of home and away."""
    return [int(state["home_goals"]), int(state["away_goals"])]


def in_play(half=0, laws=LAWS, opener=HOME):
    """The state after the kick-off of a half."""
    state = begin(opener)
    calls([scene()], laws, state)
    if half:
        state["frame"] = laws.duration // 2
        assert calls([scene()], laws, state) == [(laws.duration // 2, HALF)]
    return state


def first(bodies, state, laws=LAWS, most=1000):
    """After how many frames of this scene there is a call, and the call."""
    begun = int(state["frame"])
    for _ in range(most):
        if found := calls([bodies], laws, state):
            return found[0][0] - begun + 1, found[0][1]
    return None
