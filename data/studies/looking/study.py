"""Apprentices that look, of fresh seeds: against the panel, and without looking.

``study.py DATA`` (six hours on 2 cores; what is in the data folder is not played again). Settings of
learners may follow: then these are played, and the rows of others stay.

The aims were written down before any of these seeds was played. Apprentices train against the static team
alone, in seasons of 140 matches of eight minutes, own exploration included. Each plays 100 matches, in
pairs with one seed and sides swapped, in each arm. The independent observation is the apprentice:
intervals are Student's over the five. The settings were chosen on seasons of seeds 901 to 914 and matches
of seeds 740,000 to 880,019. That the team with the late camera predicts was chosen after its first five
seasons, which did not and missed their aim; so it has seasons and matches of fresh seeds. So have the
apprentices of ``looking-all``, which are offered all 31 actions and not only those that they watched: ten
seasons of each (data/studies/imitation) showed that they play better. Their matches with cameras that
disturb, and their seasons with the late one, were added when their other matches were known. Apprentices
of ``looking`` have watched 21 to 31 of the 31 actions in a role after the first game, and nearly all
after the third: the two learners hardly differ. So ``together.csv`` has the ten apprentices of both.

``looking-held`` holds what it tries for a second. It was chosen on development seeds (seasons 915 to 924;
docs/decisions/players.md, ``explore_s``), after the other two were known, and has seasons and matches of
fresh seeds.

Who is blind acts each time on another sight, so that it also changes its mind more often
(:mod:`looking.blind`). So apprentices of ``looking-held`` are blind in another way, too: they see what
was 30 s ago. This arm, and the matches with what each role does best for a second, were added when the
others were known.

Controls of the learner (:mod:`looking.permuted`): ``looking-shuffled`` learns from actions, and
``looking-drawn`` from sights, that were dealt out anew.

``results.csv`` has a row for each apprentice, arm and opponent, ``controls.csv`` the same of teams that
learn nothing, on the same seeds. ``aims.csv`` says what was reached. ``decisions.csv`` describes the
decisions of four logged matches of each apprentice.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import polars as pl
from looking.aims import aims
from looking.decisions import described
from looking.learners import ARMS, CONSTANT, CONTROLS, STATIC, Learner, learners_of
from looking.measuring import measured, seasons
from looking.rows import replaced, row, together

from pitchlore.pipeline.engine.placement.executors import Executors
from pitchlore.pipeline.engine.placement.places import executors_at
from pitchlore.pipeline.store import Store


def played(store: Store, learner: Learner, executors: Executors) -> dict[str, pl.DataFrame]:
    """The tables of a learner by name; what is missing is played."""
    results = pl.DataFrame([
        row(word, arm.name, opponent, measured(store, word, arm, opponent, executors))
        for arm in ARMS[learner.season] for word in arm.words for opponent in arm.opponents])
    controls = {(word, arm.name, opponent): measured(store, word, arm, opponent, executors)
                for word, arm in CONTROLS[learner.season] for opponent in arm.opponents}
    decided = pl.DataFrame([described(store, word) for word in learner.panel.words])
    reached = aims(results, learner, controls[CONSTANT, learner.panel.name, STATIC], decided)
    return {
        "results": results,
        "controls": pl.DataFrame([row(*who, pairs) for who, pairs in controls.items()]),
        "aims": pl.DataFrame([aim._asdict() | {"reached": aim.reached} for aim in reached]),
        "decisions": decided,
    }


def main(out: Path, data: Path, chosen: Sequence[str] = ()) -> None:
    """Play what is missing, and write the tables."""
    learners = learners_of(chosen, ARMS)
    seasons([arm for learner in learners for arm in ARMS[learner.season]], data)
    store = Store(data)
    with executors_at(None, store.root) as executors:
        tables = {learner.season: played(store, learner, executors) for learner in learners}
    for name, digits in (("results", 2), ("controls", 2), ("aims", 2), ("decisions", 3)):
        replaced(out / f"{name}.csv", {season: own[name] for season, own in tables.items()}, digits)
    together(pl.read_csv(out / "results.csv")).write_csv(out / "together.csv", float_precision=2)


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1]), sys.argv[2:])
