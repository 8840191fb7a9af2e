"""Evaluations: a team is measured by many matches, with intervals.

Matches come in pairs of one seed, in which the team plays home, then away, so that what chance gives to one
side it gives to the other. The two share their chances; what is independent is the pair, and it is the unit
of every interval.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import polars as pl

from pipeline.arena.match.match import PART, Match
from pipeline.arena.match.minds import minds_of
from pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings
from pipeline.matches.frame import AWAY, HOME
from pipeline.settings import Frozen
from pipeline.store.receipts import fingerprint
from pipeline.studies.statistics import F64, mean_interval, wilson
from schemas import TEAMS, Evaluations

#: The seeds of matches: two to a pair, above those of seasons.
_FIRST_SEED = 2_000_000_000


class Entrant(Frozen):
    """A team as it enters an evaluation.

    Attributes:
        name: what it is called: a scripted team's kind, v and the version of its policy, or the id of the
            season whose apprentice it is.
        settings: how it plays.
        policy_version: of its policy, None for a scripted team.
        knowledge_version: that its policy values.
    """

    name: str
    settings: TeamSettings
    policy_version: int | None = None
    knowledge_version: int | None = None


class Evaluation(MatchSettings):
    """What is played to measure a team, but for the seeds.

    Attributes:
        team: which is measured.
        opponent: against whom.
    """

    team: Entrant
    opponent: Entrant

    @property
    def id(self) -> str:
        """Both teams, as far as there is room, and a hash of everything."""
        return f"{self.team.name}-{self.opponent.name}"[:51].rstrip("-") + f"-{fingerprint(self)[:12]}"

    @property
    def of_itself(self) -> bool:
        """Whether the team plays against itself."""
        return self.team.settings == self.opponent.settings


class Pair(Frozen):
    """The two matches of one seed.

    Attributes:
        evaluation: that they are of.
        seed: of the pair.
    """

    evaluation: Evaluation
    seed: int

    @property
    def name(self) -> str:
        """Of the pair's output, unique among all evaluations."""
        return f"{self.evaluation.id}-{self.seed}"

    def matches(self) -> list[tuple[int, Recipe]]:
        """The side (0 home, 1 away) of the team that is measured, and the match, of both."""
        whole = self.evaluation
        seeds = [_FIRST_SEED + 2 * self.seed + (match if whole.of_itself else 0) for match in range(2)]
        sides = (HOME, HOME if whole.of_itself else AWAY)
        found = []
        for side, seed in zip(sides, seeds, strict=True):
            home, away = (whole.team, whole.opponent) if side == HOME else (whole.opponent, whole.team)
            found.append((side, Recipe(
                **whole.of_match(), home=home.settings, away=away.settings, seed=seed)))
        return found


def play(pair: Pair, policies: Mapping[str, pl.DataFrame]) -> pl.DataFrame:
    """Play a pair of matches; nothing is logged.

    Args:
        pair: which.
        policies: rows of schema Policies by the label that the teams' settings name.

    Returns:
        Rows of schema Evaluations, two.
    """
    whole, rows = pair.evaluation, []
    for number, (side, recipe) in enumerate(pair.matches(), start=1):
        minds = minds_of(recipe, policies)
        match = Match(recipe, minds, logged=False)
        while match.advance(PART):
            pass
        decided = minds[side].decided()
        learned = whole.team.settings.kind == "learned"
        rows.append({
            "evaluation": whole.id, "team": whole.team.name, "policy_version": whole.team.policy_version,
            "knowledge_version": whole.team.knowledge_version, "opponent": whole.opponent.name,
            "seed": pair.seed, "match": number, "side": TEAMS[side], "match_seed": recipe.seed,
            "duration_s": recipe.referee.duration_s,
            "goals_for": match.score[side], "goals_against": match.score[1 - side],
            "actions": len(decided) if learned else None,
            "other_actions": sum(d.behaviour_id is not None for d in decided) if learned else None,
        })  # fmt: skip
    return Evaluations.validate(pl.DataFrame(rows, schema=Evaluations.dtypes()))


class Measured(NamedTuple):
    """A quantity with its 95 % interval, both ends included, None where there are too few pairs."""

    value: float
    low: float | None
    high: float | None


class EvaluationSummary(Frozen):
    """What an evaluation says of a team, each match counting the same.

    Attributes:
        evaluation, team, opponent: of the matches.
        matches: how many.
        pairs: of them; the unit of all intervals.
        wins, draws, losses: matches.
        win_rate, draw_rate, loss_rate: shares of the matches, with Wilson's intervals.
        goal_difference: goals for minus goals against, a match.
        goals_for, goals_against: a match.
        learned_share: share of the decisions that were of a learned behaviour, the mean over the
            matches in which the team decided anything; None if there is none.
    """

    evaluation: str
    team: str
    opponent: str
    matches: int
    pairs: int
    wins: int
    draws: int
    losses: int
    win_rate: Measured
    draw_rate: Measured
    loss_rate: Measured
    goal_difference: Measured
    goals_for: Measured
    goals_against: Measured
    learned_share: Measured | None


def summarise(rows: pl.DataFrame) -> EvaluationSummary:
    """What an evaluation says of a team.

    The intervals of means are Student's over the pairs' means, cut off where no mean can be (goals below 0,
    shares outside of [0, 1]); those of wins, draws and losses Wilson's with the pairs' shares as
    observations: whatever the two matches of a pair have in common, they are not too narrow. The share of
    learned actions is a mean, not such a rate: a match is a yes or no to the one and hundreds of decisions
    to the other, so that how pairs differ is seen, and Wilson's interval, which supposes that they differ
    as much as they possibly could, would be several times too wide.

    Args:
        rows: schema Evaluations, of one evaluation, at least one pair.
    """
    difference = pl.col("goals_for") - pl.col("goals_against")
    rows = rows.with_columns(
        difference=difference, won=difference > 0, drawn=difference == 0, lost=difference < 0,
        share=pl.when(pl.col("actions") > 0).then(pl.col("other_actions") / pl.col("actions")),
    )
    pairs = rows.group_by("seed").agg(
        pl.col("difference", "won", "drawn", "lost", "goals_for", "goals_against", "share").mean()
    ).sort("seed")

    def mean(column: str, least: float = -math.inf, most: float = math.inf) -> Measured:
        return _mean(pairs[column].drop_nulls().to_numpy().astype(np.float64), least, most)

    def rate(column: str) -> Measured:
        shares = pairs[column].to_numpy()
        low, high = wilson(shares.sum(), len(shares))
        return Measured(float(shares.mean()), float(low), float(high))

    return EvaluationSummary(
        **rows.select("evaluation", "team", "opponent").row(0, named=True),
        matches=rows.height, pairs=pairs.height,
        wins=int(rows["won"].sum()), draws=int(rows["drawn"].sum()), losses=int(rows["lost"].sum()),
        win_rate=rate("won"), draw_rate=rate("drawn"), loss_rate=rate("lost"),
        goal_difference=mean("difference"),
        goals_for=mean("goals_for", least=0), goals_against=mean("goals_against", least=0),
        learned_share=None if pairs["share"].is_null().all() else mean("share", least=0, most=1),
    )


def _mean(values: F64, least: float, most: float) -> Measured:
    """The mean with Student's interval, of which no more is left than lies in [least, most]."""
    ends = mean_interval(values)
    if ends is None:
        return Measured(float(values.mean()), None, None)
    return Measured(float(values.mean()), max(ends[0], least), min(ends[1], most))
