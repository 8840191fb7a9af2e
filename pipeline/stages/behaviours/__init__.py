"""The noun behaviours: a map over distinct grams, and the selection of grams on its neurons."""
