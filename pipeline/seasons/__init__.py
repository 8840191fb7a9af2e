"""Seasons: what their games show, beside what the paper reports of its own."""
