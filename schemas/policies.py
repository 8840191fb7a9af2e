"""Policies: action values of behaviours in states."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.behaviours import behaviour_id
from pitchlore.schemas.table import KEYS, ROLES, Table


class Policies(Table):
    """One state-behaviour pair of one policy version.

    Unique by role, key, state and behaviour_id, and sorted so.
    """

    NAME: ClassVar[str] = "policies"
    VERSION: ClassVar[int] = 3

    version = dy.Int32(min=1, description="version of the policy")
    knowledge_version = dy.Int32(min=1, description="version of the knowledge whose pairs it values")
    role = dy.Enum(ROLES, description="role of the robot")
    key = dy.Enum(KEYS, description="which elements of the state are kept")
    state = dy.Int64(min=0, description="state in mixed radix, by its key")
    behaviour_id = behaviour_id()
    q = dy.Float64(description="action value")
    visits = dy.Int64(min=0, description="visits to the pair in the batches that the policy and its ancestors learned from")
    evidence = dy.Float64(min=0, description="number of episodes that the value is the mean of, its start included; at most one over the step size")


#: Episodes below which a behaviour's mean return says little.
FEW = 5
#: What the evidence says of the choice in a state.
VERDICTS = ("sure", "close", "few", "alone")


class Returns(Table):
    """Returns of one state-behaviour pair of one policy version, episode by episode.

    The return of a decision is +1 for the goal that ends its episode and -1 for one against, times the policy's
    discount to the power of the seconds until then; 0 without a goal. An episode is a stretch of play of a match
    as one team plays it. Its robots and its visits share their outcome, so they count once, with their mean.
    Episodes that were cut by the recording are left out. Pairs without episodes have no row. Unique by role, key,
    state and behaviour_id, and sorted so.
    """

    NAME: ClassVar[str] = "returns"
    VERSION: ClassVar[int] = 1

    version = dy.Int32(min=1, description="version of the policy")
    role = dy.Enum(ROLES, description="role of the robot")
    key = dy.Enum(KEYS, description="which elements of the state are kept")
    state = dy.Int64(min=0, description="state in mixed radix, by its key")
    behaviour_id = behaviour_id()
    episodes = dy.Int64(min=1, description=(
        "number of episodes with a known return, of the batches of the policy and of its ancestors that have this table"
    ))
    mean = dy.Float64(min=-1, max=1, description="mean return of the episodes")
    spread = dy.Float64(nullable=True, min=0, description="standard deviation of their returns (n - 1); null for one episode")


class States(Table):
    """One state of one policy version: which behaviour is best there, and whether that is sure.

    best is the behaviour of the greatest action value (table policies), second the next. Of equal values the
    one with more episodes comes first, then by id. Unique by role, key and state, and sorted so.
    """

    NAME: ClassVar[str] = "states"
    VERSION: ClassVar[int] = 2
    SINCE: ClassVar[int] = 1

    version = dy.Int32(min=1, description="version of the policy")
    role = dy.Enum(ROLES, description="role of the robot")
    key = dy.Enum(KEYS, description="which elements of the state are kept")
    state = dy.Int64(min=0, description="state in mixed radix, by its key")
    behaviours = dy.Int32(min=1, description="number of behaviours to choose from")
    visits = dy.Int64(min=0, description="visits to the state (sum over its rows of table policies)")
    best = behaviour_id()
    best_episodes = dy.Int64(min=0, description="episodes of best (table returns)")
    second = dy.String(nullable=True, description="behaviour with the next greatest action value; null if there is one behaviour")
    second_episodes = dy.Int64(nullable=True, min=0, description="episodes of second; null if there is one behaviour")
    gap = dy.Float64(nullable=True, min=0, description="action value of best less that of second; null if there is one behaviour")
    low = dy.Float64(nullable=True, description=(
        "lower end of Welch's 95 % interval of the mean return of best less that of second; null if one of them "
        "has fewer than two episodes"
    ))
    high = dy.Float64(nullable=True, description="upper end of that interval")
    verdict = dy.Enum(VERDICTS, description=(
        f"few: best or second has fewer than {FEW} episodes; else alone: there is one behaviour; sure: low > 0; "
        "close: any other. The policy is unsure in states that are few or close"
    ))
