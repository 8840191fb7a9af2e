"""Neurons: the maps on which grams lie."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import Table


class Neurons(Table):
    """One neuron of the self-organising map of one team's grams of one length.

    Which grams lie on it is the column neuron of the table grams; all of them, however rare, are counted
    here. A team without grams of a length has no map of it. Sorted by n (descending), team, kind, neuron.
    Source: paper section 3.2.2.
    """

    NAME: ClassVar[str] = "neurons"
    VERSION: ClassVar[int] = 1

    team = dy.String(description="team or pool of teams whose grams trained the map")
    kind = dy.String(description="league that they were shown in: vsss, ssl, 2d or human")
    n = dy.Int8(min=1, max=4, description="length of the map's grams")
    neuron = dy.Int16(min=0, description="number in the map: row times the columns of the map, plus column")
    grid_row = dy.Int16(min=0, description="row in the map")
    grid_column = dy.Int16(min=0, description="column in the map")
    prototype = dy.List(dy.Float64(), description="its weights, n of them: a gram's codes as real numbers, no scale")
    grams = dy.Int64(min=0, description="distinct grams (role and codes) of which it is the best-matching unit")
    count = dy.Int64(min=0, description="instances of these grams: its activations")
    value = dy.Float64(nullable=True, description=(
        "mean of these instances' values (value_sum over count in the table grams), not shrunk; null without any"
    ))
    kept = dy.Bool(description="whether its activations reach the round's threshold, so that its grams may be behaviours")
    distance = dy.Float64(nullable=True, min=0, description=(
        "mean Euclidean distance of its weights to those of the neurons that touch it, corners too "
        "(the U-matrix, Ultsch 1993); null in a map of one neuron"
    ))
    quantisation_error = dy.Float64(min=0, description=(
        "of the whole map: mean Euclidean distance of an instance's codes to its best-matching unit"
    ))
    topographic_error = dy.Float64(min=0, max=1, description=(
        "of the whole map: share of the instances whose best and second best units do not touch"
    ))
