"""The maps of a team's grams, neuron by neuron, from the public tables neurons, grams and behaviours."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import polars as pl

from pitchlore.pipeline.views.scout.words import TITLES, titled
from pitchlore.schemas.behaviours import id_of

#: Grams that the panel of a neuron lists, the most frequent first; and behaviours, in their order for people.
LISTED = 8
#: Percent of the heat's colour in the busiest cell: words on it stay readable.
_DARKEST = 45
#: Gaps round the cells, pixels.
_NARROWEST, _WIDEST = 1, 9


def neuron_key(n: int, neuron: int) -> str:
    """Id of a neuron's panel in the page."""
    return f"n{n}-{neuron}"


def lying(behaviours: pl.DataFrame, grams: pl.DataFrame) -> pl.DataFrame:
    """The behaviours that lie on the maps, each with the neuron of its gram.

    A behaviour of knowledge that adds up versions may be from before these maps: it lies on none of them.

    Args:
        behaviours: rows of schema Behaviours of one team.
        grams: rows of schema Grams of the same team.
    """
    return behaviours.drop("neuron").join(
        grams.select("neuron", behaviour_id=id_of()), on="behaviour_id", how="left", maintain_order="left")


def maps(
    neurons: pl.DataFrame, grams: pl.DataFrame, behaviours: pl.DataFrame, shown: Collection[str],
) -> list[dict[str, Any]]:
    """Text of the page on each map of a team, the longest grams first.

    Args:
        neurons: rows of schema Neurons of the team.
        grams: rows of schema Grams of the team.
        behaviours: from :func:`lying`, in their order for people.
        shown: ids of the behaviours that have a card in the gallery.
    """
    return [_map(int(n), rows.sort("neuron"), grams.filter(n=n), behaviours.filter(n=n), shown)
            for (n,), rows in neurons.sort("n", descending=True).group_by("n", maintain_order=True)]


def _map(
    n: int, neurons: pl.DataFrame, grams: pl.DataFrame, behaviours: pl.DataFrame, shown: Collection[str],
) -> dict[str, Any]:
    most = max(neurons["count"].to_list())
    last = neurons.row(-1, named=True)
    return {
        "n": n, "columns": last["grid_column"] + 1, "rows": last["grid_row"] + 1,
        "quantisation_error": last["quantisation_error"], "topographic_error": last["topographic_error"],
        "count": int(neurons["count"].sum()), "behaviours": behaviours.height,
        "cells": [
            _cell(n, row, grams.filter(neuron=row["neuron"]), behaviours.filter(neuron=row["neuron"]),
                  shown)
            | {"shade": round(_DARKEST * row["count"] / max(most, 1)), "gap": gap}
            for row, gap in zip(neurons.iter_rows(named=True), _gaps(neurons["distance"]), strict=True)],
    }


def _gaps(distance: pl.Series) -> list[int]:
    """The gap round each cell, pixels: the widest round the neuron that is farthest from its neighbours."""
    apart = distance.fill_null(0.0).to_numpy()
    share = (apart - apart.min()) / max(float(np.ptp(apart)), 1e-9)
    return [_NARROWEST + round((_WIDEST - _NARROWEST) * float(each)) for each in share]


def _cell(
    n: int, neuron: dict[str, Any], grams: pl.DataFrame, behaviours: pl.DataFrame,
    shown: Collection[str],
) -> dict[str, Any]:
    """One neuron: how it is drawn, and what its panel says."""
    listed = grams.sort("count", "role", "codes", descending=[True, False, False]).head(LISTED)
    return neuron | {
        "key": neuron_key(n, neuron["neuron"]), "sign": sign(neuron["value"]),
        "near": titled(nearest(neuron["prototype"], list(TITLES))),
        "weights": ", ".join(f"{weight:.1f}" for weight in neuron["prototype"]),
        "often": " ".join(f"{code:03d}" for code in listed["codes"][0]) if listed.height else "",
        "known": grams.height,
        "list": [{"words": titled(row["codes"]), "codes": row["codes"], "role": row["role"],
                  "count": row["count"], "value": row["value_sum"] / row["count"]}
                 for row in listed.iter_rows(named=True)],
        "behaviours": behaviours["behaviour_id"].to_list(),
        "best": [{"id": row["behaviour_id"], "words": titled(row["codes"]), "role": row["role"],
                        "support": row["support"], "value": row["value"], "low": row["low"],
                        "high": row["high"], "shown": row["behaviour_id"] in shown}
                       for row in behaviours.head(LISTED).iter_rows(named=True)],
    }


def nearest(prototype: Sequence[float], codes: Sequence[int]) -> list[int]:
    """The code nearest to each weight of a prototype, the least on a tie."""
    there = np.sort(np.asarray(codes))
    at = np.abs(there - np.asarray(prototype)[:, None]).argmin(axis=1)
    return [int(code) for code in there[at]]


def sign(value: float | None) -> str:
    """A value's sign as a character, so that no colour is needed; empty for none."""
    if value is None:
        return ""
    return "+" if value > 0 else "−" if value < 0 else "0"
