"""Appraisals: what a policy expects of an action at a sight, as boosted trees."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.sights import SIGHT
from pitchlore.schemas.table import Table


class Appraisals(Table):
    """One node of one tree of one version of a policy.

    What a code is worth at a sight is the sum of the leaves that the sight reaches in all of the code's trees, in
    V (table values). Its first tree is one leaf, the mean. Unique by code, tree and node, and sorted so; the root
    of a tree is node 0.
    """

    NAME: ClassVar[str] = "appraisals"
    VERSION: ClassVar[int] = 1

    version = dy.Int32(min=1, description="version of the policy")
    code = dy.Int16(min=1, max=194, description="the paper's code (Table 1)")
    tree = dy.Int32(min=0, description="number of the tree")
    node = dy.Int32(min=0, description="number of the node in its tree")
    feature = dy.Enum(list(SIGHT), nullable=True, description="number of the sight by which the node splits; null in a leaf")
    threshold = dy.Float64(nullable=True, description="a sight whose number is at most this goes left; null in a leaf")
    missing_left = dy.Bool(nullable=True, description="whether a sight whose number is not known goes left; null in a leaf")
    left = dy.Int32(nullable=True, description="node that follows to the left; null in a leaf")
    right = dy.Int32(nullable=True, description="node that follows to the right; null in a leaf")
    value = dy.Float64(description="what a leaf adds; 0 elsewhere")
