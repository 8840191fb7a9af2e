"""Copies of two SSL teams play in a small arena, beside controls on the same seeds.

Run with a folder of recordings: ``playing.py FOLDER``. A copy draws its option each 0.2 s from its habits,
and drives by it. It is learned from all play of the recording. Seeds are written down here: development used
others, from 51,000 on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from harness import SSL, elsewhere, recordings
from numba import njit
from omnidirectional.learning import BACK, WINDOW, Clone, Windows, cloned, windows
from omnidirectional.recording import HZ, STEPS, Recording, Stretch, recorded
from omnidirectional.seeing import ANGLES, NUMBERS, VECTORS, observe_omni
from omnidirectional.study import COUNTS, chosen
from omnidirectional.world import World, fronts, limits, rolling
from scipy.spatial import KDTree

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import BALL, VX, X, see_both
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.numbers.threads import one_thread

FOLDER = Path(__file__).parent
#: Seeds of the matches of each pairing; length of a match, s; frames between looks, and looks of an option.
SEEDS, SECONDS, EVERY, LOOKS = tuple(range(52_000, 52_020)), 60.0, 6, 2
#: A robot this near to the ball is at it, and its team has the ball if no adversary is nearer, metres. A
#: kick-off begins with the ball this near to the middle.
NEAR, _MIDDLE = 0.5, 0.5
#: Fastest turn, rad/s; speed of a robot that goes to its place, m/s.
_SPIN, _WALK = 12.0, 1.5
_PUSH = WINDOW / HZ


class Observed(NamedTuple):
    """All robots of a team: vectors [N, VECTORS, 2], angles [N, ANGLES], numbers [N, NUMBERS]."""

    vectors: F64
    angles: F64
    numbers: F64


@njit(cache=True, nogil=True, error_model="numpy")
def _observe(view: F64, before: F64, goal_x: float, out: Observed) -> None:
    for robot in range(1, len(out.vectors) + 1):
        observe_omni(view, robot, before[robot], goal_x, out.vectors[robot - 1], out.angles[robot - 1],
                     out.numbers[robot - 1])


class Moments:
    """A team's recorded moments: a robot can do as some robot of the team did at the moment most alike."""

    def __init__(self, known: Windows) -> None:
        at = self._place(known.numbers.astype(np.float64))
        self._tree = KDTree(at)  # type: ignore[no-untyped-call]
        self._told, self._turned = known.told, known.turned

    def __call__(self, numbers: F64) -> tuple[F64, F64]:
        """Velocities [N, 2] 0.2 s after the moments most alike, and turns [N] until then."""
        _, found = self._tree.query(self._place(numbers))  # type: ignore[no-untyped-call]
        return self._told[found], self._turned[found]

    def shuffled(self, rng: np.random.Generator) -> Moments:
        """The same moments, but what was done is that of others."""
        other = copy(self)
        order = rng.permutation(len(self._told))
        other._told, other._turned = self._told[order], self._turned[order]
        return other

    @staticmethod
    def _place(numbers: F64) -> F64:
        """Coordinates in which near is alike: of the robot, of the ball, whether it is nearest to it."""
        ball, far = numbers[:, 13:15], numbers[:, 15:16]
        return np.column_stack([
            numbers[:, :2] / 3, numbers[:, 2:6], 2.5 * ball / (far + 1e-6) * np.minimum(np.sqrt(far), 1.5),
            numbers[:, 11:13] / 2, 2.0 * (numbers[:, 19] == 0)])


class Learned(NamedTuple):
    """A team as it was learned: with options, without, by moments; mean places float64 [N, 2]."""

    copy: Clone
    plain: Clone
    moments: Moments
    shuffled: Moments
    places: F64


