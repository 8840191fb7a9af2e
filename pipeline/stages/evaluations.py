"""Evaluations: the measurement of a team by pairs of matches, with intervals.

The two matches of a pair have one seed. The team plays home in the first and away in the second, so that
luck favours neither side. The matches of a pair share their chances: the independent observation of every
interval is the pair.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import compress
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.arena.match.controllers import Controller, Decided, PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import PART, MatchInPlay
from pitchlore.pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings, team_slug
from pitchlore.pipeline.arena.physics.laws import PENALTY
from pitchlore.pipeline.arena.physics.referee import WORDS, RefereeEvent
from pitchlore.pipeline.base.digests import fingerprint
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.numbers.statistics import mean_interval, wilson
from pitchlore.schemas import AWAY, HOME, SIDES, Evaluations, Side
from pitchlore.schemas.decisions import BRIEF_FRAMES
from pitchlore.schemas.evaluations import PENALTY_S

#: Controller of a team in a match, by its recipe and the team's side.
ControllerOf = Callable[[Recipe, int], Controller]
#: First seed of the matches, two for each pair; seeds of seasons are below.
_FIRST_SEED = 2_000_000_000
#: Columns of schema Evaluations that :func:`fouls_of` counts.
FOULS = ("fouls_for", "fouls_against", "penalties_for", "penalties_against", "penalty_goals_for",
         "penalty_goals_against")


def match_seed(seed: int) -> int:
    """The seed of both matches of a pair; a team against itself has the next in its second match."""
    return _FIRST_SEED + 2 * seed


class Entrant(Frozen):
    """A team in an evaluation.

    Attributes:
        name: name of the team: the kind of a scripted team, the word of a constant team, v and the version
            of its policy, or the id of the season whose apprentice it is.
        settings: settings of the team.
        policy_version: version of its policy; None for a scripted or constant team.
        knowledge_version: version of the knowledge that the policy values; None for a scripted or constant
            team.
    """

    name: str
    settings: TeamSettings
    policy_version: int | None = None
    knowledge_version: int | None = None


class Evaluation(MatchSettings):
    """Settings of a team's measurement, without the seeds.

    Attributes:
        team: team that is measured.
        opponent: team that it plays against.
    """

    team: Entrant
    opponent: Entrant

    @property
    def id(self) -> str:
        """Name of the evaluation: both teams, as far as there is room, and a hash of everything."""
        return f"{team_slug(self.team.name, self.opponent.name)[:51].rstrip('-')}-{fingerprint(self)[:12]}"

    @property
    def of_itself(self) -> bool:
        """True if the team plays against itself."""
        return self.team.settings == self.opponent.settings


class Pair(Frozen):
    """Two matches of one seed."""

    evaluation: Evaluation
    seed: int

    @property
    def name(self) -> str:
        """Name of the pair's output, unique among all evaluations."""
        return f"{self.evaluation.id}-{self.seed}"

    def matches(self) -> Iterator[tuple[int, Recipe]]:
        """Side of the measured team (0 home, 1 away) and recipe, of both matches."""
        whole = self.evaluation
        seeds = [match_seed(self.seed) + (match if whole.of_itself else 0) for match in range(2)]
        sides = (HOME, HOME if whole.of_itself else AWAY)
        for side, seed in zip(sides, seeds, strict=True):
            home, away = (whole.team, whole.opponent) if side == HOME else (whole.opponent, whole.team)
            yield side, Recipe(**whole.of_match(), home=home.settings, away=away.settings, seed=seed)


def results_of_pair(
    pair: Pair, policies: Mapping[str, PolicyTables], measured: ControllerOf | None = None
) -> pl.DataFrame:
    """Results of a pair of matches, which are played without a log.

    Args:
        pair: the pair.
        policies: by the label in the teams' settings.
        measured: controller of the measured team, by recipe and side (0 home, 1 away); None: that of its
            settings.

    Returns:
        Two rows of schema Evaluations.
    """
    whole, rows = pair.evaluation, []
    for number, (side, recipe) in enumerate(pair.matches(), start=1):
        live: list[Controller | None] = [None, None]
        live[side] = None if measured is None else measured(recipe, side)
        controllers = controllers_of(recipe, policies, (live[HOME], live[AWAY]))
        match = MatchInPlay(recipe, controllers, logged=False)
        while match.advance(PART):
            pass
        decided = controllers[side].decided()
        learned = whole.team.settings.kind == "learned"
        rows.append({
            "evaluation": whole.id, "team": whole.team.name, "policy_version": whole.team.policy_version,
            "knowledge_version": whole.team.knowledge_version, "opponent": whole.opponent.name,
            "seed": pair.seed, "match": number, "side": SIDES[side], "match_seed": recipe.seed,
            "duration_s": recipe.referee.duration_s,
            "goals_for": match.score[side], "goals_against": match.score[1 - side],
            **(_decisions(decided, recipe.physics.hz) if learned else {}),
            **fouls_of(match.events, SIDES[side]),
        })  # fmt: skip
    return Evaluations.of(rows)


