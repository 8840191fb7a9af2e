"""The command export: matches in a form that other people's programs read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, Json, UserPath
from pitchlore.flows.commands.printing import console, print_json
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.face.match import Match

Word = Literal["csv", "parquet", "kloppy", "floodlight", "foxglove", "rerun", "physics", "lerobot"]


def export(
    *matches: str, to: Word, output: Annotated[UserPath | None, Parameter(alias="-o")] = None,
    fps: int | None = None, json: Json = False, common: Common = DEFAULTS,
) -> None:
    """Write a match as a table, as files for kloppy and floodlight, for a viewer, or as a dataset.

    Args:
        matches: Id of the match, or its beginning; of several, each is written. With lerobot they are in one
            dataset, and no id means all matches of the data folder.
        to: Format. csv and parquet are tables that `import` reads back; kloppy and floodlight get two files
            that both read; foxglove and rerun are recordings that those viewers draw; physics are settings
            for `record`, by how the ball rolled; lerobot is a dataset of what each team saw and did.
        output: Folder to write into (default: exports/ in the data folder); with lerobot the dataset's own
            folder, which must not exist (default: exports/lerobot).
        fps: Frames a second of a dataset, at most those of each recording (default 20, or fewer if a
            recording is slower).
        json: Print JSON.
        common: Options of every command.
    """
    if to == "lerobot":
        _dataset(matches, output, fps, json, common)
        return
    if not matches:
        raise BadSettings("no match is named", where=f"--to {to}", next_step=(
            "Name one or more; `pitchlore sql \"select match_id from matches\"` lists them"))
    if fps is not None:
        raise BadSettings("only a dataset has frames a second", where="--fps", next_step="Leave it out")
    written = []
    for found in map(common.league.match, matches):
        paths = found.export(to, output)
        written.append({"match": found.name, "to": to, "files": [str(path) for path in paths]})
        for path in () if json else paths:
            console().print(f"{path} ({path.stat().st_size / 1e6:.2f} MB)", soft_wrap=True)
    if json:
        print_json(written[0] if len(written) == 1 else written)
    else:
        console().print(Match.forms()[to], soft_wrap=True)


def _dataset(
    matches: tuple[str, ...], output: Path | None, fps: int | None, json: bool, common: Common
) -> None:
    """Write a dataset of LeRobot, and say how it is loaded."""
    made = common.league.lerobot(*matches, folder=output, fps=fps)
    if json:
        print_json({**made._asdict(), "path": str(made.path), "matches": list(made.matches), "to": "lerobot"})
        return
    count = len(made.matches)
    said = [f"{made.path}: {made.frames} frames, {made.fps} a second, in {made.episodes} episodes",
            f"Load it with `LeRobotDataset(\"pitchlore/league\", root=\"{made.path}\")`"]
    if made.recovered < count:
        said.append(f"Options are known in {made.recovered} of {count} matches: "
                    "`recover = true` in the table options of the settings recovers them")
    console().print(". ".join(said) + ".", soft_wrap=True, markup=False)
