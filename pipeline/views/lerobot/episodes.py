"""The episodes of a match: each stretch of play as each of its teams lives it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.game.bodies import OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.episodes import episodes
from pitchlore.pipeline.game.pitch import SCALES
from pitchlore.pipeline.matches.frame import wrap
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.options.windows import bodies
from pitchlore.pipeline.views.labels import CODES, Labels
from pitchlore.pipeline.views.lerobot.grid import even_frames
from pitchlore.schemas import SIDES

#: Columns that turn round where a team attacks -x.
_TURNED = [X, Y, VX, VY]


class Episode(NamedTuple):
    """An episode.

    Attributes:
        task: the play that it shows, by the team's name.
        facts: its match, side and so on, for people; the same keys in each episode.
        columns: arrays by feature, each [T, n]: all but those that number frames.
    """

    task: str
    facts: dict[str, Any]
    columns: dict[str, npt.NDArray[Any]]


def episodes_of(match: MatchTables, robots: int, fps: int) -> Iterator[Episode]:
    """The episodes of a match, in order of time, home's first. A stretch of less than two frames has none.

    The last frame of a stretch is that which the last action leads to, so it has no row.

    Args:
        match: the match.
        robots: most robots of a team; those that a team lacks are not seen.
        fps: frames a second, at most those of the recording.

    Raises:
        BadRecording: if it has no headings: actions could not be told.
        NotFound: if the match's stages have not run.
    """
    trajectories = match.trajectories
    own = bodies(trajectories, 0.0)
    if not np.isfinite(own.places[:, 1:, THETA]).any():
        raise BadRecording("has no headings of robots, from which their actions are told", where=match.name,
                           next_step="Export it in another form, or leave it out")
    names = [str(match.inputs.details("matches")[side]) for side in SIDES]
    labels, scales = Labels(match), SCALES[match.pitch.kind]
    for stretch in episodes(trajectories, match.referee).to_dicts():
        segment, goal = stretch["episode"], stretch["outcome"] == "goal"
        frames = even_frames(own, segment, fps)
        if len(frames.t_ns) < 2:
            continue
        for team, side in enumerate(SIDES):
            views = _views(frames.places, team, robots)
            reward = (1.0 if stretch["scorer"] == side else -1.0) if goal else 0.0
            yield Episode(
                f"play robot soccer ({match.pitch.kind}) as {names[team]}",
                {
                    "match_id": match.name, "side": side, "team": names[team], "adversary": names[1 - team],
                    "segment": segment, "start_ns": int(frames.t_ns[0]), "outcome": stretch["outcome"] or "",
                    "options_recovered": labels.recovered, "numbers": list(own.numbers[team]),
                    "pitch_length": match.pitch.length, "pitch_width": match.pitch.width,
                    "goal_width": match.pitch.goal_width,
                },
                {
                    **motion(views, robots, fps, scales.max_robot_speed / fps + scales.robot_radius),
                    **_labels(labels, side, own.numbers[team], segment, frames.t_ns[:-1], robots),
                    **_ends(len(frames.t_ns) - 1, reward),
                },
            )


def _views(places: F64, team: int, robots: int) -> F64:
    """Bodies as a team sees them, float64 [K, 1 + 2 N, 6]: its own robots first, the team attacks +x."""
    count = (places.shape[1] - 1) // 2
    sides = [places[:, 1:1 + count], places[:, 1 + count:]]
    more = np.full((len(places), robots - count, places.shape[2]), np.nan)
    found = np.concatenate([places[:, :1], sides[team], more, sides[1 - team], more], axis=1)
    if team == 1:
        found[..., _TURNED] *= -1
        found[..., THETA] = wrap(found[..., THETA] + np.pi)
    return found


def motion(views: F64, robots: int, fps: int, farthest: float) -> dict[str, npt.NDArray[Any]]:
    """Observations and actions, each [K - 1, n].

    Args:
        views: float64 [K, 1 + 2 N, 6], bodies as the team sees them at K frames; NaN where one is not seen.
        robots: N.
        fps: frames a second.
        farthest: greatest way of a robot in a frame, metres: one that moved further was put there.
    """
    frames = len(views) - 1
    seen = ~np.isnan(views[..., X])
    numbers = np.stack([
        views[..., X], views[..., Y], np.cos(views[..., THETA]), np.sin(views[..., THETA]),
        views[..., VX], views[..., VY], views[..., OMEGA], np.ones_like(views[..., X]),
    ], axis=-1)
    numbers = np.where(seen[..., None], np.nan_to_num(numbers), 0.0)[:-1].astype(np.float32)
    ball, own, their = numbers[:, 0][:, [0, 1, 4, 5, 7]], numbers[:, 1:1 + robots], numbers[:, 1 + robots:]
    pose = views[:, 1:1 + robots]
    way, turn = np.diff(pose[..., :2], axis=0), wrap(np.diff(pose[..., THETA], axis=0))
    half = pose[:-1, :, THETA] + turn / 2
    forward = way[..., 0] * np.cos(half) + way[..., 1] * np.sin(half)
    left = way[..., 1] * np.cos(half) - way[..., 0] * np.sin(half)
    action = np.stack([forward, left, turn], axis=-1) * fps
    action[np.hypot(forward, left) > farthest] = np.nan
    return {
        "observation.state": own.reshape(frames, -1),
        "observation.environment_state": np.concatenate([ball, their.reshape(frames, -1)], axis=1),
        "action": np.nan_to_num(action).astype(np.float32).reshape(frames, -1),
        "acts": np.isfinite(action.sum(axis=-1)),
    }


def _ends(frames: int, reward: float) -> dict[str, npt.NDArray[Any]]:
    """Reward and ends of an episode, each [T, 1]."""
    last = np.zeros((frames, 1), dtype=np.bool_)
    last[-1] = True
    return {
        "next.reward": np.where(last, reward, 0.0).astype(np.float32), "next.done": last,
        "next.truncated": last if reward == 0.0 else np.zeros_like(last),
    }


def _labels(
    labels: Labels, side: str, numbers: tuple[int, ...], segment: int, t_ns: I64, robots: int
) -> dict[str, npt.NDArray[Any]]:
    """Labels of a team at T times: those of robots [T, N], and V [T, 1]."""
    found: dict[str, npt.NDArray[Any]] = {
        name: np.zeros((len(t_ns), robots), dtype=np.int64) for name in CODES}
    share = np.zeros((len(t_ns), robots), dtype=np.float32)
    for place, number in enumerate(numbers):
        for name, codes in found.items():
            codes[:, place] = labels.codes(name, side, number, t_ns)
        share[:, place] = labels.probability(side, number, t_ns)
    value = labels.value(side, segment, t_ns).astype(np.float32)[:, None]
    return {**found, "option.probability": share, "value": value}
