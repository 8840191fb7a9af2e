"""Tracker packets: bodies as a vision filter of the league or of a team estimates them."""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.base.text import NAME_CHARACTERS, printable
from pitchlore.pipeline.importers.ssl_logs import fields as f
from pitchlore.pipeline.importers.ssl_logs.container import ORDER, Batch
from pitchlore.pipeline.importers.ssl_logs.kicks import KickLog
from pitchlore.pipeline.importers.ssl_logs.samples import CapturedSamples
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, ROBOTS, YELLOW, Unused
from pitchlore.pipeline.importers.ssl_logs.wire import Fields, fields, texts
from pitchlore.pipeline.numbers.arrays import F64, I64, U8, Bools

#: Farther from the centre is nothing, metres; a clock that shows more has no number, seconds.
_FURTHEST_M, _LATEST_S = 1_000.0, 2.0**33
#: Columns of a robot, as in ``samples.CapturedSamples``, and whether it is seen. The ball has those from
#: ``_X`` on.
_TEAM, _ID, _X, _Y, _THETA, _VX, _VY, _OMEGA, _SEEN = range(9)


def trackers_of(batch: Batch) -> tuple[list[tuple[str, str]], I64]:
    """The trackers of a batch of tracker packets.

    Returns:
        uuid and name of each, and the tracker of each packet, int64 [M]; "" where a packet gives none.
    """
    return _sources(batch, fields(batch.data, batch.start, batch.end)[0])


def _sources(batch: Batch, packets: Fields) -> tuple[list[tuple[str, str]], I64]:
    names = [[b"", b""] for _ in range(len(batch.start))]
    for column, number in ((0, f.TRACKER_UUID), (1, f.TRACKER_NAME)):
        found = packets.spans(number)
        for packet, text in zip(found.of.tolist(), texts(batch.data, found.value, found.end), strict=True):
            names[packet][column] = text
    numbers: dict[tuple[bytes, bytes], int] = {}
    which = [numbers.setdefault((uuid, name), len(numbers)) for uuid, name in names]
    return [(_text(uuid), _text(name)) for uuid, name in numbers], np.array(which, dtype=np.int64)


def _text(data: bytes) -> str:
    return printable(data.decode(errors="replace"), NAME_CHARACTERS)


def tracker_samples(
    batch: Batch, uuid: str, visibility: float, kicks: KickLog | None = None
) -> tuple[CapturedSamples, Unused]:
    """Samples of one tracker's packets.

    Args:
        batch: tracker packets, of any source.
        uuid: id of the source.
        visibility: bodies with this visibility or less are left out.
        kicks: takes up the kicks that it tells.
    """
    packets, damaged = fields(batch.data, batch.start, batch.end)
    found, which = _sources(batch, packets)
    mine = np.array([text[0] == uuid for text in found], dtype=np.bool_)[which]
    frame = packets.spans(f.TRACKER_FRAME)
    inside, broken = fields(batch.data, frame.value, frame.end)
    inside = inside._replace(of=frame.of[inside.of])
    damaged[frame.of[broken]] = True
    there = np.zeros(len(mine), np.bool_)
    there[frame.of] = True
    captured, number = np.full(len(mine), np.nan), np.zeros(len(mine), np.int64)
    of, value = inside.varints(f.TRACKED_NUMBER)
    number[of] = value & 0xFFFFFFFF
    of, values = inside.reals(batch.data, f.TRACKED_TIME)
    captured[of] = values
    known = np.abs(captured) < _LATEST_S
    lost = int((mine & damaged).sum()) + int((mine & there & ~damaged & ~known).sum())
    sound = np.flatnonzero(mine & there & ~damaged & known)
    if kicks is not None:
        kicks.add(batch.data, inside, batch.packets[:, ORDER],
                  np.where(mine & there & ~damaged & known, captured, np.nan))
    robots, of, unused = _robots(batch.data, inside, visibility)
    used = np.isin(of, sound)
    ball = _balls(batch.data, inside, visibility, len(mine))
    return CapturedSamples(
        batch.packets[sound], captured[sound], number[sound], ball[sound],
        np.searchsorted(sound, of[used]), robots[used],
    ), Unused(lost, *(int(np.isin(packets_of, sound).sum()) for packets_of in unused))


