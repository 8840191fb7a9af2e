"""The few goals that V rests on, in a sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt

#: Standard deviations of a normal distribution on either side of which 5 % lie in all.
_Z = 1.96


def few_goals(store: Store, values: Mapping[str, Receipt]) -> dict[str, str]:
    """Sentence on the few goals that V rests on, by league; leagues that have enough have none.

    Args:
        store: the data folder.
        values: values of a match of each league, the models of which count.
    """
    said: dict[str, str] = {}
    for kind, made in values.items():
        names = {label.split("/")[1] for label in made.inputs if label.startswith("models/")}
        held = [receipt for name in sorted(names) if (receipt := store.receipt("models", name)) is not None]
        report = held[0].details["report"].get(kind, {}) if held else {}
        if "level" in report:
            times, low, high = (math.exp(report["level"]["offset"] + ends * report["level"]["error"])
                                for ends in (0, -_Z, _Z))
            said[kind] = (
                f"Few goals: {number_of(report['goals'], 'goal')} in {kind} so far. Below ten, V is fitted "
                f"to matches of our arena, and its odds are multiplied by {times:.2f} [{low:.2f}, {high:.2f}]"
                " for the rate of goals here. Take V, and all that follows from it, as a hint.")
    return said
