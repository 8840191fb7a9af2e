"""RoboCup SSL game logs: what vision, trackers and the game controller sent, as a recorder received it.

``container`` cuts a log into messages, ``wire`` and ``fields`` are how messages are written, ``vision``,
``tracker``, ``geometry`` and ``referee`` decode them to columns. ``cameras`` and ``balls`` join what several
cameras saw, ``clock`` makes times of samples, ``commands`` makes events of what the referee said. ``survey``
reads a log once to learn what is in it, and ``reading`` once more to make a match of it.
"""
