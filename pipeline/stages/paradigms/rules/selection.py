"""Choice of an action: weights of the actions from their values, and a draw by the weights.

Values are float64 [A] and finite. Weights are written into ``out``, float64 [A]. A temperature is at least 0,
in the unit of the values; a probability of exploring, ``epsilon``, is in [0, 1].
"""

from __future__ import annotations

import math
from enum import IntEnum

from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel

#: The exponential of this is 0 in float64. Late in training most weights are 0; to compute them took a tenth
#: of a step.
UNDERFLOW = -746.0


class ActionSelection(IntEnum):
    """Rule that makes weights of values; ``temperature`` is the probability of exploring in the last two."""

    BOLTZMANN = 0
    EPSILON_GREEDY = 1
    MIXED = 2


@kernel
def boltzmann(values: F64, temperature: float, out: F64) -> None:
    """Softmax of ``values / temperature``: ``out[a] = exp((values[a] - max(values)) / temperature)``.

    The greatest weight is 1, so nothing overflows; a weight that underflows is 0. At temperature 0 the
    actions of the greatest value weigh 1 and all others 0, which is the limit.
    """
    best = values[0]
    for a in range(1, values.shape[0]):
        best = max(best, values[a])
    for a in range(values.shape[0]):
        if values[a] == best:
            out[a] = 1.0
        elif values[a] - best > UNDERFLOW * temperature:
            out[a] = math.exp((values[a] - best) / temperature)
        else:
            out[a] = 0.0


@kernel
def epsilon_greedy(values: F64, epsilon: float, out: F64) -> None:
    """Weights of a uniform choice of all actions (``epsilon``) or of those of the greatest value; sum 1."""
    boltzmann(values, 0.0, out)
    ties = 0.0
    for a in range(out.shape[0]):
        ties += out[a]
    for a in range(out.shape[0]):
        out[a] = (1.0 - epsilon) * out[a] / ties + epsilon / out.shape[0]


@kernel
def mixed(policy: F64, epsilon: float, out: F64) -> None:
    """Weights of a uniform choice (``epsilon``) or of a draw from the agent's own mixed policy; sum 1."""
    for a in range(policy.shape[0]):
        out[a] = (1.0 - epsilon) * policy[a] + epsilon / policy.shape[0]


@kernel
def selection_weights(selection: int, values: F64, temperature: float, out: F64) -> None:
    """Weights that a :class:`ActionSelection` gives to actions of these values."""
    if selection == 0:
        boltzmann(values, temperature, out)
    elif selection == 1:
        epsilon_greedy(values, temperature, out)
    else:
        mixed(values, temperature, out)


@kernel
def sample(weights: F64, u: float) -> int:
    """Action that ``u``, drawn from [0, 1), selects; never one of weight 0.

    Args:
        weights: float64 [A], at least 0, not all 0; probabilities are proportional to them.
        u: in [0, 1).
    """
    total = 0.0
    for a in range(weights.shape[0]):
        total += weights[a]
    rest = u * total
    last = 0
    for a in range(weights.shape[0]):
        if weights[a] > 0.0:
            last = a
            rest -= weights[a]
            if rest < 0.0:
                return a
    return last  # rounding left a rest
