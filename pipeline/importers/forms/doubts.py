"""Doubts about a table that is read: pitches that two games have, times and axes that look like others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.game.pitch import Kind, Pitch
from pitchlore.pipeline.importers.tracking.guesses import guess_pitch
from pitchlore.pipeline.importers.tracking.mapping import PitchMap, TrackingMap
from pitchlore.pipeline.matches.frame import Frames
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import F64, I64

#: Highest number of a player in 2D, and least interval of its samples, ns.
_SHIRT, _CYCLE_NS = 11, 99_000_000
#: Median sampling interval from which on the unit of time is likely to be wrong, ns.
_SLOW_NS = 1_000_000_000
#: Least number of frames to tell.
_TELLING = 100
#: The next finer unit of time.
_FINER = {"s": "ms", "ms": "us", "us": "ns"}
#: Share of robots' steps that are slower than the speed that is looked at, and one that nobody has, m/s.
_USUALLY, _FASTEST = 0.9, {Kind.VSSS: 5.0, Kind.SSL: 9.0, Kind.SIM2D: 15.0, Kind.HUMAN: 15.0}
#: Robots that are looked at for it.
_LOOK = 20_000
#: Bodies that reach less far along, or further across, as a share of half of the pitch, do not fit it.
_ALONG, _ACROSS = 0.8, 1.06
#: Share of bodies that are beyond what counts as how far they reach.
_STRAY = 0.001
#: Share of rows that are a second sample of a body at one time, from which on halves lie on each other.
_TWICE = 0.3


class GuessedPitch(NamedTuple):
    """The pitch of a table, whether its kind was inferred, and what is said of that."""

    pitch: Pitch
    inferred: bool
    flaws: list[Flaw]


def settled_pitch(table: pl.DataFrame, x: F64, given: PitchMap, *, corner: bool) -> GuessedPitch:
    """Pitch of a tracking table (``tracking.guesses``); one of 105 x 68 m is 2D's or people's.

    Samples that are closer than a cycle of 2D, or numbers above 11, are people's.

    Args:
        table: ``t_ns``, ``side``, ``id`` of each row.
        x: places along the pitch, metres, NaN where unknown.
        given: the map's pitch.
        corner: whether the origin of ``x`` is a corner.
    """
    pitch, inferred = guess_pitch(x, given, corner=corner)
    if not inferred or pitch.kind is not Kind.SIM2D:
        return GuessedPitch(pitch, inferred, [])
    t_ns = np.unique(table["t_ns"].to_numpy())
    shirt = table.filter(pl.col("side") < 2)["id"].max()
    why = ""
    if isinstance(shirt, int) and shirt > _SHIRT:
        why = f", because a player has the number {shirt}"
    elif len(t_ns) > 1 and (step := float(np.median(np.diff(t_ns)))) < _CYCLE_NS:
        why = f", because there is a sample each {step / 1e9:.3g} s"
    if why:
        pitch, _ = guess_pitch(x, given.model_copy(update={"kind": Kind.HUMAN}), corner=corner)
    kind, other = (Kind.HUMAN, Kind.SIM2D) if why else (Kind.SIM2D, Kind.HUMAN)
    called = {Kind.HUMAN: "people's football", Kind.SIM2D: "RoboCup 2D"}
    note = (f"a pitch of 105 x 68 m is that of {called[kind]} and of {called[other]}: taken for "
            f'{called[kind]}{why}; a map settles it, [pitch] kind = "{kind}" or "{other}"')
    return GuessedPitch(pitch, True, [Flaw("assumed", note)] if len(t_ns) >= _TELLING else [])


def check_once(table: pl.DataFrame, first: I64, name: str) -> None:
    """Refuse a table in which most bodies are at two places at one time, as where halves lie on each other.

    Args:
        table: ``t_ns``, ``side``, ``id``, ``x``, ``y``.
        first: int64 [F] index of each frame's first row.
        name: the file's name, for messages.

    Raises:
        BadRecording: if they are.
    """
    times = table["t_ns"].to_numpy()[first]
    if len(times) < _TELLING or len(np.unique(times)) > (1 - _TWICE) * len(times):
        return
    key = ["t_ns", "side", "id"]
    again = table.filter(pl.struct(key).is_duplicated()).group_by(key).agg(
        pl.len(), *(pl.col(axis).max() - pl.col(axis).min() for axis in ("x", "y")))
    if again.filter((pl.col("x") > 0) | (pl.col("y") > 0))["len"].sum() > _TWICE * len(table):
        raise BadRecording(
            "has bodies at several places at one time, as if halves that count from 0 were sorted by time, "
            "or a clock showed seconds", where=name,
            next_step="Write the half of each row in a column period, or the number of its frame in frame")


def doubts(
    frames: Frames, pitch: Pitch, mapping: TrackingMap, *, inferred: bool, mapped: bool = True
) -> list[Flaw]:
    """Flaws of times and axes that are likely to be others than the map says.

    Args:
        frames: the samples, in our axes and units.
        pitch: the pitch.
        mapping: the map.
        inferred: whether the pitch's kind was inferred.
        mapped: whether people can give a map; else they are told of none.
    """
    if len(frames) < _TELLING:
        return []
    t_ns = np.sort(frames.t_ns)
    end = int(t_ns[-1]) + 1
    flaws = []
    interval = float(np.median(np.diff(t_ns)))
    if interval >= _SLOW_NS:
        unit, note = mapping.units.time, f"the median sampling interval is {interval / 1e9:g} s"
        if mapped and unit in _FINER:
            note += f': if times are not in {unit}, say so in a map: [units] time = "{_FINER[unit]}"'
        flaws.append(Flaw("slow sampling", note, len(t_ns), 0, end))
    speed = _usual_speed(frames)
    if mapped and speed > _FASTEST[pitch.kind]:
        note = (f"robots move at {speed:.3g} m/s: nobody is so fast. Nothing is learned from it; if units "
                'are others, say so in a map, [units] time = "min" or length = "cm"')
        flaws.append(Flaw("implausible", note, len(t_ns), 0, end))
    some = frames.robots[::max(1, len(frames.robots) // _LOOK)]
    along, across = (float(np.nanquantile(np.abs(some[axis]), 1 - _STRAY)) * 2 / whole
                     for axis, whole in (("x", pitch.length), ("y", pitch.width)))
    if inferred and (along < _ALONG or across > _ACROSS):
        swapped = along * pitch.length < across * pitch.width
        cure = ('if x and y are exchanged, say so in a map, [columns] x = "y", y = "x"' if swapped else
                "if it is another, say so in a map, [pitch] kind, length and width, or [units] length")
        note = (f"bodies reach {along * pitch.length / 2:.3g} m along and {across * pitch.width / 2:.3g} m "
                f"across: taken for a pitch of {pitch.length:g} x {pitch.width:g} m ({pitch.kind}); {cure}")
        flaws.append(Flaw("assumed", note, len(t_ns)))
    return flaws


def _usual_speed(frames: Frames) -> float:
    """Speed that nine in ten steps of robots are below, m/s, in the middle of a match; 0 if none is known."""
    middle = max(0, len(frames.robots) // 2 - _LOOK // 2)
    robots = frames.robots[middle:middle + _LOOK]
    at = np.repeat(frames.t_ns, np.diff(frames.offsets))[middle:middle + _LOOK]
    who = robots["team"].astype(np.int64) << 16 | robots["id"]
    order = np.lexsort((at, who))
    dt = np.diff(at[order])
    far = np.hypot(np.diff(robots["x"][order]), np.diff(robots["y"][order]))
    same = (np.diff(who[order]) == 0) & (dt > 0) & np.isfinite(far)
    return float(np.quantile(far[same] / dt[same] * 1e9, _USUALLY)) if same.any() else 0.0
