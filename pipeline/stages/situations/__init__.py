"""The noun situations: the fuzzy rules of Table 1, found in trajectories."""
