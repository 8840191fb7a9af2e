"""The goldens: each is a text that carries its own settings, made by one function from the sample."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable
from pathlib import Path

import polars as pl
from support import executions, played

from pipeline import decisions, knowledge, matches
from pipeline.behaviours import select as behaviours
from pipeline.goals import attribute
from pipeline.grams import count as grams
from pipeline.importers import source, tracking
from pipeline.matches.frame import MatchLog
from pipeline.policies import train as policies
from pipeline.settings import Settings
from pipeline.situations.recognise import recognise
from pipeline.studies.paradigms.claims import verdicts
from pipeline.studies.paradigms.experiments import Design, sweeps
from pipeline.trajectories.derive import trajectories
from pipeline.views.commentary import CommentarySettings, commentary
from pipeline.views.commentary.summary import heading, numbers
from schemas import PUBLIC

HERE = Path(__file__).parent
SAMPLE = HERE.parent.parent / "data" / "samples" / "rsim-vss-3v3.parquet"


def _log(start_s: float, end_s: float) -> MatchLog:
    """A stretch of the sample, through the importer and the log's own format."""
    table = pl.read_parquet(SAMPLE).filter(pl.col("t").is_between(start_s, end_s, closed="left"))
    buffer = io.BytesIO()
    table.write_parquet(buffer)
    log = tracking.read(
        buffer.getvalue(), name="clip.parquet", match_id=source.match_id("clip.parquet", b""),
        mapping=tracking.TrackingMap(),
    )
    written = io.BytesIO()
    matches.write(log, written)
    return matches.read(written.getvalue(), where="clip")


def _text(settings: dict[str, object], *tables: pl.DataFrame) -> str:
    """Settings as a comment, then each table as CSV with numbers a person can compare."""
    lines = [f"# {json.dumps(settings, sort_keys=True)}"]
    for table in tables:
        shown = table.with_columns(
            pl.col(name).list.eval(pl.element().cast(pl.String).str.zfill(3)).list.join("-")
            for name, dtype in table.schema.items() if isinstance(dtype, pl.List)
        )
        lines.append(shown.write_csv(float_precision=5).rstrip())
    return "\n\n".join(lines) + "\n"


class _Clip:
    """A stretch of the sample: its log, and what the first stages make of it by their defaults."""

    def __init__(self, start_s: float, end_s: float) -> None:
        settings = Settings()
        self.log = log = _log(start_s, end_s)
        self.pitch = log.info.pitch
        self.bodies, self.flaws = trajectories(log, settings.trajectories)
        self.situations = recognise(self.bodies, self.pitch, settings.situations)
        self.goals = attribute(log.referee, self.bodies, self.situations, self.pitch, settings.goals)


def situations() -> str:
    """Trajectories of 20 s thinned to one sample a second, and all situations in them."""
    clip, settings = _Clip(20.0, 40.0), Settings()
    thinned = clip.bodies.filter(pl.col("frame") % 40 == 0).drop("match_id")
    chosen = {"clip_s": [20.0, 40.0], "trajectories": settings.trajectories.model_dump(mode="json"),
              "situations": settings.situations.model_dump(mode="json")}
    return _text(chosen, clip.flaws.drop("match_id"), thinned, clip.situations.drop("match_id"))


def knowledge_and_policy() -> str:
    """Behaviours of all rounds over two minutes, the busiest occasions, and their action values."""
    clip, settings = _Clip(0.0, 120.0), Settings()
    valued = grams.value(clip.situations, clip.goals, settings.grams)
    patterns: list[pl.DataFrame] = []
    for round_ in settings.behaviours.rounds:
        taken = grams.cover(valued, pl.concat(patterns), settings.grams) if patterns else None
        counted = grams.merge([grams.grams(valued, round_.n, taken, settings.grams)])
        patterns.append(behaviours.select(counted, clip.situations.height, settings.behaviours, round_).patterns)
    seen = decisions.observe(
        valued, clip.bodies, clip.log.referee, pl.concat(patterns), clip.pitch, settings.grams)
    occasions = knowledge.occasions([seen], 1, settings.knowledge)
    policy, _ = policies.train([seen], occasions, None, settings.policies, 1, 1)
    chosen = {"clip_s": [0.0, 120.0]} | settings.model_dump(mode="json", exclude={"trajectories"})
    return _text(
        chosen, clip.goals.drop("match_id"), knowledge.behaviours(patterns, 1).drop("version"),
        occasions.drop("version").head(40), policy.drop("version", "knowledge_version").head(40),
    )


