"""Samples of bodies whose positions come on topics of their own, each at its own times."""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.numbers.arrays import I64

#: Gap of the clock from which on others' times are taken, in its usual steps.
_GAP = 2.0


def usual_step(t_ns: I64) -> float:
    """Median of the steps between times that rise, ns; infinite below two."""
    return float(np.median(np.diff(t_ns))) if len(t_ns) > 1 else float("inf")


def sample_times(bodies: dict[int, I64], ball: int | None) -> tuple[I64, float]:
    """Times of the samples, ns, and their usual step.

    The clock is the ball or the robot with the most messages, whichever has fewer a second: so no body is at
    two samples by one message, if all others have as many. In gaps of the clock the others' times go on.

    Args:
        bodies: int64 [K], times of each body, rising.
        ball: the ball among them, if it is there.
    """
    robots = [body for body in bodies if body != ball] or [*bodies]
    clock = max(robots, key=lambda body: len(bodies[body]))
    if ball is not None and len(bodies[ball]) > 1 and usual_step(bodies[ball]) >= usual_step(bodies[clock]):
        clock = ball
    times = bodies[clock]
    step = usual_step(times)
    if not np.isfinite(step):
        return np.unique(np.concatenate([*bodies.values()])), step
    every = np.unique(np.concatenate([*bodies.values()]))
    edges = np.concatenate(([every[0] - step], times, [every[-1] + step]))
    parts = [times]
    for gap in np.flatnonzero(np.diff(edges) > _GAP * step):
        inside = every[(every > edges[gap] + step / 2) & (every < edges[gap + 1] - step / 2)]
        _, first = np.unique(((inside - inside[0]) / step + 0.5).astype(np.int64), return_index=True) \
            if len(inside) else (inside, inside)
        parts.append(inside[first])
    return np.unique(np.concatenate(parts)), step


def nearest_messages(times: I64, of_body: I64, step: float) -> I64:
    """Index of the body's message for each sample, int64 [times]; -1 where it has none within a step.

    Args:
        times: int64 [F], times of the samples, rising.
        of_body: int64 [K], times of the body's messages, rising.
        step: usual step of the samples, ns; the body's own counts if it is longer.
    """
    after = np.clip(np.searchsorted(of_body, times), 0, len(of_body) - 1)
    before = np.clip(after - 1, 0, None)
    index = np.where(times - of_body[before] <= of_body[after] - times, before, after)
    own = usual_step(of_body)
    within = max(step, own if np.isfinite(own) else 0.0)
    return np.where(np.abs(of_body[index] - times) <= within, index, -1)
