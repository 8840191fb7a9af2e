"""The command export: a match in a form that other people's programs read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, Json
from pitchlore.flows.commands.match_id import chain_of
from pitchlore.flows.commands.printing import console, print_json
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.schemas import Possession, Situations, Trajectories

if TYPE_CHECKING:
    from pitchlore.pipeline.views.exports.content import Content

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
    from pitchlore.pipeline.views.exports.formats import FORMATS  # noqa: PLC0415 (numba's code is loaded with some)

    store, chosen = common.existing, FORMATS[to]
    log, made = chain_of(store, match, *chosen.needs)
    files = {}
    for ending, data in chosen.write(_content(store, log, made)).items():
        path = (output or store.root / "exports") / f"{log.name}.{ending}"
        if output is None:
            store.keep(path, data)
        else:
            store.write_bytes(path, data)
        files[path] = len(data)
    if json:
        print_json({"match": log.name, "to": to, "files": [str(path) for path in files]})
        return
    for path, size in files.items():
        console().print(f"{path} ({size / 1e6:.2f} MB)", soft_wrap=True)
    console().print(chosen.about, soft_wrap=True)


def _content(store: Store, log: Receipt, made: dict[str, Receipt]) -> Content:
    """The match's log, and those of its tables that are needed."""
    from pitchlore.pipeline import matches  # noqa: PLC0415 (see export)
    from pitchlore.pipeline.views.exports.content import Content  # noqa: PLC0415 (see export)

    tables = {
        name: store.read_table(made[noun], name, schema)
        for noun, name, schema in (
            ("trajectories", "trajectories", Trajectories), ("situations", "situations", Situations),
            ("events", "possession", Possession))
        if noun in made
    }
    return Content(matches.read(store.read(log, "log"), where=log.name), **tables)
