"""Prefect flows and the command line: the only rooms that know Prefect."""
