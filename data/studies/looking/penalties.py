"""Penalties: at our rate, at that of recorded play, at none, and with the goalkeeper on its line.

``penalties.py DATA`` (a quarter of an hour, and as much for each season that DATA has not) plays each
team against static under each of :data:`LAWS`, with the same seeds. The laws are the intervention: nobody
was retrained. Seeds and laws were written down before any match was played. Then it judges the recorded
match by the same referee.

``penalties.csv`` has a row for each team and law, and what came of each side's penalties within 5 s.
``judged.csv`` has a row for each way in which the recording was judged. Its teams did not know these laws.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import harness
import numpy as np
import polars as pl
from harness import SAMPLE, read
from looking.learners import CONSTANT, STATIC, USUAL
from looking.pairs import of_pairs
from scipy.special import gammaincinv

from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.physics.laws import FOUL, GOAL, PENALTY, PLAY_ON, RefereeSettings
from pitchlore.pipeline.arena.physics.referee import Laws, begin, referee_call
from pitchlore.pipeline.engine.evaluations import evaluate
from pitchlore.pipeline.engine.placement.executors import Executors
from pitchlore.pipeline.engine.placement.places import executors_at
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.game.bodies import BALL, Record
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.statistics import mean_interval, wilson
from pitchlore.pipeline.stages.evaluations import Evaluation
from pitchlore.pipeline.store import Store

#: Seasons whose apprentices play, by settings and seeds.
SEASONS = (("looking-held", (4301, 4302)), ("looking-all", (4303,)))
TEAMS = (*(f"{name}-{STATIC}-{seed}" for name, seeds in SEASONS for seed in seeds), CONSTANT)
#: The laws, by their name in the tables, and what differs from the usual ones. A tenth is 1.6 penalties a
#: match, as in the recording by crowds that last, of the 16 of apprentices by the usual laws.
USUALLY: Final = "all penalties"
LAWS: Mapping[str, Mapping[str, Any]] = {
    USUALLY: {}, "a tenth of them": {"penalty_share": 0.1}, "none": {"penalty": False},
    "all, the goalkeeper on its line": {"keeper_on_line": True}}
#: Seeds of the pairs of matches, which nothing else has.
SEEDS = range(4_430_000, 4_430_050)
#: Ways to judge the recording.
JUDGED: Mapping[str, Mapping[str, Any] | None] = {
    "as recorded": None, "crowds that last": {"remember_crowds": False}, "all crowds": {}}
#: Minutes of a match.
_MINUTES = USUAL.referee.duration_s / 60


def played(store: Store, word: str, executors: Executors) -> Iterator[dict[str, object]]:
    """Rows of a team, one for each law; what is missing is played."""
    usual: F64 | None = None
    for name, law in LAWS.items():
        policies: dict[str, PolicyTables] = {}
        team, other = (entrant(store, each, policies) for each in (word, STATIC))
        how = USUAL.model_copy(update={"referee": USUAL.referee.model_copy(update=dict(law))})
        whole = Evaluation(**how.of_match(), team=team, opponent=other)
        rows = evaluate(store, whole, SEEDS, policies, executors)[0]
        difference = of_pairs(rows).sort("seed")["difference"].to_numpy()
        usual = difference if usual is None else usual
        yield {
            "team": word, "laws": name, "matches": len(rows),
            **_interval("difference", difference),
            **_interval("change", difference - usual if name != USUALLY else np.array([])),
            **_penalties(rows, "for"), **_penalties(rows, "against"),
        }


def _interval(name: str, values: F64) -> dict[str, float | None]:
    """The mean of some pairs with Student's interval; None of none."""
    low, high = mean_interval(values) or (None, None)
    return {name: float(values.mean()) if len(values) else None, f"{name}_low": low, f"{name}_high": high}


def _penalties(rows: pl.DataFrame, whom: str) -> dict[str, float | None]:
    """Fouls and penalties a match of a side, and the share scored within 5 s with Wilson's interval."""
    counted = ("fouls", "penalties", "penalty_goals")
    fouls, taken, scored = (int(rows[f"{what}_{whom}"].sum()) for what in counted)
    low, high = wilson(scored, taken) if taken else (None, None)
    return {
        f"fouls_{whom}": fouls / len(rows), f"penalties_{whom}": taken / len(rows),
        f"scored_{whom}": scored / taken if taken else None,
        f"scored_{whom}_low": low, f"scored_{whom}_high": high,
    }


