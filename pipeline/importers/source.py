"""A recording's bytes: opened once, inflated once, hashed once, and named."""

from __future__ import annotations

import re
import unicodedata
import zlib
from dataclasses import dataclass, field, replace

from pipeline.errors import BadRecording
from pipeline.settings import ImportSettings

#: Highest compression ratio. Deflate reaches 1,000; recordings of matches were seen to have 5 to 25.
MAX_RATIO = 400
#: Most gzip streams in one file; rotated logs have a few.
_MEMBERS = 1_000
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
        limits: what reading it may cost.
    """

    name: str
    content: bytes = field(repr=False)
    damage: str | None
    format: str | None
    sha256: str
    match_id: str
    limits: ImportSettings = ImportSettings()

    def named(self, match_id: str) -> SourceFile:
        """The same recording under another id of its match."""
        return replace(self, match_id=match_id)

    def too_much(self, what: str, limit: str) -> BadRecording:
        """The refusal of a file that exceeds a limit.

        Args:
            what: what it has too much of.
            limit: name of the limit in the settings.
        """
        return BadRecording(
            f"has {what}, more than the limit {limit} = {getattr(self.limits, limit)}", where=self.name,
            next_step=f"Split it into matches; if you trust it, raise {limit} in the [imports] settings",
        )

    def check_text(self) -> None:
        """Check the lines of a text against the limits, before it is parsed.

        Raises:
            BadRecording: if it has too many lines, or one that is too long.
        """
        lines = self.content.count(b"\n")
        if lines > self.limits.rows:
            raise self.too_much(f"{lines} lines", "rows")
        longest = self.limits.line_kilobytes << 10
        for start in range(0, len(self.content), longest):  # a line of twice that spans a whole stretch
            if self.content.find(b"\n", start, start + longest) < 0 and len(self.content) - start >= longest:
                end = self.content.find(b"\n", start) % (len(self.content) + 1)
                length = end - self.content.rfind(b"\n", 0, start)
                raise self.too_much(f"a line of {length} bytes", "line_kilobytes")


def inflate(data: bytes, name: str, megabytes: int = ImportSettings().megabytes) -> tuple[bytes, str | None]:
    """Content of a file, and why bytes of it are missing (else None): gunzipped if it is gzipped.

    A cut or corrupt gzip stream is inflated up to the damage. Its checksum is not verified then, and
    the last bytes may be garbage; the readers skip or refuse those.

    Args:
        data: the file's bytes.
        name: the file's name, for messages.
        megabytes: greatest size of the content.

    Raises:
        BadRecording: if no byte can be inflated, or if the content exceeds its greatest size, or, beyond
            64 MiB, ``MAX_RATIO`` times the bytes that it was inflated from so far: a bomb is refused as soon
            as it is one, and not once it has grown to the ratio of the whole file.
    """
    if not data.startswith(_GZIP):
        return data, None
    chunks: list[bytes] = []
    total = at = members = 0
    damage = None
    while damage is None and data.startswith(_GZIP, at):
        members += 1
        if members > _MEMBERS:
            raise BadRecording(f"has more than {_MEMBERS} gzip streams", where=name,
                               next_step="Unpack it yourself if it is a recording of one match")
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
            if total > megabytes << 20 or (total > _RATIO_MATTERS_FROM and total > MAX_RATIO * at):
                raise BadRecording(
                    f"unpacks to more than {total >> 20} MiB from {at} bytes", where=name,
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
