"""Situations: who does what, from when to when (paper section 3.2.1, Table 1).

The rules (:mod:`pipeline.situations.rules`) are compiled once for each kind of match and run over
blocks of samples: geometry to signals, signals to degrees of conditions, degrees to occurrences,
occurrences to one sequence.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt
import polars as pl

from pipeline.errors import SchemaMismatch
from pipeline.pitch import SCALES, Pitch
from pipeline.settings import SituationSettings
from pipeline.situations import conditions, occurrences, signals
from pipeline.situations.dense import DenseMatch, dense_match
from pipeline.situations.rulebook import RuleSet, compiled, rule_table, term_table
from pipeline.situations.rules import RULES, TABLE_1, Start, Target
from schemas import ROLES, TEAMS, Situations
from schemas.situations import MOVES_RANDOMLY

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

#: Float64 registers worked on at a time: as many as stay in a second-level cache of half a megabyte or more.
REGISTERS = 80_000

#: Degrees are rounded: a condition that should hold to exactly ``fire_at`` does hold.
ROUNDING = 1e-9

__all__ = ["recognise", "rule_table", "term_table"]


def recognise(trajectories: pl.DataFrame, pitch: Pitch, settings: SituationSettings) -> pl.DataFrame:
    """Recognise the situations of every robot of both teams, each from its own team's point of view.

    Samples at which play is stopped, and bodies that are suspect there, are not looked at. A robot that is
    away for longer than ``flicker_s`` starts anew when it is back. Conditions about a missing body, or
    about a heading or velocity that is not known, are not fulfilled.

    Args:
        trajectories: rows of schema Trajectories of one match, sorted as it says.
        pitch: the field of play; its kind decides what near and fast mean.
        settings: thresholds and times.

    Returns:
        Rows of schema Situations, sorted by team, robot, start_ns. ``start_ns`` is the time of the first
        sample (inclusive); ``end_ns`` that of the first sample after (exclusive), or, where nothing
        follows without interruption, the last sample's time and the segment's median interval, at most
        the time of the match's next sample. ``strength`` is as
        :func:`pipeline.situations.occurrences.advance` defines it; a merged situation has the least
        of its parts'.

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
    scene = dense_match(trajectories, SCALES[pitch.kind])
    distances = signals.ball_distances(scene.poses, scene.ball)
    median_ns = _median_intervals(scene)
    workers = {name: _Worker(rules, settings) for name, rules in compiled(pitch.kind).items()}
    parts = [
        _situations_of(row, scene, distances, median_ns, pitch, settings, workers)
        for row in range(len(scene.robot))
    ]
    rows = np.concatenate([np.empty((0, 7), dtype=np.int64), *(part[0] for part in parts)])
    strengths = np.concatenate([np.empty(0), *(part[1] for part in parts)])
    return _table(match_id, scene, rows, strengths)


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


def _median_intervals(scene: DenseMatch) -> I64:
    """Median sampling interval of each sample's segment, int64 [T] nanoseconds; 0 in one of one sample."""
    medians = np.zeros(len(scene.t_ns), dtype=np.int64)
    edges = np.flatnonzero(np.diff(scene.segment)) + 1
    for start, end in zip([0, *edges.tolist()], [*edges.tolist(), len(scene.t_ns)], strict=True):
        if end - start > 1:
            medians[start:end] = int(np.median(np.diff(scene.t_ns[start:end])))
    return medians


@dataclass(frozen=True, slots=True)
class _Samples:
    """The samples of one robot in play, k = 0, 1, … N - 1.

    Attributes:
        index: int64 [N], their places among the match's samples.
        t_ns: int64 [N].
        until_ns: int64 [N], where each one's own interval ends.
        piece: int64 [N], counts up where the sequence is interrupted.
        fresh: bool [N], whether a piece begins there.
    """

    index: I64
    t_ns: I64
    until_ns: I64
    piece: I64
    fresh: Flags


def _samples(scene: DenseMatch, row: int, median_ns: I64, settings: SituationSettings) -> _Samples:
    index = np.flatnonzero(scene.present[row] & (scene.segment >= 0))
    t_ns, segment = scene.t_ns[index], scene.segment[index]
    away = (np.diff(index) > 1) & (np.diff(t_ns) > _ns(settings.flicker_s) + occurrences.CLOCK_NS)
    fresh = np.concatenate(([True], away | (np.diff(segment) != 0)))[: len(index)]
    follows = np.append(scene.t_ns, np.iinfo(np.int64).max)[index + 1]
    until_ns = np.minimum(t_ns + median_ns[index], follows)
    goes_on = ~fresh[1:]
    until_ns[:-1][goes_on] = t_ns[1:][goes_on]
    return _Samples(index, t_ns, until_ns, np.cumsum(fresh), fresh)


