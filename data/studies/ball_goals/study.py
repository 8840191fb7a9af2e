"""Goals and restarts found from the ball, beside those of matches whose score and referee are known.

``make ball-goals`` (ten minutes; what was stopped goes on). Recorded
matches and matches that are played here are read, and nothing but the ball is kept: as it was recorded, with
the noise of a camera, at ten samples a second, hidden in the goals, in play only, on a pitch whose length is
mistaken, and without the kick-offs. In the control everything from a goal to its restart is cut out, so that
no goal is left. A goal is found if one of the same end is found within :data:`NEAR_S` of it. RECORDINGS are
read there and not copied; those that are absent are left out.

``found.csv`` has recall and precision of each kind of match and of ball, at the default confidence.
``kinds.csv`` has for each kind of finding the share that were goals, over all but the control;
``ball_goals.CONFIDENCE`` is made of it.
``restarts.csv`` has the restarts of each kind that the referee called and that are found, by the rule and by
rules that ask for less. One is found if one of the same kind is found within :data:`SOON_S` of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from harness import INSPER, RCSS, RSIM, SSL, elsewhere, going_on, logged, read, recordings, workers

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.table import TeamKind
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.importers.tracking.ball_goals import ball_goals
from pitchlore.pipeline.importers.tracking.ball_restarts import LIES_S, Ball, ball_restarts, line_ups
from pitchlore.pipeline.importers.tracking.mapping import GoalFinding
from pitchlore.pipeline.matches.frame import MatchLog, home_attacks
from pitchlore.pipeline.stages.events.restarts import kind_of

PAIRINGS: tuple[tuple[TeamKind, TeamKind], ...] = (
    ("static", "static"), ("static", "human-like"), ("human-like", "human-like"), ("static", "random"),
    ("random", "random"))
SEEDS, SECONDS = range(900_001, 900_005), 480.0
#: The recordings in words.
GAMES = {RSIM: "rc-robosim VSSS", RCSS: "rcssserver 2D", INSPER: "Insper 2D", SSL: "RoboCup SSL 2025"}
#: Greatest time between a goal and its finding, s.
NEAR_S = 2.0
#: Standard deviation of the noise, as a share of the pitch's length (4.5 mm on a VSSS pitch), and samples a
#: second.
NOISE, SLOW_HZ = 0.003, 10
#: How many times longer than the pitch the places are, where its length is mistaken.
LONGER = 1.04
#: Greatest time between a restart and its finding, s.
SOON_S = 1.0
#: Longest time for which a tracker takes something else for the ball, s.
GLITCH_S = 1.5
#: Places of which it takes a third: the marks of a VSSS pitch, but for their signs.
MARKS = ((0.375, 0.0), (0.375, 0.4), (0.6, 0.35))


class Known(NamedTuple):
    """The ball of a match, and its goals.

    Attributes:
        ball: where it was seen.
        goals: time of each goal, and the end at which it fell.
        spans: start and end of each stretch from a goal to its restart, ns.
        restarts: time and kind of each restart but for kick-offs.
        pitch: the match's.
    """

    ball: Ball
    goals: list[tuple[int, int]]
    spans: list[tuple[int, int]]
    restarts: list[tuple[int, str]]
    pitch: Pitch


def known(log: MatchLog) -> Known:
    """A match's word on the ball and on its goals."""
    frames = log.frames
    x, y = (frames.ball[axis].astype(np.float64) for axis in ("x", "y"))
    order = np.argsort(frames.t_ns, kind="stable")
    ups = np.zeros(len(order), dtype=np.int64)
    ups[order] = line_ups(frames, order, log.info.pitch)
    order = order[np.isfinite(x[order]) & np.isfinite(y[order])]
    order = order[np.diff(frames.t_ns[order], prepend=-1) > 0]
    ball = Ball(frames.t_ns[order], x[order], y[order], np.zeros(len(order), dtype=np.bool_), ups[order])
    reported = log.referee.filter(pl.col("event") == "goal").drop_nulls("team")
    signs = home_attacks(log.info.periods, reported["t_ns"].to_numpy())
    ends = [
        int(sign) if team == "home" else -int(sign) for sign, team in
        zip(signs, reported["team"], strict=True)]
    goals = list(zip(reported["t_ns"].to_list(), ends, strict=True))
    restarts = log.referee.filter(pl.col("event").is_in(["kick-off", "end"]))["t_ns"].to_numpy()
    last = int(frames.t_ns.max()) + 1
    spans = [(t_ns, int(min(restarts[restarts >= t_ns], default=last))) for t_ns, _ in goals]
    put = log.referee.filter(pl.col("event") == "fault", pl.col("note") != "segment")
    called = [(t_ns, kind_of("fault", note)) for t_ns, note in put.select("t_ns", "note").iter_rows()]
    return Known(ball, goals, spans, called, log.info.pitch)


