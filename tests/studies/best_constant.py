"""Which three codes make the best constant team against the static team? A search by successive halving.

``PYTHONPATH=tests python -m studies.best_constant pipeline/arena/teams/best-constant.json`` (a few minutes; two
processes) writes the file that the team best-constant plays from. The laws and the time of play are those
of an apprentice of the settings ``best``: 35 games and 3 further matches beside each, 140 matches of 8 minutes
against the static team. The clock is the paper's. The seeds are used for nothing else.

The search has four stages of the same time. The first compares the teams whose robots all take one code. Each
later one compares the codes of one role, striker, midfield, goalkeeper, given the best codes of the others so
far. In a stage the better half of the codes goes on from each round to the next, until one is left. The rounds
get the same time, but each code plays two matches at least (Karnin, Koren and Somekh 2013, Sequential Halving).
Two matches are one pair: a minute each, one seed, sides swapped. A code counts by all pairs of its stage. All
30,000 triples cannot be compared in this time; DECISIONS.md ("The best constant team") says what that costs.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from statistics import fmean
from typing import NamedTuple

import polars as pl

from pipeline.arena.match.controllers import PolicyTables
from pipeline.arena.match.recipe import TeamSettings
from pipeline.arena.physics.laws import RefereeSettings
from pipeline.arena.teams.constant import Constant
from pipeline.arena.teams.executors.actions import CODES
from pipeline.store.receipts import software
from pipeline.studies.evaluations import Entrant, Evaluation, Pair, play

#: Time of play that an apprentice has: 35 games of 1 counted and 3 further matches of 8 minutes.
BUDGET_MINUTES = 35 * (1 + 3) * 8
#: Seed of the first pair of matches.
FIRST_SEED = 610_000_000
#: What is chosen in each stage.
STAGES = ("all", "striker", "midfield", "goalkeeper")
_STATIC = Entrant(name="static", settings=TeamSettings(kind="static"))
_MINUTE = RefereeSettings(duration_s=60.0)
_PAIR_MINUTES = 2

#: A team, and the seed of its pair of matches.
Job = tuple[Constant, int]
#: Plays jobs: goal differences, goals a minute, in their order.
Play = Callable[[Iterable[Job]], Iterable[float]]


class Round(NamedTuple):
    """A round of the search.

    Attributes:
        stage: what is chosen.
        pairs: number of pairs of matches of each code.
        minutes: minutes of play.
        values: goal difference of each code in the stage so far, goals in 8 minutes, the best first. The
            first half, rounded up, goes on.
    """

    stage: str
    pairs: int
    minutes: int
    values: dict[int, float]


def difference(job: Job) -> float:
    """Goal difference against the static team, goals a minute, in two matches of a minute with sides swapped."""
    team, seed = job
    entrant = Entrant(name=team.word, settings=TeamSettings(kind="learned", policy=team.word))
    pair = Pair(evaluation=Evaluation(team=entrant, opponent=_STATIC, referee=_MINUTE), seed=seed)
    rows = play(pair, {team.word: PolicyTables(team.policy())})
    return float(rows.select((pl.col("goals_for") - pl.col("goals_against")).mean()).item())


def search(codes: Sequence[int], budget: int, seed: int, played: Play) -> Iterator[Round]:
    """The rounds of a search.

    Args:
        codes: the codes that each role chooses from, at least two.
        budget: minutes of play of all stages together, enough for a pair of each code in each stage.
        seed: of the first pair of matches. Codes of one round share their seeds, so luck favours none; other
            rounds have other seeds.
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


def _halve(stage: str, teams: Mapping[int, Constant], budget: int, seed: int, played: Play) -> Iterator[Round]:
    """The rounds of a stage; ``teams`` are the teams that its codes make."""
    got: dict[int, list[float]] = {code: [] for code in teams}
    left = list(teams)
    while len(left) > 1:
        share = budget // math.ceil(math.log2(len(left)))
        pairs = max(1, share // (_PAIR_MINUTES * len(left)))
        found = iter(played((teams[code], seed + pair) for pair in range(pairs) for code in left))
        for _ in range(pairs):
            for code in left:
                got[code].append(next(found))
        minutes = _PAIR_MINUTES * pairs * len(left)
        budget, seed = budget - minutes, seed + pairs
        left.sort(key=lambda code: -fmean(got[code]))
        yield Round(stage, pairs, minutes, {code: round(8 * fmean(got[code]), 2) for code in left})
        left = left[: (len(left) + 1) // 2]


def main(path: Path, seed: int = FIRST_SEED) -> None:
    """Search, and write the file."""
    with ProcessPoolExecutor(2) as pool:
        rounds = list(search(CODES, BUDGET_MINUTES, seed, lambda jobs: pool.map(difference, jobs, chunksize=4)))
    last = {each.stage: next(iter(each.values)) for each in rounds}
    best = Constant(**{stage: last[stage] for stage in STAGES[1:]})
    said = {
        "command": "make best-constant", "software": software(), "opponent": _STATIC.name, "seed": seed,
        "minutes": sum(each.minutes for each in rounds), "codes": best._asdict(),
        "rounds": [each._asdict() for each in rounds],
    }
    path.write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    print(best.word, said["minutes"])


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:3]))
