"""Small games of section 5, drawn at random."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st
from support.planning import (
    choices,
)


def named(game, chosen):
    """The joint actions of a bool [J], as tuples of the agents' actions."""
    return {tuple(int(a) for a in choices(game)[:, j]) for j in np.flatnonzero(chosen)}


@st.composite
def tables(draw):
    """Rewards of one to three agents, [A] * N + [N], with many ties."""
    agents = draw(st.integers(1, 3))
    shape = (draw(st.integers(1, 3)),) * agents + (agents,)
    rewards = draw(st.lists(st.integers(-3, 3), min_size=math.prod(shape), max_size=math.prod(shape)))
    return np.array(rewards, dtype=np.float64).reshape(shape)
