"""What arrives while a match is played.

==============  ==============================================================
sockets         packets from the network
screening       which of them are sound, and why the others are not
status          what they say, in a line
==============  ==============================================================
"""
