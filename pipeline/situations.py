"""Situations: who does what, from when to when (paper section 3.2.1, Table 1).

The rules (:mod:`pipeline.rules`) are compiled once for each kind of match and run over blocks of samples:
geometry to signals, signals to degrees of conditions, degrees to occurrences, occurrences to one sequence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
import polars as pl

from pipeline import conditions, fuzzy, occurrences, signals
from pipeline.errors import SchemaMismatch
from pipeline.fuzzy import Variable
from pipeline.pitch import SCALES, Kind, Pitch
from pipeline.rules import MACROS, RANDOM, RULES, TABLE_1, Rule, Start, Target
from pipeline.settings import SituationSettings
from schemas import ROLES, TEAMS, Situations

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

#: Samples that are worked on at a time: their registers stay in the second-level cache.
BLOCK = 512

#: Degrees are rounded: a condition that should hold to exactly ``fire_at`` does hold.
ROUNDING = 1e-9

_STARTS = {Start.ONSET: occurrences.ONSET, Start.LATEST: occurrences.LATEST, Start.WHILE: occurrences.WHILE}


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
        the time of the match's next sample. ``strength`` is as :func:`pipeline.occurrences.advance`
        defines it; a merged situation has the least of its parts'.

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
    scene = signals.scene(trajectories, SCALES[pitch.kind])
    distances = signals.ball_distances(scene.poses, scene.ball)
    median_ns = _median_intervals(scene)
    parts = [
        _situations_of(row, scene, distances, median_ns, pitch, settings) for row in range(len(scene.robot))
    ]
    rows = np.concatenate([np.empty((0, 7), dtype=np.int64), *(part[0] for part in parts)])
    strengths = np.concatenate([np.empty(0), *(part[1] for part in parts)])
    return _table(match_id, scene, rows, strengths)


@dataclass(frozen=True, slots=True)
class _Rules:
    """Rules that look at the same signals, compiled.

    Attributes:
        rules: int64 [V], their places in RULES.
        code: their conditions.
        initial, final: int32 [V], registers of the conditions.
        start, limit_ns, hold_ns: int64 [V].
        once: bool [V].
    """

    rules: I64
    code: conditions.Code
    initial: npt.NDArray[np.int32]
    final: npt.NDArray[np.int32]
    start: I64
    limit_ns: I64
    hold_ns: I64
    once: Flags


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


def _variable(signal: str) -> Variable:
    """The fuzzy variable that a signal is a value of."""
    if signal.endswith("_distance"):
        return Variable.DISTANCE
    if signal == "heading_off_ball_course":
        return Variable.ORIENTATION
    return Variable.BEARING if "_off_" in signal else Variable.VELOCITY


@cache
def _compiled(kind: Kind) -> dict[str, _Rules]:
    """The rules about the robot itself, about opponents and about teammates."""
    terms = fuzzy.terms(SCALES[kind])

    def lines(signal: str, term: str) -> fuzzy.Lines:
        return fuzzy.lines(terms[_variable(signal)][term])

    def group(members: Sequence[int], names: tuple[str, ...]) -> _Rules:
        rules = [RULES[i] for i in members]
        texts = [text for rule in rules for text in (rule.initial, rule.final or rule.initial)]
        code = conditions.compile_conditions([conditions.parse(text, MACROS) for text in texts], names, lines)
        return _Rules(
            rules=np.array(members, dtype=np.int64), code=code,
            initial=code.outputs[0::2].copy(), final=code.outputs[1::2].copy(),
            start=np.array([_STARTS[rule.start] for rule in rules], dtype=np.int64),
            limit_ns=np.array([_ns(rule.limit_s) for rule in rules], dtype=np.int64),
            hold_ns=np.array([_ns(rule.hold_s) for rule in rules], dtype=np.int64),
            once=np.array([rule.once for rule in rules], dtype=np.bool_),
        )

    places: dict[str, list[int]] = {"own": [], Target.OPPONENT: [], Target.TEAMMATE: []}
    for i, rule in enumerate(RULES):
        places.get(rule.target, places["own"]).append(i)
    return {
        name: group(members, signals.OWN if name == "own" else signals.OTHER) for name, members in places.items()
    }


def _median_intervals(scene: signals.Scene) -> I64:
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


def _samples(scene: signals.Scene, row: int, median_ns: I64, settings: SituationSettings) -> _Samples:
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
    row: int, scene: signals.Scene, distances: F64, median_ns: I64, pitch: Pitch, settings: SituationSettings
) -> tuple[I64, F64]:
    """The situations of one robot.

    Returns:
        int64 [S, 7] rows (row, role, code, target, start_ns, end_ns, segment), see :func:`_target_names`
        for the targets, and the strengths float64 [S].
    """
    samples = _samples(scene, row, median_ns, settings)
    if len(samples.index) == 0:
        return np.empty((0, 7), dtype=np.int64), np.empty(0)
    found, strengths = _occurrences(row, scene, samples, distances, pitch, settings)
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
        RANDOM, _ns(settings.random_least_s), _ns(settings.random_longest_s),
    )
    code, target, k0, k1 = rows.T
    index = samples.index[k0]
    return np.column_stack((
        np.full(len(rows), row), scene.role[row, index], code, target,
        samples.t_ns[k0], samples.until_ns[k1 - 1], scene.segment[index],
    )), strengths


def _occurrences(
    row: int, scene: signals.Scene, samples: _Samples, distances: F64, pitch: Pitch, settings: SituationSettings
) -> tuple[I64, F64]:
    """All that the rules find in one robot's samples, [M, 4] (rule of RULES, other robot's row, k0, k1)."""
    rules = _compiled(pitch.kind)
    n = len(samples.index)
    index = samples.index
    ours = scene.team == scene.team[row]
    mates = ours & (np.arange(len(ours)) != row)
    opponent = signals.nearest_to_ball(distances, ~ours, scene.ball)[index]
    teammate = signals.nearest_to_ball(distances, mates, scene.ball)[index]
    mine = scene.poses[:, row, index]
    ball = scene.ball[:, index]
    own_goal_x = -pitch.goal_x if scene.team[row] == 0 else pitch.goal_x
    subjects = [(-1, rules["own"])] + [
        (other, rules[Target.TEAMMATE if ours[other] else Target.OPPONENT])
        for other in range(len(ours)) if other != row and scene.present[other, index].any()
    ]
    parts: list[tuple[I64, F64]] = []
    for other, about in subjects:
        registers = np.empty((about.code.registers, BLOCK))
        other_x, other_y = scene.poses[0, other, index], scene.poses[1, other, index]
        marks = np.full((len(about.rules), 2), -1, dtype=np.int64)
        degrees = np.zeros(len(about.rules))
        found = np.empty((len(about.rules) * (BLOCK + 1), 4), dtype=np.int64)
        strengths = np.empty(len(found))
        lull_ns = np.where(about.start == occurrences.WHILE, _ns(settings.flicker_s), _ns(settings.lull_s))
        pieces: list[tuple[I64, F64]] = []
        for at in range(0, n, BLOCK):
            width = min(BLOCK, n - at)
            if other < 0:
                signals.fill_own(mine, ball, opponent, teammate, at, width, own_goal_x, registers)
            else:
                signals.fill_other(mine, other_x, other_y, at, width, registers)
            conditions.execute(about.code.steps, about.code.lines, registers, width)
            count = occurrences.advance(
                registers, about.initial, about.final, about.start, about.limit_ns, about.hold_ns, lull_ns,
                _ns(settings.longest_s), settings.fire_at - ROUNDING, samples.t_ns, samples.fresh, at, width,
                other, marks, degrees, found, strengths,
            )
            pieces.append((found[:count].copy(), strengths[:count].copy()))
        count = occurrences.finish(
            about.start, about.hold_ns, samples.t_ns, other, marks, degrees, found, strengths
        )
        pieces.append((found[:count], strengths[:count]))
        whole, whole_strengths = (np.concatenate(column) for column in zip(*pieces, strict=True))
        whole, whole_strengths = occurrences.cut(
            whole, whole_strengths, about.start, np.minimum(about.limit_ns, _ns(settings.longest_s)),
            about.hold_ns, about.once, samples.t_ns, samples.until_ns,
        )
        whole[:, occurrences.RULE] = about.rules[whole[:, occurrences.RULE]]
        parts.append((whole, whole_strengths))
    return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])


def _meanings(row: int, scene: signals.Scene, samples: _Samples, found: I64) -> tuple[I64, I64]:
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
_PRIORITY = np.zeros(max(TABLE_1) + 1, dtype=np.int64)
_LONGEST_NS = np.full(max(TABLE_1) + 1, np.iinfo(np.int64).max)
for _code, (_, _priority) in TABLE_1.items():
    _PRIORITY[_code] = _priority or 0
for _rule in RULES:
    if _rule.start == Start.WHILE and isinstance(_rule.code, int):
        # merging does not undo the cutting
        _LONGEST_NS[_rule.code] = max(_ns(rule.limit_s) for rule in RULES if rule.code == _rule.code)


def _target_names(scene: signals.Scene) -> list[str | None]:
    """Names of the targets by number; the last is that of -1."""
    robots = [f"{TEAMS[team]}-{robot}" for team, robot in zip(scene.team, scene.robot, strict=True)]
    return [*robots, *(str(thing) for thing in _THINGS), None]


def _table(match_id: str, scene: signals.Scene, rows: I64, strengths: F64) -> pl.DataFrame:
    row, role, code, target, start_ns, end_ns, segment = rows.T
    names = pl.Series([TABLE_1[c][0] if c in TABLE_1 else "" for c in range(max(TABLE_1) + 1)])
    targets = pl.Series(_target_names(scene), dtype=pl.String)
    columns = {
        "match_id": pl.repeat(match_id, len(rows), eager=True),
        "team": pl.Series(np.array(TEAMS)[scene.team[row]]),
        "robot": scene.robot[row],
        "role": pl.Series(np.array(ROLES)[role]),
        "code": code,
        "name": names.gather(code),
        "start_ns": start_ns,
        "end_ns": end_ns,
        "strength": pl.Series(strengths).fill_nan(None),
        "target": targets.gather(np.where(target < 0, len(targets) - 1, target)),
        "segment": segment,
    }
    return pl.DataFrame(columns).cast(dict(Situations.dtypes()))
