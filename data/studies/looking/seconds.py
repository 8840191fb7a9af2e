"""Matches in which the lot decides how each robot acts in each second."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress

import numpy as np
import polars as pl
from looking.choosing import Chooser, Seen
from looking.decisions import cells
from looking.learners import STATIC
from looking.lots import Trial
from peers.playing import STEP_S, pitch_of
from peers.worth import Worth

from pitchlore.pipeline.arena.teams.appraising import ActionValues
from pitchlore.schemas import SIDES
from pitchlore.schemas.sights import SIGHT

#: Steps of a second.
_SECOND = round(1 / STEP_S)


def seconds(appraiser: ActionValues, trial: Trial, seeds: Sequence[int]) -> pl.DataFrame:
    """Play pairs of matches by lot, side by side; a row a robot and second that began in play.

    Returns:
        Columns seed, role, cell (:func:`looking.decisions.cells`), way (its number), first (whether the
        second before was no play), and change: V at the end less V at the start, for the robot's team.
    """
    rng = np.random.default_rng(seeds[0])
    choose, worth = Chooser(appraiser, trial.ways, rng), Worth(1.0)
    tickets = np.array([trial.ways.index(ticket) for ticket in trial.tickets])
    pitches = [pitch_of(STATIC, side) for _ in seeds for side in SIDES]
    each = np.repeat(seeds, len(SIDES))
    begun = [pitch.reset(seed=int(seed))[0] for pitch, seed in zip(pitches, each, strict=True)]
    seen = Seen.of(pitches, begun)
    robots, found = seen.roles.shape[1], list[pl.DataFrame]()
    before = np.zeros(len(pitches), dtype=bool)
    while pitches[0].agents:  # all last as long
        on, value, start = np.array([pitch.match.in_play for pitch in pitches]), worth.of(pitches), seen
        ways = tickets[rng.integers(len(tickets), size=seen.roles.shape)]
        goals = np.zeros(len(pitches))
        for _ in range(_SECOND):
            if not pitches[0].agents:
                break
            playing = np.array([pitch.match.in_play for pitch in pitches])
            choose.keep(seen.sights[playing].reshape(-1, len(SIGHT)), seen.roles[playing].ravel())
            actions = choose(seen.sights.reshape(-1, len(SIGHT)), seen.roles.ravel(), ways.ravel())
            observed = []
            for place, (pitch, own) in enumerate(zip(pitches, actions.reshape(-1, robots), strict=True)):
                pitch.begin_anew(list(compress(pitch.agents, choose.anew(ways[place]))))
                sees, rewards, *_ = pitch.step(dict(zip(pitch.agents, own, strict=True)))
                observed.append(sees)
                goals[place] += rewards[pitch.possible_agents[0]]
            seen = Seen.of(pitches, observed)
        change = np.where(goals != 0, np.sign(goals), worth.of(pitches)) - value
        found.append(pl.DataFrame({
            "seed": np.repeat(each, robots), "role": start.roles.ravel(),
            "cell": cells(start.sights.reshape(-1, len(SIGHT))), "way": ways.ravel(),
            "first": np.repeat(~before, robots), "change": np.repeat(change, robots),
        }).filter(np.repeat(on, robots)))
        before = on
    return pl.concat(found)
