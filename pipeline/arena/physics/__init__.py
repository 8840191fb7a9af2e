"""The arena: bodies that move by the laws of physics, and the referee who watches them."""