def _situations_of(
    row: int, scene: DenseMatch, distances: F64, median_ns: I64, pitch: Pitch, settings: SituationSettings,
    workers: dict[str, _Worker],
) -> tuple[I64, F64]:
    """The situations of one robot.

    Returns:
        int64 [S, 7] rows (row, role, code, target, start_ns, end_ns, segment), see :func:`_target_names`
        for the targets, and the strengths float64 [S].
    """
    samples = _samples(scene, row, median_ns, settings)
    if len(samples.index) == 0:
        return np.empty((0, 7), dtype=np.int64), np.empty(0)
    found, strengths = _occurrences(row, scene, samples, distances, pitch, workers)
    code, target = _meanings(row, scene, samples, found)
    named = code > 0
    found, strengths, code, target = found[named], strengths[named], code[named], target[named]
    # priority, start, code; then rule and other robot, which only make the order definite
    key = _PRIORITY[code]
    for part, bits in (
        (found[:, occurrences.K0], 32), (code, 8),
        (found[:, occurrences.RULE], 7), (found[:, occurrences.OTHER] + 1, 10),
    ):
        key = (key << bits) | part
    rows, strengths = occurrences.resolve(
        np.argsort(key), found, strengths, code, target,
        np.minimum(_LONGEST_NS[code], _ns(settings.longest_s)),
        samples.t_ns, samples.until_ns, samples.piece, settings.least_share,
        MOVES_RANDOMLY, _ns(settings.random_least_s), _ns(settings.random_longest_s),
    )
    code, target, k0, k1 = rows.T
    index = samples.index[k0]
    return np.column_stack((
        np.full(len(rows), row), scene.role[row, index], code, target,
        samples.t_ns[k0], samples.until_ns[k1 - 1], scene.segment[index],
    )), strengths


class _Worker:
    """Runs one group of rules over a robot's samples; its buffers serve one robot after the other."""

    def __init__(self, rules: RuleSet, settings: SituationSettings) -> None:
        self.rules = rules
        self.settings = settings
        self.block = REGISTERS // rules.program.registers
        self.registers = np.empty((rules.program.registers, self.block))
        self.found = np.empty((len(rules.places) * (self.block + 1), 4), dtype=np.int64)
        self.strengths = np.empty(len(self.found))
        self.lull_ns = np.where(
            rules.start == occurrences.WHILE, _ns(settings.flicker_s), _ns(settings.lull_s)
        )

    def run(
        self, samples: _Samples, other: int, fill: Callable[[int, int, F64], None]
    ) -> tuple[I64, F64]:
        """Occurrences int64 [M, 4] (rule of RULES, other robot, k0, k1) and their strengths float64 [M].

        Args:
            samples: the robot's.
            other: row of the other robot that the rules are about, -1 if none.
            fill: fills the signals of a block: (first sample, samples, registers).
        """
        rules, t_ns = self.rules, samples.t_ns
        marks = np.full((len(rules.places), 2), -1, dtype=np.int64)
        degrees = np.zeros(len(rules.places))
        parts: list[tuple[I64, F64]] = []
        for at in range(0, len(t_ns), self.block):
            n = min(self.block, len(t_ns) - at)
            fill(at, n, self.registers)
            conditions.execute(rules.program.steps, rules.program.lines, self.registers, n)
            count = occurrences.advance(
                self.registers, rules.initial, rules.final, rules.start, rules.limit_ns, rules.hold_ns,
                self.lull_ns, _ns(self.settings.longest_s), self.settings.fire_at - ROUNDING,
                t_ns, samples.fresh, at, n, other, marks, degrees, self.found, self.strengths,
            )
            parts.append((self.found[:count].copy(), self.strengths[:count].copy()))
        count = occurrences.finish(
            rules.start, rules.hold_ns, t_ns, other, marks, degrees, self.found, self.strengths
        )
        parts.append((self.found[:count], self.strengths[:count]))
        found, strengths = occurrences.cut(
            np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts]),
            rules.start, np.minimum(rules.limit_ns, _ns(self.settings.longest_s)), rules.hold_ns, rules.once,
            t_ns, samples.until_ns,
        )
        found[:, occurrences.RULE] = rules.places[found[:, occurrences.RULE]]
        return found, strengths


