"""The game: pitch, bodies, touches, roles, episodes, tactics."""
