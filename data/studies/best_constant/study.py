"""Search for the three codes of the best constant team against the static team, and a final.

``study.py`` (ten minutes on 2 cores; what was stopped goes on) writes ``best-constant.json`` beside the teams
of the package, from which the team best-constant plays, and what was played.

A search has the laws and the time of play of an apprentice of the settings ``best``: 35 games and 3 further
matches beside each, 140 matches of 8 minutes against the static team. One search is a lottery, so there are
nine: three with that apprentice's clock, three with the paper's, and three with one for a team that looks,
which decides each 0.2 s. For a constant team that is to decide at once when the ball is won or lost, when a
role changes and when its action is over. Between these it has nothing to choose; but whom an action is done
to stays as it was. What they find, and ``constant:044``, then play 100 matches of 8 minutes against the
static team. All together is 16 times the play of an apprentice: that favours the control. The seeds are used
for nothing else.

``searches.csv`` has a row for each search, stage, round and code, ``final.csv`` one for each team of the
final.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from importlib.resources import files
from pathlib import Path
from statistics import fmean

import polars as pl
from best_constant.search import Job, Round, search, team_of
from harness import going_on, of_pairs, workers

from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.clock import PAPER, ClockSettings
from pitchlore.pipeline.arena.teams.constant import BEST_FILE, Constant
from pitchlore.pipeline.base.software import software
from pitchlore.pipeline.game.tactics.executors.actions import CODES
from pitchlore.pipeline.stages.evaluations import Entrant, Evaluation, Pair, results_of_pair
from pitchlore.pipeline.stages.seasons.settings import named_settings

_APPRENTICE = named_settings("best")
#: Time of play that an apprentice has: 35 games of 1 counted and 3 further matches of 8 minutes.
BUDGET_MINUTES = _APPRENTICE.games * _APPRENTICE.matches_a_game * 8
#: The clocks of the searches, by the team that has them.
CLOCKS = {"paper": PAPER, "best": _APPRENTICE.clock, "looks": ClockSettings(interrupts=True)}
#: The searches: seed of the first pair of matches, and clock.
SEARCHES = {
    610_000_000: "paper", 630_000_000: "paper", 650_000_000: "paper",
    620_000_000: "best", 640_000_000: "best", 660_000_000: "best",
    680_000_000: "looks", 690_000_000: "looks", 700_000_000: "looks",
}
#: Seeds of the pairs of the final.
FINAL_SEEDS = range(670_000_000, 670_000_050)
#: A team of the final that no search has to find.
_NAMED = Constant(44, 44, 44)
_STATIC = Entrant(name="static", settings=TeamSettings(kind="static"))
#: Duration of matches, s: in the searches, and in the final.
_MINUTE, _WHOLE = 60.0, 480.0


def difference(job: tuple[Constant, int, str, float]) -> float:
    """Goal difference against the static team, goals a match, in two matches with sides swapped.

    Args:
        job: a team, the seed, the name of its clock, and the duration of a match, s.
    """
    team, seed, clock, seconds = job
    settings = TeamSettings(kind="learned", policy=team.word, clock=CLOCKS[clock])
    how = Evaluation(team=Entrant(name=team.word, settings=settings), opponent=_STATIC,
                     referee=RefereeSettings(duration_s=seconds))
    rows = results_of_pair(Pair(evaluation=how, seed=seed), {team.word: PolicyTables(team.policy())})
    return float(rows.select((pl.col("goals_for") - pl.col("goals_against")).mean()).item())


def main(
    out: Path, path: Path, codes: Sequence[int] = CODES, budget: int = BUDGET_MINUTES,
    final_seeds: Sequence[int] = FINAL_SEEDS,
) -> None:  # fmt: skip
    """Search, play the final, and write the files.

    Args:
        out: folder of the tables.
        path: file from which the team best-constant plays.
        codes: the codes that each role chooses from.
        budget: minutes of play of a search.
        final_seeds: seeds of the pairs of the final.
    """
    with workers() as pool, going_on(out, __file__) as parts:
        def play_all(clock: str, seconds: float, jobs: Sequence[Job]) -> list[float]:
            return parts([(team, seed, clock, seconds) for team, seed in jobs], difference, pool)

        searches: dict[tuple[int, str], list[Round]] = {
            (seed, clock): list(search(codes, budget, seed, partial(play_all, clock, _MINUTE)))
            for seed, clock in SEARCHES.items()}
        entered = [(_NAMED, "paper"), *((team_of(rounds), clock) for (_, clock), rounds in searches.items())]
        final = {(team, clock): play_all(clock, _WHOLE, [(team, seed) for seed in final_seeds])
                 for team, clock in entered}
    best, clock = max(final, key=lambda each: fmean(final[each]))
    pl.DataFrame([
        {"seed": seed, "clock": clock, "stage": each.stage, "pairs": each.pairs, "minutes": each.minutes,
         "code": code, "difference": value}
        for (seed, clock), rounds in searches.items() for each in rounds
        for code, value in each.values.items()
    ]).write_csv(out / "searches.csv")
    pl.DataFrame([
        {"team": team.word, "clock": clock, **of_pairs(differences)}
        for (team, clock), differences in final.items()
    ]).sort("difference", descending=True).write_csv(out / "final.csv", float_precision=2)
    said = {"command": "make best-constant", "software": software(), "codes": best._asdict(),
            "clock": CLOCKS[clock].model_dump()}
    path.write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    print(best.word, clock)


if __name__ == "__main__":
    main(Path(__file__).parent, Path(str(files("pitchlore.pipeline.arena.teams").joinpath(BEST_FILE))))
