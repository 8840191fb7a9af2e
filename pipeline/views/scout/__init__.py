"""The scout: static pages about a league's matches, teams and behaviours, which open from disk.

Pure functions from tables to facts (:mod:`.facts`, :mod:`.gallery`), pictures of them (:mod:`.pictures`), and
pages (:mod:`.pages`, by Jinja2). Clips are the replay's own code on the replay's own payload.
"""
