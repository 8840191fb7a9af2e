"""Randomised trials: a second of looking beside a second of the role's best constant, and of being blind.

``trial.py DATA`` (half an hour on 2 cores; what is in
the data folder is not played again) plays the apprentices of ``looking-all`` and ``looking-held`` of that
data folder against the static team; if one of them is named after DATA, that one, and the rows of the other
stay as they are. For each robot and second of a match a draw decides between ways to act: it looks (its
policy, each 0.2 s, and it begins its action anew, as in its own matches); it does what the constant team
001/088/044 does in its role, which goes on; or it is blind, and its policy looks at what a robot of its role
saw at another moment of play. The measure is V a second later, 1 or -1 after a goal and 0 where play has
stopped, less V at the start. All else is alike: the ways of one match differ by nothing but the draw. So the
differences of their means are what a second of looking is worth. A log cannot say this: there an action was
chosen where it seemed good.

That team was the best found in whole matches when this was written, where three robots do it at once. For a
second, among robots that look, a role may have a better constant. So for ``looking-held`` there is a search
first: half of the seconds have a randomly drawn behaviour, the same for all, and each role's best six are
played again. The best of these stands beside looking and that team in a trial of its own. Search and
trial have seeds of their own.

V is the model that the package ships; it has not seen these matches. Seconds are the independent observation,
because each has a draw of its own; intervals are Welch's.

``trial.csv`` has the differences for all seconds and for each role, and for each state: role, the ball's
third, how near the robot is to it and whether it is behind it (36 cells, :func:`looking.decisions.cells`).
``earned.csv`` says in what share of time a state's lower bound is above 0, outside the first second of play.
``constants.csv`` has the search.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import polars as pl
from harness import workers
from looking.effects import differences, shares, worth_of
from looking.learners import HELD, Learner, learners_of
from looking.lots import FIRST, SEARCH, Trial, against, final
from looking.rows import replaced
from looking.seconds import seconds

from pitchlore.pipeline import arena
from pitchlore.pipeline.arena.teams.appraising import appraiser_of
from pitchlore.pipeline.arena.teams.constant import Constant, constant
from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.engine.teams import apprentice, labelled
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES

#: Behaviours of a role that the search plays again; pairs of matches that are played side by side.
_FINALISTS, _PAIRS = 6, 10
#: Columns of the groups in which ways to act are compared, and of the states in which one is earned.
_GROUPS: tuple[list[str], ...] = ([], ["team"], ["role"], ["role", "cell"])
_STATES = (["role"], ["role", "cell"], ["team", "role", "cell"])


def played(data: Path, trial: Trial, word: str) -> pl.DataFrame:
    """The seconds of an apprentice; they are kept in the data folder."""
    player = apprentice(Store(data), word)
    policy, tables = labelled(player.store, player.manifest)
    said = json.dumps([policy, arena.VERSION, trial.tickets, *map(constant, trial.ways)])
    kept = data / "trial" / f"{word}-{trial.seeds.start}-{digest(said.encode())[:12]}.parquet"
    if not kept.exists():
        assert tables.appraisals is not None, "it looks"
        appraiser, _ = appraiser_of(tables.values, tables.appraisals)
        parts = [seconds(appraiser, trial, trial.seeds[at : at + _PAIRS])
                 for at in range(0, len(trial.seeds), _PAIRS)]
        kept.parent.mkdir(parents=True, exist_ok=True)
        aside = kept.with_suffix(".part")
        pl.concat(parts).with_columns(team=pl.lit(word)).write_parquet(aside)
        aside.rename(kept)
    return pl.read_parquet(kept)


def searched(data: Path, words: Sequence[str]) -> tuple[Constant, pl.DataFrame]:
    """Each role's best constant for a second, and the table of the search."""
    first = worth_of(_rows(data, SEARCH, words), SEARCH)
    ranked = [first.filter(role=role)["code"].to_list() for role in ROLES]
    last = final([Constant(*codes) for codes in list(zip(*ranked, strict=True))[:_FINALISTS]])
    second = worth_of(_rows(data, last, words), last)
    both = pl.concat(own.select(pl.lit(stage).alias("stage"), pl.all())
                     for stage, own in ((1, first), (2, second)))
    return Constant(*(second.filter(role=role)["code"][0] for role in ROLES)), both


def _rows(data: Path, trial: Trial, words: Sequence[str]) -> pl.DataFrame:
    """The seconds of some apprentices, with the names of their roles."""
    with workers() as pool:
        rows = pl.concat(pool.map(partial(played, data, trial), words))
    return rows.with_columns(pl.col("role").replace_strict(range(len(ROLES)), ROLES))


def found(learner: Learner, data: Path) -> dict[str, pl.DataFrame]:
    """The tables of a learner by name; what is missing is played."""
    tables, trials, words = dict[str, pl.DataFrame](), [FIRST[learner.season]], learner.panel.words
    if learner is HELD:
        best, tables["constants"] = searched(data, words)
        trials.append(against(best))
    played_by_lot = [(_rows(data, trial, words), trial) for trial in trials]
    by_group = [differences(rows, trial, by) for rows, trial in played_by_lot for by in _GROUPS]
    by_state = [shares(rows, trial, by) for rows, trial in played_by_lot for by in _STATES]
    return tables | {
        "trial": pl.concat(by_group, how="diagonal").select(
            "way", "less", "team", "role", "cell", "seconds", "difference", "low", "high"),
        "earned": pl.concat(by_state),
    }


def main(out: Path, data: Path, chosen: Sequence[str] = ()) -> None:
    """Play what is missing, and write the tables."""
    tables = {each.season: found(each, data) for each in learners_of(chosen, FIRST)}
    for name, digits in (("trial", 5), ("earned", 3), ("constants", 5)):
        if there := {season: own[name] for season, own in tables.items() if name in own}:
            replaced(out / f"{name}.csv", there, digits)


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1]), sys.argv[2:])
