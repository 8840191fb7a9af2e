"""The paper's 36-element abstraction of the state of a match (section 4, Table 2).

Each team sees the match turned so that its own goal is at -x. The six robots of the paper
become six slots: own goalkeeper, midfield, striker, then the adversary's. The levels and break
points are in DECISIONS.md, "The paper contradicts itself" and "Knowledge, learning".
"""

from pipeline.state.abstraction import BinEdges, Observation, abstract_state, elements, score_levels
from pipeline.state.keys import (
    PAPER_STATES,
    Column,
    Radix,
    columns,
    decode,
    encode,
    encode_one,
    project,
    radix,
    size,
)
from pipeline.state.table import DRAWING, ELEMENTS, FAULT, GOAL, LEVELS, NORMAL, SLOTS, TABLE, Element
from schemas.table import KEYS, Key

__all__ = [
    "DRAWING", "ELEMENTS", "FAULT", "GOAL", "KEYS", "LEVELS", "NORMAL", "PAPER_STATES", "SLOTS", "TABLE",
    "BinEdges", "Column", "Element", "Key", "Observation", "Radix", "abstract_state", "columns", "decode",
    "elements", "encode", "encode_one", "project", "radix", "score_levels", "size",
]
