"""How much more probable a motion is with one option than with others: the trees that come with the package.

The trees tell windows described with the option that was executed from the same windows described with
another option. The logit of such a classifier is the logarithm of the ratio of the two probabilities of the
motion, but for a constant. `make study-options` fits them anew, to matches between teams that deal options
at random.
"""

from __future__ import annotations

import io
from functools import cache
from importlib import resources

import numpy as np

from pitchlore.pipeline.numbers.trees import Trees

#: Trees by the setting ``robots``.
_FILES = {"arena": "shipped.npz", "measured": "measured.npz"}


@cache
def shipped_ratios(robots: str = "arena") -> Trees:
    """The trees that come with the package, for the robots of the arena or for any that were measured."""
    data = resources.files(__package__).joinpath(_FILES[robots]).read_bytes()
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        return Trees(**{name: arrays[name] for name in Trees._fields})


def ratios_to_bytes(trees: Trees) -> bytes:
    """The trees as such a file; the same trees give the same bytes."""
    out = io.BytesIO()
    np.savez_compressed(out, allow_pickle=False, **trees._asdict())
    return out.getvalue()
