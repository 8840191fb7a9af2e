"""Bringing a data folder up to date: stages as data, their inputs, outputs, versions, and where work goes."""
