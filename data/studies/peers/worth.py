"""V of matches that are being played, for rewards: goals come once in ten seconds, V changes at each step.

A reward that adds ``discount * V(after) - V(before)`` has the same best policies (Ng, Harada and Russell
1999, "Policy invariance under reward transformations"). V is the model that the package ships, which has not
seen these matches.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pitchlore.pipeline.arena.env import ParallelMatch
from pitchlore.pipeline.game.bodies import BALL, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.numbers.arrays import F32
from pitchlore.pipeline.stages.values.models import logits_of, probability, shipped
from pitchlore.pipeline.stages.values.moments import BallStates, RobotStates, features

_PITCH = PITCHES[Kind.VSSS]


class Worth:
    """V of matches, for the team that is driven.

    Args:
        discount: discount of a step.
    """

    def __init__(self, discount: float) -> None:
        self.discount = discount
        models = shipped()
        (self._model,), self._calibration = models.fits, models.calibration

    def of(self, pitches: Sequence[ParallelMatch]) -> F32:
        """V of the moment in each match, float32 [matches]; 0 while play is stopped."""
        teams = [pitch.driven[0] for pitch in pitches]
        views = np.stack([
            *(pitch.match.views[team] for pitch, team in zip(pitches, teams, strict=True)),
            *(pitch.match.views[1 - team] for pitch, team in zip(pitches, teams, strict=True))])
        robots = views.shape[1] // 2
        ball = BallStates(*(views[:, BALL, part] for part in (X, Y, VX, VY)))
        own, their = (
            RobotStates(*(views[:, first : first + robots, part].T for part in (X, Y, THETA, VX, VY)))
            for first in (1, 1 + robots))
        logits = logits_of(self._model, features(ball, own, their, _PITCH))
        scores = probability(self._calibration[0] * logits + self._calibration[1])
        on = np.array([pitch.match.in_play for pitch in pitches])
        value = np.where(on, scores[: len(pitches)] - scores[len(pitches) :], 0.0)
        return value.astype(np.float32)
