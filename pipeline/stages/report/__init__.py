"""The report on seasons: measures, claims with verdicts, tables, and one page."""
