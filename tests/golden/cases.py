"""The goldens: each is a text that says what it was made by, and from what; one function makes it.

The first line of a golden is JSON: the versions of the stages that made it, its settings, a digest of its
inputs, and a digest of all that was made, of which the text may show a part. If the same versions, settings
and inputs give another text, a version must be raised: :func:`complaint` says which.
"""

import io
import json
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import polars as pl
from conftest import clip
from support import executions, played, recordings
from support.mcap_logs import written

from pitchlore.flows.commands.common import NAMED, named_run
from pitchlore.pipeline import arena, matches
from pitchlore.pipeline.arena.match.recipe import TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.engine.evaluations import evaluate
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.run import run
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.tables import MatchTables, stored_match
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import (
    EventSettings,
    ModelSettings,
    MomentSettings,
    OptionSettings,
    Settings,
    TrajectorySettings,
)
from pitchlore.pipeline.stages.evaluations import Entrant, Evaluation
from pitchlore.pipeline.stages.events.derive import events
from pitchlore.pipeline.stages.paradigms.claims import verdicts
from pitchlore.pipeline.stages.paradigms.experiments import Design, sweeps
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.stages.values import models, shooting
from pitchlore.pipeline.stages.values.chances import FEATURES
from pitchlore.pipeline.stages.values.fitting import fit
from pitchlore.pipeline.stages.values.moments import moments
from pitchlore.pipeline.state.words import with_elements
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.views.commentary import CommentarySettings, commentary
from pitchlore.pipeline.views.commentary.summary import heading, summary_lines
from pitchlore.pipeline.views.report import write_report
from pitchlore.schemas import PUBLIC, Evaluations, Patterns, Policies, Situations, States, Table, Trajectories

#: Settings of all stages: the usual ones, but for what is off.
SETTINGS = Settings(options=OptionSettings(recover=True))
HERE = Path(__file__).parent
#: Where the version of a stage is raised.
PLACES = {"arena": "pipeline/arena/__init__.py"}
#: The stretch of the sample that goes through all stages, s.
CLIP = (0.0, 120.0)
#: Rows shown of a table; those of bodies and situations are of a few seconds.
SHOWN = 40


@dataclass(frozen=True)
class Golden:
    """A golden as it is made now.

    Attributes:
        text: shown text.
        versions: versions of the stages that it depends on, the one that makes it last.
        settings: settings of these.
        inputs: digest of all else that it is made from.
        content: digest of all that was made, where the text shows a part.
    """

    text: str
    versions: dict[str, int] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)
    inputs: str = ""
    content: str = ""

    def __str__(self) -> str:
        """The file's text."""
        head = {"versions": self.versions, "settings": self.settings, "inputs": self.inputs, "content": self.content}
        return f"# {json.dumps({key: value for key, value in head.items() if value})}\n\n{self.text.rstrip()}\n"


def complaint(name: str, before: str, now: Golden) -> str | None:
    """Advice if a golden changed though nothing that it is made by or from did; else None."""
    head = json.loads(before.splitlines()[0].removeprefix("# "))
    same = (head.get("versions", {}), head.get("settings", {}), head.get("inputs", "")) == (
        now.versions, json.loads(json.dumps(now.settings)), now.inputs)
    if before == str(now) or not same or not now.versions:
        return None
    noun, version = list(now.versions.items())[-1]
    return (f"{name}: the same versions, settings and inputs give something else. Raise the version of {noun} from "
            f"{version} to {version + 1} in {PLACES.get(noun, 'pipeline/engine/stages.py')}, then `make golden`")


def _csv(*tables: pl.DataFrame) -> str:
    """Tables as CSV with numbers a person can compare."""
    return "\n\n".join(
        table.with_columns(
            pl.col(name).cast(pl.List(pl.Float64)).list.eval(pl.element().round(3).cast(pl.String)).list.join(" ")
            for name, dtype in table.schema.items() if isinstance(dtype, pl.Array)
        ).with_columns(
            pl.format("{} of {}", pl.col(name).list.head(2).list.join(", "), pl.col(name).list.len())
            if dtype == pl.List(pl.String) else
            pl.col(name).list.eval(pl.element().cast(pl.String).str.zfill(3)).list.join("-")
            for name, dtype in table.schema.items() if isinstance(dtype, pl.List)
        ).write_csv(float_precision=5).rstrip()
        for table in tables
    )


def _log(start_s: float, end_s: float) -> MatchLog:
    """A stretch of the sample, through the importer and the log's own format."""
    buffer = io.BytesIO()
    clip(start_s, end_s).write_parquet(buffer)
    log = recordings.read(buffer.getvalue(), "clip.parquet", match_id="clip-e3b0c44298fc")
    return matches.read(written(log), where="clip")


# --- the chain: each stage from what the stages before it made of a clip ---------------------------


@cache
def _data() -> tempfile.TemporaryDirectory[str]:
    """A data folder after all stages over the clip; it goes with the process."""
    folder = tempfile.TemporaryDirectory(prefix="golden-")
    file = Path(folder.name, "clip.csv")  # its bytes do not depend on how Parquet is written
    clip(*CLIP).write_csv(file)
    run(file.parent, [Recording(file=file)], SETTINGS)
    return folder


