"""Text of strangers: made printable once, where it comes in."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from contextlib import suppress
from datetime import UTC, datetime
from difflib import get_close_matches

#: Most characters of a name that a recording gives.
NAME_CHARACTERS = 200
#: A day, and perhaps a time of it, as names of files have them: 2026-09-12, 20260912T1530, 20260912153005.
_DAY = re.compile(
    r"(?<!\d)(?P<year>20\d\d)([-_.]?)(?P<month>\d\d)\2(?P<day>\d\d)"
    r"(?:[T_ -]?(?P<hour>[01]\d|2[0-3])[:h._-]?(?P<minute>[0-5]\d)(?:[:._-]?(?P<second>[0-5]\d))?)?(?!\d)")


def printable(text: str, most: int | None = None) -> str:
    r"""The text without anything that a terminal, a page or a log would not print.

    Control characters (newlines and ESC among them), marks that change the direction of writing, and bytes
    of a file name that are not UTF-8 become escapes such as ``\x1b``. Spaces of all kinds become ``" "``.

    Args:
        text: any text, also with lone surrogates.
        most: greatest length; what is longer ends with ``…``.
    """
    if not text.isprintable():
        text = "".join(c if c.isprintable() else _escaped(c) for c in text)
    return text if most is None or len(text) <= most else f"{text[:most - 1]}…"


def without_password(text: str) -> str:
    """The text with ``…`` for whoever is named before the host in a URL, a password among it."""
    return re.sub(r"(?<=://)[^/@\s]+(?=@)", "…", text)


def date_in(name: str) -> datetime | None:
    """The first date in a file's name, with its time of day if it has one, taken as UTC; None without one."""
    for found in _DAY.finditer(name):
        with suppress(ValueError):  # no day of the calendar
            return datetime(**{part: int(it) for part, it in found.groupdict("0").items()}, tzinfo=UTC)
    return None


def number_of(count: int, noun: str) -> str:
    """A number of things, such as "1 goal" or "2 goals"; the noun has a regular plural."""
    return f"{count:,} {noun if count == 1 else f'{noun}s'}"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """A question for the known word that is near to another, such as " (did you mean best?)", or ""."""
    near = get_close_matches(word, [*known], 1)
    return f" (did you mean {near[0]}?)" if near else ""


def as_markdown(text: str) -> str:
    """The text as Markdown that shows it: no link, picture, table or HTML of a stranger's comes of it."""
    return re.sub(r"([\\`*_{}\[\]()<>#+!|~&:.-])", r"\\\1", printable(text))


def _escaped(character: str) -> str:
    if unicodedata.category(character) == "Zs":
        return " "
    if "\udc80" <= character <= "\udcff":  # a byte of a file name
        return f"\\x{ord(character) - 0xDC00:02x}"
    return character.encode("unicode_escape").decode()