def telling() -> str:
    """The commentary of the sample's seconds 100 to 200, and its numbers."""
    clip = _Clip(100.0, 200.0)
    told = commentary(matches.row(clip.log), clip.log.referee, clip.goals, clip.situations, clip.bodies,
                      clip.pitch)
    chosen = {"clip_s": [100.0, 200.0], "commentary": CommentarySettings().model_dump(mode="json")}
    lines = [f"# {json.dumps(chosen, sort_keys=True)}", "", *heading(told.summary)]
    lines += [*(moment.line() for moment in told.moments), "", *numbers(told.summary)]
    return "\n".join(lines) + "\n"


def paradigms() -> str:
    """A few points of every figure, and what they say of the paper's claims."""
    design = Design(quick=True)
    points = pl.concat(
        curve.play(k, decay, runs=sweep.runs, seed=sweep.seed)
        for sweep in sweeps(design) for curve in sweep.curves for k, decay in curve.points()
    )
    shown = points.select("figure", "learner", "reading", "k", "decay", "steps", "runs", "p_optimal", "p_low",
                          "p_high", "p_equilibrium", "path_length", "diverged")
    return _text(design.model_dump(mode="json"), shown, verdicts(points).drop("quantity"))


def match() -> str:
    """20 s that are played: what the referee called, where all were each second, what was decided."""
    settings, shown = played.match()
    return _text(settings, *shown)


def season() -> str:
    """Two games, and what was known and valued after them."""
    settings, shown = played.season()
    return _text(settings, *shown)


def tables() -> str:
    """The columns of every public table: a change here needs another VERSION of the table."""
    lines = []
    for schema in PUBLIC.values():
        lines.append(f"\n{schema.tag()}")
        lines += [f"  {name}: {dtype}" for name, dtype in schema.dtypes().items()]
    return "\n".join(lines).lstrip() + "\n"


def log() -> str:
    """A log as it was written once: what is read from it must never change."""
    read = matches.read((HERE / "matches" / "rsim-3s.mcap").read_bytes(), where="rsim-3s.mcap")
    frames = read.frames
    ball = pl.DataFrame({"number": frames.number, "t_ns": frames.t_ns, **{c: frames.ball[c] for c in "xy"}})
    robots = pl.DataFrame(
        {"frame": frames.robot_frames(), **{c: frames.robots[c] for c in frames.robots.dtype.names}})
    return _text(
        read.info.model_dump(mode="json", exclude={"software"}), ball.gather_every(20),
        robots.filter(pl.col("frame") % 40 == 0), read.referee, read.quality)


def write_log() -> None:
    """Write the log of :func:`log` anew."""
    buffer = io.BytesIO()
    matches.write(_log(1.0, 4.0), buffer, chunk_bytes=16_384)
    path = HERE / "matches" / "rsim-3s.mcap"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(buffer.getvalue())


#: Noun and file name to what makes it.
CASES: dict[str, Callable[[], str]] = {
    "schemas/tables.txt": tables,
    "matches/rsim-3s.txt": log,
    "situations/rsim-20s.txt": situations,
    "knowledge/rsim-120s.txt": knowledge_and_policy,
    "commentary/rsim-100s.txt": telling,
    "paradigms/quick.txt": paradigms,
    "executors/confusion.txt": executions.report,
    "matches/played-20s.txt": match,
    "seasons/two-games.txt": season,
}


def main() -> None:
    """Make all goldens anew."""
    write_log()
    for name, make in CASES.items():
        path = HERE / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(make(), encoding="utf-8")
        print(path, file=sys.stderr)


if __name__ == "__main__":
    main()