def _occurrences(
    row: int, scene: DenseMatch, samples: _Samples, distances: F64, pitch: Pitch, workers: dict[str, _Worker]
) -> tuple[I64, F64]:
    """All that the rules find in one robot's samples, see :meth:`_Worker.run`."""
    index = samples.index
    # most robots are there all the time: a slice of the arrays then costs nothing
    part = slice(index[0], index[-1] + 1) if index[-1] - index[0] + 1 == len(index) else index
    ours = scene.team == scene.team[row]
    mates = ours & (np.arange(len(ours)) != row)
    mine = np.ascontiguousarray(scene.poses[:, row, part])
    ball = np.ascontiguousarray(scene.ball[:, part])
    opponent = signals.nearest_to_ball(distances, ~ours, scene.ball)[part]
    teammate = signals.nearest_to_ball(distances, mates, scene.ball)[part]
    own_goal_x = -pitch.goal_x if scene.team[row] == 0 else pitch.goal_x

    def own(at: int, n: int, registers: F64) -> None:
        signals.fill_own(mine, ball, opponent, teammate, at, n, own_goal_x, registers)

    parts = [workers["own"].run(samples, -1, own)]
    for other in np.flatnonzero(scene.present[:, part].any(axis=1)):
        if other != row:
            x, y = scene.poses[0, other, part], scene.poses[1, other, part]
            worker = workers[Target.TEAMMATE if ours[other] else Target.OPPONENT]
            parts.append(worker.run(samples, int(other), partial(signals.fill_other, mine, x, y)))
    return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])


def _meanings(row: int, scene: DenseMatch, samples: _Samples, found: I64) -> tuple[I64, I64]:
    """Code (0: none) and target of each occurrence; the roles at its start decide the code."""
    rule, other = found[:, occurrences.RULE], found[:, occurrences.OTHER]
    start = samples.index[found[:, occurrences.K0]]
    role, other_role = scene.role[row, start], scene.role[other, start]
    turn = np.where(_TARGET[rule] == Target.TEAMMATE, (other_role - role) % len(ROLES), other_role)
    unknown = (other >= 0) & (other_role < 0)
    code = np.where(other < 0, _CODES[rule, 0], np.where(unknown, 0, _CODES[rule, turn]))
    things = len(scene.robot) + np.array([_THINGS.index(t) if t in _THINGS else -1 for t in _TARGET])
    return code, np.where(other >= 0, other, np.where(_TARGET[rule] == Target.NOTHING, -1, things[rule]))


#: Targets that are not robots; in numbers they come after the robots' rows, -1 is none.
_THINGS = (Target.BALL, Target.OWN_GOAL, Target.ADVERSARY_GOAL)
_TARGET = np.array([rule.target for rule in RULES])
_CODES = np.array([rule.code if isinstance(rule.code, tuple) else (rule.code,) * 3 for rule in RULES])
_PRIORITY = np.array([TABLE_1.get(code, ("", None))[1] or 0 for code in range(MOVES_RANDOMLY + 1)])
_NAMES = pl.Series([TABLE_1.get(code, ("", None))[0] for code in range(MOVES_RANDOMLY + 1)])

#: How long situations of a code may last when merged, so that merging does not undo the cutting.
_LONGEST_NS = np.array([
    max(
        (_ns(rule.limit_s) for rule in RULES if rule.start == Start.WHILE and rule.code == code),
        default=np.iinfo(np.int64).max,
    )
    for code in range(MOVES_RANDOMLY + 1)
])


def _target_names(scene: DenseMatch) -> list[str | None]:
    """Names of the targets by number; the last is that of -1."""
    robots = [f"{TEAMS[team]}-{robot}" for team, robot in zip(scene.team, scene.robot, strict=True)]
    return [*robots, *(str(thing) for thing in _THINGS), None]


def _table(match_id: str, scene: DenseMatch, rows: I64, strengths: F64) -> pl.DataFrame:
    """Rows of schema Situations from what :func:`_situations_of` returns."""
    row, role, code, target, start_ns, end_ns, segment = rows.T
    targets = pl.Series(_target_names(scene), dtype=pl.String)
    columns = {
        "match_id": pl.repeat(match_id, len(rows), eager=True),
        "team": pl.Series(np.array(TEAMS)[scene.team[row]]),
        "robot": scene.robot[row],
        "role": pl.Series(np.array(ROLES)[role]),
        "code": code,
        "name": _NAMES.gather(code),
        "start_ns": start_ns,
        "end_ns": end_ns,
        "strength": pl.Series(strengths).fill_nan(None),
        "target": targets.gather(np.where(target < 0, len(targets) - 1, target)),
        "segment": segment,
    }
    return pl.DataFrame(columns).cast(pl.Schema(Situations.dtypes()))
