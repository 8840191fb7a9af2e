"""The recogniser's codes of robots that execute a code in the arena."""

import math
from collections import Counter
from functools import cache
from typing import NamedTuple

import numpy as np
from support.openings import BY_CHANCE, CODES, VSSS, filmed, openings, perform

from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations.recognise import recognise

#: Scenes a code.
EACH = 30


class Named(NamedTuple):
    """Names that the recogniser gave the executions of one code.

    Attributes:
        count: executions.
        last: how many of them ended with each code: that of the last situation that has a name, 194 if none.
        ever: in how many of them each code was said at any time.
    """

    count: int
    last: Counter[int]
    ever: Counter[int]


@cache
def trials(seed: int) -> dict[int, list[tuple[np.ndarray, bool]]]:
    """For each code, what came of it in scenes in which it may begin: (track, over) each."""
    return {
        code: [perform(scene, roles, code, chance) for scene, roles, chance in chosen]
        for code, chosen in openings(seed, each=EACH).items()
    }


def said(seed: int, *, ball: bool = True) -> list[tuple[int, list[int]]]:
    """For each trial of more frames than one, its code and those that the recogniser says of it, with its ball or without."""
    done = [(code, track) for code, tracks in trials(seed).items() for track, _ in tracks if len(track) > 1]
    seen, found = filmed([track for _, track in done]), [[] for _ in done]
    table = recognise(seen if ball else seen.filter(seen["team"] != "ball"), VSSS, SituationSettings())
    mine = table.filter((table["team"] == "home") & (table["robot"] == 1)).sort("segment", "end_ns")
    for segment, code in mine.select("segment", "code").iter_rows():
        found[segment].append(code)
    return [(label, codes) for (label, _), codes in zip(done, found, strict=True)]


@cache
def confusion() -> dict[int, Named]:
    """For each executed code, what the recogniser called it."""
    named = {code: Named(0, Counter(), Counter()) for code in CODES}
    for label, codes in said(2):
        before = named[label]
        before.ever.update(set(codes))
        before.last[next((code for code in reversed(codes) if code != BY_CHANCE), BY_CHANCE)] += 1
        named[label] = before._replace(count=before.count + 1)
    return named


def report() -> str:
    """The confusion as a text: a line for each executed code, what it was called most often behind it."""
    named = confusion()
    right = [named[code].last[code] / named[code].count for code in named]
    ever = [named[code].ever[code] / named[code].count for code in named]
    lines = [
        f"# Executed in the arena in {EACH} scenes a code (a film of one frame is left out), named by the recogniser.",
        "# ends: share of films whose last named situation it is; has: share in which it is said at any time.",
        f"# mean: ends {np.mean(right):.2f}, has {np.mean(ever):.2f}; one guess in {len(named)} codes: {1 / len(named):.2f}",
        "",
        "code films ends  has  the films end with",
    ]
    for code, (count, last, any_time) in named.items():
        ends = " ".join(
            f"{other:03d}:{math.floor(100 * films / count + 0.5):d}%"
            for other, films in sorted(last.items(), key=lambda item: (-item[1], item[0]))[:6]
        )
        lines.append(f"{code:03d}  {count:5d} {last[code] / count:.2f} {any_time[code] / count:.2f}  {ends}")
    return "\n".join(lines) + "\n"