def fouls_of(events: Iterable[RefereeEvent], side: Side) -> dict[str, int]:
    """Fouls and penalties of a match, and the penalties' goals, by the names of :data:`FOULS`.

    A penalty counts when it is taken: one that the end of a half forestalls does not.

    Args:
        events: the referee's events of the match, in order.
        side: side of the measured team.
    """
    counts, penalty = dict.fromkeys(FOULS, 0), None
    for event in events:
        whom = "for" if event.team == side else "against"
        if event.event == "goal":
            if penalty and penalty.team == event.team and event.t_ns - penalty.t_ns <= PENALTY_S * 1e9:
                counts[f"penalty_goals_{whom}"] += 1
        elif event.event in ("fault", "kick-off"):
            penalty = event if event.note == WORDS[PENALTY] else None
            counts[f"fouls_{whom}"] += event.event == "fault" and event.team is not None
            counts[f"penalties_{whom}"] += penalty is not None
    return counts


def _decisions(decided: Sequence[Decided], hz: float) -> dict[str, float]:
    """Counts and times of a team's decisions, with the names of schema Evaluations."""
    other = [each.behaviour_id is not None for each in decided]
    frames = [each.end - each.frame for each in decided]
    return {
        "actions": len(decided), "other_actions": sum(other), "played_s": sum(frames) / hz,
        "other_s": sum(compress(frames, other)) / hz,
        "brief_actions": sum(lasted <= BRIEF_FRAMES for lasted in frames),
    }


class Measured(NamedTuple):
    """Quantity with its 95 % interval, both ends included; None if there are fewer than two pairs."""

    value: float
    low: float | None
    high: float | None


class EvaluationSummary(Frozen):
    """Results of an evaluation; all matches count the same.

    Attributes:
        evaluation, team, opponent: names.
        matches: number of matches.
        pairs: number of pairs, the independent observations of all intervals.
        wins, draws, losses: numbers of matches.
        win_rate, draw_rate, loss_rate: shares of the matches, with Wilson's intervals.
        goal_difference: goals for minus goals against, per match.
        goals_for, goals_against: goals per match.
        learned_share: share of decisions for a learned behaviour, mean over the matches in which the team
            decided; None if there is no such match.
        learned_time: the same as a share of the robots' time.
        brief: share of decisions that lasted two frames or fewer, likewise.
        fouls_for, fouls_against: penalties and goal kicks per match, of the team and of the opponent; None,
            like all that follow, if the rows have none.
        penalties_for, penalties_against: penalties per match that the team and the opponent took.
        penalty_goals_for, penalty_goals_against: goals per match that came of these penalties within
            ``PENALTY_S``.
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
    learned_time: Measured | None
    brief: Measured | None
    fouls_for: Measured | None
    fouls_against: Measured | None
    penalties_for: Measured | None
    penalties_against: Measured | None
    penalty_goals_for: Measured | None
    penalty_goals_against: Measured | None


def summarise(rows: pl.DataFrame) -> EvaluationSummary:
    """Summary of an evaluation.

    Intervals of means are Student's over the pairs' means, cut off at impossible values (goals below 0,
    shares outside [0, 1]). Intervals of wins, draws and losses are Wilson's with the pairs' shares as
    observations: however alike the two matches of a pair are, these intervals are not too narrow. The share
    of learned actions is treated as a mean. A match contributes hundreds of decisions to it and one result
    to a rate, so the pairs' spread is observed. Wilson's interval assumes the greatest possible spread and
    would be several times too wide.

    Args:
        rows: schema Evaluations, of one evaluation, at least one pair.
    """
    difference = pl.col("goals_for") - pl.col("goals_against")
    rows = rows.with_columns(
        difference=difference, won=difference > 0, drawn=difference == 0, lost=difference < 0,
        share=pl.when(pl.col("actions") > 0).then(pl.col("other_actions") / pl.col("actions")),
        time=pl.when(pl.col("played_s") > 0).then(pl.col("other_s") / pl.col("played_s")),
        brief=pl.when(pl.col("actions") > 0).then(pl.col("brief_actions") / pl.col("actions")),
    )
    pairs = rows.group_by("seed").agg(
        pl.col("difference", "won", "drawn", "lost", "goals_for", "goals_against", "share", "time",
               "brief", *FOULS).mean()
    ).sort("seed")

    def mean(column: str, least: float = -math.inf, most: float = math.inf) -> Measured:
        values = pairs[column].drop_nulls().to_numpy()
        ends = mean_interval(values)
        low, high = (None, None) if ends is None else (max(ends[0], least), min(ends[1], most))
        return Measured(float(values.mean()), low, high)

    def known(column: str, most: float = math.inf) -> Measured | None:
        return None if pairs[column].is_null().all() else mean(column, least=0, most=most)

    def rate(column: str) -> Measured:
        shares = pairs[column].to_numpy()
        return Measured(float(shares.mean()), *wilson(float(shares.sum()), len(shares)))

    return EvaluationSummary(
        **rows.select("evaluation", "team", "opponent").row(0, named=True),
        matches=rows.height, pairs=pairs.height,
        wins=int(rows["won"].sum()), draws=int(rows["drawn"].sum()), losses=int(rows["lost"].sum()),
        win_rate=rate("won"), draw_rate=rate("drawn"), loss_rate=rate("lost"),
        goal_difference=mean("difference"),
        goals_for=mean("goals_for", least=0), goals_against=mean("goals_against", least=0),
        learned_share=known("share", 1), learned_time=known("time", 1), brief=known("brief", 1),
        fouls_for=known("fouls_for"), fouls_against=known("fouls_against"),
        penalties_for=known("penalties_for"), penalties_against=known("penalties_against"),
        penalty_goals_for=known("penalty_goals_for"), penalty_goals_against=known("penalty_goals_against"),
    )
