"""Matches that are played: the recipe, the teams' minds, and the loop of physics and referee."""
