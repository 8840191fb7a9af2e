"""What a foreign recording is: its content, its format and its identity."""

from __future__ import annotations

import hashlib
import re
import unicodedata
import zlib
from typing import Literal, NamedTuple

from pipeline.errors import BadRecording

Format = Literal["mcap", "rcg", "tracking-parquet", "tracking-csv"]

#: What a user is told when a file is none of these.
SUPPORTED = (
    "Give an MCAP log, a RoboCup 2D text log (.rcg, ULG4 to ULG6) or a tracking table "
    "(Parquet, or CSV with a header); any of them may be gzipped"
)

MAX_BYTES = 2 << 30
#: Deflate can pack a thousandfold; logs of matches were seen to pack 5 to 25 times.
MAX_RATIO = 400
_RATIO_MATTERS_FROM = 64 << 20
#: Deflate makes at most a thousand times as much of it; where the stream is corrupt, so much is lost.
_PIECE = 1 << 12
_PEEK = 1 << 16

_GZIP = b"\x1f\x8b"
_MCAP = b"\x89MCAP0\r\n"
_PARQUET = b"PAR1"
#: Fields that a table of bodies has at least: time, team, player, x, y.
_LEAST_FIELDS = 5


class Content(NamedTuple):
    """The bytes of a recording, unpacked.

    Attributes:
        data: the content.
        damage: why it is not all of it (a gzip stream that is cut or corrupt), else None.
    """

    data: bytes
    damage: str | None


def content(data: bytes, name: str, *, limit: int = MAX_BYTES, ratio: int = MAX_RATIO) -> Content:
    """A recording's content: gunzipped if it is gzipped, else as it is.

    Of a cut or corrupt gzip stream what can be unpacked is kept; its sum is not checked then, so that
    the end may be garbage, which the readers of the formats skip or refuse.

    Args:
        data: the file's bytes.
        name: the file's name, for the message.
        limit: most bytes that are unpacked.
        ratio: most times that more than 64 MiB may be larger than the file.

    Raises:
        BadRecording: if it unpacks to more than that, or if nothing can be unpacked.
    """
    if not data.startswith(_GZIP):
        return Content(data, None)
    chunks: list[bytes] = []
    total = at = 0
    damage = None
    while damage is None and data.startswith(_GZIP, at):
        unpack = zlib.decompressobj(wbits=31)
        while not unpack.eof and damage is None:
            piece = data[at : at + _PIECE]
            try:
                chunks.append(unpack.decompress(piece))
            except zlib.error as error:
                damage = f"the gzip stream is corrupt ({error})"
                break
            at += len(piece) - len(unpack.unused_data)
            total += len(chunks[-1])
            if total > limit or (total > _RATIO_MATTERS_FROM and total > ratio * len(data)):
                raise BadRecording(
                    f"unpacks to more than {total >> 20} MiB from {len(data)} bytes", where=name,
                    next_step="Make sure that it is a recording of one match; unpack it yourself if it is",
                )
            if not piece:
                damage = "the gzip stream is cut off"
    if damage is None and data[at:].strip(b"\0"):
        damage = "the gzip stream is followed by something else"
    if not total and damage is not None:
        raise BadRecording(damage, where=name, next_step="Copy or record it again")
    return Content(b"".join(chunks), damage)


def detect(data: bytes, name: str) -> Format:
    """The format of a recording, from its content and never from its name.

    Args:
        data: the file's bytes, gzipped or not.
        name: the file's name, for the message.

    Raises:
        BadRecording: if it is empty or none of the supported formats.
    """
    head = _peek(data, name)
    if not head:
        raise BadRecording("is empty", where=name, next_step=SUPPORTED)
    if head.startswith(_MCAP):
        return "mcap"
    if head.startswith(_PARQUET):
        return "tracking-parquet"
    if re.match(rb"ULG[\x01-\x0f0-9]", head):
        return "rcg"
    if _is_table(head):
        return "tracking-csv"
    raise BadRecording("is not a recording of a known format", where=name, next_step=SUPPORTED)


def match_id(name: str, data: bytes) -> str:
    """The identity of a match: ``<slug of the name>-<12 hex digits of its content's hash>``.

    The hash does not depend on the name nor on whether the file is gzipped.

    Args:
        name: the file's name; directories and endings do not matter.
        data: the file's bytes.
    """
    return f"{slug(name)}-{hashlib.sha256(content(data, name).data).hexdigest()[:12]}"


def slug(name: str) -> str:
    """A file's stem in at most 40 lower-case ASCII letters, digits and single inner hyphens."""
    base = re.split(r"[/\\]", name)[-1].strip()
    stem = re.sub(r"\.gz$", "", base, flags=re.IGNORECASE)
    stem = re.sub(r"(?<=.)\.[^.]*$", "", stem)
    ascii_stem = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", ascii_stem).strip("-")[:40].rstrip("-") or "match"


def separator(header: str) -> str:
    """What separates the fields of a CSV's header line."""
    return max((",", ";", "\t"), key=header.count)


def _peek(data: bytes, name: str) -> bytes:
    """The first 64 KiB of the content."""
    if not data.startswith(_GZIP):
        return data[:_PEEK]
    try:
        return zlib.decompressobj(wbits=31).decompress(data, _PEEK)
    except zlib.error as error:
        raise BadRecording(
            f"the gzip stream is corrupt ({error})", where=name, next_step="Copy or record it again"
        ) from error


def _is_table(head: bytes) -> bool:
    """Whether it begins like a CSV: a header of names, then as many fields, a number among them."""
    try:
        # the last character may be cut in two
        text = head.decode("utf-8-sig", errors="strict" if len(head) < _PEEK else "ignore")
    except UnicodeDecodeError:
        return False
    lines = text.splitlines()[:2]
    if not lines or "\0" in text:
        return False
    mark = separator(lines[0])
    names = [field.strip(' "') for field in lines[0].split(mark)]
    if len(names) < _LEAST_FIELDS or any(not name or _is_number(name) for name in names):
        return False
    if len(lines) == 1:
        return True
    fields = lines[1].split(mark)
    return len(fields) == len(names) and any(_is_number(field.strip(' "')) for field in fields)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
