"""Tiny hand-made matches: bodies on given paths, as tables of trajectories."""

from collections.abc import Callable, Mapping
from math import pi
from typing import Any

import numpy as np
import polars as pl

from pitchlore.schemas import ROLES, Trajectories

Path = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


def stands(x: float, y: float, theta: float = 0.0) -> Path:
    """A body that stays where it is."""
    return goes((0.0, x, y, theta))


def goes(*waypoints: tuple[float, float, float, float]) -> Path:
    """A body that goes through (time, x, y, theta) in straight lines at constant speeds."""
    times, *columns = np.array(waypoints).T
    return lambda t: tuple(np.interp(t, times, column) for column in columns)


def rows_of(body: str, t_ns: np.ndarray, x: Any, y: Any, theta: Any, vx: Any, vy: Any, **columns: Any) -> pl.DataFrame:
    """Rows of schema Trajectories of 'ball', 'home-1' or another body, with other columns as they are given."""
    team, _, robot = body.partition("-")
    return pl.DataFrame({
        "match_id": "scene", "frame": np.arange(len(t_ns)), "t_ns": t_ns.astype(np.int64), "team": team,
        "robot": int(robot) if robot else None, "role": None, "x": x, "y": y,
        "theta": np.angle(np.exp(1j * theta)) if robot else None, "vx": vx, "vy": vy, "omega": None,
        "segment": 0, "suspect": False, "turned": False, **columns,
    }, schema_overrides=Trajectories.dtypes()).select(*Trajectories.dtypes())


def film(
    bodies: Mapping[str, Path],
    seconds: float,
    *,
    hz: float = 40.0,
    roles: Mapping[str, str] | None = None,
) -> pl.DataFrame:
    """Rows of schema Trajectories.

    Args:
        bodies: 'ball', 'home-1', … and their paths.
        seconds: from 0, exclusive.
        hz: samples a second.
        roles: roles of robots; by default by their distance to their own goal.
    """
    t = np.arange(round(seconds * hz)) / hz
    places = {body: path(t) for body, path in bodies.items()}
    rows = []
    for body, (x, y, theta) in places.items():
        team, _, _ = body.partition("-")
        role: list[str | None] = [None] * len(t)
        if team != "ball":
            goal = -0.75 if team == "home" else 0.75
            mine = np.hypot(x - goal, y)
            ahead = sum(
                (np.hypot(px - goal, py) < mine).astype(int)
                for other, (px, py, _) in places.items() if other.startswith(team) and other != body
            )
            role = [ROLES[min(rank, 2)] for rank in np.broadcast_to(ahead, len(t))]
            role = [(roles or {}).get(body, by_place) for by_place in role]
        rows.append(rows_of(body, np.round(t * 1e9), x, y, theta, np.gradient(x, t), np.gradient(y, t), role=role))
    return pl.concat(rows).sort("team", "robot", "t_ns")


def walk(seed: int, *, omnidirectional: bool = False) -> pl.DataFrame:
    """A random match full of faults: irregular times, missing and suspect bodies, stops, unknown headings."""
    rng = np.random.default_rng(seed)
    samples = int(rng.integers(2, 70))
    scale = float(rng.choice([0.01, 0.03, 0.12]))
    t = np.cumsum(rng.uniform(0.5, 1.5, samples) * scale)
    t_ns = np.round((t - t[0]) * 1e9).astype(np.int64)
    stopped = rng.random(samples) < 0.02
    segment = np.cumsum((rng.random(samples) < 0.03) | np.insert(stopped[:-1], 0, False))
    home, away = rng.integers(0, 4, 2)
    names = ["ball", *(f"home-{i}" for i in range(home)), *(f"away-{i}" for i in range(1, away + 1))]
    rows = []
    for name in names:
        turn = np.cumsum(rng.normal(0, 4, samples) * np.gradient(t)) + rng.uniform(-np.pi, np.pi)
        speed = rng.choice([0.0, 0.3, 0.8]) * np.clip(rng.normal(1, 0.5) + np.cumsum(rng.normal(0, 0.2, samples)), -1, 1)
        drift = rng.normal(0, 1, samples) if omnidirectional else 0
        vx, vy = speed * np.cos(turn + drift), speed * np.sin(turn + drift)
        x = np.clip(rng.uniform(-0.2, 0.2) + np.cumsum(vx * np.gradient(t)), -0.75, 0.75)
        y = np.clip(rng.uniform(-0.2, 0.2) + np.cumsum(vy * np.gradient(t)), -0.65, 0.65)
        role = rng.choice(ROLES, samples) if name != "ball" else None
        table = rows_of(name, t_ns, x, y, turn, vx, vy, role=role, segment=segment, suspect=rng.random(samples) < 0.03)
        table = table.with_columns(
            pl.when(pl.Series(stopped)).then(None).otherwise(pl.col("segment")).alias("segment"),
            pl.when(pl.Series(rng.random(samples) < 0.03)).then(None).otherwise(pl.col("theta")).alias("theta"),
            pl.when(pl.Series(rng.random(samples) < 0.03)).then(None).otherwise(pl.col("vx")).alias("vx"),
        )
        rows.append(table.filter(pl.Series(rng.random(samples) >= rng.choice([0, 0, 0.02, 0.3]))))
    return pl.concat(rows).sort("team", "robot", "t_ns")


