"""How often each kind of match shows each situation: ``pipeline/situations/usual.json``.

    PYTHONPATH=tests python -m studies.usual pipeline/situations/usual.json [FOLDER]

FOLDER has the recordings that are not part of the project; without it, ``../shared/matches``. Football is the
match of SkillCorner in kloppy's wheel. The file says how many recordings and robots' seconds each kind has. The
rate of a kind is the mean of its recordings' rates.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import polars as pl
from conftest import RECORDINGS, SAMPLE
from support import recordings
from support.football import whole_match

from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import SituationSettings, TrajectorySettings
from pitchlore.pipeline.situations.recognise import recognise
from pitchlore.pipeline.trajectories.derive import trajectories
from pitchlore.pipeline.trajectories.heights import with_heights
from pitchlore.schemas.situations import MOVES_RANDOMLY


def situations_of(match: MatchLog) -> pl.DataFrame:
    """The situations of a match by the default settings."""
    bodies, _ = trajectories(match, TrajectorySettings())
    return recognise(with_heights(bodies, match.heights), match.info.pitch, SituationSettings())


def rates_of(situations: pl.DataFrame) -> tuple[dict[int, float], float]:
    """Rate of each code but 194, per robot's second, and the robots' seconds."""
    seconds = (situations["end_ns"] - situations["start_ns"]).sum() / 1e9
    counts = situations.filter(pl.col("code") != MOVES_RANDOMLY).group_by("code").len().sort("code")
    return {int(code): count / seconds for code, count in counts.iter_rows()}, seconds


def matches(folder: Path) -> list[MatchLog]:
    """The recordings: the sample, those of the folder, and football's."""
    files = [SAMPLE, *(folder / name for name in recordings.ALL if name != recordings.RSIM)]
    return [*(read(open_source(file.read_bytes(), file.name)) for file in files), whole_match()]


def main(out: Path, folder: Path) -> None:
    """Measure all recordings and write the file."""
    told: dict[str, dict[str, object]] = {}
    of_kind: dict[Kind, list[tuple[dict[int, float], float]]] = {}
    for match in matches(folder):
        of_kind.setdefault(match.info.pitch.kind, []).append(rates_of(situations_of(match)))
    for kind in Kind:
        found = of_kind[kind]
        codes = sorted({code for rates, _ in found for code in rates})
        told[kind.value] = {
            "recordings": len(found), "robot_s": round(sum(seconds for _, seconds in found)),
            "rates": {str(c): round(sum(r.get(c, 0.0) for r, _ in found) / len(found), 7) for c in codes},
        }
    out.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else RECORDINGS)
