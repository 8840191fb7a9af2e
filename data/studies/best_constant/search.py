"""Search of the best codes by successive halving.

A search has four stages of the same time. The first compares the teams whose robots all take one code. Each
later one compares the codes of one role, striker, midfield, goalkeeper, given the best codes of the others so
far. In a stage the better half of the codes goes on from each round to the next, until one is left. The
rounds get the same time, but each code plays two matches at least (Karnin, Koren and Somekh 2013, Sequential
Halving). Two matches are one pair: a minute each, one seed, sides swapped. A code counts by all pairs of its
stage. All 30,000 triples cannot be compared in this time; docs/decisions/players.md ("The best constant
team") says what that costs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from statistics import fmean
from typing import NamedTuple

from pitchlore.pipeline.arena.teams.constant import Constant

#: Roles whose codes are chosen in each stage.
STAGES = ("all", "striker", "midfield", "goalkeeper")
_PAIR_MINUTES = 2

#: A team, and the seed of its pair of matches.
Job = tuple[Constant, int]
#: Plays jobs: goal differences, goals a match, in their order.
Play = Callable[[Sequence[Job]], Sequence[float]]


class Round(NamedTuple):
    """A round of the search.

    Attributes:
        stage: the stage, of :data:`STAGES`.
        pairs: number of pairs of matches of each code.
        minutes: minutes of play.
        values: goal difference of each code in the stage so far, goals in 8 minutes, the best first. The
            first half, rounded up, goes on.
    """

    stage: str
    pairs: int
    minutes: int
    values: dict[int, float]


def search(codes: Sequence[int], budget: int, seed: int, played: Play) -> Iterator[Round]:
    """The rounds of a search.

    Args:
        codes: the codes that each role chooses from, at least two.
        budget: minutes of play of all stages together, enough for a pair of each code in each stage.
        seed: seed of the first pair of matches. Codes of one round share their seeds, so luck favours none;
            other rounds have other seeds.
        played: plays the teams.
    """
    best = dict.fromkeys(STAGES[1:], codes[0])
    for number, stage in enumerate(STAGES):
        chosen = tuple(best) if stage == "all" else (stage,)
        teams = {code: Constant(**(best | dict.fromkeys(chosen, code))) for code in codes}
        for each in _halve(stage, teams, budget // (len(STAGES) - number), seed, played):
            yield each
            budget, seed = budget - each.minutes, seed + each.pairs
        best |= dict.fromkeys(chosen, next(iter(each.values)))


def _halve(
    stage: str, teams: Mapping[int, Constant], budget: int, seed: int, played: Play
) -> Iterator[Round]:
    """The rounds of a stage; ``teams`` are the teams that its codes make."""
    got: dict[int, list[float]] = {code: [] for code in teams}
    left = list(teams)
    while len(left) > 1:
        share = budget // math.ceil(math.log2(len(left)))
        pairs = max(1, share // (_PAIR_MINUTES * len(left)))
        found = iter(played([(teams[code], seed + pair) for pair in range(pairs) for code in left]))
        for _ in range(pairs):
            for code in left:
                got[code].append(next(found))
        minutes = _PAIR_MINUTES * pairs * len(left)
        budget, seed = budget - minutes, seed + pairs
        left.sort(key=lambda code: -fmean(got[code]))
        yield Round(stage, pairs, minutes, {code: round(8 * fmean(got[code]), 2) for code in left})
        left = left[: (len(left) + 1) // 2]


def team_of(rounds: Sequence[Round]) -> Constant:
    """The team that a search found."""
    last = {each.stage: next(iter(each.values)) for each in rounds}
    return Constant(**{stage: last[stage] for stage in STAGES[1:]})
