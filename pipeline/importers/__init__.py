"""Importers of recordings: bytes in, a :class:`~pipeline.matches.frame.MatchLog` out.

``readers`` has the table of formats. It opens a recording (``source``) and passes it to the module of its
format. Tables of positions are in ``tracking``. All readers share ``rows`` and ``directions``, and
``plausibility`` checks their matches.
"""
