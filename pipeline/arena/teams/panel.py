"""The panel: the opponents that every team is measured against."""

from pitchlore.pipeline.arena.teams.constant import BEST

#: Words of the opponents, as :func:`pipeline.engine.teams.entrant` takes them. They play in different ways:
#: fixed roles, a second script that drives one robot at a time, three constant teams, a high press, and a
#: deep block with passes.
PANEL = ("static", "human-like", "constant:044", "constant:021", BEST, "pressing", "counter")
