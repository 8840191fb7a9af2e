"""The command export: a match in a form that other people's programs read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, Json
from pitchlore.flows.commands.printing import console, print_json
from pitchlore.pipeline.face.match import Match

Word = Literal["csv", "parquet", "kloppy", "floodlight", "foxglove", "rerun"]


def export(
    match: str, *, to: Word, output: Annotated[Path | None, Parameter(alias="-o")] = None,
    json: Json = False, common: Common = DEFAULTS,
) -> None:
    """Write a match as a table, as files for kloppy and floodlight, or as a recording for a viewer.

    Args:
        match: Id of the match, or its beginning.
        to: Format. csv and parquet are tables that `import` reads back; kloppy and floodlight get two files
            that both read; foxglove and rerun are recordings that those viewers draw.
        output: Folder to write into (default: exports/ in the data folder).
        json: Print JSON.
        common: Options of every command.
    """
    found = common.league.match(match)
    paths = found.export(to, output)
    if json:
        print_json({"match": found.name, "to": to, "files": [str(path) for path in paths]})
        return
    for path in paths:
        console().print(f"{path} ({path.stat().st_size / 1e6:.2f} MB)", soft_wrap=True)
    console().print(Match.forms()[to], soft_wrap=True)
