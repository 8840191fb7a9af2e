"""How an agent chooses: weights of its actions from their values, and a draw by them."""

from __future__ import annotations

import math
from enum import IntEnum

from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import F64

#: The exponential of this is 0 in float64. Where training ends most weights are, and finding it out by
#: computing them took a tenth of a step.
UNDERFLOW = -746.0


class Selection(IntEnum):
    """What makes weights of values; heat is the temperature, or the probability of exploring."""

    BOLTZMANN = 0
    EPSILON_GREEDY = 1
    MIXED = 2


@kernel
def boltzmann(values: F64, temperature: float, out: F64) -> None:
    """Softmax of ``values / temperature``: ``out[a] = exp((values[a] - max(values)) / temperature)``.

    The greatest weight is 1, so nothing overflows; what underflows is rightly never chosen. At
    temperature 0 the actions of the greatest value weigh the same and others nothing, which is the limit.

    Args:
        values: float64 [A], finite.
        temperature: at least 0, in the unit of the values.
        out: float64 [A], the weights.
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
    """With probability ``epsilon`` any action, else one of the greatest value; both without preference.

    Args:
        values: float64 [A], finite.
        epsilon: in [0, 1].
        out: float64 [A], the weights; they add up to 1.
    """
    boltzmann(values, 0.0, out)
    ties = 0.0
    for a in range(out.shape[0]):
        ties += out[a]
    for a in range(out.shape[0]):
        out[a] = (1.0 - epsilon) * out[a] / ties + epsilon / out.shape[0]


@kernel
def mixed(policy: F64, epsilon: float, out: F64) -> None:
    """With probability ``epsilon`` any action, else one drawn from the agent's own mixed policy.

    Args:
        policy: float64 [A], probabilities.
        epsilon: in [0, 1].
        out: float64 [A], the weights; they add up to 1.
    """
    for a in range(policy.shape[0]):
        out[a] = (1.0 - epsilon) * policy[a] + epsilon / policy.shape[0]


@kernel
def select(selection: int, values: F64, heat: float, out: F64) -> None:
    """The weights that a :class:`Selection` gives to actions of such values."""
    if selection == 0:
        boltzmann(values, heat, out)
    elif selection == 1:
        epsilon_greedy(values, heat, out)
    else:
        mixed(values, heat, out)


@kernel
def sample(weights: F64, u: float) -> int:
    """The action that ``u``, drawn from [0, 1), falls on; never one of weight 0.

    Args:
        weights: float64 [A], not negative, not all 0; probabilities are in proportion to them.
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
