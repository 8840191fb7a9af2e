"""A policy as arrays for compiled look-up: states are found by bisection, behaviours are rows of codes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.state import radix
from pitchlore.schemas import ROLES
from pitchlore.schemas.situations import MOVES_RANDOMLY
from pitchlore.schemas.table import KEYS, Key

#: Row of the behaviour "moves randomly", which every state offers.
RANDOMLY = 0
#: Most codes of a behaviour.
LONGEST = 4
#: Standard error of the value of a row of schema Policies, as a share of the standard deviation of one
#: episode: one over the root of the evidence, at most 1.
STANDARD_ERROR = 1.0 / pl.max_horizontal(pl.col("evidence"), 1.0).sqrt()


class PolicyTable(NamedTuple):
    """A policy as :mod:`pipeline.arena.teams.learned` looks it up.

    Attributes:
        codes: int64 [B, 4], of each behaviour, 0 after the last; row 0 is moves randomly.
        digits: int64 [K, 3, D], elements of the state that each key keeps for each role, the most
            significant first. The finest key is first.
        levels: int64 [K, 3, D], how many values each has; 1 after the last: that changes no state.
        starts: int64 [K, 3, 2], range of rows in ``states``.
        states: int64 [S], increasing within each range.
        first: int64 [S + 1]; the actions of state i are rows ``first[i]`` to ``first[i + 1]``, exclusive.
        actions: int64 [A], rows of ``codes``.
        values: float64 [A], value of each action, goals.
        standard_errors: float64 [A], of the values, see :data:`STANDARD_ERROR`.
    """

    codes: I64
    digits: I64
    levels: I64
    starts: I64
    states: I64
    first: I64
    actions: I64
    values: F64
    standard_errors: F64


def _digits_of(keys: Sequence[Key]) -> tuple[I64, I64]:
    """Elements and levels of keys for each role, both int64 [K, 3, D]; see :class:`PolicyTable`."""
    of = [[radix(key, slot) for slot in range(len(ROLES))] for key in keys]
    most = max((len(own.digits) for row in of for own in row), default=0)
    digits = np.zeros((len(keys), len(ROLES), most), dtype=np.int64)
    levels = np.ones_like(digits)
    for k, row in enumerate(of):
        for slot, own in enumerate(row):
            count = len(own.digits)
            digits[k, slot, :count], levels[k, slot, :count] = own
    return digits, levels


def policy_table_of(policy: pl.DataFrame, min_visits: int = 0) -> tuple[PolicyTable, list[str | None]]:
    """A policy's table, and the names of its behaviours.

    Args:
        policy: rows of schema Policies, of one version; none for a team that knows nothing.
        min_visits: a state is used only if its pairs were visited so often together, or if there is no
            coarser key to fall back to.

    Returns:
        The table; and behaviour ids by row of ``codes``, None for moves randomly of any role.
    """
    keys = [key for key in KEYS if key in policy["key"].unique().to_list()]
    if min_visits > 0 and len(keys) > 1:
        enough = pl.col("visits").sum().over("role", "key", "state") >= min_visits
        policy = policy.filter(enough | (pl.col("key").cast(pl.String) == keys[-1]))
    random = [f"{MOVES_RANDOMLY:03d}"]
    names = [name for name in sorted(policy["behaviour_id"].unique()) if name.split("-")[1:] != random]
    codes = np.zeros((1 + len(names), LONGEST), dtype=np.int64)
    codes[RANDOMLY, 0] = MOVES_RANDOMLY
    for row, name in enumerate(names, start=1):
        own = [int(code) for code in name.split("-")[1:]]
        codes[row, : len(own)] = own
    row_of = {name: row for row, name in enumerate(names, start=1)}
    pairs = policy.select(
        "state", "q", STANDARD_ERROR.alias("standard_error"),
        table=pl.col("key").cast(pl.Enum(keys)).to_physical() * len(ROLES) + pl.col("role").to_physical(),
        action=pl.col("behaviour_id").replace_strict(row_of, default=RANDOMLY, return_dtype=pl.Int64),
    ).sort("table", "state", "action")
    first = pairs.select("table", "state").with_row_index("first").unique(
        ("table", "state"), keep="first", maintain_order=True
    )
    tables = np.arange(len(keys) * len(ROLES))
    starts = np.stack(
        [np.searchsorted(first["table"].to_numpy(), tables, side=side) for side in ("left", "right")], axis=-1
    )
    digits, levels = _digits_of(keys)
    table = PolicyTable(
        codes, digits, levels, starts.reshape(len(keys), len(ROLES), 2).astype(np.int64),
        first["state"].to_numpy().copy(), np.append(first["first"].to_numpy(), len(pairs)).astype(np.int64),
        pairs["action"].to_numpy().copy(), pairs["q"].to_numpy().copy(),
        pairs["standard_error"].to_numpy().copy(),
    )  # fmt: skip
    return table, [None, *names]
