"""Recordings of packets (``pipeline.packets``) as matches: those of SSL and of VSSS."""
