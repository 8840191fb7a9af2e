"""Matches that are played: a recipe, the teams' minds, and the loop in which they meet physics and referee."""
