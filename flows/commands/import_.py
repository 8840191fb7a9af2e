"""The command import: import recordings as logs."""

from __future__ import annotations

import sys
from typing import Annotated

import polars as pl
from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json, On, UserPath
from pitchlore.flows.commands.folders import recordings_in
from pitchlore.flows.commands.performing import perform
from pitchlore.flows.commands.printing import console, print_failed, print_frame, print_json
from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.engine.placement.places import place_of
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.recordings import Recording, with_map
from pitchlore.pipeline.engine.run import import_recordings
from pitchlore.pipeline.importers.football.providers import PROVIDERS, provider_of
from pitchlore.pipeline.importers.forms.presets import text_of, titles
from pitchlore.pipeline.importers.readers import FORMATS, READERS
from pitchlore.pipeline.settings import HistorySettings, ImportSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.buckets import check_local
from pitchlore.schemas import SIDES


def import_files(
    *files: Annotated[UserPath, Parameter(json_list=False, help=(
        f"Recordings, plain or gzipped: {FORMATS}. Of a folder, all in it and in its folders."))],
    mapping: Annotated[UserPath | None, Parameter(name="--map")] = None,
    origin: Annotated[str | None, Parameter(name="--from", help=(
        "kloppy:PROVIDER: the files are one recording of football, in the provider's order: "
        + "; ".join(f"{word} {provider.usage()}" for word, provider in PROVIDERS.items()) + "."
    ))] = None,
    form: Annotated[str | None, Parameter(name="--as", help=(
        f"Form of a table that is known already: {'; '.join(map(', '.join, titles().items()))}."
    ))] = None,
    together: Flag = False,
    listed: Annotated[Flag, Parameter(name="--list")] = False,
    settings: UserPath | None = None,
    isolate: Flag = False,
    on: On = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Import recordings of matches, as logs or tracking tables, or one of football, as kloppy reads it.

    Args:
        files: Recordings, or folders of them. Their format is detected from their content.
        mapping: TOML file that names a tracking table's columns, units, axes and teams (default: FILE.toml
            or map.toml beside the recording, else the map that the match was imported with). An empty file
            takes the map away.
        origin: Provider of the files.
        form: Form of a table.
        together: The files are tables of one match in CSV, as one of home and one of away.
        listed: Print the formats, the forms of --as and the providers of --from, and import nothing.
        settings: TOML file with settings; its table [imports] has the limits on a recording.
        isolate: Read each recording in a process of its own, with limits on its time and memory.
        on: Where recordings are read.
        json: Print the report as JSON.
        common: Options of every command.
    """
    if listed:
        _print_all(json=json)
        return
    if not files:
        raise NotFound("no file was named", next_step="Name one or more recordings: pitchlore import FILE…")
    for path in (*files, *([mapping] if mapping else ())):
        check_local(path)
    store, chosen = common.store, common.settings(settings)
    files, notes = (files, []) if origin else recordings_in(store, files, chosen.imports)
    recordings = [Recording(file=f, mapping=mapping) if mapping else with_map(f) for f in files]
    if form is not None:
        if mapping is not None:
            raise BadSettings("--as and --map are two maps", next_step=f'Write form = "{form}" into the map')
        text_of(form)  # so that a name that there is not is refused at once
        recordings = [Recording(file=file, form=form) for file in files]
    if together:
        recordings = [recordings[0].model_copy(update={"more": files[1:]})]
    if origin is not None:
        if mapping is not None:
            raise BadSettings("--map is for tracking tables, and files of --from describe themselves",
                              next_step="Leave --map out")
        recordings = [Recording(file=files[0], provider=provider_of(origin), more=files[1:])]
    limits = chosen.imports.isolated() if isolate else chosen.imports
    report = bring_in(store, recordings, limits, on or chosen.placement.on, chosen.history)
    report.notes = notes + report.notes
    if json:
        print_json(report.model_dump())
    else:
        _print_matches(store, report)
    sys.exit(1 if report.failed else 0)


def _print_all(*, json: bool) -> None:
    """Print all that can be imported."""
    rows = [{"give": "FILE", "reads": f"{reader.title}: {reader.about}"} for reader in READERS]
    rows += [{"give": f"FILE --as {word}", "reads": title} for word, title in titles().items()]
    rows += [{"give": f"{provider.usage()} --from kloppy:{word}", "reads": provider.title}
             for word, provider in PROVIDERS.items()]
    if json:
        print_json(rows)
    else:
        print_frame(pl.DataFrame(rows))


def bring_in(
    store: Store, recordings: list[Recording], limits: ImportSettings = ImportSettings(),
    on: str | None = None, history: HistorySettings = HistorySettings(), *, as_flow: bool = False,
) -> StageReport:
    """Import recordings."""
    place_of(on)  # so that a word that names none is refused at once
    return perform(store, "matches_flow", StageReport, import_recordings, as_flow=as_flow)(
        store.root, recordings, limits, on, history)


def _print_matches(store: Store, report: StageReport) -> None:
    out = console()
    out.print(f"{len(report.made)} imported, {report.kept} already here, {len(report.failed)} not imported")
    rows = []
    for name in report.made:
        receipt = store.receipt("matches", name)
        assert receipt is not None
        flaws = receipt.details.get("flaws", {})
        score = [receipt.details["score"][side] for side in SIDES]
        rows.append({"match": name, "teams": f"{receipt.details['home']} - {receipt.details['away']}",
                     "score": "unknown" if None in score else " : ".join(map(str, score)),
                     "s": receipt.details["duration_s"], "frames": receipt.details["frames"],
                     "complete": "yes" if receipt.details["complete"] else "no",
                     "flaws": ", ".join(flaw if n == receipt.details["frames"] else f"{flaw} {n}"
                                        for flaw, n in flaws.items())})
    if rows:
        print_frame(pl.DataFrame(rows))
    sources = [f"{name}: bodies from {receipt.details['bodies']}" for name in report.made
               if (receipt := store.receipt("matches", name)) is not None and "bodies" in receipt.details]
    for note in [*sources, *report.notes]:
        out.print(note, soft_wrap=True, highlight=False, markup=False)
    print_failed(report.failed)
