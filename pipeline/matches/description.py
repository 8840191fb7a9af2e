"""What a log says of its match: the metadata record, its making and its reading."""

from __future__ import annotations

import json
import zlib

import polars as pl
from pydantic import ValidationError

from pipeline.errors import DamagedLog
from pipeline.frame import MatchInfo
from schemas import Quality

#: Name of the metadata record.
METADATA = "pitchlore"


def describe(info: MatchInfo, quality: pl.DataFrame) -> dict[str, str]:
    """Info and quality as JSON, and a CRC of their own that tells which copy is good."""
    texts = {
        "info": json.dumps(info.model_dump(mode="json"), sort_keys=True),
        "quality": json.dumps(quality.drop("match_id").to_dicts(), sort_keys=True),
    }
    return {**texts, "crc32": _checksum(texts)}


def is_sound(texts: dict[str, str]) -> bool:
    """Whether the CRC of a description holds."""
    return texts.get("crc32") == _checksum(texts)


def parse(texts: dict[str, str], *, where: str) -> tuple[MatchInfo, pl.DataFrame]:
    """A sound description's info, and its rows of schema Quality.

    Raises:
        DamagedLog: if it is not as this version describes matches.
    """
    try:
        info = MatchInfo.model_validate_json(texts["info"])
        rows = [{**row, "match_id": info.match_id} for row in json.loads(texts["quality"])]
        return info, pl.DataFrame(rows, schema=Quality.dtypes()) if rows else Quality.empty()
    except (ValidationError, ValueError, TypeError, KeyError, pl.exceptions.PolarsError) as error:
        raise DamagedLog(
            "its metadata are of another version of pitchlore", where=where,
            next_step="Read it with the version that wrote it",
        ) from error


def _checksum(texts: dict[str, str]) -> str:
    return f"{zlib.crc32(json.dumps([texts.get('info'), texts.get('quality')]).encode()):08x}"
