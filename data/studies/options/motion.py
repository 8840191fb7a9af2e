"""Half a second ahead: how well options foretell motion, beside wheels that are cloned and the last velocity.

Run after ``data/studies/from_recordings/study.py`` (`make from-recordings` does), whose recordings and clues
it takes. Each model learns from ten recordings of a team, and foretells where the team's robots are 0.1, 0.25
and 0.5 s later in five others; of the sample, from one half of the match the other. Whatever foretells
wheels is rolled out in the same way: rims follow their commands as motors can, the robot rolls without
slip, all other bodies keep their velocities, and nobody touches anybody.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from from_recordings.study import NAME, Study
from from_recordings.wheels import Clone, by_steps, fit, joined, measured, playing, samples
from harness import ROOT, SAMPLE, read
from options.rolling import AHEAD, FRAMES, HZ, Moments, by_option, by_velocity, by_wheels

from pitchlore.pipeline import matches
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.game.bodies import THETA, X, Y
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.numbers.arrays import F32, F64
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.numbers.trees import Trees
from pitchlore.pipeline.settings import HabitSettings, OptionSettings, TrajectorySettings
from pitchlore.pipeline.stages.options.likelihood import shipped_ratios
from pitchlore.pipeline.stages.options.of_team import habits, probabilities
from pitchlore.pipeline.stages.options.recover import options
from pitchlore.pipeline.stages.options.windows import Bodies, bodies, views_of
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.store import Store
from pitchlore.schemas import SIDES, Clues
from pitchlore.schemas.options import OPTIONS

#: Teams of the study of recordings that are looked at; how many of their recordings are learned from, the
#: first, and how many are foretold, the last.
TEAMS, LEARNED, FORETOLD = ("static", "pressing", "best-constant"), 10, 5
#: Length of the stretches of the sample that are told from each other, ns.
_MINUTE_NS = 60_000_000_000
_OPTIONS = np.array(OPTIONS, dtype=np.int64)
FOLDER = Path(__file__).parent


class Part(NamedTuple):
    """A match as one team played it, or a part of it: bodies, the team's side, its clues, the pitch."""

    match: Bodies
    team: int
    clues: pl.DataFrame
    pitch: Pitch


def moments(part: Part) -> Moments:
    """The moments of a part after which all bodies are seen in play for as long as is foretold."""
    moved = by_steps(part.match)
    seen, lost = views_of(moved.places, part.team), np.concatenate([[0], np.cumsum(~playing(moved))])
    rows = part.clues.select(
        "robot", "end_ns", sample=pl.Series(np.searchsorted(moved.t_ns, part.clues["start_ns"].to_numpy())),
        follows=(pl.col("end_ns").shift() == pl.col("start_ns"))
        & (pl.col("robot").shift() == pl.col("robot")))
    sample = rows["sample"].to_numpy()
    last = np.minimum(sample + FRAMES, len(seen) - 1)
    whole = (last - sample == FRAMES) & (lost[last] == lost[sample])
    here = np.flatnonzero(rows["follows"].fill_null(value=False).to_numpy() & whole)
    numbers = list(part.match.numbers[part.team])
    robot = np.array([1 + numbers.index(number) for number in rows["robot"]], dtype=np.int64)[here]
    at = sample[here]
    poses = np.stack([seen[at + ahead, robot][:, [X, Y, THETA]] for ahead in AHEAD], axis=1)
    return Moments(seen[at], robot, poses, here - 1, here)


class Model(NamedTuple):
    """A team as it was learned: the habits of its options, and its wheels."""

    habits: dict[int, Trees]
    wheels: Clone


def learned(parts: Sequence[Part], settings: OptionSettings) -> Model:
    """Learn from some parts."""
    clues = [part.clues.drop_nulls("role") for part in parts]
    every = pl.concat(clues)
    role = every["role"].to_physical().to_numpy().astype(np.int64)
    fold = np.repeat(np.arange(len(parts)) % 2, [each.height for each in clues])
    grown, _ = habits(every["ratios"].to_numpy(), _sight(every), role, fold, HabitSettings())
    known = joined(samples(part.match, part.team, part.pitch, settings, place % 3)
                   for place, part in enumerate(parts))
    return Model(grown, fit(known))


def _sight(clues: pl.DataFrame) -> F32:
    """Sights of windows, float32 [W, 30]."""
    return np.ascontiguousarray(clues["sight"].to_numpy(), dtype=np.float32)


def foretold(part: Part, now: Moments, model: Model, settings: OptionSettings) -> Iterator[tuple[str, F64]]:
    """Names and poses [K, H, 3] of all that foretells."""
    packed, doubt = measured(part.pitch, 1 / HZ, settings), HabitSettings().doubt
    usual = (1 - doubt) * probabilities(model.habits, _sight(part.clues), len(OPTIONS)) + doubt / len(OPTIONS)
    both = np.log(usual) + part.clues["ratios"].to_numpy()
    yield "the last velocity", by_velocity(now)
    yield "the last speeds of the rims", by_wheels(now, lambda _, rims: rims.copy(), packed, settings)
    for name, logits, rows in (
        ("the option before, carried on", both, now.before), ("the habitual option", usual, now.here),
        ("the option that the motion itself shows", both, now.here),
    ):
        yield name, by_option(now, _OPTIONS[logits[rows].argmax(axis=1)], packed, settings)
    top = float(packed[0]["top"])

    def told(seen: F64, _: F64) -> F64:
        return np.clip(model.wheels(seen.astype(np.float32)), -top, top).astype(np.float64)

    yield "wheels cloned", by_wheels(now, told, packed, settings)


