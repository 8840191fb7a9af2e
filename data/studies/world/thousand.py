"""A thousand matches of two random teams, and two hundred of two static ones, looked at frame by frame.

``make world`` (about a minute) writes ``thousand.json``. It fails
if a number of any frame is not finite, or a body is deeper in a wall than ``borders`` allows.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from harness import workers
from world.borders import BALL_MOST, ROBOT_MOST, ball_overlaps, robot_overlaps

from pitchlore.pipeline.arena.match.controllers import controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.table import TeamKind

#: Teams of both sides, matches; a match has both halves.
STUDY: tuple[tuple[TeamKind, int], ...] = (("random", 1000), ("static", 200))
SECONDS = 20.0
_DEEP = 0.005  # metres


class Look(NamedTuple):
    """A match as it was seen.

    Attributes:
        frames: how many.
        finite: whether all numbers are.
        ball, robot: deepest overlap with a wall, metres.
        ball_deep, robot_deep: frames in which it is more than 5 mm.
        calls: the referee's, how often each.
    """

    frames: int
    finite: bool
    ball: float
    robot: float
    ball_deep: int
    robot_deep: int
    calls: Counter[str]


def recipe(kind: TeamKind, seconds: float, seed: int) -> Recipe:
    """Two teams of a kind."""
    team = TeamSettings(kind=kind)
    return Recipe(home=team, away=team, seed=seed, referee=RefereeSettings(duration_s=seconds))


def look(kind: TeamKind, seconds: float, seed: int) -> Look:
    """Play a match, and look at each of its frames."""
    of = recipe(kind, seconds, seed)
    match = MatchInPlay(of, controllers_of(of, {}))
    while match.advance(1024):
        pass
    frames, referee, _ = match.take()
    numbers = [table[name] for table, names in ((frames.ball, ("x", "y", "vx", "vy")),
               (frames.robots, ("x", "y", "theta", "vx", "vy", "omega"))) for name in names]
    ball, robots = ball_overlaps(frames, of.pitch), robot_overlaps(frames, of.pitch).max(-1)
    return Look(
        len(frames), all(np.isfinite(column).all() for column in numbers), float(ball.max()),
        float(robots.max()), int((ball > _DEEP).sum()), int((robots > _DEEP).sum()),
        Counter(referee["event"].cast(str).to_list()))


def summary(kind: TeamKind, looks: list[Look]) -> dict[str, object]:
    """All matches of a kind; lengths in millimetres."""
    frames = sum(seen.frames for seen in looks)
    calls = sum((seen.calls for seen in looks), Counter[str]())
    return {
        "matches": len(looks),
        "seeds": f"1 to {len(looks)}",
        "frames": frames,
        "matches with a number that is not finite": sum(not seen.finite for seen in looks),
        "matches with a body outside": sum(
            seen.ball > BALL_MOST or seen.robot > ROBOT_MOST for seen in looks),
        "ball deepest in a wall (mm)": round(1000 * max(seen.ball for seen in looks), 1),
        "ball deeper than 5 mm (share of frames)": float(f"{sum(s.ball_deep for s in looks) / frames:.2g}"),
        "robot deepest in a wall (mm)": round(1000 * max(seen.robot for seen in looks), 1),
        "robot deeper than 5 mm (share of frames)": float(f"{sum(s.robot_deep for s in looks) / frames:.2g}"),
        "calls": dict(sorted(calls.items())),
        "settings": recipe(kind, SECONDS, 1).model_dump(
            mode="json", exclude={"seed": True, "home": {"people"}, "away": {"people"}}),
    }


def main(out: Path, study: Sequence[tuple[TeamKind, int]] = STUDY) -> bool:
    """Write the study into a folder; whether every match was as it should be."""
    said: dict[str, object] = {
        "command": "make world", "bounds (mm)": {"ball": 1000 * BALL_MOST, "robot": 1000 * ROBOT_MOST}}
    good = True
    with workers() as pool:
        for kind, matches in study:
            looks = list(pool.map(partial(look, kind, SECONDS), range(1, matches + 1), chunksize=10))
            said[f"{kind} against {kind}"] = summary(kind, looks)
            good &= all(seen.finite and seen.ball <= BALL_MOST and seen.robot <= ROBOT_MOST for seen in looks)
    (out / "thousand.json").write_text(json.dumps(said, indent=1) + "\n")
    return good


if __name__ == "__main__":
    sys.exit(0 if main(Path(__file__).parent) else 1)
