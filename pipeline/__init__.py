"""The stages of Pitchlore, one module a noun (see CONTRIBUTING.md for the map)."""

__version__ = "0.1.0"
