"""The formats that a match is exported in: one table, ``FORMATS``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from pitchlore.pipeline.base.errors import NotFound, in_one_line
from pitchlore.pipeline.views.exports import ball_model, foxglove, second_spectrum, tables
from pitchlore.pipeline.views.exports.content import ExportedMatch

#: Files by the ending of their names after the match's id.
FilesByEnding = dict[str, bytes]


@dataclass(frozen=True, slots=True)
class Format:
    """A format of exports.

    Attributes:
        about: programs that read it, for people.
        write: function from a match to its files.
    """

    about: str
    write: Callable[[ExportedMatch], FilesByEnding]


def _provider(content: ExportedMatch) -> FilesByEnding:
    meta, raw = second_spectrum.second_spectrum_files(content)
    return {"meta.json": meta, "tracking.jsonl": raw}


def _rerun(content: ExportedMatch) -> FilesByEnding:
    try:
        module = import_module("pitchlore.pipeline.views.exports.rerun_log")
    except ImportError as error:
        if error.name is None or error.name.partition(".")[0] != "rerun":
            raise
        raise NotFound(
            f"rerun cannot be loaded ({in_one_line(error)})", where="export",
            next_step="Install the extra pitchlore[rerun]",
        ) from error
    made: bytes = module.recording(content)
    return {"rrd": made}


def _physics(content: ExportedMatch) -> FilesByEnding:
    info = content.log.info
    model = ball_model.ball_model(content.log.frames, info.pitch, info.match_id)
    return {"physics.toml": ball_model.physics_toml(model, info.match_id).encode()}


_OF_PROVIDER = "Second Spectrum's two files: {}"
FORMATS: dict[str, Format] = {
    "csv": Format("the plain tracking table", lambda content: {"csv": tables.csv(content)}),
    "parquet": Format("the plain tracking table", lambda content: {"parquet": tables.parquet(content)}),
    "kloppy": Format(
        _OF_PROVIDER.format("kloppy.secondspectrum.load(META, TRACKING)"), _provider),
    "floodlight": Format(
        _OF_PROVIDER.format("floodlight.io.secondspectrum.read_position_data_jsonl(TRACKING, META)"),
        _provider),
    "foxglove": Format(
        "MCAP with Foxglove's schemas, for its 3D and Log panels",
        lambda content: {"foxglove.mcap": foxglove.recording(content)}),
    "physics": Format("settings for `pitchlore record --settings`: the ball as it rolls here", _physics),
    "rerun": Format("a recording for Rerun's viewer, with its views", _rerun),
}
