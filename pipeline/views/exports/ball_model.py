"""Model of the ball, fitted to a match: how it slides and rolls, and how fast it is kicked.

After a kick a ball slides and slows down fast until it rolls; from then on it slows down little. It is the
model of two phases that the league's own messages and simulators have (ER-Force's extended team description
of 2016; RoboCup-SSL/ssl-vision, pull request 180). Its numbers differ from carpet to carpet, so teams ask for
them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.matches.frame import Frames
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools

#: A ball is free if no robot is so near to it beyond both radii, metres, and if its samples are as dense, s.
_NEAR_M, _GAP_S = 0.05, 0.1
#: A roll is straight within this, metres; it lasts as long, has as many samples, and goes as far.
_STRAIGHT_M, _LASTS_S, _SAMPLES, _FAR_M = 0.02, 0.5, 16, 0.3
#: Rolls that are needed, and the most samples of one that are looked at.
_FEWEST, _MOST = 5, 400
#: A slide is believed if it makes the fit so much better (Bayes's criterion), if it slows the ball by so much
#: more than rolling does, m/s², and if it ends at such a share of the kick's speed.
_BETTER, _HARDER, _SHARES = 10.0, 0.8, (0.4, 0.95)
_RESAMPLED, _SEED = 1_000, 20_260


class Interval(NamedTuple):
    """A weighted median over rolls and its 95 % interval, by resampling rolls; and their number."""

    value: float
    low: float
    high: float
    rolls: int

    def __str__(self) -> str:
        return f"{self.value:.3g} [{self.low:.3g}, {self.high:.3g}] ({self.rolls} rolls)"


class BallModel(NamedTuple):
    """Model of the ball of a match.

    Attributes:
        rolling, sliding: decelerations, m/s²; None where no slide was seen.
        share: share of the kick's speed at which it begins to roll.
        kicks: speed just after a kick, m/s, of each slide, rising.
        kicked: their median.
    """

    rolling: Interval
    sliding: Interval | None
    share: Interval | None
    kicks: F64
    kicked: Interval | None


class _Roll(NamedTuple):
    """A free roll: speed at the start, decelerations, share at the switch, weight; NaN without a slide."""

    speed: float
    rolling: float
    sliding: float
    share: float
    weight: float


def ball_model(frames: Frames, pitch: Pitch, name: str) -> BallModel:
    """Model of the ball of a match.

    Args:
        frames: samples as recorded.
        pitch: the pitch, for its kind.
        name: the match, for errors.

    Raises:
        BadRecording: if the ball is seldom seen to roll freely.
    """
    rolls = [roll for t, s in _stretches(frames, pitch) if (roll := _fitted(t, s)) is not None]
    columns = np.array(rolls).reshape(-1, 5)
    slides = np.isfinite(columns[:, 2])
    rolling = np.isfinite(columns[:, 1])
    if rolling.sum() < _FEWEST:
        raise BadRecording(
            f"has {int(rolling.sum())} free rolls of the ball, fewer than {_FEWEST}", where=name,
            next_step="Take a longer recording, or one in which cameras see the ball more often")
    weights, of_slides = columns[:, 4], columns[slides]
    some = slides.sum() >= _FEWEST
    equal = np.ones(int(slides.sum()))
    return BallModel(
        _interval(columns[rolling, 1], weights[rolling]),
        _interval(of_slides[:, 2], equal) if some else None,
        _interval(of_slides[:, 3], equal) if some else None,
        np.sort(of_slides[:, 0]),
        _interval(of_slides[:, 0], equal) if some else None,
    )


def physics_toml(model: BallModel, name: str) -> str:
    """Settings of the arena by a model, as TOML; what the arena has no word for is a comment."""
    lines = [f"# The ball of {name}; medians with 95 % intervals. pitchlore record --settings THIS",
             f"# rolling, m/s2: {model.rolling}"]
    if model.sliding is not None and model.share is not None:
        acc = -model.sliding.value, -model.rolling.value
        fast = np.quantile(model.kicks, 0.9)
        lines += [
            f"# sliding, m/s2: {model.sliding}; the arena's ball does not slide",
            f"# share of the kick's speed at which it begins to roll: {model.share}",
            f"# kick, m/s: {model.kicked}; nine of ten below {fast:.3g}, the fastest {model.kicks[-1]:.3g}",
            (f"# in SSL-Vision's geometry: acc_slide = {acc[0]:.3g}, acc_roll = {acc[1]:.3g}, "
            f"k_switch = {model.share.value:.3g}"),
        ]
    else:
        lines.append(f"# {len(model.kicks)} slides after a kick were seen: too few to say more")
    return "\n".join([*lines, "[physics]", f"rolling = {max(model.rolling.value, 0.0):.4g}", ""])


def _stretches(frames: Frames, pitch: Pitch) -> Iterator[tuple[F64, F64]]:
    """Times and ways of each free roll, seconds and metres, from its first sample on."""
    scale = SCALES[pitch.kind]
    order = np.argsort(frames.t_ns, kind="stable")
    t = frames.t_ns[order] / 1e9
    ball = np.column_stack([frames.ball[axis].astype(np.float64) for axis in ("x", "y")])
    free = _free(frames, ball, scale.robot_radius + scale.ball_radius + _NEAR_M)[order]
    ball = ball[order]
    step, gap = np.hypot(*np.diff(ball, axis=0).T), np.diff(t)
    near = step <= 1.5 * scale.max_ball_speed * gap + _STRAIGHT_M
    goes_on = free[1:] & free[:-1] & (gap > 0) & (gap <= _GAP_S) & near
    for part in np.split(np.arange(len(t)), np.flatnonzero(~goes_on) + 1):
        yield from _straight(t[part], ball[part])


def _free(frames: Frames, ball: F64, near: float) -> Bools:
    """Mask of the samples in which the ball is seen and no robot is near, bool [F]."""
    of = frames.robot_frames()
    away = np.hypot(frames.robots["x"] - ball[of, 0], frames.robots["y"] - ball[of, 1])
    free: Bools = np.isfinite(ball[:, 0]) & np.isfinite(ball[:, 1])
    free[of[away < near]] = False
    return free


def _straight(t: F64, ball: F64) -> Iterator[tuple[F64, F64]]:
    """The straight rolls of a stretch: it is cut where it is farthest from the line between its ends."""
    if len(t) < _SAMPLES or t[-1] - t[0] < _LASTS_S:
        return
    ahead = ball[-1] - ball[0]
    far = float(np.hypot(*ahead))
    away = ball - ball[0]
    if far < _FAR_M:
        apart = np.hypot(*away.T)
        cut = int(np.argmax(apart))
        off = float(apart[cut])
    else:
        apart = np.abs(away @ np.array([-ahead[1], ahead[0]]) / far)
        cut = int(np.argmax(apart))
        off = float(apart[cut])
    if far >= _FAR_M and off <= _STRAIGHT_M:
        s = away @ ahead / far
        if (np.diff(s) > -_STRAIGHT_M).all():
            some = np.unique(np.linspace(0, len(t) - 1, _MOST).astype(np.int64))
            yield t[some] - t[0], s[some]
        return
    if off > _STRAIGHT_M and 0 < cut < len(t) - 1:
        yield from _straight(t[:cut], ball[:cut])
        yield from _straight(t[cut:], ball[cut:])


def _fitted(t: F64, s: F64) -> _Roll | None:
    """The fit of a roll: with a slide at its begin where that is surely better; None if it is no roll."""
    plain, error = _least(t, s, 0.0)
    lasts = float(t[-1])
    found = _Roll(plain[1], plain[2], np.nan, np.nan, np.sqrt(len(t)) * lasts**2)
    best, switch = np.inf, 0.0
    for at in np.linspace(0.06, lasts - 0.2, 24) if lasts > 0.4 else ():
        _, other = _least(t, s, float(at))
        if other < best:
            best, switch = other, float(at)
    if switch and len(t) * np.log(error / max(best, 1e-18)) > _BETTER + 2 * np.log(len(t)):
        fit, _ = _least(t, s, switch)
        speed, rolling, sliding = fit[1], fit[2], fit[3]
        share = 1 - sliding * switch / speed if speed > 0 else 0.0
        if sliding < rolling + _HARDER or not _SHARES[0] < share < _SHARES[1]:
            return None  # neither model fits: it was touched, or hops
        found = _Roll(speed, rolling, sliding, share, np.sqrt(len(t)) * (lasts - switch) ** 2)
        error = best
    sound = error / len(t) < (_STRAIGHT_M / 2) ** 2 and found.speed > 0
    return found if sound else None


def _least(t: F64, s: F64, switch: float) -> tuple[F64, float]:
    """Least-squares fit [place, speed, rolling, sliding], sliding until ``switch``, and its squared error."""
    before, after = np.minimum(t, switch), np.maximum(t - switch, 0)
    columns = [np.ones_like(t), t, -(after**2) / 2]
    if switch:
        columns.append(-(before**2) / 2 - switch * after)
    basis = np.column_stack(columns)
    fit: F64 = np.linalg.lstsq(basis, s, rcond=None)[0].astype(np.float64)
    return fit, float(((basis @ fit - s) ** 2).sum())


def _interval(values: F64, weights: F64) -> Interval:
    rng = np.random.default_rng(_SEED)
    drawn: I64 = rng.integers(len(values), size=(_RESAMPLED, len(values)))
    low, high = np.quantile([_median(values[row], weights[row]) for row in drawn], [0.025, 0.975]).tolist()
    return Interval(_median(values, weights), low, high, len(values))


def _median(values: F64, weights: F64) -> float:
    """Weighted median."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, total[-1] / 2)])