def _kept(match: Known, mask: np.ndarray) -> Ball:
    return Ball(*(column[mask] for column in match.ball))


def _noisy(match: Known) -> Ball:
    noise = np.random.default_rng(0).normal(0, NOISE * match.pitch.length, (2, len(match.ball.t_ns)))
    return match.ball._replace(x=match.ball.x + noise[0], y=match.ball.y + noise[1])


def _slow(match: Known) -> Ball:
    slots = match.ball.t_ns * SLOW_HZ // 1_000_000_000
    return _kept(match, np.diff(slots, prepend=-1) > 0)


def _between(match: Known, before_s: float, after_s: float) -> np.ndarray:
    """Tell whether a sample is between a goal and its restart, bool [S]; the ends are moved by so much."""
    t_ns = match.ball.t_ns
    inside = np.zeros(len(t_ns), dtype=np.bool_)
    for start, end in match.spans:
        inside |= (t_ns > start - round(before_s * 1e9)) & (t_ns < end + round(after_s * 1e9))
    return inside


def _short(match: Known) -> Ball:
    """The ball on a pitch that is taken for shorter than it is."""
    return match.ball._replace(x=match.ball.x * LONGER, y=match.ball.y * LONGER)


def _glitches(match: Known, every_s: float = 10.0) -> Ball:
    """The ball as a tracker sees it that so often takes something else for it, a third of it on marks."""
    rng, t_ns = np.random.default_rng(0), match.ball.t_ns
    x, y = match.ball.x.copy(), match.ball.y.copy()
    for start in np.arange(every_s, t_ns[-1] / 1e9, every_s):
        at = slice(*np.searchsorted(t_ns, [start * 1e9, (start + rng.uniform(0, GLITCH_S)) * 1e9]))
        x[at], y[at] = rng.uniform(-0.5, 0.5, 2) * (match.pitch.length, match.pitch.width)
        if rng.random() < 1 / 3:
            x[at], y[at] = MARKS[rng.integers(3)] * rng.choice([-1.0, 1.0], 2)
    return match.ball._replace(x=x, y=y)


#: How the ball is seen, by name.
SEEN: dict[str, Callable[[Known], Ball]] = {
    "as recorded": lambda match: match.ball, "noise": _noisy, "ten a second": _slow,
    "hidden in the goals": lambda match: _kept(match, np.abs(match.ball.x) <= match.pitch.goal_x),
    "in play only": lambda match: _kept(match, ~_between(match, 0.0, 0.0)), "pitch 4 % too short": _short,
    "without kick-offs": lambda match: _kept(match, ~_between(match, -0.3, 2.0)),
    "control: no goals": lambda match: _kept(match, ~_between(match, 2.5, 0.0))}
CONTROL = "control: no goals"
#: How the ball is seen of which restarts are looked for.
RESTARTS_SEEN: dict[str, Callable[[Known], Ball]] = {
    **{name: SEEN[name] for name in ("as recorded", "noise", "ten a second")},
    "glitches": _glitches, "many glitches": lambda match: _glitches(match, 4.0)}
#: Rules of a restart, by name: whether the robots are asked, and how long the ball lies.
RULES = {"the rule": (True, LIES_S), "a ball that need not lie": (True, (0.0, 0.0)),
         "without the robots": (False, LIES_S), "neither": (False, (0.0, 0.0))}


def findings(game: str, log: MatchLog) -> Iterator[dict[str, object]]:
    """A row for each goal that is found, and for each that is missed."""
    match = known(log)
    for seen, change in SEEN.items():
        goals = [] if seen == CONTROL else list(match.goals)
        about = {"game": game, "match": log.info.match_id, "seen": seen}
        # the match was looked at, whatever is found
        yield about | {"crossing": None, "sequel": None, "confidence": None, "goal": False, "found": False}
        ball = change(match)
        for found in ball_goals(ball, match.pitch, ball_restarts(ball, match.pitch)):
            near = [goal for goal in goals
                    if goal[1] == found.end and abs(goal[0] - found.t_ns) <= round(NEAR_S * 1e9)]
            right = min(near, default=None, key=lambda goal: abs(goal[0] - found.t_ns))
            if right is not None and found.confidence >= GoalFinding().confidence:
                goals.remove(right)
            yield about | {"crossing": found.crossing, "sequel": found.sequel, "confidence": found.confidence,
                           "goal": right is not None, "found": True}
        for _ in goals:
            yield about | {"crossing": None, "sequel": None, "confidence": None, "goal": True, "found": False}


