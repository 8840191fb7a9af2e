"""Matches for other people's programs: tables, football's libraries, and viewers of robots.

=================  ===========================================================
content            what is exported of a match: samples, states, situations
tables             the plain tracking table, as CSV and Parquet
spreadsheet        CSV whose text is no formula
second_spectrum    the files of a provider that kloppy and floodlight read
foxglove           MCAP with Foxglove's well-known schemas
ball_model         how the ball slides, rolls and is kicked, as settings of the arena
rerun_log          a recording of Rerun; the only module that imports rerun
formats            the table of all formats, ``FORMATS``
=================  ===========================================================
"""
