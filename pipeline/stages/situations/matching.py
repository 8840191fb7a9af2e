"""Occurrences of the rules: one robot's samples, all at once or part by part."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations import conditions, signals
from pitchlore.pipeline.stages.situations.dense import DenseMatch
from pitchlore.pipeline.stages.situations.occurrences import (
    MARK,
    OCCURRENCE,
    WHILE,
    RobotSamples,
    Rows,
    advance,
    cut,
    finish,
    nanoseconds,
)
from pitchlore.pipeline.stages.situations.rulebook import RuleSet, holds_ns
from pitchlore.pipeline.stages.situations.rules import Target

#: Float64 registers worked on at a time; so many fit in a second-level cache of half a megabyte or more.
REGISTERS = 80_000

#: Tolerance of ``fire_at``, because degrees are rounded: a condition that holds to exactly it does hold.
ROUNDING = 1e-9

#: Fills the signals of a block of a robot's samples: (first sample, samples, registers).
Fill = Callable[[int, int, F64], None]


class Worker:
    """Runs one group of rules over a robot's samples; one robot after the other uses its buffers.

    Args:
        rules: the group.
        settings: thresholds and times.

    Attributes:
        lasts: whether the group has rules of WHILE; only these leave stretches open, and are cut.
    """

    def __init__(self, rules: RuleSet, settings: SituationSettings) -> None:
        self._rules = rules
        self._records = rules.records.copy()
        self._records["lull_ns"] = np.where(
            rules.records["start"] == WHILE, nanoseconds(settings.flicker_s), nanoseconds(settings.lull_s)
        )
        self._records["hold_ns"] = holds_ns(settings.fire_at)[rules.places]
        self.lasts = bool((rules.records["start"] == WHILE).any())
        self._fire_at = settings.fire_at - ROUNDING
        self._longest_ns = nanoseconds(settings.longest_s)
        self._block = REGISTERS // rules.program.registers
        self._registers = np.empty((rules.program.registers, self._block))
        self._found = np.empty(len(rules.places) * (self._block + 1), dtype=OCCURRENCE)

    def marks(self) -> Rows:
        """The marks before the first sample, MARK [V]."""
        marks = np.zeros(len(self._rules.places), dtype=MARK)
        marks["held"] = marks["set_in"] = -1
        return marks

    def advance(
        self, t_ns: I64, fresh: Bools, first: int, other: int, fill: Fill, marks: Rows
    ) -> Iterator[bytes]:
        """Occurrences that end at the samples from ``first`` on, block by block, as bytes of OCCURRENCE.

        ``rule`` counts in the group. (Bytes, because numpy copies records field by field.)

        Args:
            t_ns: int64 [N], as in Samples.
            fresh: bool [N], as in Samples.
            first: first sample that has not been worked on; ``fill`` counts from it.
            other: the other robot that the rules are about, -1 for none.
            fill: fills the signals.
            marks: marks of the samples before; changed.
        """
        program = self._rules.program
        for at in range(first, len(t_ns), self._block):
            n = min(self._block, len(t_ns) - at)
            fill(at - first, n, self._registers)
            conditions.execute(program.steps, program.lines, self._registers, n)
            count = advance(
                self._registers, self._records, t_ns, fresh, self._fire_at, self._longest_ns,
                at, n, other, marks, self._found,
            )
            if count:
                yield self._found[:count].tobytes()

    def interrupted(self, t_ns: I64, other: int, marks: Rows) -> bytes:
        """Occurrences that end with a piece, whose samples are the last of ``t_ns``; nothing stays marked."""
        count = finish(self._records, t_ns, other, marks, self._found)
        marks["held"] = -1
        return self._found[:count].tobytes()

    def finish(self, found: bytes, samples: RobotSamples, other: int, marks: Rows) -> Rows:
        """All occurrences up to the last sample, cut to their lengths; ``rule`` counts in RULES.

        Args:
            found: from :meth:`advance`.
            samples: the robot's.
            other: as for :meth:`advance`.
            marks: as the last sample left them; not changed.
        """
        if not self.lasts:
            return self.named(found)
        count = finish(self._records, samples.t_ns, other, marks, self._found)
        whole = np.frombuffer(found + self._found[:count].tobytes(), OCCURRENCE)
        rows: Rows = cut(whole, self._records, samples, self._longest_ns)
        rows["rule"] = self._rules.places[rows["rule"]]
        return rows

    def named(self, found: bytes) -> Rows:
        """Occurrences as they were found, but for ``rule``, which counts in RULES."""
        rows: Rows = np.frombuffer(found, OCCURRENCE).copy()
        rows["rule"] = self._rules.places[rows["rule"]]
        return rows


def groups(
    row: int, match: DenseMatch, index: I64, distances: F64, pitch: Pitch
) -> Iterator[tuple[str, int, Fill]]:
    """The groups of rules about a robot: name, row of the other robot (-1: none), what fills their signals.

    Args:
        row: row of the robot.
        match: the match, or a part of it.
        index: int64 [N], places of the robot's samples among those of ``match``; not empty.
        distances: from :func:`pipeline.stages.situations.signals.ball_distances`.
        pitch: the field of play.
    """
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

    yield "own", -1, own
    for other in np.flatnonzero(match.present[:, part].any(axis=1)):
        if other != row:
            x, y = match.poses[0, other, part], match.poses[1, other, part]
            group = Target.TEAMMATE if ours[other] else Target.OPPONENT
            yield group, int(other), partial(signals.fill_other, mine, x, y)
