"""Errors in one line, TOML, text of strangers: what everything stands on."""
