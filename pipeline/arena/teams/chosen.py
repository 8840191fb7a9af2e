"""A team whose robots do what somebody chooses: each carries out a code of Table 1.

A code that is chosen again goes on. When it is over, and at a restart, it is begun anew. So robots that are
always told the same play as the constant team of that code does.
"""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.game.bodies import Records
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.game.tactics.splitmix import SplitMix
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.kernels import njit


@njit(cache=True, nogil=True, error_model="numpy")
def carry_out(
    view: F64, codes: I64, robots: Records, packed: Records, splitmix: SplitMix, wheels: F64
) -> None:
    """Carry out the chosen codes for a frame.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        codes: int64 [N], chosen; each is one of ``executors.actions.CODES``.
        robots: records of ``executors.actions.ACTION``, [N], as the frames before left them; changed. A
            robot with the code 0 begins.
        packed: measures, ``Measures.packed()``.
        splitmix: draws the wheels of random moves.
        wheels: float64 [N, 2], written.
    """
    m = packed[0]
    count = len(robots)
    roles = np.empty(2 * count, dtype=np.int64)
    assigned = False
    for robot in range(1, count + 1):
        own = robots[robot - 1]
        code = codes[robot - 1]
        if own["code"] != code:
            if not assigned:
                assign(view, m, roles)
                assigned = True
            executors.start(code, robot, view, roles, m, splitmix, own)
        if executors.act(robot, view, m, own, wheels):
            own["code"] = 0