@cache
def chain(noun: str) -> Golden:
    """The tables that a stage makes of the clip."""
    store, stage = Store(Path(_data().name)), STAGES[noun]
    receipts: list[Receipt] = [*store.receipts(noun), *store.manifests(noun)]
    tables = {
        (receipt.name, schema): store.read_table(receipt, schema.NAME, schema)
        for receipt in receipts for schema in stage.schemas if schema.NAME in receipt.files
    }
    return Golden(
        "\n\n".join(f"{name} {schema.tag()}, {table.height} rows\n{_csv(_shown(table, schema))}"
                    for (name, schema), table in tables.items()),
        {noun: stage.version}, {} if stage.compute is None else stage.settings(SETTINGS).model_dump(mode="json"),
        inputs=_digest(*(schema.tag() for schema in stage.schemas), *(chain(source).content for source in stage.inputs if STAGES[source].schemas)),
        content=_digest(*map(_csv, tables.values())),
    )


def _shown(table: pl.DataFrame, schema: type[Table]) -> pl.DataFrame:
    """Some rows of a table, without what is the same in all of them."""
    same = [name for name in ("match_id", "version", "knowledge_version") if name in table.columns]
    if schema is Trajectories:
        table = table.filter(pl.col("frame") % 240 == 0)
    elif schema is Situations:
        table = table.filter(pl.col("start_ns").is_between(20_000_000_000, 30_000_000_000))
    else:
        table = table.head(SHOWN)
    return table.drop(same)


# --- other goldens ---------------------------------------------------------------------------------


def commentary_clip() -> Golden:
    """The commentary of the sample's seconds 0 to 120, and its numbers."""
    store = Store(Path(_data().name))
    reported = commentary(MatchTables(stored_match(store, next(store.receipts("matches")))))
    lines = [*heading(reported.summary), *(moment.line() for moment in reported.moments), "", *summary_lines(reported.summary)]
    return Golden("\n".join(lines), settings={"commentary": CommentarySettings().model_dump(mode="json")})


def scored(name: str) -> Golden:
    """Behaviours of the clip by ``run --settings NAME``, how many and the best; and the best states, in words."""
    with _folder() as data:
        shutil.copytree(_data().name, data, ignore=shutil.ignore_patterns("knowledge", "policies"), dirs_exist_ok=True)
        run(data, [], settings := named_run(name))
        store = Store(data)
        behaviours = store.read_table(next(store.receipts("behaviours")), Patterns.NAME, Patterns).filter("kept")
        policies, states = (store.read_table(store.latest("policies"), table.NAME, table) for table in (Policies, States))
    best = policies.join(states, on=("role", "key", "state")).sort("q", "behaviour_id", descending=True).head(2)
    return Golden(_csv(
        behaviours.sort("value", "behaviour_id", descending=True).group_by("n").agg(
            pl.len().alias("kept"), pl.sum("support"), pl.first("behaviour_id", "value", "paper", "neuron")).sort("n"),
        with_elements(best).select("behaviour_id", "q", pl.col("elements").list.join("; "))),
        _versions("sides", "sequences", "knowledge", "policies", "behaviours"), settings.model_dump(mode="json", exclude_defaults=True),
        inputs=_digest(chain("sequences").content, settings.model_dump_json()))


def paradigms() -> Golden:
    """A few points of every figure with a few runs, and what they say of the paper's claims."""
    design = Design(quick=True, runs=20)
    every = sweeps(design)
    points = pl.concat(
        curve.play(k, decay, runs=sweep.runs, seed=sweep.seed)
        for sweep in every for curve in sweep.curves for k, decay in curve.points()
    )
    shown = points.select("figure", "learner", "reading", "k", "decay", "steps", "runs", "p_optimal", "p_low",
                          "p_high", "p_equilibrium", "path_length", "diverged")
    return Golden(_csv(shown, verdicts(points).drop("quantity")), _versions("paradigms"),
                  design.model_dump(mode="json"), inputs=_digest(*(sweep.model_dump_json() for sweep in every)))


def match() -> Golden:
    """20 s that are played: what the referee called, where all were each second, what was decided."""
    settings, shown = played.match()
    return Golden(_csv(*shown), {"arena": arena.VERSION}, settings)


@cache
def _games(play: Callable[[Path], played.Shown]) -> tuple[tempfile.TemporaryDirectory[str], played.Shown]:
    """A data folder after two games, and what is shown of them."""
    folder = tempfile.TemporaryDirectory(prefix="golden-")
    return folder, play(Path(folder.name))


def games(play: Callable[[Path], played.Shown]) -> Golden:
    """Two games, and what was known and valued after them, or seen, and what comes of it."""
    _, (settings, shown) = _games(play)
    return Golden(_csv(*shown), _versions("arena", *STAGES.learned, *STAGES.versioned, "seasons"), settings)


