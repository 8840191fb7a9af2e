"""The metadata record that describes a log's match: written and parsed."""

from __future__ import annotations

import json
import zlib

import polars as pl
from pydantic import ValidationError

from pitchlore.pipeline.base.errors import DamagedLog
from pitchlore.pipeline.matches.frame import MatchInfo
from pitchlore.schemas import Quality

#: Name of the metadata record.
METADATA = "pitchlore"

#: Kinds of pydantic's errors that point to another version, which has more or fewer fields.
_OF_ANOTHER_VERSION = ("missing", "extra_forbidden")
_OTHER_VERSION = "Read it with the version that wrote it"


def description_of(info: MatchInfo, quality: pl.DataFrame) -> dict[str, str]:
    """Info and quality as JSON, with their own CRC, which tells a good copy from a bad one."""
    about = info.model_dump(mode="json", exclude={"recording"} if info.recording is None else None)
    texts = {
        "info": json.dumps(about, sort_keys=True),
        "quality": json.dumps(quality.drop("match_id").to_dicts(), sort_keys=True),
    }
    return {**texts, "crc32": _checksum(texts)}


def is_sound(texts: dict[str, str]) -> bool:
    """True if the CRC of a description holds."""
    return texts.get("crc32") == _checksum(texts)


def parse(texts: dict[str, str], *, where: str) -> tuple[MatchInfo, pl.DataFrame]:
    """Info and rows of schema Quality of a sound record.

    Raises:
        DamagedLog: if it does not fit this version's description; the message names the field.
    """
    try:
        info = MatchInfo.model_validate_json(texts["info"])
    except ValidationError as error:
        raise _unusable(error, where) from error
    except KeyError as error:
        raise DamagedLog(
            "its metadata do not describe the match", where=where, next_step=_OTHER_VERSION
        ) from error
    unknown = DamagedLog(
        "its metadata's list of flaws is not one that this version of pitchlore knows", where=where,
        next_step=_OTHER_VERSION,
    )
    try:
        rows = [{**row, "match_id": info.match_id} for row in json.loads(texts["quality"])]
        quality = pl.DataFrame(rows, schema=Quality.dtypes()) if rows else Quality.empty()
    except (ValueError, TypeError, KeyError, RecursionError, pl.exceptions.PolarsError) as error:
        raise unknown from error
    if rows and not Quality.holds(quality):  # polars makes null of a word that it does not know
        raise unknown
    return info, quality


def _unusable(error: ValidationError, where: str) -> DamagedLog:
    """Error for info that does not validate; it names the first bad field."""
    first = error.errors()[0]
    field = ".".join(str(part) for part in first["loc"]) or "info"
    if first["type"] in _OF_ANOTHER_VERSION:
        what = "is missing" if first["type"] == "missing" else "is not known"
        return DamagedLog(
            f"the field {field} of its metadata {what}: they are of another version of pitchlore",
            where=where, next_step=_OTHER_VERSION,
        )
    given = "" if field == "info" else f" (it is {str(first['input'])[:60]!r})"
    return DamagedLog(
        f"the field {field} of its metadata is not usable: {first['msg'].lower()}{given}", where=where,
        next_step="Mend it with the tool that wrote it",
    )


def _checksum(texts: dict[str, str]) -> str:
    return f"{zlib.crc32(json.dumps([texts.get('info'), texts.get('quality')]).encode()):08x}"
