"""States in words: the elements that an encoded state keeps, each with the name of its level."""

from __future__ import annotations

from itertools import chain

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.state.keys import KeyDigit, columns, decode
from pitchlore.pipeline.state.table import TABLE
from pitchlore.schemas.table import ROLES, Key

#: Between the name of an element and that of its level.
IS = ": "


def levels_of(column: KeyDigit) -> tuple[str, ...]:
    """Names of the values of a digit; levels of the element that fall together are joined by *or*."""
    names = TABLE[column.element].levels
    return (*names[: column.levels - 1], " or ".join(names[column.levels - 1:]))


def elements_of(states: I64, key: Key, slot: int) -> pl.Series:
    """The elements of encoded states in words, the inverse of :func:`pipeline.state.encode`.

    Args:
        states: int64 [K], by ``key``.
        key: name of the kept elements.
        slot: own slot (0, 1, 2) of the robot that decides: the index of its role.

    Returns:
        List[String] [K], each entry ``name: level`` by :data:`pipeline.state.table.TABLE`, in the order of
        the key's digits. An empty list by a key that keeps nothing.
    """
    digits = decode(states, key)
    own = columns(key, slot)
    if not own:
        return pl.Series("elements", [[]] * len(states), dtype=pl.List(pl.String))
    words = [[f"{TABLE[column.element].name}{IS}{level}" for level in levels_of(column)] for column in own]
    before = np.cumsum([0, *map(len, words[:-1])])
    said = pl.Series("elements", list(chain.from_iterable(words))).gather((digits + before).ravel())
    return said.reshape((len(states), len(own))).arr.to_list()


def with_elements(states: pl.DataFrame) -> pl.DataFrame:
    """Rows of schema States in their order, with a column ``elements``: those of :func:`elements_of`."""
    parts = [elements_of(rows["state"].to_numpy(), key, ROLES.index(str(role)))
             for (role, key), rows in states.group_by("role", "key", maintain_order=True)]
    return states.with_columns(pl.concat([pl.Series("elements", [], dtype=pl.List(pl.String)), *parts]))


def levels_in_words(elements: list[str]) -> dict[str, str]:
    """Name of each element to the name of its level, from a state in words."""
    return dict(element.split(IS, 1) for element in elements)
