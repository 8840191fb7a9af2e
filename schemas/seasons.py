"""Seasons: an apprentice's games against one opponent, its growing knowledge, and the paper's claims."""

from __future__ import annotations

from typing import Any, ClassVar

import dataframely as dy
import polars as pl

from pitchlore.schemas.paradigms import VERDICTS
from pitchlore.schemas.table import ROLES, SLUG, STAND_IN, Table, match_id, unit

#: The opponent that is no team of ours: a person plays it in a window.
PERSON = "person"
CLAIM_VERDICTS = (*VERDICTS, "contradictory", "reached", "not reached", "not judged", "by construction")


class OfGame(Table):
    """Columns that identify one game of one season."""

    season = dy.String(primary_key=True, regex=SLUG, description="season the row belongs to: a slug, unique in a data folder")
    settings = dy.String(regex=SLUG, description="name of the season's settings: paper, best, or an ablation's")
    opponent = dy.String(regex=SLUG, description=f"team played against; person: a person in a window. {STAND_IN}")
    seed = dy.Int64(min=0, description="seed of the season; all its random numbers follow from it")
    game = dy.Int16(primary_key=True, min=1, description="number of the game in its season")


class Games(OfGame):
    """One game of one season, from the apprentice's side. Sorted by season, game.

    Only the apprentice's decisions in play count (Decisions: team home, chosen). A decision is random if
    its behaviour is moves randomly (194), drawn or preferred. The paper's Table 3 counts so, too. Times are
    added up over the robots. Columns from played_s on are null in tables that were written without them.
    """

    NAME: ClassVar[str] = "games"
    VERSION: ClassVar[int] = 3
    SINCE: ClassVar[int] = 1

    match_id = match_id()
    lead = dy.Int16(description="goals that the apprentice started ahead by (negative: behind)", metadata=unit("goals"))
    goals_for = dy.Int16(min=0, description="goals that the apprentice made in play, without the lead", metadata=unit("goals"))
    goals_against = dy.Int16(min=0, description="goals that the opponent made in play", metadata=unit("goals"))
    actions = dy.Int64(min=0, description="the apprentice's decisions in the game (Table 3: total)")
    random_actions = dy.Int64(min=0, description="the apprentice's decisions for moves randomly, 194 (Table 3: random)")
    other_actions = dy.Int64(min=0, description="the apprentice's decisions for any other behaviour (Table 3: other)")
    known_states = dy.Float64(min=0, max=1, description=(
        "share of its decisions made in a known state: the knowledge that it played with has a behaviour "
        "other than 194 there for the role; 0 without decisions"
    ))
    direct = dy.Int16(min=0, description="its goals by direct action", metadata=unit("goals"))
    indirect = dy.Int16(min=0, description="its goals by indirect action", metadata=unit("goals"))
    error = dy.Int16(min=0, description="its goals by error of the opponent", metadata=unit("goals"))
    direct_against = dy.Int16(min=0, description="the opponent's goals by direct action", metadata=unit("goals"))
    indirect_against = dy.Int16(min=0, description="the opponent's goals by indirect action", metadata=unit("goals"))
    error_against = dy.Int16(min=0, description="the opponent's goals by error of the apprentice", metadata=unit("goals"))
    situations = dy.Int64(min=0, description="situations recognised, of all robots")
    duration_s = dy.Float64(min=0, description="first to last sample of the match", metadata=unit("s"))
    policy_version = dy.Int32(nullable=True, min=1, description="version of the policy it played with; null where there was none yet")
    knowledge_version = dy.Int32(nullable=True, min=1, description="newest version of the knowledge after the game; null where there was none yet")
    left = dy.Int16(nullable=True, min=0, description="times that a person left the game before its end, after which it was played anew; null where a script plays")
    played_s = dy.Float64(nullable=True, min=0, description="time of the apprentice's decisions, each from its start to the next or to the end of play", metadata=unit("s"))
    other_s = dy.Float64(nullable=True, min=0, description="time of its decisions for any other behaviour than moves randomly, 194", metadata=unit("s"))
    first_actions = dy.Int64(nullable=True, min=0, description="its decisions in the first second of an episode: after a kick-off or another restart")
    first_other_actions = dy.Int64(nullable=True, min=0, description="its decisions for any other behaviour in the first second of an episode")
    other_states = dy.Int64(nullable=True, min=0, description="pairs of role and state in which it decided for any other behaviour, by the finest key of the knowledge")
    brief_actions = dy.Int64(nullable=True, min=0, description="its decisions that lasted two frames or fewer")

    @dy.rule()
    def actions_add_up(cls: Any) -> pl.Expr:  # noqa: N805
        """Random and other actions are all actions."""
        return pl.col("random_actions") + pl.col("other_actions") == pl.col("actions")

    @dy.rule()
    def parts_are_no_more_than_all(cls: Any) -> pl.Expr:  # noqa: N805
        """A part of the decisions, or of their time, is not more than all."""
        return (
            (pl.col("other_s") <= pl.col("played_s")) & (pl.col("first_actions") <= pl.col("actions"))
            & (pl.col("first_other_actions") <= pl.min_horizontal("first_actions", "other_actions"))
            & (pl.col("other_states") <= pl.col("other_actions")) & (pl.col("brief_actions") <= pl.col("actions")))

    @dy.rule()
    def goals_are_attributed_once(cls: Any) -> pl.Expr:  # noqa: N805
        """At most as many goals are attributed as were made; some have no known kind."""
        return (pl.col("direct") + pl.col("indirect") + pl.col("error") <= pl.col("goals_for")) & (
            pl.col("direct_against") + pl.col("indirect_against") + pl.col("error_against") <= pl.col("goals_against"))


