"""Recordings of the packets of a match, as they came from a league's cameras, trackers and referee.

==============  ==============================================================
streams         what each league sends, and where
recorder        writes a recording, packet by packet
recording       reads one, damaged ones included
told            the options that a team tells of its own robots
ssl, vsss       read one as a match
==============  ==============================================================

A recording is an MCAP file. Each stream of a league is a topic, each packet a message whose log time is when
it was received. What packets say is decoded on import, by the importer of that league's logs, so that a match
that was watched and a match that was imported are read by the same code.
"""
