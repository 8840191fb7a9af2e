"""Pictures of a match, for films and the window."""
