"""The arena: physics and referee, teams, their matches, the window for a person, and environments for learners."""

#: Raised when the same recipe plays another match: part of the key of all that is played here.
VERSION = 2
