"""Situations of every robot of a match, with start and end (paper section 3.2.1, Table 1).

The rules (:mod:`pipeline.situations.rules`) are compiled once for each kind of match. They run over
blocks of samples: geometry to signals, signals to degrees of conditions, degrees to occurrences,
occurrences to one sequence.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from pipeline.arrays import F64, I64, U8
from pipeline.errors import SchemaMismatch
from pipeline.pitch import SCALES, Pitch
from pipeline.settings import SituationSettings
from pipeline.situations import conditions, signals
from pipeline.situations.dense import DenseMatch, dense_match
from pipeline.situations.occurrences import (
    CLOCK_NS,
    MARK,
    OCCURRENCE,
    WHILE,
    Gaps,
    Meanings,
    Rows,
    Samples,
    advance,
    cut,
    finish,
    resolve,
)
from pipeline.situations.rulebook import RuleSet, compiled, holds_ns
from pipeline.situations.rules import RULES, TABLE_1, Start, Target
from schemas import ROLES, SIDES, Situations
from schemas.situations import MOVES_RANDOMLY

#: Float64 registers worked on at a time; so many fit in a second-level cache of half a megabyte or more.
REGISTERS = 80_000

#: Tolerance of ``fire_at``, because degrees are rounded: a condition that holds to exactly it does hold.
ROUNDING = 1e-9


def recognise(trajectories: pl.DataFrame, pitch: Pitch, settings: SituationSettings) -> pl.DataFrame:
    """Recognise the situations of every robot of both teams, each from its own team's point of view.

    Samples without play are left out, and so are suspect bodies. A robot that is away for longer than
    ``flicker_s`` starts a new sequence when it is back. A condition does not hold if it is about a
    missing body, or about an unknown heading or velocity.

    Args:
        trajectories: rows of schema Trajectories of one match, sorted as it says.
        pitch: the field of play; its kind scales distances and speeds.
        settings: thresholds and times.

    Returns:
        Rows of schema Situations, sorted by team, robot, start_ns. ``start_ns`` is the time of the
        first sample (inclusive). ``end_ns`` is the time of the first sample after it (exclusive). Where
        the sequence ends, it is the last sample's time plus the segment's median interval, at most the
        time of the match's next sample. ``strength`` is defined at
        :func:`pipeline.situations.occurrences.advance`; a merged situation has the least of its parts'.

    Raises:
        SchemaMismatch: if the table holds several matches or is not sorted.
    """
    if trajectories.is_empty():
        return Situations.empty()
    match_id = trajectories["match_id"][0]
    if trajectories["match_id"].n_unique() != 1:
        raise SchemaMismatch(
            "holds more than one match", where="trajectories", next_step="Recognise one match at a time"
        )
    match = dense_match(trajectories, SCALES[pitch.kind])
    distances = signals.ball_distances(match.poses, match.ball)
    median_ns = _median_intervals(match)
    workers = {name: _Worker(rules, settings) for name, rules in compiled(pitch.kind).items()}
    parts = []
    for row in range(len(match.robot)):
        samples = _samples(row, match, median_ns, settings)
        if len(samples.place):
            found = _occurrences(row, match, samples, distances, pitch, workers)
            parts.append(_situations(row, match, samples, found, settings))
    if not parts:
        return Situations.empty()
    return _table(match, str(match_id), {
        name: np.concatenate([part[name] for part in parts]) for name in parts[0]})


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


def _median_intervals(match: DenseMatch) -> I64:
    """Median sampling interval of each sample's segment, int64 [T] nanoseconds; 0 in one of one sample."""
    medians = np.zeros(len(match.t_ns), dtype=np.int64)
    edges = np.flatnonzero(np.diff(match.segment)) + 1
    for start, end in zip([0, *edges.tolist()], [*edges.tolist(), len(match.t_ns)], strict=True):
        if end - start > 1:
            medians[start:end] = int(np.median(np.diff(match.t_ns[start:end])))
    return medians


def _samples(row: int, match: DenseMatch, median_ns: I64, settings: SituationSettings) -> Samples:
    """The samples in play of the robot in ``row``."""
    index = np.flatnonzero(match.present[row] & (match.segment >= 0))
    t_ns, segment = match.t_ns[index], match.segment[index]
    away = (np.diff(index) > 1) & (np.diff(t_ns) > _ns(settings.flicker_s) + CLOCK_NS)
    fresh = np.concatenate(([True], away | (np.diff(segment) != 0)))[: len(index)]
    follows = np.append(match.t_ns, np.iinfo(np.int64).max)[index + 1]
    until_ns = np.minimum(t_ns + median_ns[index], follows)
    goes_on = ~fresh[1:]
    until_ns[:-1][goes_on] = t_ns[1:][goes_on]
    return Samples(index, t_ns, until_ns, np.cumsum(fresh), fresh)


