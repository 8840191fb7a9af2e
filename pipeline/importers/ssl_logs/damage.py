"""Flaws of an SSL log as a file: what is missing of it, and why."""

from __future__ import annotations

from collections.abc import Callable

from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.ssl_logs.survey import Survey
from pitchlore.pipeline.matches.quality import Flaw

#: Damaged places that have a row each.
_SHOWN = 100
#: Time in the match of a packet, by when it was received; None is the start.
When = Callable[[int | None], int | None]


def container_flaws(
    found: Survey, source: SourceFile, when: When, *, whole: bool, last: bool
) -> tuple[list[Flaw], list[str]]:
    """Flaws of a match's part of a log, and the reasons why it is not complete.

    Args:
        found: its survey.
        source: the file.
        when: time of what was received at a time.
        whole: whether it is the only match of the file.
        last: whether it is the last match of the file, which has the file's end.
    """
    damage = found.damage
    rows: list[Flaw] = []
    reasons: list[str] = []
    there = [part for part in found.parts if part.messages]
    if source.damage is not None and last:
        reasons.append(source.damage)
        rows.append(Flaw("truncated", source.damage, start_ns=when(there[-1].last)))
    if damage.cut and last:
        reasons.append("the log is cut off")
        rows.append(Flaw("truncated", f"the log is cut off: its last {damage.cut} bytes are no whole message",
                         start_ns=when(there[-1].last)))
    skipped = [(received, size) for received, size in damage.skipped if whole or _is_in(received, found)]
    places = skipped[:_SHOWN]
    rows.extend(Flaw("damaged record", f"{size} bytes in which no message was found: left out",
                     start_ns=when(received)) for received, size in places)
    if more := skipped[_SHOWN:]:
        note = f"places without a message, {sum(size for _, size in more)} bytes: left out"
        rows.append(Flaw("damaged record", note, len(more), when(more[0][0])))
    if skipped:
        reasons.append(f"{len(skipped)} damaged places")
    if found.damaged:
        rows.append(Flaw("damaged record", "referee packets that cannot be decoded", found.damaged))
    if found.unheard:
        note = "packets of another game controller: who sent the most is heard"
        rows.append(Flaw("skipped", note, found.unheard))
    for kind, count in sorted(found.unread.items()):
        rows.append(Flaw("skipped", f"messages of type {kind}, which is not read", count))
    rows.extend(Flaw("skipped", "the header of a further log in the file: read on, it is of the same match",
                     start_ns=when(before.last)) for before in there[:-1])
    return rows, reasons


def _is_in(received: int | None, found: Survey) -> bool:
    """True if what was received at a time, or at the start, is in a part of the file that was surveyed."""
    there = [part for part in found.parts if part.messages]
    if received is None:
        return there[0].order == 0
    return any(min(part.first, part.last) <= received <= max(part.first, part.last) for part in there)
