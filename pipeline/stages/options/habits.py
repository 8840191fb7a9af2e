"""Habits: how probable each option of a team is in a role and a cell of what a robot sees.

They are learned from the windows of a match together with the windows' options (expectation maximisation).
That a robot goes on with what it did in the window before is not assumed: it made things worse
(docs/decisions/options.md).
"""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.settings import OptionSettings


def by_habits(ratios: F64, cell: I64, roles: I64, settings: OptionSettings) -> F64:
    """The probability of each option in each window, by its motion and by habits, float64 [W, A].

    Args:
        ratios: float64 [W, A], see schema Clues.
        cell: int64 [W], cell of what the robot sees at the start.
        roles: int64 [C], the role of each cell; a cell that was seen seldom has its role's habits.
        settings: ``rounds`` and ``evidence``.
    """
    likelihood = np.exp(ratios - ratios.max(axis=1, keepdims=True))
    posterior: F64 = likelihood / likelihood.sum(axis=1, keepdims=True)
    for _ in range(settings.rounds):
        both = likelihood * _habits(posterior, cell, roles, settings.evidence)[cell]
        posterior = both / both.sum(axis=1, keepdims=True)
    return posterior


def _habits(posterior: F64, cell: I64, roles: I64, evidence: float) -> F64:
    """Habits in all cells, float64 [C, A], from the options of all windows."""
    counts = np.zeros((len(roles), posterior.shape[1]))
    np.add.at(counts, cell, posterior)
    of_role = np.zeros((roles.max() + 1, posterior.shape[1]))
    np.add.at(of_role, roles, counts)
    of_role = (of_role + 1 / posterior.shape[1]) / (of_role.sum(axis=1, keepdims=True) + 1)
    habits: F64 = (counts + evidence * of_role[roles]) / (counts.sum(axis=1, keepdims=True) + evidence)
    return habits