def _balls(data: U8, inside: Fields, visibility: float, packets: int) -> F64:
    """Ball of each packet, float64 [packets, 4]: x, y, vx, vy; NaN if it is damaged, unseen or nowhere."""
    ball = np.full((packets, 4), np.nan)
    spans = inside.spans(f.TRACKED_BALLS)
    _, first = np.unique(spans.of, return_index=True)  # the first one is the primary one
    spans = spans.at(first)
    reported, damaged = fields(data, spans.value, spans.end)
    bodies = np.full((len(spans.of), 9), np.nan)
    _vectors(data, reported, f.TRACKED_BALL_PLACE, bodies, _X)
    _vectors(data, reported, f.TRACKED_BALL_SPEED, bodies, _VX)
    of, values = reported.reals(data, f.TRACKED_BALL_VISIBILITY)
    bodies[of, _SEEN] = values
    _bounded(bodies)
    bodies[damaged | (bodies[:, _SEEN] <= visibility) | ~_somewhere(bodies)] = np.nan
    ball[spans.of] = bodies[:, [_X, _Y, _VX, _VY]]
    return ball


def _robots(data: U8, inside: Fields, visibility: float) -> tuple[F64, I64, tuple[I64, I64]]:
    """Robots [R, 8] and their packets [R]; and packets of robots without a usable number or team, and place.

    A robot that comes twice in a packet is the first one.
    """
    spans = inside.spans(f.TRACKED_ROBOTS)
    reported, damaged = fields(data, spans.value, spans.end)
    robots = np.full((len(spans.of), 9), np.nan)
    robots[:, _ID] = -1
    identity = reported.spans(f.TRACKED_ROBOT_ID)
    inner, _ = fields(data, identity.value, identity.end)
    inner = inner._replace(of=identity.of[inner.of])
    for column, number in ((_ID, f.ID_NUMBER), (_TEAM, f.ID_TEAM)):
        of, value = inner.varints(number)
        robots[of, column] = value
    team = robots[:, _TEAM]
    robots[:, _TEAM] = np.where(team == f.ID_YELLOW, YELLOW, np.where(team == f.ID_BLUE, BLUE, np.nan))
    _vectors(data, reported, f.TRACKED_ROBOT_PLACE, robots, _X)
    _vectors(data, reported, f.TRACKED_ROBOT_SPEED, robots, _VX)
    for column, number in ((_THETA, f.TRACKED_ROBOT_ORIENTATION), (_OMEGA, f.TRACKED_ROBOT_TURN),
                           (_SEEN, f.TRACKED_ROBOT_VISIBILITY)):
        of, values = reported.reals(data, number)
        robots[of, column] = values
    robots[damaged, _X] = np.nan
    numbered = (robots[:, _ID] >= 0) & (robots[:, _ID] < ROBOTS) & np.isfinite(robots[:, _TEAM])
    somewhere = _somewhere(robots)
    _bounded(robots)
    used = np.flatnonzero(numbered & somewhere & ~(robots[:, _SEEN] <= visibility))
    team_id = robots[used, _TEAM] * ROBOTS + robots[used, _ID]
    key = spans.of[used] * 2 * ROBOTS + team_id.astype(np.int64)
    _, first = np.unique(key, return_index=True)
    used = used[np.sort(first)]
    return robots[used, :_SEEN], spans.of[used], (spans.of[~numbered], spans.of[numbered & ~somewhere])


def _vectors(data: U8, reported: Fields, number: int, bodies: F64, column: int) -> None:
    """Write the vectors with a number into two columns of their bodies; NaN where a coordinate is missing."""
    spans = reported.spans(number)
    inner, _ = fields(data, spans.value, spans.end)
    for axis, which in enumerate((f.VECTOR_X, f.VECTOR_Y)):
        of, values = inner.reals(data, which)
        bodies[spans.of[of], column + axis] = values


def _somewhere(bodies: F64) -> Bools:
    found: Bools = (np.abs(bodies[:, _X]) < _FURTHEST_M) & (np.abs(bodies[:, _Y]) < _FURTHEST_M)
    return found


def _bounded(bodies: F64) -> None:
    """Take what is no number of a match for unknown, but the place; a speed as a whole."""
    for columns in (slice(_THETA, _THETA + 1), slice(_VX, _VY + 1), slice(_OMEGA, _OMEGA + 1)):
        bodies[~(np.abs(bodies[:, columns]) < _FURTHEST_M).all(axis=1), columns] = np.nan
