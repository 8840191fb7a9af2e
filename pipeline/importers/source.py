"""A recording's bytes: opened once, inflated once, hashed once, and named."""

from __future__ import annotations

import re
import unicodedata
import zlib
from dataclasses import dataclass, field

from pipeline.errors import BadRecording

#: Most bytes that a recording is inflated to.
MAX_BYTES = 2 << 30
#: Highest compression ratio. Deflate reaches 1,000; recordings of matches were seen to have 5 to 25.
MAX_RATIO = 400
_RATIO_MATTERS_FROM = 64 << 20
#: Compressed bytes that are inflated at once. If the stream is corrupt, the piece with the damage is lost.
_PIECE = 1 << 12
_GZIP = b"\x1f\x8b"


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A recording that was opened: all that a reader needs of the file.

    Attributes:
        name: the file's name, for messages.
        content: its bytes, inflated if the file is gzipped.
        damage: why bytes are missing from ``content`` (a gzip stream that is cut or corrupt), else None.
        format: name of the reader in ``readers.READERS`` that recognises the content, else None.
        sha256: SHA-256 of ``content`` in hex.
        match_id: identity of the match, ``<slug of the name>-<12 hex digits of sha256>``.
    """

    name: str
    content: bytes = field(repr=False)
    damage: str | None
    format: str | None
    sha256: str
    match_id: str


def inflate(data: bytes, name: str) -> tuple[bytes, str | None]:
    """Content of a file, and why bytes of it are missing (else None): gunzipped if it is gzipped.

    A cut or corrupt gzip stream is inflated up to the damage. Its checksum is not verified then, and
    the last bytes may be garbage; the readers skip or refuse those.

    Args:
        data: the file's bytes.
        name: the file's name, for messages.

    Raises:
        BadRecording: if no byte can be inflated, or if the content exceeds ``MAX_BYTES``, or 64 MiB and
            ``MAX_RATIO``.
    """
    if not data.startswith(_GZIP):
        return data, None
    chunks: list[bytes] = []
    total = at = 0
    damage = None
    while damage is None and data.startswith(_GZIP, at):
        stream = zlib.decompressobj(wbits=31)
        while not stream.eof and damage is None:
            piece = data[at : at + _PIECE]
            try:
                chunks.append(stream.decompress(piece))
            except zlib.error as error:
                damage = f"the gzip stream is corrupt ({error})"
                break
            at += len(piece) - len(stream.unused_data)
            total += len(chunks[-1])
            if total > MAX_BYTES or (total > _RATIO_MATTERS_FROM and total > MAX_RATIO * len(data)):
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
    return b"".join(chunks), damage


def slug(name: str) -> str:
    """Stem of a file's name in at most 40 lower-case ASCII letters, digits and single inner hyphens.

    Folders and endings do not matter.
    """
    base = re.split(r"[/\\]", name)[-1].strip()
    stem = re.sub(r"\.gz$", "", base, flags=re.IGNORECASE)
    stem = re.sub(r"(?<=.)\.[^.]*$", "", stem)
    ascii_stem = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", ascii_stem).strip("-")[:40].rstrip("-") or "match"