def errors(poses: F64, now: Moments) -> F64:
    """Mean errors in centimetres and degrees, float64 [H, 2]."""
    away = np.hypot(poses[:, :, 0] - now.poses[:, :, 0], poses[:, :, 1] - now.poses[:, :, 1])
    turned = (poses[:, :, 2] - now.poses[:, :, 2] + math.pi) % (2 * math.pi) - math.pi
    return np.column_stack([100 * away.mean(axis=0), np.degrees(np.abs(turned).mean(axis=0))])


def rows_of(
    team: str, tested: Sequence[tuple[Part, Model]], settings: OptionSettings
) -> Iterator[dict[str, object]]:  # fmt: skip
    """Rows of a team: the mean over parts, with Student's interval over them."""
    found: dict[str, list[F64]] = {}
    count = 0
    for part, model in tested:
        now = moments(part)
        count += len(now.robot)
        for name, poses in foretold(part, now, model, settings):
            found.setdefault(name, []).append(errors(poses, now))
    for name, each in found.items():
        for place, ahead in enumerate(AHEAD):
            way = [float(one[place, 0]) for one in each]
            low, high = mean_interval(way) or (None, None)
            yield {"team": team, "by": name, "seconds": ahead / HZ, "moments": count, "parts": len(each),
                   "cm": float(np.mean(way)), "low": low, "high": high,
                   "degrees": float(np.mean([one[place, 1] for one in each]))}


def recorded(study: Study, team: str, which: slice) -> list[Part]:
    """Some recordings of a demonstrator."""
    store = Store(study.data / "learned" / f"{team}-copy0-{max(study.recorded)}")
    receipts = {receipt.name: receipt for receipt in store.receipts("options")}
    parts = []
    for _, path in study.recordings(team, noisy=False)[which]:
        log = matches.read(path.read_bytes(), where=path.name)
        side = 0 if log.info.home == NAME else 1
        clues = table_of(store, receipts[log.info.match_id], Clues).filter(pl.col("team") == SIDES[side])
        parts.append(Part(_bodies(log)[1], side, clues, log.info.pitch))
    return parts


def _bodies(log: MatchLog) -> tuple[pl.DataFrame, Bodies]:
    """Trajectories and bodies of a match."""
    table, _ = trajectories(log, TrajectorySettings())
    return table, bodies(table, 1 / HZ)


def minutes(path: Path, settings: OptionSettings) -> list[list[Part]]:
    """The minutes of a match, for each team."""
    log = read(path)
    table, match = _bodies(log)
    _, clues, _ = options(table, log.info.pitch, settings, shipped_ratios())
    minute = (match.t_ns - match.t_ns[0]) // _MINUTE_NS
    found: list[list[Part]] = [[], []]
    for team, side in enumerate(SIDES):
        for each in np.unique(minute):
            own = match._replace(t_ns=match.t_ns[minute == each], segment=match.segment[minute == each],
                                 places=match.places[minute == each])
            kept = clues.filter(
                pl.col("team") == side, pl.col("start_ns").is_between(own.t_ns[0], own.t_ns[-1]))
            if not kept.is_empty():
                found[team].append(Part(own, team, kept, log.info.pitch))
    return found


def main(
    study: Study, out: Path = FOLDER / "motion.csv", teams: Sequence[str] = TEAMS, count: int = LEARNED,
    foretell: int = FORETOLD, sample: Path | None = SAMPLE,
) -> pl.DataFrame:  # fmt: skip
    """Learn, foretell, and write the table."""
    settings, rows = OptionSettings(), list[dict[str, object]]()
    for team in teams:
        model = learned(recorded(study, team, slice(count)), settings)
        parts = recorded(study, team, slice(-foretell, None))
        rows += rows_of(team, [(part, model) for part in parts], settings)
    if sample is not None:
        tested = []
        for own in minutes(sample, settings):
            middle = len(own) // 2
            for known, others in ((own[:middle], own[middle:]), (own[middle:], own[:middle])):
                model = learned(known, settings)
                tested += [(part, model) for part in others]
        rows += rows_of(sample.name, tested, settings)
    numbers = dict.fromkeys(("cm", "low", "high", "degrees", "seconds"), pl.Float64)
    table = pl.DataFrame(rows, schema_overrides=numbers).with_columns(pl.col(*numbers).round(2))
    table.write_csv(out)
    return table


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "data" / "from-recordings"
    with pl.Config(tbl_rows=-1, fmt_str_lengths=50):
        print(main(Study(folder)))
