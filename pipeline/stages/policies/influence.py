"""Influence values between team-mates whose decisions last unequally long (paper, section 2.3.4).

Equations 4 to 6 assume agents that act at once. Robots of a team decide each in its own time, so a
team-mate judges a decision by its own decision that was under way when the judged one began.

RV of an opinion (equation 6) is what the judge got and may expect, less what it had expected. Here it
is the TD error of the judge's own update. Sarsa's next pair replaces Q-learning's greatest, and the
next value is discounted. Equation 6 does not discount; discounting did better in the paper's games
(data/studies/paradigms).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.kernels import njit


@njit(cache=True, nogil=True, error_model="numpy")
def opinion_on(relative: float, share: float) -> float:
    """A judge's opinion on an action (equation 5): with repetition protest grows and praise fades.

    Args:
        relative: RV_j, the judge's own outcome less what it had expected.
        share: Pe, the action's share of all visits of its state, in [0, 1].
    """
    return relative * share if relative <= 0.0 else relative * (1.0 - share)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_values(
    order: I64, team_episode: I64, robot: I64, t_ns: I64, pair: I64, share: F64, rate: float, errors: F64,
    latest: I64, out: F64,
) -> None:
    """Fill ``out`` [T] with influence values; ``latest`` [robots] is scratch: the decisions under way."""
    total = len(order)
    start = 0
    while start < total:
        first = order[start]
        same = team_episode[first]
        if start == 0 or team_episode[order[start - 1]] != same:
            latest[:] = -1
        stop = start
        while stop < total and team_episode[order[stop]] == same and t_ns[order[stop]] == t_ns[first]:
            row = order[stop]
            if pair[row] >= 0:
                latest[robot[row]] = row
            stop += 1
        # robots that decide at one time judge each other by these decisions
        for i in range(start, stop):
            row = order[i]
            out[row] = 0.0
            if pair[row] < 0:
                continue
            opinions = 0.0
            for judge in range(len(latest)):
                if judge != robot[row] and latest[judge] >= 0 and not np.isnan(errors[latest[judge]]):
                    opinions += opinion_on(errors[latest[judge]], share[pair[row]])
            out[row] = rate * opinions
        start = stop


@dataclass(frozen=True)
class Influence:
    """The influence values of a batch; called with TD errors, as ``influence`` of ``sarsa_lambda``.

    Attributes:
        team_episode: int64 [T], equal for decisions that may be under way together: those of one team
            in one episode of one match.
        robot: int64 [T], number of the robot in its team, from 0.
        t_ns: int64 [T], when the decision begins, ns. A known decision is under way from then
            (included) until the robot's next known one, or the episode's end.
        pair: int64 [T], as in Transitions. A decision of no known pair neither judges nor is judged. The
            known decision before it stays under way, as in the update.
        share: float64 [P], Pe of equation 5: a pair's share of all visits of its state, in [0, 1].
        rate: beta of equation 4, for every team-mate; 0 or more. It stands inside the learning
            rate's bracket, as equation 7 is printed; outside is beta / alpha inside.
    """

    team_episode: I64
    robot: I64
    t_ns: I64
    pair: I64
    share: F64
    rate: float

    @cached_property
    def _order(self) -> I64:
        """The decisions by team, episode and time."""
        return np.lexsort((self.t_ns, self.team_episode))

    def __call__(self, errors: F64) -> F64:
        """Influence value of every decision (equation 4), float64 [T]; 0 where no team-mate judges.

        Args:
            errors: float64 [T], TD error of each decision. Where it is NaN, the robot has no opinion.
        """
        out = np.empty(len(self.pair))
        latest = np.empty(int(self.robot.max(initial=-1)) + 1, dtype=np.int64)
        _fill_values(
            self._order, self.team_episode, self.robot, self.t_ns, self.pair, self.share, self.rate, errors,
            latest, out,
        )
        return out
