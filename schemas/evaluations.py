"""Evaluations: results of a team in the matches that measure it."""

from __future__ import annotations

import re
from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import SIDES, SLUG, STAND_IN, Table, unit

#: A goal within this time after the restart came of the penalty, s, both ends included.
PENALTY_S = 5.0


def word_of(team: str) -> str:
    """Name that commands accept for a team of the columns team and opponent."""
    return re.sub(r"^v(\d+)$", r"learned:\1", team)


def minutes_of(duration_s: float) -> str:
    """Minutes, as commands accept them, for a value of the column duration_s."""
    return str(duration_s / 60).removesuffix(".0")


class Evaluations(Table):
    """One match that was played to measure a team, from its side. Sorted by evaluation, seed, match.

    The two matches of one seed are a pair; pairs are independent of each other. In a pair the team plays
    home, then away, with the same random numbers. A team that is measured against itself plays home in
    both, each with its own random numbers; with sides swapped they would be the same match.
    """

    NAME: ClassVar[str] = "evaluations"
    VERSION: ClassVar[int] = 3
    SINCE: ClassVar[int] = 1

    evaluation = dy.String(regex=SLUG, description="team, opponent, and a hash of all but the seed")
    team = dy.String(description="team that is measured: v and the version of its policy, the id of its season if it is an apprentice, or a scripted team")
    policy_version = dy.Int32(nullable=True, min=1, description="version of the policy it plays, among the season's own if it is an apprentice; null for a scripted team")
    knowledge_version = dy.Int32(nullable=True, min=1, description="version of the knowledge whose pairs that policy values")
    opponent = dy.String(description=f"team that it plays against, named as in team. {STAND_IN}")
    seed = dy.Int64(min=0, description="seed of the pair of matches")
    match = dy.Int8(min=1, max=2, description="first or second of the pair")
    side = dy.Enum(SIDES, description="side of the team that is measured")
    match_seed = dy.Int64(min=0, description="seed of the match; at least 2,000,000,000, so that no season and no match recorded with a lower seed shares it")
    duration_s = dy.Float64(min=0, description="duration of the match", metadata=unit("s"))
    goals_for = dy.Int16(min=0, description="goals of the team", metadata=unit("goals"))
    goals_against = dy.Int16(min=0, description="goals of the opponent", metadata=unit("goals"))
    actions = dy.Int64(nullable=True, min=0, description="the team's decisions; null for a scripted team, which makes none")
    other_actions = dy.Int64(nullable=True, min=0, description="the team's decisions for any other behaviour than moves randomly (194)")
    played_s = dy.Float64(nullable=True, min=0, description="time of the team's decisions, added up over its robots; null for a scripted team, and in tables that were written without it", metadata=unit("s"))
    other_s = dy.Float64(nullable=True, min=0, description="time of its decisions for any other behaviour than moves randomly (194)", metadata=unit("s"))
    brief_actions = dy.Int64(nullable=True, min=0, description="its decisions that lasted two frames or fewer")
    fouls_for = dy.Int16(nullable=True, min=0, description="penalties and goal kicks that the team took after a foul; null in tables that were written without it", metadata=unit("restarts"))
    fouls_against = dy.Int16(nullable=True, min=0, description="penalties and goal kicks that the opponent took after a foul; null likewise", metadata=unit("restarts"))
    penalties_for = dy.Int16(nullable=True, min=0, description="penalties that the team took; null likewise", metadata=unit("penalties"))
    penalties_against = dy.Int16(nullable=True, min=0, description="penalties that the opponent took; null likewise", metadata=unit("penalties"))
    penalty_goals_for = dy.Int16(nullable=True, min=0, description=f"goals of the team within {PENALTY_S:g} s of its penalty, with no other restart between; null likewise", metadata=unit("goals"))
    penalty_goals_against = dy.Int16(nullable=True, min=0, description=f"goals of the opponent within {PENALTY_S:g} s of its penalty, with no other restart between; null likewise", metadata=unit("goals"))
