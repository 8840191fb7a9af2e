"""The dataset of a league's matches, written whole or not at all."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pq

from pitchlore.pipeline.base.errors import BadSettings, NotFound, unwritable
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.base.system import sync_file, sync_folder
from pitchlore.pipeline.engine.outputs import find_match, match_names
from pitchlore.pipeline.engine.tables import MatchTables, stored_match
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.buckets import check_local
from pitchlore.pipeline.store.temporaries import sweep, temporary_beside
from pitchlore.pipeline.views.lerobot.episodes import Episode, episodes_of
from pitchlore.pipeline.views.lerobot.files import NumberedFiles
from pitchlore.pipeline.views.lerobot.layout import DatasetFacts, Feature, card, frame_features, info, tasks
from pitchlore.pipeline.views.lerobot.moments import RunningStatistics, as_lists
from pitchlore.schemas import SIDES

#: Frames a second unless somebody says otherwise: samples of 40, 60 and 100 Hz are frames as they are.
FPS = 20


class LeRobotFolder(NamedTuple):
    """A dataset that was written.

    Attributes:
        path: its folder, LeRobot's ``root``.
        episodes: their number.
        frames: their number in all.
        fps: frames a second.
        robots: the most robots of a team.
        matches: ids of the matches.
        recovered: how many of them have options recovered from motion.
    """

    path: Path
    episodes: int
    frames: int
    fps: int
    robots: int
    matches: tuple[str, ...]
    recovered: int


def write_lerobot(
    store: Store, folder: Path | None = None, matches: Sequence[str] = (), fps: int | None = None
) -> LeRobotFolder:
    """Write matches as a dataset of LeRobot, match by match: only one is in memory at a time.

    Args:
        store: the data folder.
        folder: folder of the dataset, made here; None: ``exports/lerobot`` in the data folder.
        matches: ids of matches of one league, or their beginnings; none: all.
        fps: frames a second; None: 20, or the rate of the slowest recording where that is less.

    Returns:
        What was written.

    Raises:
        BadSettings: if the folder is there, if the matches are of several leagues, if a recording has fewer
            samples a second, or if the data folder is in a bucket and no folder is named.
        NotFound: if there is no such match, if its stages have not run, or if no episode is in them.
        BadRecording: if a match has no headings.
        StorageFailed: if the disk refuses.
    """
    if folder is None and store.mirror is not None:
        raise BadSettings("is in a bucket, and LeRobot reads a folder", where=store.where,
                          next_step="Name a folder with --output")
    target = store.root / "exports" / "lerobot" if folder is None else folder
    names = sorted({find_match(store, word).name for word in matches} or match_names(store))
    if not names:
        raise NotFound("there are no matches yet", where=store.where,
                       next_step="Run `pitchlore import` first")
    with store.keeping(), _whole(target) as staging:
        kind, robots, rate = _league(store, names)
        return _written(store, names, _rate(fps, rate), robots, kind, staging)._replace(path=target)


@contextmanager
def _whole(target: Path) -> Iterator[Path]:
    """A folder that becomes the target when the body has ended well, and goes if it has not.

    Raises:
        BadSettings: if the target is there.
        StorageFailed: if the disk refuses.
    """
    check_local(target)
    if target.exists():
        raise BadSettings("is there already", where=str(target),
                          next_step="Name another folder, or remove it")
    sweep(target.parent, 1)
    staging = temporary_beside(target, "staging")
    try:
        staging.mkdir(parents=True)
        yield staging
        for path in staging.rglob("*"):
            if path.is_file():
                sync_file(path)
        os.rename(staging, target)  # noqa: PTH104 (as for files)
        sync_folder(target.parent)
    except OSError as error:
        raise unwritable(target, error) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _match(store: Store, name: str) -> MatchTables:
    return MatchTables(stored_match(store, find_match(store, name)))


def _league(store: Store, names: Sequence[str]) -> tuple[str, int, float]:
    """Kind of the matches, most robots of a team, and the least rate of samples, 1/s.

    Raises:
        BadSettings: if the matches are of several kinds.
        NotFound: if a match has fewer than two samples.
    """
    kinds, robots, rates = set[str](), 1, list[float]()
    for name in names:
        match = _match(store, name)
        kinds.add(str(match.pitch.kind))
        seen = match.trajectories.select("team", "robot").unique()
        robots = max(robots, *(seen.filter(team=side).height for side in SIDES))
        rates += match.matches["hz"].drop_nulls().to_list()
    if len(kinds) > 1:
        raise BadSettings(f"the matches are of several leagues ({', '.join(sorted(kinds))})",
                          where=store.where, next_step="Name matches of one league")
    if not rates:
        raise NotFound("no match has two samples", where=store.where, next_step="Import other matches")
    return kinds.pop(), robots, min(rates)


def _rate(fps: int | None, rate: float) -> int:
    """Frames a second of the dataset, for recordings of at least so many samples a second."""
    most = max(1, int(rate + 0.01))  # 59.996 Hz are 60
    if fps is None:
        return min(FPS, most)
    if not 1 <= fps <= most:
        raise BadSettings(f"{fps} frames a second do not fit a recording of {rate:.4g} samples a second",
                          where="--fps", next_step=f"Name 1 to {most}")
    return fps


def _written(
    store: Store, names: Sequence[str], fps: int, robots: int, kind: str, folder: Path
) -> LeRobotFolder:
    """Write all files of the dataset into a folder."""
    statistics, words = RunningStatistics(), dict[str, int]()
    columns, frames, count, recovered = frame_features(robots), 0, 0, 0
    data, meta = (NumberedFiles(folder / word) for word in ("data", "meta/episodes"))
    with data, meta:
        for name in names:
            rows = list[dict[str, Any]]()
            for episode in episodes_of(_match(store, name), robots, fps):
                task = words.setdefault(episode.task, len(words))
                numbered = episode.columns | _numbers(episode, count, frames, task, fps)
                place = data.place
                data.write(_table(numbered, columns))
                own = statistics.add(numbered)
                length = len(numbered["index"])
                rows.append({
                    "episode_index": count, "tasks": [episode.task], "length": length,
                    "data/chunk_index": place[0], "data/file_index": place[1],
                    "dataset_from_index": frames, "dataset_to_index": frames + length, **episode.facts,
                    **{f"stats/{column}/{word}": value for column in columns if column in own
                       for word, value in as_lists(own[column]).items()},
                })
                count, frames = count + 1, frames + length
            if rows:
                meta.write(_episodes(rows, meta.place, columns))
                recovered += rows[0]["options_recovered"]
    if not count:
        raise NotFound("no match has a stretch of play with two frames", where=store.where,
                       next_step="Import other matches")
    facts = DatasetFacts(kind, fps, robots, count, frames, len(words), len(names), RELEASE)
    (folder / "meta" / "info.json").write_bytes(info(facts))
    (folder / "meta" / "stats.json").write_text(json.dumps(statistics.as_json(), indent=4))
    pq.write_table(tasks(list(words)), folder / "meta" / "tasks.parquet")
    (folder / "README.md").write_bytes(card(facts))
    return LeRobotFolder(folder, count, frames, fps, robots, tuple(names), recovered)


def _numbers(episode: Episode, number: int, first: int, task: int, fps: int) -> dict[str, npt.NDArray[Any]]:
    """The columns that number the frames of an episode, each [T, 1]."""
    frame = np.arange(len(episode.columns["action"]))[:, None]
    return {
        "timestamp": (frame / fps).astype(np.float32), "frame_index": frame,
        "episode_index": np.full_like(frame, number), "index": first + frame,
        "task_index": np.full_like(frame, task),
    }


def _table(columns: dict[str, npt.NDArray[Any]], layout: dict[str, Feature]) -> pa.Table:
    """The frames of an episode as they lie in Parquet."""
    arrays = []
    for name, feature in layout.items():
        flat = pa.array(columns[name].reshape(-1))
        arrays.append(flat if feature.size == 1 else pa.FixedSizeListArray.from_arrays(flat, feature.size))
    schema = pa.schema([(name, feature.arrow()) for name, feature in layout.items()])
    return pa.table(dict(zip(layout, arrays, strict=True))).cast(schema)


def _episodes(rows: list[dict[str, Any]], place: tuple[int, int], layout: dict[str, Feature]) -> pa.Table:
    """Rows of ``meta/episodes``, all statistics as lists; those of a column without a value are null."""
    plain = pa.Table.from_pylist([
        {name: value for name, value in row.items() if not name.startswith("stats/")}
        | {"meta/episodes/chunk_index": place[0], "meta/episodes/file_index": place[1]} for row in rows])
    words = ("min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99")
    for name in (f"stats/{column}/{word}" for column in layout for word in words):
        kind = pa.int64() if name.endswith("/count") else pa.float64()
        plain = plain.append_column(name, pa.array([row.get(name) for row in rows], type=pa.list_(kind)))
    return plain
