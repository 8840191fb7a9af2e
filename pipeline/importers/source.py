"""A recording's bytes: opened once, inflated once, hashed once, and named."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.packing import Octets, Unpacking
from pitchlore.pipeline.settings import ImportSettings

#: Bytes of a content that is in memory that are given at once.
_PIECE = 1 << 20
#: How much more content than a file a streamed format may have, as a factor.
_STREAMED = 16


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A recording that was opened: all that a reader needs of the file.

    Attributes:
        name: the file's name, for messages.
        content: its bytes, unpacked if the file is packed; b"" if its format is streamed.
        damage: why bytes are missing from its content (a packed stream that is cut or corrupt), else None.
        format: name of the reader in ``readers.READERS`` that recognises the content, else None.
        sha256: SHA-256 of its content in hex.
        match_id: identity of the match, ``<slug of the name>-<12 hex digits of sha256>``.
        limits: bounds of reading's cost.
        packed: the file's bytes as they are, if its format is streamed, else None.
        parts: content of each file of a recording that is of several; ``content`` is then empty.
        provider: provider of the files, a key of ``football.providers.PROVIDERS``; None for other recordings.
        number: number of the match that is asked for, if it has several one after the other.
    """

    name: str
    content: bytes = field(repr=False)
    damage: str | None
    format: str | None
    sha256: str
    match_id: str
    limits: ImportSettings = ImportSettings()
    packed: Octets | None = field(default=None, repr=False, compare=False)
    parts: tuple[bytes, ...] = field(default=(), repr=False)
    provider: str | None = None
    number: int = 1

    def pieces(self) -> Iterator[bytes]:
        """The content in pieces; a streamed format's is unpacked anew each time, never whole in memory."""
        if self.packed is not None:
            yield from Unpacking(self.packed, self.name, streamed_megabytes(self.limits))
            return
        for at in range(0, len(self.content), _PIECE):
            yield self.content[at : at + _PIECE]

    def named(self, match_id: str) -> SourceFile:
        """The same recording under another id of its match."""
        return replace(self, match_id=match_id)

    def numbered(self, number: int) -> SourceFile:
        """The same recording asked for another of its matches, as a recording of its own."""
        if number == 1:
            return self
        return replace(self, number=number, sha256=part_sha256(self.sha256, number),
                       match_id=f"{self.match_id}-{number}")

    def too_much(self, what: str, limit: str) -> BadRecording:
        """The refusal of a file that exceeds a limit.

        Args:
            what: thing of which it has too much.
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


def part_sha256(sha256: str, number: int) -> str:
    """SHA-256 by which a match of a recording of several is known; the first has the recording's own."""
    return sha256 if number == 1 else digest(f"{sha256} {number}".encode())


def inflate(data: bytes, name: str, megabytes: int = ImportSettings().megabytes) -> tuple[bytes, str | None]:
    """Content of a file, and why bytes of it are missing (else None): unpacked if it is packed.

    Args:
        data: the file's bytes.
        name: the file's name, for messages.
        megabytes: greatest size of the content.

    Raises:
        BadRecording: as for ``packing.Unpacking``.
    """
    unpacking = Unpacking(data, name, megabytes)
    content = b"".join(unpacking)
    return content, unpacking.damage


def streamed_megabytes(limits: ImportSettings) -> int:
    """Greatest size of the content of a streamed format, MiB: it does not decide how much memory is used."""
    return _STREAMED * limits.megabytes


def slug(name: str) -> str:
    """Stem of a file's name in at most 40 lower-case ASCII letters, digits and single inner hyphens.

    Folders and endings do not matter.
    """
    base = re.split(r"[/\\]", name)[-1].strip()
    stem = re.sub(r"\.(gz|zst)$", "", base, flags=re.IGNORECASE)
    stem = re.sub(r"(?<=.)\.[^.]*$", "", stem)
    ascii_stem = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", ascii_stem).strip("-")[:40].rstrip("-") or "match"
