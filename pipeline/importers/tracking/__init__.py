"""Matches of tracking tables: positions of bodies at samples, from whatever file.

==============  ==============================================================
csv_file        a file of text: its columns under our names
parquet_file    the same of a Parquet file
mapping         the map: a TOML file that gives names, units, axes and teams
columns         columns found, named and typed
match           the match that the table tells: rows, frames, facts
guesses         the pitch and the home team, where nothing names them
states          referee events, from states of the game and the score
==============  ==============================================================
"""
