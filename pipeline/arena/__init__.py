"""The arena: physics and referee, teams, their matches, and the window for a person."""

#: Raised when the same recipe plays another match: part of the key of all that is played here.
VERSION = 2
