"""Learning rules, one a module."""