class _Worker:
    """Runs one group of rules over a robot's samples; one robot after the other uses its buffers."""

    def __init__(self, rules: RuleSet, settings: SituationSettings) -> None:
        self.rules = rules
        self.records = rules.records.copy()
        self.records["lull_ns"] = np.where(
            rules.records["start"] == WHILE, _ns(settings.flicker_s), _ns(settings.lull_s)
        )
        self.records["hold_ns"] = holds_ns(settings.fire_at)[rules.places]
        self.fire_at = settings.fire_at - ROUNDING
        self.longest_ns = _ns(settings.longest_s)
        self.block = REGISTERS // rules.program.registers
        self.registers = np.empty((rules.program.registers, self.block))
        self.found = np.empty(len(rules.places) * (self.block + 1), dtype=OCCURRENCE)

    def run(self, samples: Samples, other: int, fill: Callable[[int, int, F64], None]) -> Rows:
        """Occurrences of the group's rules, OCCURRENCE [M]; ``rule`` counts in RULES.

        Args:
            samples: the robot's.
            other: row of the other robot that the rules are about, -1 for none.
            fill: fills the signals of a block: (first sample, samples, registers).
        """
        program, t_ns = self.rules.program, samples.t_ns
        marks = np.zeros(len(self.rules.places), dtype=MARK)
        marks["held"] = marks["set_in"] = -1
        parts: list[U8] = []
        for at in range(0, len(t_ns), self.block):
            n = min(self.block, len(t_ns) - at)
            fill(at, n, self.registers)
            conditions.execute(program.steps, program.lines, self.registers, n)
            count = advance(
                self.registers, self.records, t_ns, samples.fresh, self.fire_at, self.longest_ns,
                at, n, other, marks, self.found,
            )
            # as bytes, because numpy copies records field by field
            parts.append(self.found[:count].view(np.uint8).copy())
        count = finish(self.records, t_ns, other, marks, self.found)
        parts.append(self.found[:count].view(np.uint8))
        found: Rows = cut(np.concatenate(parts).view(OCCURRENCE), self.records, samples, self.longest_ns)
        found["rule"] = self.rules.places[found["rule"]]
        return found


def _occurrences(
    row: int, match: DenseMatch, samples: Samples, distances: F64, pitch: Pitch, workers: dict[str, _Worker]
) -> Rows:
    """Occurrences of all rules in the samples of the robot in ``row``, OCCURRENCE [M]."""
    index = samples.place
    # most robots are there all the time: a slice of the arrays then costs nothing
    part = slice(index[0], index[-1] + 1) if index[-1] - index[0] + 1 == len(index) else index
    ours = match.team == match.team[row]
    mates = ours & (np.arange(len(ours)) != row)
    mine = np.ascontiguousarray(match.poses[:, row, part])
    ball = np.ascontiguousarray(match.ball[:, part])
    opponent = signals.nearest_to_ball(distances, ~ours, match.ball)[part]
    teammate = signals.nearest_to_ball(distances, mates, match.ball)[part]
    faces = SCALES[pitch.kind].faces
    own_goal_x = -pitch.goal_x if match.team[row] == 0 else pitch.goal_x

    def own(at: int, n: int, registers: F64) -> None:
        signals.fill_own(mine, ball, opponent, teammate, at, n, own_goal_x, faces, registers)

    parts = [workers["own"].run(samples, -1, own)]
    for other in np.flatnonzero(match.present[:, part].any(axis=1)):
        if other != row:
            x, y = match.poses[0, other, part], match.poses[1, other, part]
            worker = workers[Target.TEAMMATE if ours[other] else Target.OPPONENT]
            parts.append(worker.run(samples, int(other), partial(signals.fill_other, mine, x, y)))
    return np.concatenate([part.view(np.uint8) for part in parts]).view(OCCURRENCE)


