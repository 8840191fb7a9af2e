"""Influence values between team-mates whose decisions last unequally long (paper, section 2.3.4).

Equations 4 to 6 are written for agents that act at once; robots of a team decide each in its own
time. So the others judge what a robot decided by the decisions that they were in the midst of: the
opinion of a team-mate on decision d is its opinion on what became of its own decision that was under
way when d began.

An opinion's RV (equation 6: what j got and may expect, less what it had expected) is the TD error of
j's own update: Sarsa's next pair stands where Q-learning has the greatest, and the next value is
discounted, which equation 6 leaves out and which did better in the paper's games
(data/studies/paradigms).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from numba import njit

from pipeline.errors import BadSettings, SchemaMismatch

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def opinion(relative: float, share: float) -> float:
    """What a judge thinks of an action (equation 5): a protest grows, and praise fades, with repetition.

    Args:
        relative: RV_j, by how much the judge's own outcome beat what it had expected.
        share: Pe, how often the action is taken in its state, of all times in the state, in [0, 1].
    """
    return relative * share if relative <= 0.0 else relative * (1.0 - share)


@njit(cache=True, nogil=True, error_model="numpy")
def _sway(
    order: I64, company: I64, robot: I64, t_ns: I64, pair: I64, share: F64, errors: F64, rate: float,
    latest: I64, out: F64,
) -> None:
    """Fill ``out`` [T]; ``latest`` [robots] is scratch: each robot's decision that is under way."""
    total = len(order)
    start = 0
    while start < total:
        first = order[start]
        if start == 0 or company[order[start - 1]] != company[first]:
            latest[:] = -1
        stop = start
        while stop < total and company[order[stop]] == company[first] and t_ns[order[stop]] == t_ns[first]:
            row = order[stop]
            if pair[row] >= 0:
                latest[robot[row]] = row
            stop += 1
        # those who decide at once judge each other by what they decide now
        for i in range(start, stop):
            row = order[i]
            out[row] = 0.0
            if pair[row] < 0:
                continue
            swayed = 0.0
            for judge in range(len(latest)):
                if judge != robot[row] and latest[judge] >= 0 and not np.isnan(errors[latest[judge]]):
                    swayed += opinion(errors[latest[judge]], share[pair[row]])
            out[row] = rate * swayed
        start = stop


@dataclass(frozen=True, slots=True)
class Influence:
    """The influence values of a batch; called with TD errors, as ``sway`` of ``sarsa_lambda``.

    Attributes:
        company: int64 [T], equal for the decisions that can be under way together: those of one
            team in one episode of one match.
        robot: int64 [T], which robot of the team decides, from 0.
        t_ns: int64 [T], when the decision begins, ns. A known decision is under way from then
            (included) until the robot's next known one, or the episode's end.
        pair: int64 [T], as in Transitions. A decision of no known pair neither judges nor is judged; the
            known one before it stays under way, as it does in the update.
        share: float64 [P], Pe of equation 5: a pair's share of all visits of its state, in [0, 1].
        rate: beta of equation 4, of every team-mate; 0 or more. It stands inside the learning
            rate's bracket, as equation 7 is printed; outside is beta / alpha inside.

    Raises:
        SchemaMismatch: if the arrays are not int64 [T] and float64 [P], a robot is negative, a
            share is outside [0, 1], or a pair is not below P.
        BadSettings: if ``rate`` is negative or not finite.
    """

    company: I64
    robot: I64
    t_ns: I64
    pair: I64
    share: F64
    rate: float
    _order: I64 = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("company", "robot", "t_ns", "pair"):
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
        object.__setattr__(self, "_order", np.lexsort((self.t_ns, self.company)))

    def __call__(self, errors: F64) -> F64:
        """The influence value of every decision (equation 4), float64 [T]; 0 where nobody judges.

        Args:
            errors: float64 [T], the TD error of each decision; NaN where there is none, so that the
                robot has no opinion.
        """
        out = np.empty(len(self.pair))
        latest = np.empty(int(self.robot.max(initial=-1)) + 1, dtype=np.int64)
        _sway(self._order, self.company, self.robot, self.t_ns, self.pair, self.share, errors, self.rate,
              latest, out)
        return out


def _require(ok: bool, name: str, breach: str) -> None:
    if not ok:
        raise SchemaMismatch(
            f"{name} {breach}", where="influence", next_step="Pass arrays as Influence documents them"
        )
