"""Matches of a peer, or of whoever chooses actions through the same door, against a named team."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl
from studies.peers.network import load

from pipeline import arena
from pipeline.arena.env import BEHAVIOURS, ParallelMatch, parallel_env
from pipeline.arena.match.environment import Side
from pipeline.arena.teams.constant import clock_of, constant
from pipeline.store.receipts import digest

#: Matches after which a learner's network is kept and measured.
KEPT = (20, 40, 80, 140, 280, 560, 1_000, 1_400, 2_800, 5_600, 11_200)
#: Seconds of a step: the clock of the team that looks.
STEP_S = 0.2
#: The word for a team that takes any action, in place of a network's path.
ANY = "random actions"

#: Actions of robots, int64 [n], by what they see, float32 [n, 33].
Choose = Callable[[npt.NDArray[np.float32]], npt.NDArray[np.int64]]


def pitch_of(opponent: str, side: Side) -> ParallelMatch:
    """A match of eight minutes whose agents are one team's robots, as peers train and play it."""
    return parallel_env(opponent, side=side, actions="behaviours", observations="sights", step_s=STEP_S)


def differences(choose: Choose, opponent: str, seeds: Sequence[int]) -> pl.DataFrame:
    """Goal differences in pairs of matches, with one seed and sides swapped; all are played side by side.

    Args:
        choose: chooses the actions of all robots.
        opponent: word of the other team.
        seeds: of the pairs.

    Returns:
        A row a pair: seed, and difference, the mean of its two matches.
    """
    sides: tuple[Side, Side] = ("home", "away")
    pitches = [pitch_of(opponent, side) for _ in seeds for side in sides]
    seen = [_stacked(pitch.reset(seed=seed)[0])
            for pitch, seed in zip(pitches, np.repeat(seeds, len(sides)).tolist(), strict=True)]
    robots = len(pitches[0].possible_agents)
    found = np.empty(len(pitches))
    while pitches[0].agents:  # all last as long
        actions = choose(np.concatenate(seen)).reshape(-1, robots)
        for place, pitch in enumerate(pitches):
            observed, _, _, _, told = pitch.step(dict(zip(pitch.agents, actions[place], strict=True)))
            seen[place] = _stacked(observed)
            ours, theirs = told[pitch.possible_agents[0]]["score"]
            found[place] = ours - theirs
    return pl.DataFrame({"seed": list(seeds), "difference": found.reshape(-1, len(sides)).mean(axis=1)})


def played(team: str, opponent: str, seeds: Sequence[int], data: Path, there: bool = False) -> pl.DataFrame:
    """The pairs of a team against an opponent; those that were not played before are played, unless ``there``.

    Args:
        team: path of a network, or :data:`ANY`.
        opponent: word of the other team.
        seeds: of the pairs.
        data: the data folder; results are kept there by the network's bytes.
        there: whether only those are wanted that were played before.
    """
    said = team if team == ANY else digest(Path(team).read_bytes())
    against = f"{opponent} {constant(opponent)} {clock_of(opponent)}"  # best-constant may be another one day
    kept = data / "peers" / "played" / f"{digest(f'{said} {against} {arena.VERSION}'.encode())}.csv"
    known = pl.read_csv(kept) if kept.exists() else pl.DataFrame(schema={"seed": pl.Int64, "difference": pl.Float64})
    missing = [seed for seed in seeds if seed not in known["seed"]]
    if missing and not there:
        rng = np.random.default_rng(missing[0])
        choose = (lambda seen: rng.integers(len(BEHAVIOURS), size=len(seen))) if team == ANY else load(Path(team)).choose
        known = pl.concat([known, differences(choose, opponent, missing)]).sort("seed")
        kept.parent.mkdir(parents=True, exist_ok=True)
        aside = kept.with_suffix(".part")
        known.write_csv(aside)
        aside.rename(kept)
    return known.filter(pl.col("seed").is_in(list(seeds)))


def _stacked(observed: dict[str, npt.NDArray[np.float32]]) -> npt.NDArray[np.float32]:
    """What the robots of a match see, float32 [N, 33]."""
    return np.stack(list(observed.values()))