class Player:
    """Controller of a team: it gives accelerations [N, 2], m/s², and turn rates [N], rad/s, at each look.

    Args:
        learned: the team as it was learned.
        way: one of ``WAYS``.
        rng: draws options.
    """

    def __init__(self, learned: Learned, way: str, rng: np.random.Generator) -> None:
        self._learned, self._places, self._way, self._rng = learned, learned.places, way, rng
        self._clone = learned.plain if way == "no options" else learned.copy
        robots = len(self._places)
        self._seen = Observed(np.zeros((robots, len(VECTORS), 2)), np.zeros((robots, len(ANGLES))),
                              np.zeros((robots, NUMBERS)))
        self._looks, self._shares = 0, np.tile(self._clone.options.first, (robots, 1))
        self._option: I64 = np.zeros(robots, dtype=np.int64)

    def restart(self) -> None:
        """Forget the options before."""
        self._looks, self._shares[:] = 0, self._clone.options.first

    def __call__(self, view: F64, before: F64, goal_x: float) -> tuple[F64, F64]:
        """Move on from a view; ``before`` has the velocities of 0.1 s ago, float64 [1 + 2 N, 2]."""
        own = view[1:1 + len(self._places)]
        if self._way == "standing":
            away = self._places - own[:, :2]
            far = np.linalg.norm(away, axis=1, keepdims=True) + 1e-9
            wanted = away / far * np.minimum(np.sqrt(far), _WALK)
            return (wanted - own[:, VX:VX + 2]) / _PUSH, np.zeros(len(own))
        _observe(view, before, goal_x, self._seen)
        if self._way in ("nearest moment", "shuffled moments"):
            moments = self._learned.moments if self._way == "nearest moment" else self._learned.shuffled
            wanted, turned = moments(self._seen.numbers)
            return (wanted - own[:, VX:VX + 2]) / _PUSH, np.clip(turned / _PUSH, -_SPIN, _SPIN)
        if self._looks % LOOKS == 0:
            numbers = self._seen.numbers.astype(np.float32)
            shares = (self._shares @ self._clone.options.next if self._way == "random options"
                      else self._clone.usual(numbers, self._shares))
            edge = np.cumsum(shares, axis=1) / shares.sum(axis=1, keepdims=True)
            self._option = np.sum(self._rng.random((len(own), 1)) > edge[:, :-1], axis=1)
            self._shares = np.eye(shares.shape[1])[self._option]
        self._looks += 1
        told = np.einsum("nlc,nl->nc", self._seen.vectors, self._clone.told[self._option])
        turn = np.einsum("na,na->n", self._seen.angles, self._clone.turns[self._option])
        return (told - own[:, VX:VX + 2]) / _PUSH, np.clip(turn / _PUSH, -_SPIN, _SPIN)


class Shown(NamedTuple):
    """Numbers of one match, or of one stretch of the recording; shares of time, m/s, metres."""

    near_home: float
    near_away: float
    has_home: float
    has_away: float
    front_home: float
    front_away: float
    ball_speed: float
    ball_fast: float
    robot_speed_home: float
    robot_speed_away: float
    spread_home: float
    spread_away: float
    mate_home: float
    mate_away: float


#: Names of what :func:`shown` says of each team.
_OF_TEAM = ("near", "has", "front", "robot_speed", "spread", "mate")


def shown(bodies: F64) -> Shown:
    """Numbers of bodies [T, 1 + 2 N, 6]."""
    robots = (bodies.shape[1] - 1) // 2
    there = np.asarray(np.isfinite(bodies[:, 1:, X]).all(axis=0))
    first = (0, robots)
    teams = [1 + start + np.flatnonzero(there[start:start + robots]) for start in first]
    away = [np.linalg.norm(bodies[:, rows, :2] - bodies[:, :1, :2], axis=2).min(axis=1) for rows in teams]
    speed = np.linalg.norm(bodies[:, BALL, VX:VX + 2], axis=1)
    front = fronts(bodies)
    both: list[tuple[float, ...]] = []
    for team, rows in enumerate(teams):
        mine, middle = bodies[:, rows, :2], bodies[:, rows, :2].mean(axis=1, keepdims=True)
        apart = np.linalg.norm(mine[:, :, None] - mine[:, None], axis=3) + 1e9 * np.eye(len(rows))
        near = away[team] < NEAR
        both.append((
            float(near.mean()), float((near & (away[team] < away[1 - team])).mean()),
            float(np.isfinite(front[:, rows - 1]).any(axis=1).mean()),
            float(np.linalg.norm(bodies[:, rows, VX:VX + 2], axis=2).mean()),
            float(np.linalg.norm(mine - middle, axis=2).mean()), float(apart.min(axis=2).mean())))
    found = {f"{name}_{side}": value for side, each in zip(("home", "away"), both, strict=True)
             for name, value in zip(_OF_TEAM, each, strict=True)}
    return Shown(ball_speed=float(np.median(speed)), ball_fast=float(np.quantile(speed, 0.9)), **found)