def evaluation() -> Golden:
    """A pair of matches of 20 s, sides swapped."""
    static, random = (Entrant(name=kind, settings=TeamSettings(kind=kind)) for kind in ("static", "random"))
    whole = Evaluation(team=static, opponent=random, referee=RefereeSettings(duration_s=20.0))
    with _folder() as data:
        rows, _ = evaluate(Store(data), whole, [1], {})
    return Golden(_csv(rows.select(list(Evaluations.dtypes()))), _versions("arena", "evaluations"),
                  whole.model_dump(mode="json"))


def report() -> Golden:
    """The report on the season of two games, as text."""
    store = Store(Path(_games(played.season)[0].name))
    written = write_report(store)
    text = store.read(written.receipt, "text").decode()
    return Golden(text, _versions("report"), inputs=_digest(_csv(written.tables.games, written.tables.growth)))


def tables() -> Golden:
    """The columns of every public table: a change here needs another VERSION of the table."""
    lines = []
    for schema in PUBLIC.values():
        lines.append(f"\n{schema.tag()}")
        lines += [f"  {name}: {dtype}" for name, dtype in schema.dtypes().items()]
    return Golden("\n".join(lines).lstrip())


def log() -> Golden:
    """A log as it was written once: what is read from it must never change."""
    read = matches.read((HERE / "matches" / "rsim-3s.mcap").read_bytes(), where="rsim-3s.mcap")
    frames = read.frames
    ball = pl.DataFrame({"number": frames.number, "t_ns": frames.t_ns, **{c: frames.ball[c] for c in "xy"}})
    robots = pl.DataFrame(
        {"frame": frames.robot_frames(), **{c: frames.robots[c] for c in frames.robots.dtype.names}})
    return Golden(
        _csv(ball.gather_every(20), robots.filter(pl.col("frame") % 40 == 0), read.referee, read.quality),
        settings=read.info.model_dump(mode="json", exclude={"software"}))


def fitted() -> Golden:
    """The models of the whole sample, whose clip has too few goals for any; that of its shots is of all of them."""
    read = recordings.imported(recordings.RSIM)
    bodies, _ = trajectories(read, TrajectorySettings())
    found, report = fit(moments(bodies, read.referee, read.info.pitch, MomentSettings()), ModelSettings())
    assert found is not None
    shots = events(bodies, read.referee, read.info.pitch, EventSettings()).shots
    by_shots, _ = shooting.fit_shots({"sample": (shots, read.info.pitch)}, ModelSettings().penalty)
    reported = {"features": FEATURES, "shots": shots.height, "goals": int(by_shots.goals[-1]),
            "weights": by_shots.weights[-1].round(4).tolist()}
    return Golden(
        json.dumps({"report": report, **models.to_json(found), "shots": reported}, indent=1), _versions("events", "models"),
        ModelSettings().model_dump(mode="json"), inputs=_digest(_csv(bodies), _csv(read.referee)))


def confusion() -> Golden:
    """How often the recogniser calls what a robot is told to do by its name."""
    return Golden(executions.report())


def write_log() -> None:
    """Write the log of :func:`log` anew."""
    path = HERE / "matches" / "rsim-3s.mcap"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(written(_log(1.0, 4.0), chunk_bytes=16_384))


def _digest(*texts: str) -> str:
    return digest("\n".join(texts).encode())[:16]


def _versions(*nouns: str) -> dict[str, int]:
    return {noun: arena.VERSION if noun == "arena" else STAGES[noun].version for noun in nouns}


@contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="golden-") as folder:
        yield Path(folder)


#: Noun and file name to what makes it, once a process; a stage of the chain has its golden without being named.
CASES: dict[str, Callable[[], Golden]] = {name: cache(make) for name, make in {
    **{f"{noun}/clip-120s.txt": (lambda noun=noun: chain(noun))
       for noun, stage in STAGES.items() if stage.per is not Per.OWN and stage.schemas},
    **{f"behaviours/{name}.txt": (lambda name=name: scored(name)) for name in NAMED},
    "models/sample.txt": fitted,
    "schemas/tables.txt": tables,
    "matches/rsim-3s.txt": log,
    "commentary/clip-120s.txt": commentary_clip,
    "paradigms/quick.txt": paradigms,
    "executors/confusion.txt": confusion,
    "matches/played-20s.txt": match,
    "seasons/two-games.txt": lambda: games(played.season),
    "seasons/looking.txt": lambda: games(played.looking),
    "evaluations/pair-20s.txt": evaluation,
    "report/two-games.txt": report,
}.items()}


def main() -> int:
    """Make all goldens anew, but those that need a version raised first; the number of these."""
    write_log()
    complaints = []
    for name, make in CASES.items():
        path, now = HERE / name, make()
        line = complaint(name, path.read_text(encoding="utf-8"), now) if path.exists() else None
        if line is None:
            path.parent.mkdir(exist_ok=True)
            path.write_text(str(now), encoding="utf-8")
            print(path, file=sys.stderr)
        else:
            complaints.append(line)
    for line in complaints[:1]:  # the others may follow from it
        print(line, file=sys.stderr)
    return len(complaints)


if __name__ == "__main__":
    sys.exit(1 if main() else 0)
