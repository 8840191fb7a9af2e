"""Matches of a peer, or of whoever chooses actions through the same door, against a named team."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl
from looking.pairs import kept
from peers.network import load

from pitchlore.pipeline import arena
from pitchlore.pipeline.arena.env import BEHAVIOURS, ParallelMatch, parallel_env
from pitchlore.pipeline.arena.teams.constant import clock_of, constant
from pitchlore.pipeline.stages.evaluations import match_seed
from pitchlore.schemas import SIDES, Side

#: Matches after which a learner's network is kept and measured.
KEPT = (20, 40, 80, 140, 280, 560, 1_000, 1_400, 2_800, 5_600, 11_200)
#: Seconds of a step: the clock of the team that looks.
STEP_S = 0.2
#: The word for a team that takes any action, in place of a network's path.
ANY = "random actions"

#: What robots of a match see, by agent, float32 [33] each.
Observed = dict[str, npt.NDArray[np.float32]]
#: Actions of all robots of some matches, int64 [n], by the matches and what their robots see.
Choose = Callable[[Sequence[ParallelMatch], Sequence[Observed]], npt.NDArray[np.int64]]


def pitch_of(opponent: str, side: Side) -> ParallelMatch:
    """A match of eight minutes whose agents are one team's robots, as peers train and play it."""
    return parallel_env(opponent, side=side, actions="behaviours", observations="sights", step_s=STEP_S)


def differences(choose: Choose, opponent: str, seeds: Sequence[int]) -> pl.DataFrame:
    """Goal differences in pairs of matches, with one seed and sides swapped; all are played side by side.

    Args:
        choose: chooses the actions of all robots.
        opponent: word of the other team.
        seeds: seeds of the pairs; their matches have the seeds of an evaluation's.

    Returns:
        A row a pair: seed, and difference, the mean of its two matches.
    """
    matches = [(match_seed(seed), side) for seed in seeds for side in SIDES]
    pitches = [pitch_of(opponent, side) for _, side in matches]
    seen = [pitch.reset(seed=seed)[0] for pitch, (seed, _) in zip(pitches, matches, strict=True)]
    robots = len(pitches[0].possible_agents)
    found = np.empty(len(pitches))
    while pitches[0].agents:  # all last as long
        actions = choose(pitches, seen).reshape(-1, robots)
        for place, pitch in enumerate(pitches):
            seen[place], _, _, _, reported = pitch.step(dict(zip(pitch.agents, actions[place], strict=True)))
            ours, theirs = reported[pitch.possible_agents[0]]["score"]
            found[place] = ours - theirs
    return pl.DataFrame({"seed": list(seeds), "difference": found.reshape(-1, len(SIDES)).mean(axis=1)})


def by_chance(seed: int) -> Choose:
    """Chance chooses, from a seed."""
    rng = np.random.default_rng(seed)
    return lambda _, seen: rng.integers(len(BEHAVIOURS), size=sum(map(len, seen)))


def by_network(path: Path) -> Choose:
    """A network that was kept chooses."""
    network = load(path)
    return lambda _, seen: network.choose(np.array([vector for each in seen for vector in each.values()]))


def played(
    team: str, choose: Choose, opponent: str, seeds: Sequence[int], data: Path, there: bool = False
) -> pl.DataFrame:
    """The pairs of a team against an opponent; those that are missing are played, unless ``there``.

    Args:
        team: name by which results are kept in the data folder, next to the opponent's.
        choose: chooses the actions of its robots.
        opponent: word of the other team.
        seeds: seeds of the pairs.
        data: the data folder.
        there: whether only those are wanted that were played before.
    """
    against = f"{opponent} {constant(opponent)} {clock_of(opponent)}"  # best-constant may be another one day
    play = None if there else partial(differences, choose, opponent)
    return kept(data / "peers" / "played", f"{team} {against} {arena.VERSION}", seeds, play)
