"""The noun policies: batch Sarsa(λ) over a version of the knowledge."""
