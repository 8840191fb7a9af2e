"""An hour of everything at once: recordings, deletions, kills, a full disk, stepped clocks, Ctrl-C, questions.

``PYTHONPATH=tests python -m studies.soak data/studies/soak 3600``.

league          the data folder, its recordings, and what a quiet run makes of them
questions       what `sql` and a notebook ask without pause, and whether an answer can be true
processes       all processes of the soak: found, counted, killed
clock           a clock that can be stepped under processes that know nothing of it
actors          what happens to the data folder, each in a thread of its own
"""
