"""Options of robots that drive in all directions: how well they foretell motion, beside what can do without.

Run with a folder of recordings: ``study.py FOLDER``. One recording of SSL is read there, and nothing of it is
copied. A team is learned from the first half of its play and foretold in the later half, and the other way
round; each team by itself. The number of options is chosen in the half that is learned from.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from harness import SSL, elsewhere, recordings
from omnidirectional.learning import (
    AHEAD,
    LATER,
    WINDOW,
    Chain,
    Windows,
    chained,
    cloned,
    regressed,
    summed,
    windows,
)
from omnidirectional.recording import HZ, Recording, Stretch, halves, recorded, view_of
from omnidirectional.seeing import VECTORS
from omnidirectional.straight import ways
from sklearn.metrics import adjusted_rand_score

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import Records
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.numbers.threads import one_thread
from pitchlore.schemas.options import OPTIONS

FOLDER = Path(__file__).parent
#: Numbers of options that are tried; index in AHEAD of half a second; vectors of the own motion alone.
COUNTS, _HALF, _OWN = (2, 3, 4, 5, 6, 8, 10), AHEAD.index(30), 2
#: Shares of speeds, and of their changes, that robots of executors may reach; codes of executors; that of
#: standing; samples ahead at which their ways are looked at.
_TOPS, _CODES, _STANDS = (0.5, 0.75, 0.9, 0.99), np.array(OPTIONS, dtype=np.int64), 184
_KNOWN = tuple(sorted((*AHEAD, WINDOW)))
#: Rows that others are compared with, and the columns.
_BESIDE = {"own motion alone": "less_than_own", "clone without options": "less_than_clone"}
#: Name, way [W, AHEAD, 2] in metres, and velocity [W, 2] half a second later, of what foretells.
Told = tuple[str, F64, F64 | None]


class Half(NamedTuple):
    """Windows of a team in one half, and what the team saw at their starts, float64 [W, 1 + 2 N, 6]."""

    known: Windows
    views: F64


def half_of(parts: Sequence[Stretch], team: int, recording: Recording) -> Half:
    """One half as one team played it."""
    known = windows(parts, team, recording.pitch.goal_x)
    seen = [view_of(part, team) for part in parts]
    return Half(known, np.array([seen[k][t] for k, t in zip(known.stretch, known.sample, strict=True)]))


def carried_on(known: Windows, own: Windows, count: int) -> F64:
    """Errors in metres after half a second, float64 [W], of options of others that are carried on."""
    options = chained(known, count)
    before, _, _, _ = options.told(own)
    after = options.told(known)[1]
    each = summed(own.vectors, regressed(known.vectors, known.ahead[:, _HALF], after))
    foretold = np.einsum("wk,wkc->wc", before @ options.next, each)
    found: F64 = np.linalg.norm(foretold - own.ahead[:, _HALF], axis=1)
    return found


def chosen(known: Windows, counts: Sequence[int]) -> dict[int, float]:
    """Error in centimetres for each number of options, each stretch by the others of the same half.

    Raises:
        BadSettings: if there are no others.
    """
    if len(np.unique(known.stretch)) < 2:
        raise BadSettings("a half of the play has no pause, so that nothing can be left out",
                          where="the recording", next_step="Give a recording with more stretches of play")
    found = {}
    for count in counts:
        off = [carried_on(known.some(known.stretch != each), known.some(known.stretch == each), count)
               for each in np.unique(known.stretch)]
        found[count] = 100 * float(np.nanmean(np.concatenate(off)))
    return found


def elsewhen(half: Half, rng: np.random.Generator) -> Half:
    """The same robots with their own motion, but all else that is seen is of another moment."""
    known, other = half.known, rng.permutation(len(half.known.chain))
    vectors, views = known.vectors.copy(), half.views[other].copy()
    vectors[:, _OWN:] = known.vectors[other, _OWN:]
    rows = np.arange(len(views))
    views[rows, known.robot] = half.views[rows, known.robot]
    return Half(known._replace(vectors=vectors, numbers=known.numbers[other]), views)


def by_options(learned: Half, own: Half, count: int) -> Iterator[Told]:
    """Names, ways [W, AHEAD, 2] and velocities [W, 2] of what knows options."""
    team = cloned(learned.known, count)
    before, _, _, _ = team.options.told(own.known)
    each = np.stack([summed(own.known.vectors, weights) for weights in team.ahead], axis=2)
    later, usual = summed(own.known.vectors, team.later), team.usual(own.known.numbers, before)
    evidence = team.options.evidence(own.known)
    shown = usual * np.exp(evidence - evidence.max(axis=1, keepdims=True))
    for name, shares in (("the option before, carried on", before @ team.options.next),
                         ("the habitual options", usual),
                         ("the likeliest option", np.eye(count)[usual.argmax(axis=1)]),
                         ("the option that the motion shows", shown / shown.sum(axis=1, keepdims=True))):
        yield name, np.einsum("wk,wkhc->whc", shares, each), np.einsum("wk,wkc->wc", shares, later)


def measured(learned: Half, recording: Recording) -> tuple[Records, float, float]:
    """Measures, speed and acceleration of robots of executors: those that explain the learned half best."""
    speeds = np.linalg.norm(learned.known.vectors[:, :_OWN], axis=2)
    best, least = None, np.inf
    for top in np.quantile(speeds[:, 0], _TOPS):
        for acceleration in 10 * np.quantile(speeds[:, 1], _TOPS):  # of a change in 0.1 s
            packed = Measures.of(recording.pitch, top=float(top), axle=0.16, acceleration=float(acceleration),
                                 frame_s=1 / HZ).packed()
            found = ways(learned.views, learned.known.robot, _CODES, packed, float(top), float(acceleration),
                         np.array([30], dtype=np.int64), HZ)[:, :, 0]
            off = np.linalg.norm(found - learned.known.ahead[:, None, _HALF], axis=2)
            error = float(np.nanmean(off.min(axis=1)))
            if error < least:
                best, least = (packed, float(top), float(acceleration)), error
    assert best is not None
    return best


def by_executors(own: Half, robots: tuple[Records, float, float]) -> Iterator[Told]:
    """Ways of executors' aims for robots that go straight to them."""
    window = _KNOWN.index(WINDOW)
    found = ways(own.views, own.known.robot, _CODES, *robots, np.array(_KNOWN, dtype=np.int64), HZ)
    best = np.linalg.norm(found[:, :, window] - own.known.moved[:, None], axis=2).argmin(axis=1)
    rows, kept = np.arange(len(best)), [place for place in range(len(_KNOWN)) if place != window]
    goes_on = np.diff(own.known.chain, prepend=-1) == 0
    before = np.where(goes_on, np.roll(best, 1), OPTIONS.index(_STANDS))
    yield "an executor's aim, the one before", found[rows, before][:, kept], None
    yield "an executor's aim, the one that the motion shows", found[rows, best][:, kept], None


