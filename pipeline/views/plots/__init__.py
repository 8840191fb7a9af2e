"""Plots; the only package that imports matplotlib. Every function takes a table and returns a figure."""
