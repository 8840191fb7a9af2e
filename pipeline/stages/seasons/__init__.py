"""Seasons: the paper's loop of playing, watching the adversary and learning, and its results."""
