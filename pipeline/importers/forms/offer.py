"""Maps for tables that were refused: filled in as far as is known, ready to mend."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.base.text import printable
from pitchlore.pipeline.importers.forms.naming import by_words
from pitchlore.pipeline.importers.forms.presets import presets
from pitchlore.pipeline.importers.forms.words import meant
from pitchlore.pipeline.importers.tracking.columns import REQUIRED
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap

#: Columns of the file that a map names in its comments, and characters of each.
_SHOWN, _CHARACTERS = 200, 60
#: Columns that are offered beside those that are needed.
_MORE = ("frame", "heading", "period", "score_home", "score_away", "game_state")


@contextmanager
def offering(found: Sequence[str], mapping: TrackingMap) -> Iterator[None]:
    """Refusals of a table within the body bring a map along (``offer``), if any of its columns is recognised.

    Where a form that is known has all its columns in the table, the refusal names it.

    Args:
        found: the file's columns.
        mapping: the map that was given.
    """
    try:
        yield
    except BadRecording as error:
        form = next((name for name, preset in presets().items() if _fits(preset, found)), None)
        if form is not None and mapping == TrackingMap():
            error.next_step = f"It looks like the form {form}: --as {form}. Or: {error.next_step}"
        error.offer = _offer(found, mapping, error, form) if len(found) >= len(REQUIRED) else ""
        raise


def _fits(preset: dict[str, Any], found: Sequence[str]) -> bool:
    """True if a table has all columns that a form names."""
    columns = [*preset.get("columns", {}).values(), *preset.get("teams", {}).get("named_by", {}).values()]
    bodies = preset.get("bodies", {}).values()
    return len(columns) > 1 and {*columns, *(name for body in bodies for name in body.values())} <= {*found}


def _offer(found: Sequence[str], mapping: TrackingMap, error: BadRecording, form: str | None) -> str:
    """The text of a map; empty if nothing of the table is recognised."""
    given = mapping.columns.model_dump(include=mapping.columns.model_fields_set)
    named, _ = by_words(found, mapping, (*REQUIRED, *_MORE))
    columns = {ours: theirs for ours, theirs in named.columns.model_dump().items() if theirs in found} | given
    taken = {str(theirs) for theirs in columns.values()}
    lines = [f"# {printable(error.where)} {printable(error.what)}.", f"# {printable(error.next_step)}.", ""]
    if form is not None:
        lines += [f'form = "{form}"  # {presets()[form]["title"]}', ""]
    lines += ["# The columns of the file:"]
    shown = [printable(name, _CHARACTERS) for name in found[:_SHOWN]]
    lines += [f"#   {', '.join(shown[at:at + 10])}" for at in range(0, len(shown), 10)]
    if form is None:
        lines += ["", "[columns]"]
        for ours in (*REQUIRED, *_MORE):
            near = columns.get(ours) or meant(ours, ours, found, taken)
            known = ours in columns
            value = json.dumps(printable(near, _CHARACTERS) if isinstance(near, str) else near or "?")
            lines.append(f"{'' if known else '# '}{ours} = {value}")
        if not columns:
            return ""
    units = named.units.model_dump(include=named.units.model_fields_set, exclude_none=True)
    usual = {"length": "m", "time": "s", "angle": "deg"}
    lines += ["", "[units]  # lengths: m, cm, mm, share, percent; times: s, ms, us, min; angles: deg, rad"]
    lines += [_line(key, units, word) for key, word in usual.items()]
    lines += ["", "[time]  # if the time counts samples", "# hz = 10"]
    lines += ["", "[axes]", '# origin = "corner"', '# y = "down"']
    lines += ["", "[pitch]", '# kind = "vsss"  # or ssl, 2d, human']
    teams = mapping.teams.model_dump(include=mapping.teams.model_fields_set)
    lines += ["", "[teams]  # the file's words"]
    lines += [_line(key, teams, "?") for key in ("home", "away", "ball")]
    return "\n".join(lines) + "\n"


def _line(key: str, known: dict[str, Any], usual: str) -> str:
    """The line of a key; a comment if its value is not known."""
    return f"{'' if key in known else '# '}{key} = {json.dumps(known.get(key, usual))}"
