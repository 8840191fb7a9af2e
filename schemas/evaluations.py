"""Evaluations: what a team did in the matches that it was measured by."""

from __future__ import annotations

import re
from typing import ClassVar

import dataframely as dy

from schemas.table import STAND_IN, TEAMS, Table, unit


def word_of(team: str) -> str:
    """What commands take for a team of the columns team and opponent."""
    return re.sub(r"^v(\d+)$", r"learned:\1", team)


def minutes_of(duration_s: float) -> str:
    """What commands take for the column duration_s."""
    return str(duration_s / 60).removesuffix(".0")


class Evaluations(Table):
    """One match that was played to measure a team, from its side. Sorted by evaluation, seed, match.

    The two matches of one seed are a pair, and what is independent of the other pairs. In a pair the team
    plays home, then away, with the same chances; a team that is measured against itself plays home in both
    and each has its own chances, for with sides swapped they would be the same match.
    """

    NAME: ClassVar[str] = "evaluations"
    VERSION: ClassVar[int] = 1

    evaluation = dy.String(regex=r"^[a-z0-9][a-z0-9-]{0,63}$", description="team, opponent, and a hash of all but the seed")
    team = dy.String(description="team that is measured: v and the version of its policy, the id of the season whose apprentice it is, or a scripted team")
    policy_version = dy.Int32(nullable=True, min=1, description="version of the policy it plays, among the season's own if it is an apprentice; null for a scripted team")
    knowledge_version = dy.Int32(nullable=True, min=1, description="version of the knowledge that policy values")
    opponent = dy.String(description=f"team it plays against, likewise. {STAND_IN}")
    seed = dy.Int64(min=0, description="of the pair of matches")
    match = dy.Int8(min=1, max=2, description="first or second of the pair")
    side = dy.Enum(TEAMS, description="side of the team that is measured")
    match_seed = dy.Int64(min=0, description="of the match; none of a season or of a recorded match with a seed below 2,000,000,000")
    duration_s = dy.Float64(min=0, description="of the match", metadata=unit("s"))
    goals_for = dy.Int16(min=0, description="goals of the team", metadata=unit("goals"))
    goals_against = dy.Int16(min=0, description="goals of the opponent", metadata=unit("goals"))
    actions = dy.Int64(nullable=True, min=0, description="the team's decisions; null for a scripted team, which makes none")
    other_actions = dy.Int64(nullable=True, min=0, description="those of any other behaviour than moves randomly (194)")
