"""Columns by other words: a table's names for ours, without case, in several languages, with their units."""

from __future__ import annotations

import re
from collections.abc import Sequence

from pitchlore.pipeline.importers.forms.words import WORDS_OF, bare
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap

#: Units that a column's name may end with, by key of a map's [units].
_UNITS = {
    "length": {"m": "m", "metres": "m", "meters": "m", "cm": "cm", "mm": "mm"},
    "time": {"s": "s", "sec": "s", "secs": "s", "seconds": "s", "segundos": "s", "ms": "ms",
             "milliseconds": "ms", "us": "us", "ns": "ns"},
    "angle": {"rad": "rad", "radians": "rad", "deg": "deg", "degrees": "deg", "graus": "deg"},
}
_UNIT_OF = {"x": "length", "y": "length", "t": "time", "heading": "angle"}
#: Words of these columns that mean little else: others are offered, not taken.
_SURE = {"game_state": "gamestate playmode estadojogo estadodojogo", "segment": "segment segmento"}
_SIGNS = re.compile(r"[^0-9A-Za-zÀ-ÿ]+")


def by_words(found: Sequence[str], mapping: TrackingMap, wanted: Sequence[str]) -> tuple[TrackingMap, str]:
    """The map with columns that the file calls by another word of ours, and what was taken for what.

    A column that the map names, or that the file calls as we do, stays. ``time`` is the team where another
    column is the time and none the team, as in Portuguese.

    Args:
        found: the file's columns.
        mapping: the map.
        wanted: our names of the columns that are looked for.

    Returns:
        The map, with the units that the columns' names end with; and words for a flaw, or none.
    """
    given = mapping.columns.model_fields_set
    taken = {str(theirs) for ours, theirs in mapping.columns if ours in given or theirs in found}
    free: dict[str, tuple[str, str | None]] = {}
    for name in reversed([name for name in found if name not in taken]):
        whole, word, unit = bare(name), *_without_unit(name)
        free[whole] = (name, None)
        if unit is not None and word:
            free.setdefault(word, (name, unit))
    columns: dict[str, str] = {}
    units: dict[str, set[str]] = {}
    for ours in wanted:
        if ours in given or getattr(mapping.columns, ours) in found:
            continue
        words = _SURE.get(ours, WORDS_OF.get(ours, "")).split()
        if ours == "team" and "t" in columns and bare(columns["t"]) != "time":
            words.append("time")
        named = (free[word] for word in words if word in free)
        there = next((column for column in named if column[0] not in columns.values()), None)
        if there is None:
            continue
        columns[ours] = there[0]
        unit = there[1] or _ending(bare(there[0]), ours)
        if unit in _UNITS.get(_UNIT_OF.get(ours, ""), {}):
            units.setdefault(_UNIT_OF[ours], set()).add(_UNITS[_UNIT_OF[ours]][unit])
    settled = {key: words.pop() for key, words in units.items()
               if len(words) == 1 and key not in mapping.units.model_fields_set}
    if not columns:
        return mapping, ""
    said = [f"{theirs} for {ours}" for ours, theirs in columns.items()]
    said += [f'{key} in "{unit}"' for key, unit in settled.items()]
    return mapping.model_copy(update={
        "columns": mapping.columns.model_copy(update=columns),
        "units": mapping.units.model_copy(update=settled),
    }), "columns were taken by their words: " + ", ".join(said)


def _without_unit(name: str) -> tuple[str, str | None]:
    """A column's name without the unit at its end, and that unit: ``Tempo (ms)``."""
    parts = [part for part in _SIGNS.split(name) if part]
    ending = parts[-1].lower() if len(parts) > 1 else ""
    known = any(ending in words for words in _UNITS.values())
    return (bare("".join(parts[:-1])).removesuffix("in"), ending) if known else (bare(name), None)


def _ending(word: str, ours: str) -> str | None:
    """The unit in a word that is one with it: ``xcm``, ``ms``."""
    if ours == "t":
        return word if word in _UNITS["time"] and word != "s" else None
    return next((unit for unit in ("cm", "mm", "deg") if word.endswith(unit)), None)
