"""The paper's 36-element abstraction of the state of a match (section 4, Table 2).

Each team sees the match turned so that its own goal is at -x. The six robots of the paper
become six slots: own goalkeeper, midfield, striker, then the adversary's. The levels and break
points are in docs/decisions/paper.md and docs/decisions/knowledge.md.
"""

from pitchlore.pipeline.state.abstraction import BinEdges, Observation, abstract_state, elements
from pitchlore.pipeline.state.keys import Radix, encode, encode_one, project, radix
from pitchlore.pipeline.state.table import DRAWING, NORMAL

__all__ = [
    "DRAWING", "NORMAL", "BinEdges", "Observation", "Radix", "abstract_state", "elements", "encode",
    "encode_one", "project", "radix",
]
