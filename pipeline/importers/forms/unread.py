"""Files that are met beside recordings and are not read: what each is, and what to do with it."""

from __future__ import annotations

import re
from typing import NamedTuple

from pitchlore.pipeline.importers.forms.words import WORDS, bare


class Unread(NamedTuple):
    """A kind of file that is not read by itself: its begin, what it is, and the user's next step."""

    begins: re.Pattern[bytes]
    what: str
    next_step: str


def _kind(begins: bytes, what: str, next_step: str) -> Unread:
    """A kind of file, by an expression of how it begins."""
    return Unread(re.compile(begins, re.DOTALL), what, next_step)


def _football(begins: bytes, whose: str, provider: str, files: str) -> Unread:
    """A provider's kind of file, and how its files are given."""
    step = f"Give its files: pitchlore import --from kloppy:{provider} {files}"
    return _kind(begins, f"looks like {whose}", step)


#: Kinds by how they begin; the first that fits counts. A key of JSON is looked for in the first object.
KINDS = (
    _kind(rb"PK\x03\x04.{0,400}(?:xl/|\[Content_Types\])", "is a spreadsheet of Excel",
          "Save its sheet of positions as CSV"),
    _kind(rb"PK\x03\x04", "is a zip archive", "Unpack it, and give the recordings in it"),
    _kind(rb"BZh|\xfd7zXZ\0|7z\xbc\xaf|Rar!|.{257}ustar", "is packed with bzip2, xz, 7-Zip, RAR or tar",
          "Unpack it, and give the recordings in it"),
    _kind(rb"\x1f\x8b|\x28\xb5\x2f\xfd", "is packed twice", "Unpack it once"),
    _kind(rb"version https://git-lfs", "is a pointer of Git LFS, and not the file itself",
          "Fetch it where you have the repository: git lfs pull"),
    _kind(rb"%PDF", "is a PDF", "Give the recording that it was made of"),
    _kind(rb"SQLite format 3\0", "is a database of SQLite, which rosbag2 records into (.db3)",
          "Convert it: mcap convert FILE.db3 FILE.mcap"),
    _kind(rb"#ROSBAG V", "is a bag of ROS 1",
          "Convert it: rosbags-convert --src FILE --dst FOLDER --dst-storage mcap"),
    _kind(rb"\d+,\d+\t(?:Recv |Send |\(|\[)",
          "is rcssserver's log of what players said (.rcl), without positions",
          "Import the .rcg that lies beside it, which counts their commands"),
    _football(rb"\d{1,9}:(?:-?\d+,){5}-?[\d.]+;", "TRACAB's positions (.dat)", "tracab", "METADATA FILE"),
    _football(rb"\d{1,9}:(?:(?:-?[\d.]+|NaN|),){2,}[^\n]*[;:]", "EPTS's positions, as of Metrica",
              "metrica-epts", "METADATA.xml FILE"),
    _football(rb"\d{13};\d,\d,\d:", "Stats Perform's positions (MA25)", "statsperform", "MA1 FILE"),
    _football(rb",,,(?:Home|Away),", "Metrica's CSV of one team", "metrica-csv", "HOME.csv AWAY.csv"),
    _football(rb"\s*(?:<\?xml[^>]*\?>)?\s*<PutDataRequest\b", "Sportec's (DFL) XML", "sportec",
              "METADATA.xml POSITIONS.xml"),
    _football(rb"\s*(?:<\?xml[^>]*\?>)?\s*<TracabMetaData\b", "TRACAB's metadata", "tracab",
              "FILE POSITIONS"),
    _kind(rb"\s*\{[^\n]{0,400}\"(?:detection|geometry|tracked_?[fF]rame|robots_?(?:[bB]lue|[yY]ellow)"
          rb"|command_?[cC]ounter)\"\s*:", "is SSL's packets as JSON",
          "Import the game log (.log or .log.gz) that it was made of"),
    _football(rb"\s*\{[^\n]{0,4000}\"image_corners_projection\"", "SkillCorner's positions", "skillcorner",
              "METADATA FILE"),
    _football(rb"\s*\{[^\n]{0,4000}\"frameIdx\"", "Second Spectrum's positions", "secondspectrum",
              "METADATA FILE"),
    _football(rb"\s*\{[^\n]{0,4000}\"gameRefId\"", "PFF's positions", "pff", "METADATA ROSTERS FILE"),
    _football(rb"\s*\{\s*\"FrameData\"", "TRACAB's positions in JSON", "tracab", "METADATA FILE"),
    _football(rb"\s*\[\s*\{\s*\"utc_time\".{0,400}\"phase\"", "Signality's positions", "signality",
              "METADATA VENUE FILE…"),
)


#: Words of ours in a line that make it a table's header, and lines that are looked at.
_OURS, _LINES = 4, 10


def unread(head: bytes) -> Unread | None:
    """The kind of a file that is not read by itself, by its first bytes; None if nothing tells."""
    found = next((kind for kind in KINDS if kind.begins.match(head)), None)
    if found is not None:
        return found
    lines = [re.split(r"[,;\t| ]+", line) for line in head.decode("utf-8", "replace").splitlines()[:_LINES]]
    header = next((line for line in lines if len({*map(bare, line)} & WORDS.keys()) >= _OURS), None)
    if header is None:
        return None
    what = "looks like a table of positions, but its first line is no header, or its second no row of it"
    return _kind(b"", what, (
        "Begin it with the line that names the columns, then rows of as many fields, separated by commas, "
        "semicolons, tabs or bars; leave out titles and units"))