class Growth(OfGame):
    """Knowledge of one role of the apprentice after one game. Sorted by season, game, role.

    Knowledge that has keys of several lengths is counted by the finest.
    """

    NAME: ClassVar[str] = "growth"
    VERSION: ClassVar[int] = 3
    SINCE: ClassVar[int] = 1

    role = dy.Enum(ROLES, primary_key=True, description="role of the robot")
    states = dy.Int64(min=0, description="states known after the game: seen in knowledge or played in (Figure 8)")
    behaviours = dy.Int64(min=0, description="distinct behaviours of the knowledge, without 194 (Figure 9)")
    pairs = dy.Int64(min=0, description="distinct pairs of state and behaviour of the knowledge, without 194 (Figure 9)")
    states_seen = dy.Int64(min=0, description="states in which the knowledge saw a behaviour begin, made in training")
    states_played = dy.Int64(min=0, description="states that the apprentice itself decided in, in this game or earlier in the season")
    actions = dy.Int64(min=0, description="the apprentice's decisions of this role in the game")
    other_actions = dy.Int64(min=0, description="the role's decisions for any other behaviour than 194")


class StatesPlayed(Table):
    """A state in which the apprentice decided, in any game of its season so far. Sorted by role, state.

    With this table a game finds its new states without reading all earlier games.
    """

    NAME: ClassVar[str] = "states_played"
    VERSION: ClassVar[int] = 1
    PUBLIC: ClassVar[bool] = False

    role = dy.Enum(ROLES, primary_key=True, description="role of the robot")
    state = dy.Int64(primary_key=True, description="state by the finest key of the knowledge")


class Claims(Table):
    """One claim about seasons beside what was measured. Ordered as the paper states them, then our own aims."""

    NAME: ClassVar[str] = "claims"
    VERSION: ClassVar[int] = 2

    item = dy.String(description="subject of the claim: Table 3, Figure 8, 9 or 10, ablation, aim")
    claim = dy.String(description="the claim in short")
    settings = dy.String(description="name of the settings of the seasons that it is checked on")
    opponent = dy.String(description="opponent of these seasons; of two the first less the second")
    quantity = dy.String(description="quantity that is measured to check the claim, one number a season")
    stated = dy.String(description="range of the quantity if the claim holds")
    table_3 = dy.Float64(nullable=True, description="the same quantity in the paper's own Table 3; null where the table does not hold it")
    measured = dy.Float64(nullable=True, description="the quantity over the seasons; null where there is none")
    low = dy.Float64(nullable=True, description="lower end of its 95 % interval; null below two seasons")
    high = dy.Float64(nullable=True, description="upper end of its 95 % interval")
    seasons = dy.Int64(min=0, description="seasons that have the quantity; of two opponents the fewer")
    verdict = dy.Enum(CLAIM_VERDICTS, description=(
        "contradictory: the paper's own Table 3 says otherwise; not judged: fewer than five seasons; "
        "reproduced, contradicted, or not reproduced (neither shown nor refuted); by construction: holds in "
        "any run of this system, hence no evidence; reached or not, of aims"
    ))
