"""The stage acts."""
