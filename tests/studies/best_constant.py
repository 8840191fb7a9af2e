"""Which three codes make the best constant team against the static team? Searches by successive halving, and a final.

``PYTHONPATH=tests python -m studies.best_constant pipeline/arena/teams/best-constant.json data/studies/best_constant``
(ten minutes; two processes) writes the file that the team best-constant plays from, and what was played.

A search has the laws and the time of play of an apprentice of the settings ``best``: 35 games and 3 further matches
beside each, 140 matches of 8 minutes against the static team. One search is a lottery, so there are nine: three with
that apprentice's clock, three with the paper's, and three with one for a team that looks, which decides each 0.2 s.
For a constant team that is to decide at once when the ball is won or lost, when a role changes and when its action is
over. Between these it has nothing to choose; but whom an action is done to stays as it was. What they find, and
``constant:044``, then play 100 matches of 8 minutes against the static team. All together is 16 times the play of an
apprentice: that favours the control. The seeds are used for nothing else.

A search has four stages of the same time. The first compares the teams whose robots all take one code. Each later
one compares the codes of one role, striker, midfield, goalkeeper, given the best codes of the others so far. In a
stage the better half of the codes goes on from each round to the next, until one is left. The rounds get the same
time, but each code plays two matches at least (Karnin, Koren and Somekh 2013, Sequential Halving). Two matches are
one pair: a minute each, one seed, sides swapped. A code counts by all pairs of its stage. All 30,000 triples cannot
be compared in this time; docs/decisions/players.md ("The best constant team") says what that costs.

``searches.csv`` has a row for each search, stage, round and code, ``final.csv`` one for each team of the final.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from statistics import fmean
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.clock import PAPER, ClockSettings
from pitchlore.pipeline.arena.teams.constant import Constant
from pitchlore.pipeline.arena.teams.executors.actions import CODES
from pitchlore.pipeline.evaluations import Entrant, Evaluation, Pair, play
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.seasons.settings import named
from pitchlore.pipeline.store.receipts import software

_APPRENTICE = named("best")
#: Time of play that an apprentice has: 35 games of 1 counted and 3 further matches of 8 minutes.
BUDGET_MINUTES = _APPRENTICE.games * _APPRENTICE.matches_a_game * 8
#: The clocks of the searches, by whose they are.
CLOCKS = {"paper": PAPER, "best": _APPRENTICE.clock, "looks": ClockSettings(interrupts=True)}
#: The searches: seed of the first pair of matches, and clock.
SEARCHES = {
    610_000_000: "paper", 630_000_000: "paper", 650_000_000: "paper",
    620_000_000: "best", 640_000_000: "best", 660_000_000: "best",
    680_000_000: "looks", 690_000_000: "looks", 700_000_000: "looks",
}
#: Seeds of the pairs of the final.
FINAL_SEEDS = range(670_000_000, 670_000_050)
#: What is chosen in each stage.
STAGES = ("all", "striker", "midfield", "goalkeeper")
_STATIC = Entrant(name="static", settings=TeamSettings(kind="static"))
_MINUTE, _WHOLE = RefereeSettings(duration_s=60.0), RefereeSettings(duration_s=480.0)
_PAIR_MINUTES = 2
#: A team of the final that no search has to find.
_NAMED = Constant(44, 44, 44)

#: A team, and the seed of its pair of matches.
Job = tuple[Constant, int]
#: Plays jobs: goal differences, goals a match, in their order.
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


def difference(job: Job, clock: ClockSettings = PAPER, referee: RefereeSettings = _MINUTE) -> float:
    """Goal difference against the static team, goals a match, in two matches with sides swapped."""
    team, seed = job
    settings = TeamSettings(kind="learned", policy=team.word, clock=clock)
    entrant = Entrant(name=team.word, settings=settings)
    pair = Pair(evaluation=Evaluation(team=entrant, opponent=_STATIC, referee=referee), seed=seed)
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


def team_of(rounds: Sequence[Round]) -> Constant:
    """The team that a search found."""
    last = {each.stage: next(iter(each.values)) for each in rounds}
    return Constant(**{stage: last[stage] for stage in STAGES[1:]})


def main(path: Path, out: Path) -> None:
    """Search, play the final, and write the files."""
    searches: dict[tuple[int, str], list[Round]] = {}
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        def play_all(clock: ClockSettings, referee: RefereeSettings, jobs: Iterable[Job]) -> Iterable[float]:
            return pool.map(partial(difference, clock=clock, referee=referee), jobs, chunksize=4)

        for seed, clock in SEARCHES.items():
            rounds = list(search(CODES, BUDGET_MINUTES, seed, partial(play_all, CLOCKS[clock], _MINUTE)))
            searches[seed, clock] = rounds
        entered = [(_NAMED, "paper"), *((team_of(rounds), clock) for (_, clock), rounds in searches.items())]
        final = {(team, clock): list(play_all(CLOCKS[clock], _WHOLE, [(team, seed) for seed in FINAL_SEEDS]))
                 for team, clock in entered}
    best, clock = max(final, key=lambda each: fmean(final[each]))
    out.mkdir(parents=True, exist_ok=True)
    pl.DataFrame([
        {"seed": seed, "clock": clock, "stage": each.stage, "pairs": each.pairs, "minutes": each.minutes,
         "code": code, "difference": value}
        for (seed, clock), rounds in searches.items() for each in rounds for code, value in each.values.items()
    ]).write_csv(out / "searches.csv")
    pl.DataFrame([_ended(*timed, differences) for timed, differences in final.items()]).sort(
        "difference", descending=True).write_csv(out / "final.csv", float_precision=2)
    said = {"command": "make best-constant", "software": software(), "codes": best._asdict(),
            "clock": CLOCKS[clock].model_dump()}
    path.write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    print(best.word, clock)


def _ended(team: Constant, clock: str, differences: Sequence[float]) -> dict[str, object]:
    """A row of the final, with Student's interval over the pairs."""
    low, high = mean_interval(differences) or (None, None)
    return {"team": team.word, "clock": clock, "matches": 2 * len(differences),
            "difference": fmean(differences), "low": low, "high": high}


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
