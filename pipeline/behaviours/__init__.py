"""The noun behaviours: a map over distinct grams, and what of it is kept."""
