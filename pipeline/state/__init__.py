"""The paper's 36-element abstraction of the state of a match (section 4, Table 2).

Each team sees the match turned so that its own goal is at -x. The six robots of the paper
become six slots: own goalkeeper, midfield, striker, then the adversary's. The levels and break
points are in DECISIONS.md, "The paper contradicts itself" and "Knowledge, learning".
"""

from pipeline.state.keys import (
    PAPER_STATES,
    Column,
    columns,
    decode,
    encode,
    encode_one,
    project,
    radix,
    size,
)
from pipeline.state.table import DRAWING, ELEMENTS, FAULT, GOAL, LEVELS, NORMAL, SLOTS, TABLE, Element
from pipeline.state.views import Breaks, elements, look, score_levels
from schemas.table import KEYS, Key

__all__ = [
    "DRAWING", "ELEMENTS", "FAULT", "GOAL", "KEYS", "LEVELS", "NORMAL", "PAPER_STATES", "SLOTS", "TABLE",
    "Breaks", "Column", "Element", "Key", "columns", "decode", "elements", "encode", "encode_one", "look",
    "project", "radix", "score_levels", "size",
]
