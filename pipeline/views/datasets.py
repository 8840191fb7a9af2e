"""Decisions as a dataset of Minari, for offline learners; the only module that imports Minari (extra ``rl``).

An episode of the dataset is that of a robot: its decisions in a stretch of play. With T decisions it has

- observations: uint8 [T + 1, 36], the levels of the elements of :data:`pipeline.state.table.TABLE` at each
  decision. The state at the end of an episode is in no table, so the last row repeats the one before;
- actions: int64 [T], places of behaviours in the metadata's ``behaviours``;
- rewards, terminations and truncations: [T], as in schema Decisions;
- infos: ``t_ns``, int64 [T + 1], times of the decisions and of the end; and of each decision, [T], ``role``
  (place in the metadata's ``roles``), ``chosen``, ``random``, ``value``, and where the table has them
  ``option`` and ``situation`` (codes of Table 1, 0: none) and ``v`` (V of its team, NaN: not known);
- options: ``match_id``, ``team``, ``robot`` and ``episode``; the seed is the match's, if it has one.
"""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, cast

import minari
import numpy as np
import polars as pl
from gymnasium.spaces import Discrete, MultiDiscrete
from minari.data_collector import EpisodeBuffer
from minari.dataset.minari_dataset import parse_dataset_id
from minari.storage.datasets_root_dir import get_dataset_path

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.state.keys import decode
from pitchlore.pipeline.state.table import LEVELS, TABLE
from pitchlore.schemas import ROLES
from pitchlore.schemas.decisions import ENDS
from pitchlore.schemas.situations import MOVES_RANDOMLY

#: Most characters of the id of a dataset.
_LONGEST = 200
#: What makes an episode.
_EPISODE = ("match_id", "team", "robot", "episode")
#: Columns that infos hold.
_INFOS = ("role", "chosen", "random", "value", "option", "situation", "v")
#: Name of the behaviour that is null in schema Decisions.
RANDOMLY = f"{MOVES_RANDOMLY:03d}"


class DecisionSource(NamedTuple):
    """Where decisions come from.

    Attributes:
        seeds: seeds of the matches by id; None of one that was recorded.
        knowledge_version: newest version of the knowledge that learned from all of these decisions, None if
            there is none.
        software: software that made the decisions.
        settings: settings of the stage that made them.
    """

    seeds: Mapping[str, int | None]
    knowledge_version: int | None
    software: str
    settings: Mapping[str, Any]


class WrittenDataset(NamedTuple):
    """A dataset that was written.

    Attributes:
        path: its folder.
        episodes: their number.
        steps: number of decisions.
        behaviours: names of the actions.
    """

    path: str
    episodes: int
    steps: int
    behaviours: tuple[str, ...]


def write_dataset(dataset_id: str, decisions: pl.DataFrame, origin: DecisionSource) -> WrittenDataset:
    """Write decisions as a dataset where Minari keeps its own: ``MINARI_DATASETS_PATH``, else ``~/.minari``.

    What was written is removed if it cannot be finished.

    Args:
        dataset_id: as Minari has it: ``NAMESPACE/NAME-v0``, the namespace optional.
        decisions: rows of schema Decisions, in order, at least one; they may have further labels.
        origin: kept in the metadata.

    Returns:
        What was written. ``behaviours`` are in alphabetical order, "194" (moves randomly) first.

    Raises:
        BadSettings: if the id is none of Minari's, or there is such a dataset already.
    """
    path = _free(dataset_id)
    behaviours = (RANDOMLY, *sorted(decisions["behaviour_id"].drop_nulls().unique()))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # it would like an e-mail address and an environment
            dataset = minari.create_dataset_from_buffers(
                dataset_id, cast("Any", _episodes(decisions, behaviours, origin.seeds)), data_format="hdf5",
                observation_space=MultiDiscrete(LEVELS, dtype=np.uint8),
                action_space=Discrete(len(behaviours)), algorithm_name="decisions of robots in matches",
                code_permalink=origin.software, author="pitchlore", description=_described(origin),
                requirements=[RELEASE.replace(" ", "==")],
            )  # fmt: skip
        dataset.storage.update_metadata({
            "behaviours": list(behaviours), "elements": [element.name for element in TABLE],
            "levels": [list(element.levels) for element in TABLE], "roles": list(ROLES),
            "matches": dict(origin.seeds), "knowledge_version": origin.knowledge_version,
            "settings": dict(origin.settings),
        })
    except BaseException:
        shutil.rmtree(path, ignore_errors=True)
        raise
    return WrittenDataset(str(path), int(dataset.total_episodes), int(dataset.total_steps), behaviours)


def _free(dataset_id: str) -> Path:
    """The folder of a dataset that does not exist yet."""
    try:
        parse_dataset_id(dataset_id if len(dataset_id) <= _LONGEST else "")  # minutes for a hundred thousand
    except (ValueError, TypeError) as error:  # the second: it has no version
        raise BadSettings("is no id of a Minari dataset", where=dataset_id,
                          next_step="Name it NAME-v0 or NAMESPACE/NAME-v0") from error
    path = get_dataset_path(dataset_id)
    if path.exists():
        raise BadSettings("there is such a dataset already", where=str(path), next_step=(
            f"Give the next version, or remove it with `minari delete {dataset_id}`"))
    return path


def _episodes(
    decisions: pl.DataFrame, behaviours: tuple[str, ...], seeds: Mapping[str, int | None]
) -> Iterator[EpisodeBuffer]:
    """The episodes, in the order of the rows."""
    places = {name: place for place, name in enumerate(behaviours)}
    table = decisions.with_columns(
        action=pl.col("behaviour_id").fill_null(RANDOMLY).replace_strict(places, return_dtype=pl.Int64),
        role=pl.col("role").to_physical().cast(pl.Int8))
    for key, rows in table.group_by(_EPISODE, maintain_order=True):
        episode = dict(zip(_EPISODE, key, strict=True))
        states = decode(rows["state"].to_numpy(), "full36")
        yield EpisodeBuffer(
            seed=seeds[episode["match_id"]], options=episode,
            observations=cast("Any", np.concatenate([states, states[-1:]])),
            actions=cast("Any", rows["action"].to_numpy()),
            rewards=rows["reward"].to_list(),
            terminations=(rows["ends"] == ENDS[0]).fill_null(False).to_list(),
            truncations=(rows["ends"] == ENDS[1]).fill_null(False).to_list(),
            infos={
                "t_ns": np.append(rows["t_ns"].to_numpy(), rows["end_ns"][-1]),
                **{name: rows[name].to_numpy() for name in _INFOS if name in rows.columns},
            },
        )


def _described(origin: DecisionSource) -> str:
    version = origin.knowledge_version
    known = "no version of the knowledge" if version is None else f"version {version} of the knowledge"
    return (
        f"Decisions of robots in {len(origin.seeds)} matches of robot soccer, the episode of a robot being a "
        f"stretch of play, as {known} learned from them. Observations are the levels of 36 elements of the "
        "state (metadata: elements, levels), actions are behaviours (metadata: behaviours). The last "
        "observation repeats the one before."
    )
