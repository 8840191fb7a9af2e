"""Paradigms: how often each learning rule finds the best joint action in the paper's games."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import Table, unit

STUDIES = ("figure", "sensitivity", "confirmation", "comparison")
VERDICTS = ("reproduced", "not reproduced", "contradicted")


class Paradigms(Table):
    """One point of one curve: one learner in one game under one setting, over independent runs.

    Sorted by study, figure, game, learner, reading, decay, k, runs, seed. A run is a training; in the
    grid world it is tested many times. Its share of successful tests is one observation, because tests
    of one training are not independent.
    """

    NAME: ClassVar[str] = "paradigms"
    VERSION: ClassVar[int] = 2
    SINCE: ClassVar[int] = 1

    study = dy.Enum(
        STUDIES, description=(
            "curve of a figure; sensitivity to one reading; confirmation on fresh seeds; comparison of two "
            "learners on further fresh seeds")
    )
    figure = dy.Int8(min=4, max=6, description="figure of the paper; 6 stands for Figures 6 and 7, of the same runs")
    game = dy.String(description="penalty, climbing, grid, or a game that the paper does not have")
    learner = dy.String(description="learning rule: IQ, JAQ, IVQ, IL-A and IL-B (IQ on own and joint state), or a peer")
    reading = dy.String(description="reading of the points that the text leaves open, or the peer's settings")
    k = dy.Float64(nullable=True, description="penalty as written in the game's figure; null where there is none")
    decay = dy.Float64(min=0, max=1, description="factor of the temperature a step (or episode, by the reading)")
    steps = dy.Int64(min=1, description="number of times that training lowered the temperature")
    runs = dy.Int64(min=1, description="independent trainings")
    tests = dy.Int64(min=1, description="number of tests of each training's policy")
    seed = dy.Int64(min=0, description="seed of the runs; run i draws from the i-th stream split off it")
    p_optimal = dy.Float64(min=0, max=1, description="share that reached the optimum: mean over the runs")
    p_low = dy.Float64(min=0, max=1, description="lower end of its 95 % Wilson interval over runs")
    p_high = dy.Float64(min=0, max=1, description="upper end of its 95 % Wilson interval over runs")
    p_equilibrium = dy.Float64(
        nullable=True, min=0, max=1, description="share that ended in any pure Nash equilibrium; null in the grid"
    )
    path_length = dy.Float64(
        nullable=True, min=1,
        description="mean steps to the optimum over successful tests; null if none, and in matrix games",
        metadata=unit("steps"),
    )
    path_low = dy.Float64(
        nullable=True, description="lower end of its 95 % interval over runs; null below two runs with success",
        metadata=unit("steps"),
    )
    path_high = dy.Float64(
        nullable=True, description="upper end of its 95 % interval over runs", metadata=unit("steps")
    )
    diverged = dy.Int64(min=0, description="runs whose values grew beyond all bounds; none of them counts as a success")
    settled = dy.Float64(
        nullable=True, min=0, max=1,
        description="share of runs that settled before their bound; null where training ends with the temperature"
    )
    settle_steps = dy.Float64(
        nullable=True, min=1, description="mean steps of training, the bound's where a run did not settle; null likewise",
        metadata=unit("steps"),
    )


class Verdicts(Table):
    """One claim of the paper's section 5 beside what was measured.

    Ordered by figure, then as the paper states its claims; those of one claim by reading, decay, runs.
    """

    NAME: ClassVar[str] = "verdicts"
    VERSION: ClassVar[int] = 1

    figure = dy.Int8(min=4, max=7, description="figure of the paper")
    claim = dy.String(description="the paper's claim in short")
    reading = dy.String(description="readings it was checked with, e.g. IVQ printed")
    decay = dy.Float64(
        nullable=True, min=0, max=1, description="the figure's panel; null where the claim spans the decays"
    )
    quantity = dy.String(description="quantity that was measured to check the claim")
    paper = dy.String(description="the value or relation that the claim states for the quantity")
    measured = dy.Float64(nullable=True, description="the quantity; null where it is not defined")
    low = dy.Float64(nullable=True, description="lower end of its 95 % interval")
    high = dy.Float64(nullable=True, description="upper end of its 95 % interval")
    runs = dy.Int64(min=1, description="independent trainings a point")
    verdict = dy.Enum(VERDICTS, description="reproduced, not reproduced (neither shown nor refuted), contradicted")