class Teams(NamedTuple):
    """All that matches are played with: the recording, both teams, a new world."""

    recording: Recording
    learned: tuple[Learned, Learned]
    make: Callable[[np.random.Generator], World]


def kick_offs(parts: Sequence[Stretch]) -> F64:
    """Places at a kick-off of home, and of away, as they were recorded.

    The team of the robot nearest to the ball kicks off. For one that never does, both teams are turned.

    Raises:
        BadSettings: if no stretch begins with all robots, and the ball in the middle.
    """
    found: dict[int, F64] = {}
    for part in parts:
        places = part.places[STEPS]
        if np.isfinite(places).all() and np.hypot(*places[BALL, :2]) < _MIDDLE:
            away = np.linalg.norm(places[1:, :2] - places[BALL, :2], axis=1)
            found.setdefault(int(away.argmin()) // (len(away) // 2), places)
    if not found:
        raise BadSettings("no stretch of play begins with a kick-off and all robots",
                          where="the recording", next_step="Give a recording with a kick-off")
    for team in range(2):
        if team not in found:
            both = np.zeros((2, *found[1 - team].shape))
            see_both(found[1 - team], 1.0, both)
            found[team] = both[1]
    return np.stack([found[0], found[1]])


def teams_of(recording: Recording, counts: Sequence[int] = COUNTS) -> Teams:
    """Learn both teams from all play."""
    parts = [part for part in recording.stretches if part.play]
    robots = (parts[0].places.shape[1] - 1) // 2
    learned = list[Learned]()
    for team in range(2):
        known = windows(parts, team, recording.pitch.goal_x)
        errors = chosen(known, counts)
        count, moments = min(errors, key=errors.__getitem__), Moments(known)
        places = np.array([known.numbers[known.robot == robot, :2].mean(axis=0)
                           for robot in range(1, robots + 1)], dtype=np.float64)
        learned.append(Learned(cloned(known, count), cloned(known, 1), moments,
                               moments.shuffled(np.random.default_rng(team)), places))
        print(f"{recording.names[team]}: {count} options", flush=True)
    can, roll, starts = limits(parts, robots), rolling(recording.stretches), kick_offs(parts)
    for name, each in zip(recording.names, can, strict=True):
        print(f"{name}: {each.top:.2f} m/s, {each.acceleration:.2f} m/s², {each.own_kicks} kicks in "
              f"{each.front_s:.1f} s with the ball at the front, "
              f"{each.kicks.sum() / max(len(each.kicks), 1):.2f} m/s ({len(each.kicks)} kicks), "
              f"{np.degrees(each.aside):.1f}° aside")
    print(f"the ball loses {roll.slow:.2f} m/s², above 3 m/s {roll.fast:.2f}", flush=True)
    return Teams(recording, (learned[0], learned[1]),
                 lambda rng: World(recording.pitch, can, roll, starts, rng))


def match(teams: Teams, ways: tuple[str, str], seed: int, seconds: float = SECONDS) -> dict[str, float]:
    """Play a match; home kicks off with even seeds, away with odd ones."""
    rngs = [np.random.default_rng([seed, each]) for each in range(3)]
    world = teams.make(rngs[2])
    players = [Player(own, way, rng) for own, way, rng in zip(teams.learned, ways, rngs[:2], strict=True)]
    world.kick_off(seed % 2)
    robots = (len(world.bodies) - 1) // 2
    past = np.zeros((BACK + STEPS, len(world.bodies), 2))
    changes, turns = np.zeros((2 * robots, 2)), np.zeros(2 * robots)
    views = np.zeros((2, *world.bodies.shape))
    turned = [BALL, *range(1 + robots, 1 + 2 * robots), *range(1, 1 + robots)]
    kept = list[F64]()
    for frame in range(round(seconds * HZ)):
        if world.restarted:
            past[:] = 0.0
            for player in players:
                player.restart()
        past = np.concatenate([past[1:], world.bodies[None, :, VX:VX + 2]])
        if frame % EVERY == 0 or world.restarted:
            kept.append(world.bodies.copy())
            seen, before = world.bodies.copy(), past[:STEPS].mean(axis=0)
            seen[:, VX:VX + 2] = past[-STEPS:].mean(axis=0)  # a slope over as many steps as in the recording
            see_both(seen, 1.0, views)
            for team, player in enumerate(players):
                order = before if team == 0 else -before[turned]
                own = slice(team * robots, (team + 1) * robots)
                change, turns[own] = player(views[team], order, teams.recording.pitch.goal_x)
                changes[own] = change if team == 0 else -change
        world.frame(changes, turns)
    found = shown(np.array(kept))._asdict()
    return {"goals_home": world.goals[0], "goals_away": world.goals[1], "kicks_home": world.kicks[0],
            "kicks_away": world.kicks[1], "outs": world.outs, "stuck": world.stuck, **found}


#: Ways to play: by options that habits draw, by options that the chain alone draws whatever is seen, by the
#: clone without options, as at the moment most alike, as at any moment, and to stand at the mean places.
WAYS = ("habits", "random options", "no options", "nearest moment", "shuffled moments", "standing")
#: Pairings: how home plays, how away does.
PAIRINGS = (
    ("habits", "habits"), ("nearest moment", "nearest moment"), ("habits", "random options"),
    ("random options", "habits"), *((way, "standing") for way in WAYS),
    *(("standing", way) for way in WAYS[:-1]),
)


def main(
    recording: Recording, out: Path = FOLDER, seeds: Sequence[int] = SEEDS, seconds: float = SECONDS,
    counts: Sequence[int] = COUNTS,
) -> pl.DataFrame:  # fmt: skip
    """Play all pairings, and write the table: means a match, with Student's interval over matches."""
    with one_thread():
        teams = teams_of(recording, counts)
        rows = [{"home": "recorded", "away": "recorded", "of": name, **_summary(values)}
                for name, values in _recorded(recording).items()]
        for home, away in PAIRINGS:
            played = [match(teams, (home, away), seed, seconds) for seed in seeds]
            values = {name: [each[name] for each in played] for name in played[0]}
            values["lead_home"] = [each["goals_home"] - each["goals_away"] for each in played]
            rows += [{"home": home, "away": away, "of": name, **_summary(each)}
                     for name, each in values.items()]
            goals = [np.mean(values[name]) for name in ("goals_home", "goals_away")]
            print(f"{home} : {away}: {goals[0]:.2f} : {goals[1]:.2f}", flush=True)
    table = pl.DataFrame(rows, infer_schema_length=None).with_columns(pl.col("mean", "low", "high").round(3))
    table.write_csv(out / "played.csv")
    return table


def _summary(values: Sequence[float]) -> dict[str, float | None]:
    low, high = mean_interval(values) or (None, None)
    return {"count": len(values), "mean": float(np.mean(values)), "low": low, "high": high}


def _recorded(recording: Recording) -> dict[str, list[float]]:
    """Numbers of the recording's stretches of play of at least two seconds."""
    parts = [shown(part.places[STEPS::EVERY])
             for part in recording.stretches if part.play and part.seconds >= 2]
    return {name: [getattr(part, name) for part in parts] for name in Shown._fields}


if __name__ == "__main__":
    for path in recordings(elsewhere(), (SSL,)).values():
        main(recorded(path))
