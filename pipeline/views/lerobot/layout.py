"""Layout of the dataset: its features, and the files that describe them."""

from __future__ import annotations

import json
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

#: The version of the format.
VERSION = "v3.0"
#: Files of a folder, and MB of a file, as LeRobot's own writer has them.
FILES_OF_CHUNK, MEGABYTES = 1000, 100
#: Place of a file, below ``data`` and below ``meta/episodes``.
PLACE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"

#: Numbers of a robot and of the ball in an observation, each with its meaning.
OF_ROBOT: dict[str, str] = {
    "x": "along the pitch, metres; the team attacks +x",
    "y": "across the pitch, metres, to the left of +x",
    "cos": "cosine of its heading, counter-clockwise from +x; with sin, 0 where it is not known",
    "sin": "sine of it",
    "vx": "velocity along x, m/s; 0 where it cannot be estimated",
    "vy": "velocity along y, m/s",
    "turn": "turning rate, counter-clockwise, rad/s",
    "seen": "1 where the recording has it; else 0, and so are all other numbers",
}
OF_BALL = ("x", "y", "vx", "vy", "seen")
#: Numbers of a robot in an action.
OF_ACTION = ("forward", "left", "turn")


class Feature(NamedTuple):
    """A column of the dataset.

    Attributes:
        dtype: float32, int64 or bool.
        names: names of its numbers; none: it is one number.
        about: meaning, for people.
    """

    dtype: str
    names: tuple[str, ...]
    about: str

    @property
    def size(self) -> int:
        """How many numbers it has."""
        return max(1, len(self.names))

    def arrow(self) -> pa.DataType:
        """Its type in Parquet: a list of fixed length; one number is no list."""
        one = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_()}[self.dtype]
        return one if self.size == 1 else pa.list_(one, self.size)


def frame_features(robots: int) -> dict[str, Feature]:
    """The features by name, for teams of at most so many robots.

    LeRobot takes what is called ``observation…`` as input of a policy, and ``action…`` as its output. All
    else is for the learner's own use.
    """
    own, their = ([f"{word}_{place}" for place in range(1, robots + 1)] for word in ("robot", "adversary"))
    one: tuple[str, ...] = ()

    def each(names: list[str], numbers: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(f"{name}.{number}" for name in names for number in numbers)

    numbers = tuple(OF_ROBOT)
    return {
        "observation.state": Feature("float32", each(own, numbers), "the team's own robots, by number"),
        "observation.environment_state": Feature(
            "float32", each(["ball"], OF_BALL) + each(their, numbers),
            "the ball, and the adversary's robots, by number"),
        "action": Feature("float32", each(own, OF_ACTION), (
            "what each robot did until the next frame: way forward and to its left, m/s, as seen half way "
            "between its headings here and there, and turn, rad/s")),
        "acts": Feature("bool", tuple(own), (
            "whether place and heading are known here and in the next frame, and nobody put the robot there; "
            "else the action is 0")),
        "option": Feature("int64", tuple(own), "option recovered from motion, a code; 0: none"),
        "option.probability": Feature("float32", tuple(own), "its probability, given the motion; 0: none"),
        "option.logged": Feature("int64", tuple(own), "option that the team itself logged, a code; 0: none"),
        "situation": Feature("int64", tuple(own), "situation that the robot is in, a code; 0: none"),
        "value": Feature("float32", one, (
            "V: the team's chance to score soon less the adversary's, interpolated; NaN: not known")),
        "next.reward": Feature("float32", one, (
            "1 in the last frame before a goal for, -1 before one against, else 0")),
        "next.done": Feature("bool", one, "true in the last frame of an episode"),
        "next.truncated": Feature("bool", one, "true in the last frame of an episode that no goal ends"),
        "timestamp": Feature("float32", one, "seconds since the episode's first frame"),
        "frame_index": Feature("int64", one, "number of the frame in the episode"),
        "episode_index": Feature("int64", one, "number of the episode"),
        "index": Feature("int64", one, "number of the frame in the dataset"),
        "task_index": Feature("int64", one, "number of the task: whose play it is"),
    }


class DatasetFacts(NamedTuple):
    """Facts of a whole dataset.

    Attributes:
        kind: league of its matches.
        fps: frames a second.
        robots: the most robots of a team.
        episodes, frames, tasks, matches: their numbers.
        software: software that wrote it.
    """

    kind: str
    fps: int
    robots: int
    episodes: int
    frames: int
    tasks: int
    matches: int
    software: str


def info(facts: DatasetFacts) -> bytes:
    """The file ``meta/info.json``."""
    said = {
        "codebase_version": VERSION, "fps": facts.fps,
        "features": {
            name: {"dtype": feature.dtype, "shape": [feature.size], "names": list(feature.names) or None}
            for name, feature in frame_features(facts.robots).items()
        },
        "total_episodes": facts.episodes, "total_frames": facts.frames, "total_tasks": facts.tasks,
        "chunks_size": FILES_OF_CHUNK, "data_files_size_in_mb": MEGABYTES, "video_files_size_in_mb": 200,
        "data_path": f"data/{PLACE}", "video_path": None, "robot_type": facts.kind,
        "splits": {"train": f"0:{facts.episodes}"},
    }
    return json.dumps(said, indent=4).encode()


def tasks(words: list[str]) -> pa.Table:
    """The file ``meta/tasks.parquet``: pandas reads it with the task as its index."""
    described: dict[str, Any] = {
        "index_columns": ["task"], "column_indexes": [], "pandas_version": "2.0.0",
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "columns": [
            {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": dtype, "metadata": None}
            for name, kind, dtype in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
        ],
    }
    table = pa.table({"task_index": np.arange(len(words)), "task": pa.array(words, type=pa.string())})
    return table.replace_schema_metadata({"pandas": json.dumps(described)})


def card(facts: DatasetFacts) -> bytes:
    """The file ``README.md``: how the dataset was made, and its columns."""
    rows = "\n".join(
        f"| `{name}` | {feature.dtype} [{feature.size}] | {feature.about} |"
        for name, feature in frame_features(facts.robots).items())
    numbers = "\n".join(f"- `{name}`: {about}" for name, about in OF_ROBOT.items())
    return f"""---
task_categories:
- robotics
tags:
- LeRobot
- multi-agent
- robot-soccer
configs:
- config_name: default
  data_files: data/*/*.parquet
---
# Robot soccer as its teams live it

Matches: {facts.matches}. Episodes: {facts.episodes}. Frames: {facts.frames}, {facts.fps} a second. League:
{facts.kind}. Robots of a team: at most {facts.robots}. Written by {facts.software} with
`pitchlore export --to lerobot`, in LeRobot's format {VERSION}. An episode is one stretch of play, from a
restart to a goal, a whistle or the recording's end, as one of its two teams lives it. So each stretch is
there twice.

```python
from lerobot.datasets.lerobot_dataset import LeRobotDataset
dataset = LeRobotDataset("pitchlore/league", root="THIS FOLDER")
frame = dataset[0]
```

| column | type | meaning |
|---|---|---|
{rows}

The numbers of a robot in an observation:

{numbers}

Codes are those of Table 1 of Barrios-Aranibar, Gonçalves and Alsina (2008); `pitchlore situations` prints
them. Options and V are estimates, made from the recordings by pitchlore's stages. `meta/episodes` says of
each episode its match, side, team, adversary, stretch of play, time of its first frame, what ended it,
whether options were recovered in it, its robots' numbers and the pitch.
""".encode()
