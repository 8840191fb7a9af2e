"""Hand-written situations, trajectories and patterns for tests."""

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.stages.sequences.derive import sequences
from pitchlore.schemas import ROLES, SIDES, Patterns, Referee, Situations, Trajectories

S = 1_000_000_000
MATCH = "match-0123456789ab"
WORDS = {"g": "goalkeeper", "m": "midfield", "s": "striker"}


def consecutive(codes, team="home", robot=1, role="m", start=0.0, each=0.5, segment=0):
    """A run: rows of consecutive situations of one robot; a code None is a hole of ``each`` seconds."""
    roles = role if len(role) == len(codes) else role * len(codes)
    rows = []
    for i, code in enumerate(codes):
        if code is not None:
            lo = start + i * each
            rows.append((MATCH, team, robot, WORDS[roles[i]], code, "name", round(lo * S), round((lo + each) * S),
                         None, None, segment))
    return rows


def situations(*runs):
    """A table of runs of situations (see :func:`consecutive`)."""
    rows = [row for run in runs for row in run]
    table = pl.DataFrame(rows, schema=Situations.dtypes(), orient="row").sort("team", "robot", "start_ns")
    return Situations.validate(table)


def goals(*rows):
    """(seconds, team) each."""
    return pl.DataFrame([(round(t * S), team) for t, team in rows],
                        schema={"t_ns": pl.Int64, "team": pl.Enum(SIDES)}, orient="row")


def changed(table, *changes, x=0.0, y=0.0):
    """Situations with the columns change, x and y of schema Worths; 0 without changes."""
    change = pl.Series("change", changes or [0.0] * table.height, dtype=pl.Float64)
    return table.with_columns(change, x=pl.lit(x, dtype=pl.Float32), y=pl.lit(y, dtype=pl.Float32))


def patterns(*rows, **others):
    """(role, codes) or (role, codes, value) each; columns of version 2 are null, unless the same for all is given."""
    table = [
        {"behaviour_id": "-".join([WORDS[role], *(f"{c:03d}" for c in codes)]), "role": WORDS[role], "codes": list(codes),
         "n": len(codes), "support": 3, "value": value[0] if value else 0.5, "spread": 0.1, "neuron": 0, **others}
        for role, codes, *value in rows
    ]
    return Patterns.validate(pl.DataFrame(table, schema=Patterns.dtypes()))


def bodies(times, **places):
    """Trajectories of bodies that stand still: ball=(x, y[, vx, vy]), home_1=(x, y, theta, role)."""
    rows = []
    for name, place in places.items():
        team, _, robot = name.partition("_")
        for i, t in enumerate(times):
            if team == "ball":
                x, y, vx, vy = (*place, 0.0, 0.0)[:4]
                head, role = None, None
            else:
                (x, y, head, role), vx, vy = place, 0.0, 0.0
                role = WORDS[role]
            rows.append((MATCH, i, round(t * S), team, int(robot) if robot else None, role, x, y, head, vx, vy,
                         None, 0, False, False))
    table = pl.DataFrame(rows, schema=Trajectories.dtypes(), orient="row")
    return Trajectories.validate(table.sort("team", "robot", "t_ns"))


def referee(*rows):
    """Rows of schema Referee from (seconds, event, team[, score of home, score of away])."""
    return pl.DataFrame(
        [(MATCH, round(t * S), event, team, *(*score, None, None)[:2], None) for t, event, team, *score in rows],
        schema=Referee.dtypes(), orient="row",
    )


def sequences_of(situations, goals, worths, settings=GramSettings()):
    """Sequences of situations on a field where bodies stand still, and home scores after 3 s."""
    field = bodies(np.arange(0, 10, 0.5), ball=(0.0, 0.0), home_1=(-0.3, 0.1, 0.0, "m"), away_1=(0.4, -0.2, 3.0, "s"),
                   away_2=(0.7, 0.0, 3.0, "g"))
    events = referee((3, "goal", "home"))
    return sequences(situations, goals, worths, field, events, PITCHES[Kind.VSSS], settings)


__all__ = ["MATCH", "ROLES", "SIDES", "S", "bodies", "changed", "consecutive", "goals", "patterns", "referee", "sequences_of", "situations"]
