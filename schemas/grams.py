"""Grams: distinct runs of consecutive situations, counted."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from schemas.table import ROLES, SIDES, Table, match_id, unit


class Grams(Table):
    """One distinct gram of one match, team and role; tables of matches add up in any order.

    Sorted by team, role, codes. Source: paper section 3.2.2.
    """

    NAME: ClassVar[str] = "grams"
    VERSION: ClassVar[int] = 2

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robots that showed it")
    role = dy.Enum(ROLES, description="role held when the gram starts")
    codes = dy.List(dy.Int16(min=1, max=194), description="the situations' codes in order")
    n = dy.Int8(min=1, max=4, description="number of situations")
    count = dy.Int64(min=1, description="number of instances")
    value_sum = dy.Float64(description=(
        "sum of its instances' values: what they change of V, goals included; by the setting outcome = "
        "'paper', each the mean of its situations' values by the next goal"
    ))
    value_square_sum = dy.Float64(min=0, description="sum of the squares of its instances' values")
    match_square_sum = dy.Float64(min=0, description="square of value_sum; over matches, the sum of their squares")
    match_product_sum = dy.Float64(description="value_sum times count; over matches, the sum of their products")
    match_count_square_sum = dy.Int64(min=1, description="square of count; over matches, the sum of their squares")
    paper_sum = dy.Float64(description="sum of its instances' values by the next goal (paper section 3.2.2)")
    placed = dy.Int64(min=0, description="instances whose robot's place at the start is known")
    x_sum = dy.Float64(description="sum of these places along the pitch, each robot's team attacks +x", metadata=unit("m"))
    y_sum = dy.Float64(description="sum of these places across the pitch", metadata=unit("m"))
