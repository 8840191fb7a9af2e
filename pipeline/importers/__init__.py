"""Importers of recordings: bytes in, a :class:`~pipeline.matches.frame.MatchLog` out.

``readers`` has the table of formats; it opens a recording (``source``) and hands it to the module of its
format. Tables of positions share ``tracking``: the module of a file format only finds the columns, and
``tracking`` makes a match of them, with a map where names, units, axes or teams are others. All readers
share ``rows``, and ``plausibility`` checks what they return.
"""
