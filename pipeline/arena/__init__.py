"""The arena: physics and referee, teams, the match that they play, the window for a person."""

#: Raised when the same recipe plays another match: part of the key of all that is played here.
VERSION = 1
