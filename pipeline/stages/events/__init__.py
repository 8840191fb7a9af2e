"""Events of a match: who has the ball, passes, shots, pressure."""