#: A striker drives up the halfway line towards a robot at (0, 0.5), or away from it; the goals are abeam.
TO, FRO = goes((0, 0, -0.3, pi / 2), (1, 0, 0.2, pi / 2)), goes((0, 0, 0.4, -pi / 2), (1, 0, -0.1, -pi / 2))
THERE = stands(0, 0.5)

#: What happens, for how long; the code, target and time range (s) of robot home-1's situation.
SCENES = {
    "has a resting ball": (
        {"ball": stands(0.06, 0), "home-1": stands(0, 0)}, 1.0, 1, "ball", 0.0, 1.0,
    ),
    "has the ball at its back": (
        {"ball": stands(-0.06, 0), "home-1": stands(0, 0)}, 1.0, 1, "ball", 0.0, 1.0,
    ),
    "guides the ball": (
        {"ball": goes((0, -0.24, 0, 0), (1, 0.06, 0, 0)), "home-1": goes((0, -0.3, 0, 0), (1, 0, 0, 0))},
        1.0, 11, "ball", 0.15, 1.0,
    ),
    "kicks the ball it pushes": (
        {
            "ball": goes((0, -0.24, 0, 0), (0.5, -0.09, 0, 0), (1, 0.41, 0, 0)),
            "home-1": goes((0, -0.3, 0, 0), (1, 0, 0, 0)),
        },
        1.0, 21, "ball", 0.5, 0.55,
    ),
    "kicks the ball with its side": (
        {"ball": goes((0, 0, 0.06, 0), (0.5, 0, 0.06, 0), (0.9, 0, 0.46, 0)), "home-1": stands(0, 0)},
        0.9, 21, "ball", 0.475, 0.525,
    ),
    "kicks a resting ball": (
        {"ball": goes((0, 0.06, 0, 0), (0.5, 0.06, 0, 0), (0.9, 0.46, 0, 0)), "home-1": stands(0, 0)},
        0.9, 21, "ball", 0.5, 0.525,
    ),
    "loses the ball": (
        {
            "ball": goes((0, 0.06, 0, 0), (0.5, 0.06, 0, 0), (1.2, 0.30, 0, 0)),
            "home-1": stands(0, 0), "away-1": stands(0.36, 0, pi),
        },
        1.2, 22, "ball", 0.525, 1.15,
    ),
    "yields the ball": (
        {
            "ball": goes((0, 0.06, 0, 0), (0.5, 0.06, 0, 0), (1.2, 0.30, 0, 0)),
            "home-1": stands(0, 0), "home-2": stands(0.36, 0, pi),
        },
        1.2, 23, "ball", 0.525, 1.15,
    ),
    "leaves the ball, reversing": (
        {"ball": stands(0.06, 0), "home-1": goes((0, 0, 0, 0), (0.5, 0, 0, 0), (0.9, -0.16, 0, 0))},
        0.9, 33, "ball", 0.525, 0.55,
    ),
    "moves away from the ball": (
        {"ball": stands(-0.1, 0), "home-1": goes((0, 0, 0, 0), (0.8, 0.4, 0, 0))}, 0.8, 34, "ball", 0.0, 0.8,
    ),
    "moves away from the ball, reversing": (
        {"ball": stands(-0.1, 0), "home-1": goes((0, 0, 0, pi), (0.8, 0.4, 0, pi))}, 0.8, 34, "ball", 0.0, 0.8,
    ),
    "reaches the ball": (
        {"ball": stands(0.4, 0), "home-1": goes((0, 0, 0, 0), (0.68, 0.34, 0, 0))}, 0.68, 44, "ball", 0.0, 0.65,
    ),
    "receives the ball": (
        {"ball": goes((0, 0.5, 0, 0), (0.88, 0.06, 0, 0)), "home-1": stands(0, 0)}, 0.88, 45, "ball", 0.0, 0.85,
    ),
    "approaches the ball": (
        {"ball": stands(0.3, 0), "home-1": goes((0, -0.3, 0, 0), (0.6, 0, 0, 0))}, 0.6, 46, "ball", 0.0, 0.6,
    ),
    "is hit by the ball": (
        {"ball": goes((0, 0.5, 0, 0), (0.88, 0.06, 0, 0)), "home-1": stands(0, 0, pi / 2)},
        0.88, 47, "ball", 0.1, 0.85,
    ),
    "backs into the ball": (
        {"ball": stands(0.2, 0), "home-1": goes((0, 0, 0, pi / 2), (0.8, 0.14, 0, pi / 2))},
        0.8, 47, "ball", 0.675, 0.7,
    ),
    "turns to the ball": (
        {"ball": stands(0, 0.5), "home-1": goes((0, 0, 0, -pi / 2), (1, 0, 0, pi / 2))},
        1.0, 57, "ball", 0.775, 0.875,
    ),
    "drives level with the ball along the pitch": (
        {"ball": stands(0.1, 0.2), "home-1": goes((0, -0.4, -0.4, 0), (1, 0.1, -0.4, 0))},
        1.0, 67, "ball", 0.3, 0.85,
    ),
    "drives level with the ball across the pitch": (
        {"ball": stands(0.3, 0.2), "home-1": goes((0, -0.2, -0.3, pi / 2), (1, -0.2, 0.2, pi / 2))},
        1.0, 68, "ball", 0.4, 0.85,
    ),
    "follows the ball across the pitch": (
        {"ball": goes((0, 0.5, -0.4, 0), (1, 0.5, 0.2, 0)), "home-1": goes((0, -0.3, -0.1, pi / 2), (1, -0.3, 0.4, pi / 2))},
        1.0, 68, "ball", 0.0, 1.0,
    ),
    "turns to its own goal": (
        {"home-1": goes((0, 0, 0, 0), (1, 0, 0, pi))}, 1.0, 78, "own-goal", 0.775, 0.875,
    ),
    "approaches its own goal": (
        {"home-1": goes((0, 0.2, 0, pi), (1.2, -0.4, 0, pi))}, 1.2, 88, "own-goal", 0.0, 1.2,
    ),
    "moves away from its own goal": (
        {"home-1": goes((0, -0.65, 0, 0), (0.8, -0.25, 0, 0))}, 0.8, 98, "own-goal", 0.0, 0.8,
    ),
    "turns to the adversary's goal": (
        {"home-1": goes((0, 0, 0, pi), (1, 0, 0, 0))}, 1.0, 108, "adversary-goal", 0.775, 0.875,
    ),
    "approaches the adversary's goal": (
        {"home-1": goes((0, 0.15, 0, 0), (0.8, 0.55, 0, 0))}, 0.8, 118, "adversary-goal", 0.0, 0.8,
    ),
    "moves away from the adversary's goal": (
        {"home-1": goes((0, 0.45, 0.2, 2.55), (0.8, 0.117, 0.422, 2.55))}, 0.8, 128, "adversary-goal", 0.0, 0.8,
    ),
    "stands": ({"home-1": stands(0.1, 0.3)}, 1.0, 184, None, 0.0, 1.0),
    "wanders": ({"home-1": goes((0, 0, -0.1, pi / 2), (1, 0, 0.1, pi / 2))}, 1.0, 194, None, 0.0, 1.0),
}
