"""Behaviours in words: their situations one after another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pitchlore.pipeline.numbers.estimates import FALSE_AT_MOST
from pitchlore.pipeline.stages.situations.rules import TABLE_1
from pitchlore.schemas.behaviours import SHOWN_FROM

#: Names of the situations, by code.
NAMES = {code: name for code, (name, _) in TABLE_1.items()}


#: What table answers says of acts that chance may explain.
TOO_FEW = "too few"


def sure_words(says: str) -> str:
    """How sure a sentence of a card is, as people read it; ``says`` is that of schema Answers."""
    return "may be chance" if says == TOO_FEW else says


#: Titles of the situations, two words at most: those of four make a title of eight.
TITLES = {
    1: "has ball", 11: "guides ball", 21: "kicks ball", 22: "loses ball", 23: "yields ball",
    33: "leaves ball", 34: "avoids ball", 44: "reaches ball", 45: "receives ball", 46: "nears ball",
    47: "is hit", 57: "faces ball", 67: "follows lengthways", 68: "follows sideways", 78: "faces back",
    88: "drops back", 98: "moves up", 108: "faces forward", 118: "nears goal", 128: "leaves goal",
    138: "nears goalkeeper", 139: "nears midfield", 140: "nears striker", 150: "leaves goalkeeper",
    151: "leaves midfield", 152: "leaves striker", 162: "nears mate+1", 163: "nears mate+2",
    173: "leaves mate+1", 174: "leaves mate+2", 184: "stands still", 194: "moves randomly",
}
assert TITLES.keys() == NAMES.keys()


def titled(codes: Sequence[int]) -> str:
    """Situations as a title of a few words; a code that has none stands for itself."""
    title = " → ".join(TITLES.get(code, f"{code:03d}") for code in codes)
    return title[:1].upper() + title[1:]


def short(name: str) -> str:
    """A situation's name within a phrase: of the robot that is spoken of."""
    within = name.removeprefix("Robot ")
    return within[:1].lower() + within[1:]


def said(codes: Sequence[int], names: Mapping[int, str] = NAMES) -> str:
    """Situations in words; a code that has no name stands for itself."""
    return ", then ".join(short(names.get(code, f"{code:03d}")) for code in codes)


def went_with(row: Mapping[str, Any]) -> str:
    """The side of chances that went with a behaviour, and how sure that is; no effect of doing it is meant.

    *Sure*: among those that are as sure, at most 5 % false ones are expected. *Likely*: the 95 % interval of
    its value excludes 0. *Too few*: seen fewer than five times, or the interval has 0 in it.

    Args:
        row: support, value, low, high and q of schema Behaviours.
    """
    side = "better" if row["value"] > 0 else "worse"
    if row["support"] < SHOWN_FROM or row["low"] is None or row["low"] <= 0 <= row["high"]:
        return f"went with {side} chances: too few"
    sure = row["q"] is not None and row["q"] <= FALSE_AT_MOST
    return f"went with {side} chances: {'sure' if sure else 'likely'}"


def of_behaviour(behaviour_id: str) -> str:
    """A behaviour as a title, by its id: role and codes."""
    return titled([int(code) for code in behaviour_id.split("-")[1:]])
