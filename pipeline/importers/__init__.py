"""Importers of recordings: bytes in, a :class:`~pipeline.matches.frame.MatchLog` out.

================  ==========================================================
readers           the table of formats; opens a recording and reads it
source            a recording's bytes, inflated and hashed once; its identity
mcap_log          our own logs
rcg               RoboCup 2D text logs
tracking_parquet  tracking tables in Parquet
tracking_csv      tracking tables in CSV
tracking          the match of a tracking table, whatever file it was in
tracking_table    a tracking table's columns: named and typed
tracking_map      how to read a table with other names, units, axes and teams
tracking_events   referee events of a tracking table
guesses           the pitch and the home team, where a table does not name them
directions        which way home attacks, from where the bodies stand
plausibility      checks of an imported match: signs of a wrong map
rows              referee events and packed frames, for all readers
================  ==========================================================
"""
