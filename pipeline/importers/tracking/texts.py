"""Text of a table as UTF-8, whatever it was written in; its separator; whether it has a header."""

from __future__ import annotations

import codecs
import csv
import re
from typing import NamedTuple

#: Marks at the begin of a text, and what they mean.
_MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))
#: Share of zero bytes among those of one parity, from which on a text is UTF-16 without a mark.
_ZEROS = 0.4
#: What other text is taken for: what Windows writes in western Europe and in the Americas.
_WESTERN = "cp1252"
#: Bytes that are looked at, to tell UTF-16, and that are decoded at once.
_HEAD, _PIECE = 1 << 16, 1 << 20
#: A character beyond ASCII, in UTF-8.
_BEYOND_ASCII = re.compile(rb"[\xc2-\xdf][\x80-\xbf]|[\xe0-\xef][\x80-\xbf]{2}|[\xf0-\xf4][\x80-\xbf]{3}")
_SEPARATORS = (";", "\t", "|", ",")
#: Lines before a header: empty ones, spreadsheets' word for the separator, and remarks of one or two fields.
_BEFORE = re.compile(rb"(?:[ \t]*\r?\n|sep=.\r?\n|#[^\n,;\t|]*[,;\t|]?[^\n,;\t|]*\n)*", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?|nan|inf", re.IGNORECASE)


class Text(NamedTuple):
    """A text, decoded.

    Attributes:
        utf8: it in UTF-8, without a mark.
        note: interpretation of it, if it does not give one itself; else None.
    """

    utf8: bytes
    note: str | None


def as_utf8(data: bytes) -> Text:
    """A text in UTF-8 from its header on, from UTF-8, UTF-16 or Windows-1252 (of which latin-1 is a part).

    UTF-8 that is damaged in places stays as it is. Lines may end with carriage returns.
    """
    text = _in_utf8(data)
    utf8, head = text.utf8, text.utf8[:_HEAD]
    if b"\r" in head and b"\n" not in head:
        utf8 = utf8.replace(b"\r", b"\n")
    if b"\xe2" in utf8:  # as "−" begins, and one byte is found fast
        utf8 = utf8.replace("−".encode(), b"-")
    begin = _BEFORE.match(utf8[:_HEAD])
    return Text(utf8[begin.end():] if begin and begin.end() else utf8, text.note)


def _in_utf8(data: bytes) -> Text:
    for mark, name in _MARKS:
        if data.startswith(mark):
            rest = data[len(mark):]
            return Text(rest if name == "utf-8" else _decoded(rest, name), None)
    head = data[:_HEAD]
    for name, zeros in (("utf-16-le", head[1::2]), ("utf-16-be", head[::2])):
        if zeros and zeros.count(0) >= _ZEROS * len(zeros):
            return Text(_decoded(data, name), "the text has no mark and is read as UTF-16")
    # one wrong byte among right ones is damage; without any right one it is another encoding
    if _is_utf8(data) or _BEYOND_ASCII.search(data):
        return Text(data, None)
    return Text(_decoded(data, _WESTERN), "the text is no UTF-8 and is read as Windows-1252 (latin-1)")


def _decoded(data: bytes, encoding: str) -> bytes:
    """The text in UTF-8; what its encoding does not know becomes a replacement character."""
    decoder = codecs.getincrementaldecoder(encoding)("replace")
    pieces = [decoder.decode(data[at:at + _PIECE]).encode() for at in range(0, len(data), _PIECE)]
    return b"".join([*pieces, decoder.decode(b"", final=True).encode()])


def _is_utf8(data: bytes) -> bool:
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for at in range(0, len(data), _PIECE):
            decoder.decode(data[at:at + _PIECE])
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return False
    return True


def separator(line: str) -> str:
    """Character that separates the fields of a line: semicolon or tab if it is there, else comma.

    A comma beside semicolons is a decimal comma.
    """
    return next((mark for mark in _SEPARATORS if line.count(mark) > 1), ",")


def fields_of_line(line: str, mark: str) -> list[str]:
    """Fields of a line, without quotes and blanks around them; a separator within quotes is none."""
    if '"' in line:
        try:
            return [field.strip(' "') for field in next(csv.reader([line], delimiter=mark))]
        except csv.Error:  # a field that is too long: no table of ours
            return [line]
    return [field.strip(' "') for field in line.split(mark)]


def is_number(text: str) -> bool:
    """True if a field is a number, with a decimal point or a decimal comma."""
    return _NUMBER.fullmatch(text) is not None


def headless(names: list[str]) -> bool:
    """True if the first line of a table is a row and no header: one of its fields is a number."""
    return any(is_number(name) for name in names)