def judged(log: MatchLog, laws: RefereeSettings) -> int:
    """Penalties that our referee calls in a recorded match, in which play then goes on as it was recorded.

    It begins anew at each recorded restart. After a foul it looks away until the ball has left the goal
    areas, and after a goal until the restart.
    """
    whole = laws.model_copy(update={"duration_s": 86_400.0})  # no half ends while it looks
    rules = Laws.of(log.info.pitch, whole, (len(log.frames) - 1) / (log.frames.t_ns[-1] / 1e9))
    bodies, t_ns = _bodies(log), log.frames.t_ns
    penalties = 0
    for first, last in _played(log):
        state, away = _in_play(log, int(t_ns[first])), False
        for frame in range(first + 1, last):
            x, y = np.abs(bodies[frame, BALL, :2])
            away = away and x > rules.marks.area_x and y < rules.marks.area_y
            if away:
                continue
            call = referee_call(bodies[frame], state, rules.limits)
            if call == GOAL:
                break
            if call == FOUL:
                penalties += int(state["due"]) == PENALTY
                state, away = _in_play(log, int(t_ns[frame])), True
    return penalties


def _played(log: MatchLog) -> Iterator[tuple[int, int]]:
    """Frames of the restarts, and of what ends play after each: a restart, or the frame after a stop.

    A goal at the frame of its kick-off came before it.
    """
    events = log.referee.with_columns(pl.col("event").cast(pl.String), frame=np.searchsorted(
        log.frames.t_ns, log.referee["t_ns"].to_numpy()))
    resting = pl.col("event").is_in(["stop", "goal", "end"])
    begun = sorted({0, *events.filter(~resting)["frame"]})
    stops = events.filter(resting)["frame"].to_list()
    for first, following in pairwise([*begun, len(log.frames)]):
        yield first, min([following, *(stop + 1 for stop in stops if stop > first)])


def _in_play(log: MatchLog, t_ns: int) -> Record:
    """The referee's memory of nothing, in the half of a moment."""
    state = begin()
    state["due"] = PLAY_ON
    halves = (period for period in log.info.periods if period.start_ns <= t_ns < period.end_ns)
    state["halves_over"] = next((half.home_attacks < 0 for half in halves), False)
    return state


def _bodies(log: MatchLog) -> F64:
    """Bodies of all frames [F, 1 + 2 N, 6] with the velocities between samples, m/s; all robots are seen."""
    robots = log.frames.robots.reshape(len(log.frames), -1)
    bodies = np.zeros((len(log.frames), 1 + robots.shape[1], 6))
    order = np.argsort(robots["team"].astype(int) * 1000 + robots["id"], axis=1)
    for column, name in enumerate(("x", "y")):
        bodies[:, BALL, column] = log.frames.ball[name]
        bodies[:, 1:, column] = np.take_along_axis(robots[name], order, axis=1)
    seconds = np.diff(log.frames.t_ns) / 1e9
    bodies[1:, :, 3:5] = np.diff(bodies[:, :, :2], axis=0) / seconds[:, None, None]
    return bodies


def recorded(path: Path = SAMPLE) -> pl.DataFrame:
    """Penalties of a recorded match, judged in each way, with the exact interval of a Poisson count."""
    log = read(path)
    minutes = float(log.frames.t_ns[-1]) / 60e9
    faults = log.referee.filter(pl.col("event").cast(pl.String) == "fault")
    called, share = int(faults["note"].str.contains("(?i)penalty").sum()), _MINUTES / minutes
    rows = []
    for name, laws in JUDGED.items():
        count = called if laws is None else judged(log, RefereeSettings(**laws))
        rows.append({
            "recording": path.name, "judged": name, "minutes": minutes, "penalties": count,
            "a_match": share * count, "low": share * gammaincinv(count, 0.025) if count else 0.0,
            "high": share * gammaincinv(count + 1, 0.975)})
    return pl.DataFrame(rows)


def main(out: Path, data: Path) -> None:
    """Play what is missing, judge the recording, and write both tables."""
    for name, seeds in SEASONS:
        harness.seasons(name, seeds, data)
    store = Store(data)
    with executors_at(None, store.root) as executors:
        rows = [row for word in TEAMS for row in played(store, word, executors)]
    pl.DataFrame(rows, infer_schema_length=None).write_csv(out / "penalties.csv", float_precision=3)
    recorded().write_csv(out / "judged.csv", float_precision=2)


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1]))
