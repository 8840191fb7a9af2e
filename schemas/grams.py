"""Grams: distinct runs of consecutive situations, counted."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import ROLES, Table, unit


class Grams(Table):
    """One distinct gram of one team and role, over all its matches, in the round for its length.

    A round counts only the situations that longer behaviours leave. Grams that were seen less often than a
    behaviour must be (setting ``support_at_least``) are not listed. Sorted by n (descending), team, kind,
    role, codes. Source: paper section 3.2.2.
    """

    NAME: ClassVar[str] = "grams"
    VERSION: ClassVar[int] = 4
    SINCE: ClassVar[int] = 3

    team = dy.String(description="team or pool of teams that showed it")
    kind = dy.String(description="league that it was shown in: vsss, ssl, 2d or human")
    role = dy.Enum(ROLES, description="role held when the gram starts")
    codes = dy.List(dy.Int16(min=1, max=194), description="the situations' codes in order")
    n = dy.Int8(min=1, max=4, description="number of situations")
    count = dy.Int64(min=1, description="number of instances")
    value_sum = dy.Float64(description=(
        "sum of its instances' values: what they change of V, goals included; by the setting outcome = "
        "'paper', each the mean of its situations' values by the next goal"
    ))
    value_square_sum = dy.Float64(min=0, description="sum of the squares of its instances' values")
    match_square_sum = dy.Float64(min=0, description="sum over matches of the square of the match's value_sum")
    match_product_sum = dy.Float64(description="sum over matches of the match's value_sum times its count")
    match_count_square_sum = dy.Int64(min=1, description="sum over matches of the square of the match's count")
    paper_sum = dy.Float64(description="sum of its instances' values by the next goal (paper section 3.2.2)")
    placed = dy.Int64(min=0, description="instances whose robot's place at the start is known")
    x_sum = dy.Float64(description="sum of these places along the pitch, each robot's team attacks +x", metadata=unit("m"))
    y_sum = dy.Float64(description="sum of these places across the pitch", metadata=unit("m"))
    neuron = dy.Int16(nullable=True, min=0, description=(
        "best-matching unit in the team's map of its length (table neurons); null in files from before"
    ))
