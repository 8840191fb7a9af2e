"""Sides of a match: whose match it was, and which team or pool it counts for."""

from pitchlore.pipeline.stages.sides.derive import UNUSABLE, sides

__all__ = ["UNUSABLE", "sides"]
