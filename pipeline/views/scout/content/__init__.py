"""The scout's pages from a data folder."""
