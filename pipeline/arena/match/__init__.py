"""Played matches: the recipe, the teams' controllers, and the loop of physics and referee."""
