"""Seasons: the paper's loop of playing, watching the adversary and learning, and what came of it."""
