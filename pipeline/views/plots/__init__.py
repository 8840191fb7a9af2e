"""Plots; the only door to matplotlib. Every function takes a table and returns a figure."""
