"""The arena: physics and referee, teams, the match that they play, the window for a person."""