def foretold(learned: Half, own: Half, count: int, recording: Recording) -> Iterator[Told]:
    """Names, ways [W, AHEAD, 2], metres, and velocities half a second later [W, 2], of all that foretells."""
    known, vectors = learned.known, own.known.vectors
    still = np.zeros((len(vectors), len(AHEAD), 2))
    seconds = np.array(AHEAD)[:, None] / HZ
    yield "standing still", still, still[:, 0]
    yield "the last velocity", vectors[:, 0][:, None] * seconds, vectors[:, 0]
    every = np.ones((len(known.chain), 1))
    for name, last in (("own motion alone", _OWN), ("clone without options", len(VECTORS))):
        told = [regressed(known.vectors[:, :last], each, every)
                for each in (*np.moveaxis(known.ahead, 1, 0), known.later)]
        out = [summed(vectors[:, :last], weights)[:, 0] for weights in told]
        yield name, np.stack(out[:-1], axis=1), out[-1]
    yield from by_options(learned, own, count)
    rng = np.random.default_rng(0)
    mixed, other = elsewhen(learned, rng), elsewhen(own, rng)
    for name, way, velocity in by_options(mixed, other, count):
        yield f"{name}; seen at another moment", way, velocity
    dealt = cloned(known, count, shares=rng.permutation(chained(known, count).told(known)[1]))
    before = dealt.options.told(own.known)[0] @ dealt.options.next
    each = np.stack([summed(vectors, weights) for weights in dealt.ahead], axis=2)
    yield ("the option before, carried on; options dealt anew", np.einsum("wk,wkhc->whc", before, each),
           np.einsum("wk,wkc->wc", before, summed(vectors, dealt.later)))
    robots = measured(learned, recording)
    yield from by_executors(own, robots)
    for name, way, velocity in by_executors(other, robots):
        yield f"{name}; seen at another moment", way, velocity


def by_block(errors: F64, block: I64) -> list[float]:
    """Mean error of each block of time."""
    return [float(np.nanmean(errors[block == each])) for each in np.unique(block)
            if np.isfinite(errors[block == each]).any()]