def _situations(
    row: int, match: DenseMatch, samples: Samples, found: Rows, settings: SituationSettings
) -> dict[str, npt.NDArray[Any]]:
    """The situations of the robot in ``row`` from its occurrences, for :func:`_table`."""
    code, target = _codes_and_targets(row, match, samples, found)
    named = code > 0
    found, code, target = found[named], code[named], target[named]
    # priority, start, code; then rule and other robot, which only make the order definite
    key = _PRIORITY[code]
    for part, bits in ((found["k0"], 32), (code, 8), (found["rule"], 7), (found["other"] + 1, 10)):
        key = (key << bits) | part
    least_ns = np.minimum(holds_ns(settings.fire_at), _ns(settings.random_least_s))
    longest_ns = np.minimum(_LONGEST_NS[code], _ns(settings.longest_s))
    meanings = Meanings(code, target, longest_ns, least_ns[found["rule"]])
    gaps = Gaps(
        settings.least_share, MOVES_RANDOMLY, _ns(settings.random_least_s), _ns(settings.random_longest_s)
    )
    rows = resolve(np.argsort(key), found, meanings, samples, gaps)
    index = samples.place[rows["k0"]]
    return {
        "row": np.full(len(rows), row),
        "role": match.role[row, index],
        "code": rows["code"],
        "start_ns": samples.t_ns[rows["k0"]],
        "end_ns": samples.until_ns[rows["k1"] - 1],
        "strength": rows["strength"],
        "target": rows["target"],
        "segment": match.segment[index],
    }


def _table(match: DenseMatch, match_id: str, found: dict[str, npt.NDArray[Any]]) -> pl.DataFrame:
    """Rows of schema Situations from those of :func:`_situations`, one robot after the other."""
    robots = [f"{SIDES[team]}-{robot}" for team, robot in zip(match.team, match.robot, strict=True)]
    targets = pl.Series([*robots, *map(str, _THINGS), None], dtype=pl.String)
    return pl.DataFrame({
        "team": pl.Series(SIDES, dtype=pl.Enum(SIDES)).gather(match.team[found["row"]]),
        "robot": match.robot[found["row"]],
        "role": _ROLES.gather(found["role"]),
        "code": found["code"],
        "name": _NAMES.gather(found["code"]),
        "start_ns": found["start_ns"],
        "end_ns": found["end_ns"],
        "strength": found["strength"],
        "target": targets.gather(found["target"] % len(targets)),
        "segment": found["segment"],
    }).select(
        pl.lit(match_id).alias("match_id"), pl.exclude("strength"), pl.col("strength").fill_nan(None),
    ).select(*Situations.dtypes()).cast(pl.Schema(Situations.dtypes()))


def _codes_and_targets(row: int, match: DenseMatch, samples: Samples, found: Rows) -> tuple[I64, I64]:
    """Code (0 for none) and target of each occurrence, int64 [M]; the roles at its start decide the code."""
    rule, other = found["rule"], found["other"]
    start = samples.place[found["k0"]]
    role, other_role = match.role[row, start], match.role[other, start]
    turn = np.where(_TARGET[rule] == Target.TEAMMATE, (other_role - role) % len(ROLES), other_role)
    unknown = (other >= 0) & (other_role < 0)
    code = np.where(other < 0, _CODES[rule, 0], np.where(unknown, 0, _CODES[rule, turn]))
    things = len(match.robot) + np.array([_THINGS.index(t) if t in _THINGS else -1 for t in _TARGET])
    return code, np.where(other >= 0, other, np.where(_TARGET[rule] == Target.NOTHING, -1, things[rule]))


#: Targets that are not robots. In numbers they follow the robots' rows; -1 is none.
_THINGS = (Target.BALL, Target.OWN_GOAL, Target.ADVERSARY_GOAL)
_TARGET = np.array([rule.target for rule in RULES])
_CODES = np.array([rule.code if isinstance(rule.code, tuple) else (rule.code,) * 3 for rule in RULES])
_PRIORITY = np.array([TABLE_1.get(code, ("", None))[1] or 0 for code in range(MOVES_RANDOMLY + 1)])
_ROLES = pl.Series(ROLES, dtype=pl.Enum(ROLES))
_NAMES = pl.Series([TABLE_1.get(code, ("", None))[0] for code in range(MOVES_RANDOMLY + 1)])

#: How long situations of a code may last when merged, so that merging does not undo the cutting.
_LONGEST_NS = np.array([
    max(
        (_ns(rule.limit_s) for rule in RULES if rule.start == Start.WHILE and rule.code == code),
        default=np.iinfo(np.int64).max,
    )
    for code in range(MOVES_RANDOMLY + 1)
])
