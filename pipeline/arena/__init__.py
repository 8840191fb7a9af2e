"""The arena: physics and referee, teams, matches, a window for a person, environments for learners."""

#: Raised when the same recipe plays another match: part of the key of all that is played here.
VERSION = 2
