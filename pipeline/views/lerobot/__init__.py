"""Matches as a dataset of LeRobot (format v3.0): what each team saw and did, its options, situations and V.

LeRobot need not be installed: the format is Parquet and JSON, read off LeRobot's own writer and loader.

=========  ===================================================================
grid       the bodies of a match, at evenly spaced times
episodes   the episodes of a match: a stretch of play as one team lives it
layout     features with their names, and the files that describe the dataset
moments    statistics of columns, episode by episode
files      Parquet files that are filled one after the other
write      the dataset of a league's matches, written whole or not at all
=========  ===================================================================
"""
