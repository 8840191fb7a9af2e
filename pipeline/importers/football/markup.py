"""XML of strangers, made safe before a library sees it.

Libraries load what a document type definition (DTD) names: other files into a team's name, pipes that never
end, texts that grow a thousandfold at each step. No provider's file has one. Here each is refused, and what
is handed on is UTF-8 that says so: no parser reads other letters in it than those that were checked.

Source: Extensible Markup Language (XML) 1.0, section 4.3.3 and appendix F (encodings).
"""

from __future__ import annotations

import codecs
import re
from xml.parsers import expat

from pitchlore.pipeline.base.errors import BadRecording

#: Encodings by the bytes that a text begins with: marks of the byte order, else its first "<".
_BEGINNINGS = (
    (codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"), (b"\0\0\0<", "utf-32-be"),
    (b"<\0\0\0", "utf-32-le"), (b"\0<", "utf-16-be"), (b"<\0", "utf-16-le"),
)
#: Encodings that a file may declare whose ASCII is that of UTF-8; UTF-16 is then declared by mistake.
_DECLARED = re.compile(r"utf-?(8|16)|(us-?)?ascii|iso-?8859-\d{1,2}|latin-?\d|(windows-|cp)125\d")
_DECLARATION = re.compile(rb"<\?xml\s[^<>]*\?>")
_ENCODING = re.compile(rb"""\sencoding\s*=\s*["']([^"']*)["']""")
_OURS = b'<?xml version="1.0" encoding="UTF-8"?>'
_DTD = re.compile(rb"<!(?i:doctype|entity)")
#: Separators of an EPTS file's fields, each a word of kloppy's expression for a line.
_SEPARATORS = frozenset(",;:")
#: Attributes that are names in that expression, by the element that has them.
_NAMES = {
    "StringRegister": ("name",), "BallChannelRef": ("channelId",), "PlayerChannel": ("playerId", "channelId"),
}
#: Most bytes of EPTS's metadata: those of a match are 50 kB.
_METADATA = 16 << 20


def safe_xml(content: bytes, name: str) -> bytes:
    """XML without a DTD, as UTF-8 that says so.

    Args:
        content: the file's bytes, unpacked, in any encoding.
        name: the file's name, for messages.

    Raises:
        BadRecording: if it is not XML in an encoding that is read here, or has a DTD.
    """
    encoding = next((known for mark, known in _BEGINNINGS if content.startswith(mark)), None)
    if encoding is not None:
        content = _decoded(content, encoding, name)
    declaration = _DECLARATION.match(content)
    if declaration is not None:
        said = _ENCODING.search(declaration[0])
        declared = "utf-8" if said is None else said[1].decode("latin-1").lower().replace("_", "-")
        content = content[declaration.end():]
        if encoding is None and declared != "utf-8":
            if not _DECLARED.fullmatch(declared):
                raise _unread(declared, name)
            content = _decoded(content, "utf-8" if declared.startswith("utf") else declared, name)
    if not re.match(rb"\s*<", content):
        raise BadRecording("is not XML in UTF-8, UTF-16, UTF-32 or an encoding of Europe", where=name,
                           next_step="Give the provider's own file, or save it as UTF-8")
    found = _DTD.search(content)
    if found is not None:
        raise BadRecording(f"has {found[0].decode()}, by which XML reads other files", where=name,
                           next_step="Ask whoever gave it for the provider's own file")
    return _OURS + content


def safe_xml_or_json(content: bytes, name: str) -> bytes:
    """JSON as it is, else :func:`safe_xml`.

    Raises:
        BadRecording: as :func:`safe_xml`.
    """
    json = content.removeprefix(codecs.BOM_UTF8).lstrip().startswith((b"{", b"["))
    return content if json else safe_xml(content, name)


def safe_epts(content: bytes, name: str) -> bytes:
    """Metadata of EPTS as :func:`safe_xml`, whose separators and names are no expressions.

    Kloppy makes one regular expression of them for a line of the data. It takes no step twice if no separator
    is that of a part which it lies in: otherwise a line of a hundred bytes could take years.

    Raises:
        BadRecording: as :func:`safe_xml`, or if a separator or a name could mean something else there.
    """
    content = safe_xml(content, name)
    if len(content) > _METADATA:
        raise BadRecording(f"has {len(content) >> 20} MiB, more than metadata have", where=name,
                           next_step="Give the metadata first, then the tracking data")
    left, parts = set(_SEPARATORS), list[str | None]()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        mark = attributes.get("separator")
        parts.append(mark)
        if mark is not None:
            if mark not in left:
                raise BadRecording(
                    f"separates fields by {mark!r}", where=name,
                    next_step="Give data that commas, semicolons and colons separate, each at one depth")
            left.remove(mark)
        for word in _NAMES.get(tag.rpartition(":")[2], ()):
            if not f"_{attributes.get(word, '')}".isidentifier():
                raise BadRecording(f"has the name {attributes[word]!r}", where=name,
                                   next_step="Name players and channels by letters and digits")

    def end(_: str) -> None:
        left.update(_SEPARATORS & {parts.pop()})

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise BadRecording(f"is not XML ({error})", where=name, next_step="Copy it again") from error
    return content


def _decoded(content: bytes, encoding: str, name: str) -> bytes:
    """The content in UTF-8.

    Raises:
        BadRecording: if it cannot be decoded.
    """
    try:
        return content.decode(encoding).encode()
    except (LookupError, ValueError) as error:
        raise _unread(encoding, name) from error


def _unread(encoding: str, name: str) -> BadRecording:
    return BadRecording(f"cannot be read in the encoding {encoding[:40]}", where=name,
                        next_step="Save it as UTF-8")
