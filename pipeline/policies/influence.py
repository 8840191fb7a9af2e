"""Influence values between team-mates whose decisions last unequally long (paper, section 2.3.4).

Equations 4 to 6 assume agents that act at once. Robots of a team decide each in its own time, so a
team-mate judges a decision by its own decision that was under way when the judged one began.

RV of an opinion (equation 6) is what the judge got and may expect, less what it had expected. Here it
is the TD error of the judge's own update. Sarsa's next pair replaces Q-learning's greatest, and the
next value is discounted. Equation 6 does not discount; discounting did better in the paper's games
(data/studies/paradigms).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from pipeline.errors import BadSettings, SchemaMismatch

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]


class _JudgedDecisions(NamedTuple):
    """The fields of :class:`Influence` that the kernel reads, and their order by team, episode and time."""

    order: I64
    team_episode: I64
    robot: I64
    t_ns: I64
    pair: I64
    share: F64


@njit(cache=True, nogil=True, error_model="numpy")
def opinion(relative: float, share: float) -> float:
    """A judge's opinion on an action (equation 5): with repetition protest grows and praise fades.

    Args:
        relative: RV_j, the judge's own outcome less what it had expected.
        share: Pe, the action's share of all visits of its state, in [0, 1].
    """
    return relative * share if relative <= 0.0 else relative * (1.0 - share)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_values(decisions: _JudgedDecisions, errors: F64, rate: float, latest: I64, out: F64) -> None:
    """Fill ``out`` [T] with influence values; ``latest`` [robots] is scratch: the decisions under way."""
    order, team_episode, robot, t_ns, pair, share = decisions
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
                    opinions += opinion(errors[latest[judge]], share[pair[row]])
            out[row] = rate * opinions
        start = stop


@dataclass(frozen=True, slots=True)
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

    Raises:
        SchemaMismatch: if the arrays are not int64 [T] and float64 [P], a robot is negative, a
            share is outside [0, 1], or a pair is not below P.
        BadSettings: if ``rate`` is negative or not finite.
    """

    team_episode: I64
    robot: I64
    t_ns: I64
    pair: I64
    share: F64
    rate: float
    _order: I64 = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("team_episode", "robot", "t_ns", "pair"):
            array = getattr(self, name)
            _require(array.shape == self.pair.shape and array.ndim == 1, name, "is not [T] as pair is")
            _require(array.dtype == np.int64, name, f"is {array.dtype}, not int64")
        _require(self.share.dtype == np.float64 and self.share.ndim == 1, "share", "is not float64 [P]")
        _require(bool(((self.share >= 0) & (self.share <= 1)).all()), "share", "is not in [0, 1]")
        _require(bool((self.robot >= 0).all()), "robot", "is negative")
        pairs = len(self.share)
        _require(bool((self.pair < pairs).all()), "pair", f"is not below the {pairs} shares")
        if not 0 <= self.rate < np.inf:
            raise BadSettings(f"influence cannot be {self.rate}", where="influence",
                              next_step="See PolicySettings for its bounds")
        object.__setattr__(self, "_order", np.lexsort((self.t_ns, self.team_episode)))

    def __call__(self, errors: F64) -> F64:
        """Influence value of every decision (equation 4), float64 [T]; 0 where no team-mate judges.

        Args:
            errors: float64 [T], TD error of each decision. Where it is NaN, the robot has no opinion.
        """
        out = np.empty(len(self.pair))
        latest = np.empty(int(self.robot.max(initial=-1)) + 1, dtype=np.int64)
        decisions = _JudgedDecisions(
            self._order, self.team_episode, self.robot, self.t_ns, self.pair, self.share
        )
        _fill_values(decisions, errors, self.rate, latest, out)
        return out


def _require(ok: bool, name: str, breach: str) -> None:
    if not ok:
        raise SchemaMismatch(
            f"{name} {breach}", where="influence", next_step="Pass arrays as Influence documents them"
        )
