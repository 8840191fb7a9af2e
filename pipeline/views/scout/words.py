"""Behaviours in words: their situations one after another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pitchlore.pipeline.stages.situations.rules import TABLE_1

#: Names of the situations, by code; the paper's "it's own goal" is spelt right.
NAMES = {code: name.replace("it's", "its") for code, (name, _) in TABLE_1.items()}


def short(name: str) -> str:
    """A situation's name within a phrase: of the robot that is spoken of."""
    within = name.removeprefix("Robot ")
    return within[:1].lower() + within[1:]


def said(codes: Sequence[int], names: Mapping[int, str] = NAMES) -> str:
    """Situations in words; a code that has no name stands for itself."""
    return ", then ".join(short(names.get(code, f"{code:03d}")) for code in codes)


def of_behaviour(behaviour_id: str) -> str:
    """A behaviour in words, by its id: role and codes."""
    return said([int(code) for code in behaviour_id.split("-")[1:]])
