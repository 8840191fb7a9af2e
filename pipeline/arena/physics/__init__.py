"""Physics of the arena, and the referee."""
