"""Importers of foreign recordings, one format a module."""
