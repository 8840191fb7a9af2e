"""Stamina of the players, from some of the show lines."""

from __future__ import annotations

import re
from typing import Any

from pitchlore.pipeline.importers.rcg.lines import ParsedLines
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.schemas import SIDES

_NUMBER = rb"(\d{1,6}(?:\.\d{1,9})?)"
#: Side, number and state of a player, and its group ``(s stamina effort recovery capacity)``, in version 4
#: without the capacity.
_PLAYER = re.compile(
    rb"\(\(([lr]) (\d{1,2})\) -?\d+ (0x[0-9a-f]{1,8}|\d{1,9}) (?:(?!\(\([lr] ).)*?\(s "
    + b" ".join([_NUMBER] * 3) + rb"(?: " + _NUMBER + rb")?\)")


def stamina_of(record: ParsedLines, t_ns: I64) -> dict[str, list[Any]]:
    """Columns of schema Stamina without the match: of each line that is kept, the players on the pitch.

    Args:
        record: the log.
        t_ns: int64 [F], time of each show line.
    """
    rows: list[dict[str, Any]] = []
    for index, line in record.kept:
        for side, number, state, stamina, effort, recovery, capacity in _PLAYER.findall(line):
            if int(state, 16 if b"x" in state else 10) & 1:
                rows.append({
                    "t_ns": int(t_ns[index]), "team": SIDES[side == b"r"], "robot": int(number),
                    "stamina": float(stamina), "effort": float(effort), "recovery": float(recovery),
                    "capacity": float(capacity) if capacity else None})
    rows.sort(key=lambda row: (row["t_ns"], row["team"] == SIDES[1], row["robot"]))
    return {name: [row[name] for row in rows] for name in rows[0]} if rows else {}
