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


def container_flaws(found: Survey, source: SourceFile, when: When) -> tuple[list[Flaw], list[str]]:
    """Flaws of a log, and the reasons why it is not complete.

    Args:
        found: its survey.
        source: the file.
        when: time of what was received at a time.
    """
    damage = found.damage
    rows: list[Flaw] = []
    reasons: list[str] = []
    if source.damage is not None:
        reasons.append(source.damage)
        rows.append(Flaw("truncated", source.damage, start_ns=when(_last(found))))
    if damage.cut:
        reasons.append("the log is cut off")
        rows.append(Flaw("truncated", f"the log is cut off: its last {damage.cut} bytes are no whole message",
                         start_ns=when(_last(found))))
    places = damage.skipped[:_SHOWN]
    rows.extend(Flaw("damaged record", f"{size} bytes in which no message was found: left out",
                     start_ns=when(received)) for received, size in places)
    if more := damage.skipped[_SHOWN:]:
        note = f"places without a message, {sum(size for _, size in more)} bytes: left out"
        rows.append(Flaw("damaged record", note, len(more), when(more[0][0])))
    if damage.skipped:
        reasons.append(f"{len(damage.skipped)} damaged places")
    if found.damaged:
        rows.append(Flaw("damaged record", "referee packets that cannot be decoded", found.damaged))
    for kind, count in sorted(found.unread.items()):
        rows.append(Flaw("skipped", f"messages of type {kind}, which is not read", count))
    used = [part for part in found.parts[: found.used] if part.messages]
    rows.extend(Flaw("skipped", "the header of a further log in the file: read on, it is of the same time",
                     start_ns=when(before.last)) for before in used[:-1])
    left = sum(part.messages for part in found.parts[found.used :])
    if left:
        reasons.append("the file has another log of another time")
        note = "messages of a further log in the file, which is of another time: split the file to import it"
        rows.append(Flaw("skipped", note, left))
    return rows, reasons


def _last(found: Survey) -> int | None:
    """When the last message that is used was received."""
    used = [part for part in found.parts[: found.used] if part.messages]
    return used[-1].last if used else None
