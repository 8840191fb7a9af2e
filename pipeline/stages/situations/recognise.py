"""Situations of every robot of a match, with start and end (paper section 3.2.1, Table 1).

The rules (:mod:`pipeline.stages.situations.rules`) are compiled once for each kind of match. They run over
blocks of samples: geometry to signals, signals to degrees of conditions, degrees to occurrences,
occurrences to one sequence.
"""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations import signals
from pitchlore.pipeline.stages.situations.dense import DenseMatch, dense_match
from pitchlore.pipeline.stages.situations.matching import Worker, groups
from pitchlore.pipeline.stages.situations.naming import Robots, situation_rows, situations
from pitchlore.pipeline.stages.situations.occurrences import OCCURRENCE, RobotSamples, comes_back
from pitchlore.pipeline.stages.situations.rulebook import compiled
from pitchlore.schemas import Situations


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
        :func:`pipeline.stages.situations.occurrences.advance`; a merged one has the least of its parts'.

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
    workers = {name: Worker(rules, settings) for name, rules in compiled(pitch.kind).items()}
    robots = Robots(match.team, match.robot, match.role, match.segment)
    parts = []
    for row in range(len(match.robot)):
        samples = _samples(row, match, median_ns, settings)
        if not len(samples.place):
            continue
        found = []
        for group, other, fill in groups(row, match, samples.place, distances, pitch):
            worker = workers[group]
            marks = worker.marks()
            ended = b"".join(worker.advance(samples.t_ns, samples.fresh, 0, other, fill, marks))
            found.append(worker.finish(ended, samples, other, marks).tobytes())
        parts.append(situations(row, robots, samples, np.frombuffer(b"".join(found), OCCURRENCE), settings))
    return situation_rows(robots, str(match_id), parts)


def _median_intervals(match: DenseMatch) -> I64:
    """Median sampling interval of each sample's segment, int64 [T] nanoseconds; 0 in one of one sample."""
    medians = np.zeros(len(match.t_ns), dtype=np.int64)
    edges = np.flatnonzero(np.diff(match.segment)) + 1
    for start, end in zip([0, *edges.tolist()], [*edges.tolist(), len(match.t_ns)], strict=True):
        if end - start > 1:
            medians[start:end] = int(np.median(np.diff(match.t_ns[start:end])))
    return medians


def _samples(row: int, match: DenseMatch, median_ns: I64, settings: SituationSettings) -> RobotSamples:
    """The samples in play of the robot in ``row``."""
    index = np.flatnonzero(match.present[row] & (match.segment >= 0))
    t_ns, segment = match.t_ns[index], match.segment[index]
    starts = comes_back(index, t_ns, settings.flicker_s) | (np.diff(segment) != 0)
    fresh = np.concatenate(([True], starts))[: len(index)]
    return RobotSamples.of(index, t_ns, fresh, match.t_ns, median_ns)