def rows_of(learned: Half, own: Half, count: int, recording: Recording) -> Iterator[dict[str, object]]:
    """Rows of a team in one half: means over blocks of time, with Student's interval over them."""
    kept: dict[tuple[str, str], list[float]] = {}
    for name, way, velocity in foretold(learned, own, count, recording):
        errors = {f"place after {ahead / HZ:g} s, cm": 100 * np.linalg.norm(
            way[:, place] - own.known.ahead[:, place], axis=1) for place, ahead in enumerate(AHEAD)}
        if velocity is not None:
            errors[f"velocity after {LATER / HZ:g} s, cm/s"] = 100 * np.linalg.norm(
                velocity - own.known.later, axis=1)
        for what, each in errors.items():
            blocks = kept[name, what] = by_block(each, own.known.block)
            row: dict[str, object] = {"by": name, "of": what, "windows": int(np.isfinite(each).sum()),
                                      "blocks": len(blocks), "error": float(np.mean(blocks))}
            row["low"], row["high"] = mean_interval(blocks) or (None, None)
            for beside, column in _BESIDE.items():
                if (beside, what) in kept:
                    less = np.subtract(kept[beside, what], blocks)
                    row[column] = float(less.mean())
                    row[f"{column}_low"], row[f"{column}_high"] = mean_interval(less) or (None, None)
            yield row


def options_of(options: Chain, known: Windows) -> Iterator[dict[str, object]]:
    """One row an option: how often, how long, where, how fast, and the vectors that say most."""
    after = options.told(known)[1]
    own = after.argmax(axis=1)
    new = (np.diff(own, prepend=-1) != 0) | (np.diff(known.chain, prepend=-1) != 0)
    size = np.sqrt(np.mean(np.sum(known.vectors**2, axis=2), axis=0))
    for option in np.argsort(-after.sum(axis=0)):
        mine, weights = own == option, options.weights[option] * size
        strongest = [place for place in np.argsort(-np.abs(weights)) if place >= _OWN][:3]
        yield {
            "option": int(option), "share": float(mine.mean()),
            "seconds": 0.2 * float(mine.sum() / max((new & mine).sum(), 1)),
            "speed": float(known.numbers[mine, 18].mean()),
            "gains": float((np.linalg.norm(known.told[mine], axis=1) - known.numbers[mine, 18]).mean()),
            "ball_m": float(np.median(known.numbers[mine, 15])),
            "nearest_to_ball": float((known.numbers[mine, 19] == 0).mean()),
            "deepest": float((known.numbers[mine, 20] == 0).mean()),
            "spread_cm": 100 * float(options.spread[option]),
            "keeps_velocity": float(options.weights[option, 0] / (WINDOW / HZ)),
            "vectors": "; ".join(f"{VECTORS[place]} {100 * weights[place]:+.1f} cm" for place in strongest),
        }


def agreement(learned: Half, own: Half, count: int) -> dict[str, float]:
    """Adjusted Rand index of the options that two models tell in the same windows; 0 by chance."""
    first = chained(learned.known, count).told(own.known)[1].argmax(axis=1)
    again = chained(learned.known, count, seed=1).told(own.known)[1].argmax(axis=1)
    other = chained(own.known, count).told(own.known)[1].argmax(axis=1)
    shuffled = np.random.default_rng(0).permutation(other)
    return {f"agree_{name}": float(adjusted_rand_score(first, each))
            for name, each in (("seeds", again), ("halves", other), ("shuffled", shuffled))}


def main(recording: Recording, out: Path = FOLDER, counts: Sequence[int] = COUNTS) -> pl.DataFrame:
    """Learn, foretell, and write the tables ahead, options and counts."""
    ahead, options, tried = (list[dict[str, object]]() for _ in range(3))
    parts = halves(recording)
    with one_thread():
        for team, name in enumerate(recording.names):
            both = [half_of(each, team, recording) for each in parts]
            for place, learned in enumerate(("first half", "second half")):
                one, other = both[place], both[1 - place]
                errors = chosen(one.known, counts)
                count = min(errors, key=errors.__getitem__)
                about = {"team": name, "learned_from": learned}
                tried += [{**about, "options": each, "windows": len(one.known.chain), "cm": error,
                           "chosen": each == count, **agreement(one, other, each)}
                          for each, error in errors.items()]
                ahead += [{**about, "options": count, **row} for row in rows_of(one, other, count, recording)]
                options += [{**about, **row} for row in options_of(chained(one.known, count), one.known)]
                print(f"{name}, learned from the {learned}: {count} options", flush=True)
    for table, rows in (("counts", tried), ("options", options), ("ahead", ahead)):
        frame = pl.DataFrame(rows, infer_schema_length=None).with_columns(pl.selectors.float().round(2))
        frame.write_csv(out / f"{table}.csv")
    return frame


if __name__ == "__main__":
    for path in recordings(elsewhere(), (SSL,)).values():
        main(recorded(path))
