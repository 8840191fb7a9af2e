"""Matches of people: whatever kloppy reads of football's tracking data.

``providers`` has the table of providers and their files, ``dataset`` makes a match of a kloppy dataset, and
``squad`` gives its players their numbers. This room is kloppy's door; kloppy is loaded only when it is used.
"""
