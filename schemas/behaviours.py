"""Behaviours: grams that recur and pay."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy
import polars as pl

from schemas.situations import MOVES_RANDOMLY
from schemas.table import ROLES, Table


def behaviour_id() -> dy.String:
    """Column of a behaviour's id: role and codes, the same in every version."""
    return dy.String(
        regex=r"^(goalkeeper|midfield|striker)(-\d{3}){1,4}$",
        description="role and codes, the same in every version",
    )


def moves_randomly() -> pl.Expr:
    """Id of the behaviour "moves randomly" (the one code 194), for the role in each row's column ``role``."""
    return pl.format(f"{{}}-{MOVES_RANDOMLY:03d}", pl.col("role").cast(pl.String))


class Patterns(Table):
    """One behaviour as a round of the selection found it (behaviours before they have a version).

    Sorted by role, codes. Source: paper section 3.2.2.
    """

    NAME: ClassVar[str] = "patterns"
    VERSION: ClassVar[int] = 1
    PUBLIC: ClassVar[bool] = False

    behaviour_id = behaviour_id()
    role = dy.Enum(ROLES, description="role of the robots that showed it")
    codes = dy.List(dy.Int16(min=1, max=194), description="the situations' codes in order")
    n = dy.Int8(min=1, max=4, description="number of situations")
    support = dy.Int64(min=1, description="number of instances")
    value = dy.Float64(description="mean of its instances' values, in (-1, 1)")
    spread = dy.Float64(min=0, description="standard deviation of its instances' values")
    neuron = dy.Int16(min=0, description="best-matching unit in the map of its length")


class Behaviours(Patterns):
    """One behaviour in one version of the knowledge. Sorted by n (descending), role, codes."""

    NAME: ClassVar[str] = "behaviours"
    VERSION: ClassVar[int] = 1
    PUBLIC: ClassVar[bool] = True

    version = dy.Int32(min=1, description="version of the knowledge")
