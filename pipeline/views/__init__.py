"""Views: replay, commentary, plots."""
