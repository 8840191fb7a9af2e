"""Importers of recordings: bytes in, a :class:`~pipeline.matches.frame.MatchLog` out.

``readers`` has the table of formats. It opens a recording (``source``) and passes it to the module of its
format. Tables of positions share ``tracking``: the module of a file format finds the columns, and
``tracking`` makes a match from them, with a map if names, units, axes or teams differ. All readers share
``rows``, and ``plausibility`` checks their matches.
"""
