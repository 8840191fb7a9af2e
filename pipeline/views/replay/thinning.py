"""Samples that a replay can do without, because lines between the others pass near them."""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.numbers.arrays import F64, Bools
from pitchlore.pipeline.numbers.kernels import njit

#: Samples that are kept are at most this far apart, seconds, if the recording's are.
LONGEST_S = 0.25


@njit(cache=True, nogil=True)
def thinned(times: F64, values: F64, near: F64, cut: Bools) -> Bools:
    """Mask of samples to keep, so that lines between them are ``near`` all that are left out.

    A sample is the next one that is kept if it is the last to which a line from the one before passes near
    all between them: the greedy choice (Imai and Iri 1986; in process data the swinging door).

    Args:
        times: times of the samples, seconds, increasing but for cuts, float64 [S].
        values: values of each channel at each sample, float64 [C, S].
        near: how far a line may pass, by channel, in its unit, float64 [C].
        cut: where a sample does not go on from the one before, bool [S]; both are kept.

    Returns:
        Bool [S]. The first and the last sample are kept.
    """
    channels, samples = values.shape
    keep = np.zeros(samples, np.bool_)
    low, high = np.full(channels, -np.inf), np.full(channels, np.inf)  # slopes that pass near all so far
    last = 0
    keep[0] = keep[samples - 1] = True
    for at in range(1, samples):
        ends = cut[at] or times[at] - times[last] > LONGEST_S
        for c in range(channels):
            if not ends:
                slope = (values[c, at] - values[c, last]) / (times[at] - times[last])
                ends = slope < low[c] or slope > high[c]
        if ends:
            last = at - 1
            keep[last] = True
            low[:], high[:] = -np.inf, np.inf
            if cut[at]:
                last = at
                keep[at] = True
                continue
        for c in range(channels):
            moved, lasted = values[c, at] - values[c, last], times[at] - times[last]
            low[c] = max(low[c], (moved - near[c]) / lasted)
            high[c] = min(high[c], (moved + near[c]) / lasted)
    return keep
