"""How often each kind of match shows each situation: ``pipeline/stages/situations/usual.json``.

``make usual-codes`` (two minutes; RECORDINGS is the folder of the recordings that are not part of the
project). Football is the match of SkillCorner in kloppy's wheel. The file says how many recordings and
robots' seconds each kind has. The rate of a kind is the mean of its recordings' rates. A kind with a
recording that is not there stays as it is.
"""

from __future__ import annotations

import json
from pathlib import Path

import polars as pl
from football.skillcorner import THERE, whole_match
from harness import ROOT, elsewhere, read, recordings

from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import SituationSettings, TrajectorySettings
from pitchlore.pipeline.stages.situations.recognise import recognise
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.stages.trajectories.heights import with_heights
from pitchlore.schemas.situations import MOVES_RANDOMLY


def situations_of(match: MatchLog) -> pl.DataFrame:
    """The situations of a match by the default settings."""
    bodies, _ = trajectories(match, TrajectorySettings())
    return recognise(with_heights(bodies, match.heights), match.info.pitch, SituationSettings())


def rates_of(situations: pl.DataFrame) -> tuple[dict[int, float], float]:
    """Rate of each code but 194, per robot's second, and the robots' seconds."""
    seconds = float((situations["end_ns"] - situations["start_ns"]).sum()) / 1e9
    counts = situations.filter(pl.col("code") != MOVES_RANDOMLY).group_by("code").len().sort("code")
    return {int(code): count / seconds for code, count in counts.iter_rows()}, seconds


def main(out: Path, folder: Path) -> None:
    """Measure the recordings that are there, and write the file anew."""
    reported, of_kind = json.loads(out.read_text("utf-8")), dict[Kind, list[tuple[dict[int, float], float]]]()
    for match in (*map(read, recordings(folder).values()), *([whole_match()] if THERE else [])):
        of_kind.setdefault(match.info.pitch.kind, []).append(rates_of(situations_of(match)))
    for kind, found in of_kind.items():
        if len(found) < reported[kind.value]["recordings"]:
            print(f"{kind.value}: stays as it is")
            continue
        codes = sorted({code for rates, _ in found for code in rates})
        reported[kind.value] = {
            "recordings": len(found), "robot_s": round(sum(seconds for _, seconds in found)),
            "rates": {str(c): round(sum(r.get(c, 0.0) for r, _ in found) / len(found), 7) for c in codes}}
    out.write_text(json.dumps(reported, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(ROOT / "pipeline" / "stages" / "situations" / "usual.json", elsewhere())
