"""Behaviours: grams that recur, and go with scoring or with conceding."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import dataframely as dy
import polars as pl

from pitchlore.schemas.situations import MOVES_RANDOMLY
from pitchlore.schemas.table import ROLES, Table, unit


def behaviour_id() -> dy.String:
    """Column of a behaviour's id: role and codes, the same in every version."""
    return dy.String(
        regex=r"^(goalkeeper|midfield|striker)(-\d{3}){1,4}$",
        description="role and codes, the same in every version",
    )


def id_of() -> pl.Expr:
    """Id of the behaviour of each row's columns ``role`` and ``codes``."""
    digits = pl.col("codes").list.eval(pl.element().cast(pl.String).str.zfill(3)).list.join("-")
    return pl.concat_str("role", digits, separator="-")


def moves_randomly() -> pl.Expr:
    """Id of the behaviour "moves randomly" (the one code 194), for the role in each row's column ``role``."""
    return pl.format(f"{{}}-{MOVES_RANDOMLY:03d}", pl.col("role").cast(pl.String))


#: What went with a behaviour, where that is sure: the team's chances rose, or fell; ? where it is not.
PAYS = ("+", "-", "?")


#: Codes of a robot at the ball: with it, guides, kicks, loses, yields, leaves, reaches, receives it, is hit by it; ...
AT_BALL = (1, 11, 21, 22, 23, 33, 44, 45, 47)
#: ... and of one that plays against it: nears the ball, its line, its own goal, or an adversary.
AGAINST_BALL = (46, 67, 68, 88, 138, 139, 140)
#: Least support of behaviours that are shown, unless fewer are asked for.
SHOWN_FROM = 5


def for_people(behaviours: pl.DataFrame) -> pl.DataFrame:
    """Behaviours in their order for people, with column effect: value times support, what they went with in all.

    First those that went with a rise of the team's chances, then those with a fall. Of each the ones with or
    against the ball first, and the greatest effect.

    Args:
        behaviours: columns behaviour_id, codes, value and support.
    """
    plays = pl.col("codes").list.eval(pl.element().is_in((*AT_BALL, *AGAINST_BALL))).list.any()
    ordered = behaviours.with_columns(effect=pl.col("value") * pl.col("support"))
    return ordered.sort(pl.col("value") > 0, plays, pl.col("effect").abs(), "behaviour_id", descending=True)


class Patterns(Table):
    """One behaviour of one team as a round of the selection found it (behaviours before they have a version).

    Sorted by n (descending), team, kind, role, codes. Source: paper section 3.2.2.
    """

    NAME: ClassVar[str] = "patterns"
    VERSION: ClassVar[int] = 4
    SINCE: ClassVar[int] = 1
    FORMER: ClassVar[Mapping[str, Any]] = {"pays": "+", "kept": True}
    PUBLIC: ClassVar[bool] = False

    behaviour_id = behaviour_id()
    role = dy.Enum(ROLES, description="role of the robots that showed it")
    codes = dy.List(dy.Int16(min=1, max=194), description="the situations' codes in order")
    n = dy.Int8(min=1, max=4, description="number of situations")
    support = dy.Int64(min=1, description="number of instances")
    value = dy.Float64(description=(
        "what an instance changes of V, goals included: the estimate, shrunk towards its family; by the "
        "setting outcome = 'paper', its value by the next goal"
    ))
    spread = dy.Float64(min=0, description="standard deviation of its instances' values")
    neuron = dy.Int16(min=0, description="best-matching unit in the map of its length")
    low = dy.Float64(nullable=True, description="lower end of the 95 % interval of value")
    high = dy.Float64(nullable=True, description="upper end of the 95 % interval of value")
    mean = dy.Float64(nullable=True, description="mean of its instances' values, not shrunk")
    error = dy.Float64(nullable=True, min=0, description="standard error of mean, by match")
    family = dy.Float64(nullable=True, description=(
        "what it is compared with and shrunk towards: mean value of the groups of its length and role "
        "whose last code is of the same family of table 1"
    ))
    family_spread = dy.Float64(nullable=True, min=0, description="standard deviation of the true values in that family")
    family_size = dy.Int64(nullable=True, min=1, description="number of groups in that family")
    paper = dy.Float64(nullable=True, description="mean of its instances' values by the next goal (paper section 3.2.2), in (-1, 1)")
    x = dy.Float64(nullable=True, description="where it begins: mean place of the robot along the pitch, its team attacks +x", metadata=unit("m"))
    y = dy.Float64(nullable=True, description="the same across the pitch, to the left of +x", metadata=unit("m"))
    team = dy.String(nullable=True, description="team or pool of teams that showed it; null before teams were told apart")
    kind = dy.String(nullable=True, description="league that it was shown in: vsss, ssl, 2d or human")
    pays = dy.Enum(PAYS, nullable=True, description=(
        "what went with it, where that is sure (q at most .05): + the team's chances rose, - they fell, ? neither is "
        "sure; it is no effect of doing it. Versions from before there was q have + only"
    ))
    q = dy.Float64(nullable=True, min=0, max=1, description=(
        "least share of false ones that is expected among the groups of its team, league and length that are "
        "as sure as it (Benjamini and Hochberg 1995); of groups of the map's kept neurons"
    ))
    kept = dy.Bool(nullable=True, description="whether the selection keeps it: decisions and policies know these alone")


class Behaviours(Patterns):
    """One behaviour of one team in one version of the knowledge.

    Unique by team, kind and behaviour_id. Sorted by team, kind, n (descending), role, codes.
    """

    NAME: ClassVar[str] = "behaviours"
    VERSION: ClassVar[int] = 4
    SINCE: ClassVar[int] = 1
    PUBLIC: ClassVar[bool] = True

    version = dy.Int32(min=1, description="version of the knowledge")
