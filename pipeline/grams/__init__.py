"""The noun grams: runs of consecutive situations, valued and counted."""
