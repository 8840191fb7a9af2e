"""Packets that arrive while a match is played, and teams that are driven by them.

==============  ==============================================================
sockets         packets from the network
screening       which of them are sound, and why the others are not
status          what they say, in a line
referee         the words of SSL's game controller
referee_state   whether play is on, the score, the sides
bodies          the bodies as a team that drives sees them
frames          the bodies as a log has them
following       a match that is followed: trajectories, situations, what a window shows
driver          a team that drives: see, decide, command, log
remote          a team of ours that another program drives
encoding        the packets that we send
==============  ==============================================================
"""