def put_elsewhere(game: str, log: MatchLog) -> Iterator[dict[str, object]]:
    """A row for each restart that the referee called, and for each that is found and was not called."""
    match = known(log)
    for seen, change in RESTARTS_SEEN.items():
        ball = change(match)
        for rule, (robots, lies_s) in RULES.items():
            called = list(match.restarts)
            about = {"game": game, "seen": seen, "rule": rule}
            asked = ball if robots else ball._replace(line_ups=np.zeros_like(ball.line_ups))
            for found in ball_restarts(asked, match.pitch, lies_s):
                kind: str = found.kind or "other"
                right = next((it for it in called if abs(it[0] - found.t_ns) <= round(SOON_S * 1e9)
                              and kind in ("other", it[1])), None)
                if right is not None:
                    called.remove(right)
                yield about | {"kind": kind, "called": right is not None, "found": True}
            for _, missed in called:
                yield about | {"kind": missed, "called": True, "found": False}


def played(job: tuple[TeamKind, TeamKind, int]) -> list[dict[str, object]]:
    """The findings of a match that is played here: home, away, seed."""
    home, away, seed = job
    recipe = Recipe(home=TeamSettings(kind=home), away=TeamSettings(kind=away), seed=seed,
                    referee=RefereeSettings(duration_s=SECONDS))
    return _rows("played here", matches.read(logged(recipe), where=recipe.match_id))


def recorded(path: str) -> list[dict[str, object]]:
    """The findings of a recording."""
    return _rows(GAMES[Path(path).name], read(Path(path)))


def _rows(game: str, log: MatchLog) -> list[dict[str, object]]:
    """The findings of a match; those of restarts name a rule."""
    return [*findings(game, log), *put_elsewhere(game, log)]


def summary(rows: pl.DataFrame) -> pl.DataFrame:
    """Recall and precision of each kind of match and of ball."""
    sure = pl.col("found") & (pl.col("confidence") >= GoalFinding().confidence)
    right = (sure & pl.col("goal")).sum()
    missed = (~pl.col("found") & pl.col("goal")).sum()
    return (
        rows.group_by("game", "seen", maintain_order=True)
        .agg(
            pl.col("match").n_unique().alias("matches"), (right + missed).alias("goals"),
            sure.sum().alias("found"), right.alias("right"),
            (right / (right + missed)).round(4).alias("recall"),
            (right / sure.sum()).round(4).alias("precision"))
        .with_columns(pl.col("recall", "precision").fill_nan(None))
    )


def kinds(rows: pl.DataFrame) -> pl.DataFrame:
    """The share of each kind of finding that were goals, and its Laplace estimate."""
    found = rows.filter("found", pl.col("seen") != CONTROL)
    n, goals = pl.len(), pl.col("goal").sum()
    return found.group_by("crossing", "sequel").agg(
        n.alias("found"), goals.alias("goals"), ((goals + 1) / (n + 2)).round(4).alias("estimate"),
    ).sort("crossing", "sequel")


def restarts(rows: pl.DataFrame) -> pl.DataFrame:
    """The restarts of each kind that were called, found, and both, by match, ball and rule."""
    found, called = pl.col("found"), pl.col("called")
    return rows.group_by("game", "seen", "rule", "kind").agg(
        called.sum(), found.sum(), (found & called).sum().alias("right"),
    ).with_columns(
        (pl.col("right") / pl.col("called")).round(4).alias("recall"),
        (pl.col("right") / pl.col("found")).round(4).alias("precision"),
    ).with_columns(pl.col("recall", "precision").fill_nan(None)).sort("game", "seen", "rule", "kind")


def main(out: Path, folder: Path, seeds: Sequence[int] = SEEDS) -> None:
    """Write the tables."""
    jobs = [(home, away, seed) for home, away in PAIRINGS for seed in seeds]
    with workers() as pool, going_on(out, __file__) as parts:
        found = [
            *parts(map(str, recordings(folder, GAMES).values()), recorded, pool), *parts(jobs, played, pool)]
    rows = [row for match in found for row in match]
    table = pl.DataFrame([row for row in rows if "rule" not in row], infer_schema_length=None)
    restarts(pl.DataFrame([row for row in rows if "rule" in row])).write_csv(out / "restarts.csv")
    summary(table).write_csv(out / "found.csv")
    kinds(table).write_csv(out / "kinds.csv")


if __name__ == "__main__":
    main(Path(__file__).parent, elsewhere())
