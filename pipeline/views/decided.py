"""Decisions of matches in a store, written as a dataset of Minari."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.knowledge import learned_from, lineage, sha256_of
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.stage import ALL
from pitchlore.pipeline.engine.tables import MatchTables, stored_match
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.views.labels import Labels
from pitchlore.schemas import Decisions

if TYPE_CHECKING:
    from types import ModuleType


class Dataset(NamedTuple):
    """A dataset that was written.

    Attributes:
        path: its folder.
        episodes: their number.
        steps: number of decisions.
        behaviours: names of the actions.
        matches: ids of the matches.
    """

    path: str
    episodes: int
    steps: int
    behaviours: tuple[str, ...]
    matches: tuple[str, ...]


def write_decisions(store: Store, dataset: str, matches: Sequence[str] = ()) -> Dataset:
    """Write the decisions of matches as a dataset where Minari keeps its own.

    Args:
        store: the data folder.
        dataset: id of the dataset: ``NAME-v0`` or ``NAMESPACE/NAME-v0``.
        matches: ids of matches, or their beginnings; none: all matches that have decisions.

    Raises:
        NotFound: if Minari is not installed, or if a match is named that has no decisions.
        BadSettings: if the id is none of Minari's, or there is such a dataset already.
    """
    datasets = _datasets()
    made = _made(store, matches)
    decisions = pl.concat([
        table_of(store, receipt, Decisions).filter(pl.col("match_id").is_in(names))
        for receipt, names in made
    ])
    if decisions.is_empty():
        raise NotFound("these matches have no decisions", where=store.where,
                       next_step="Import more matches and `pitchlore run`")
    digests = {name: sha256_of(receipt, name) for receipt, names in made for name in names}
    newest = made[0][0]
    written = datasets.write_dataset(dataset, _labelled(store, decisions), datasets.DecisionSource(
        {name: _seed(store, name) for name in sorted(digests)}, _version(store, digests), newest.software,
        newest.settings,
    ))  # fmt: skip
    return Dataset(
        written.path, written.episodes, written.steps, written.behaviours, tuple(sorted(digests)))


def _datasets() -> ModuleType:
    """The module that writes datasets. It is loaded only here, because not everybody has Minari.

    Raises:
        NotFound: if it is not installed.
    """
    try:
        from pitchlore.pipeline.views import datasets  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name not in ("minari", "gymnasium", "h5py"):
            raise
        raise NotFound(f"needs {error.name}, which is not installed", where="minari",
                       next_step="Install the extra pitchlore[rl]") from error
    return datasets


def _made(store: Store, matches: Sequence[str]) -> list[tuple[Receipt, list[str]]]:
    """The outputs that hold the decisions of these matches, or of all, and the matches of each.

    A match may be in several: that of all matches comes first.

    Raises:
        NotFound: if there are no decisions, or if a match is named that has none, or that is none.
    """
    receipts = sorted(store.receipts("decisions"), key=lambda receipt: (receipt.name != ALL, receipt.name))
    holder: dict[str, Receipt] = {}
    for receipt in receipts:
        for name in receipt.details.get("matches", {}):
            holder.setdefault(name, receipt)
    if not holder:
        raise NotFound("there are no decisions yet", where=store.where,
                       next_step="`pitchlore run` makes them")
    wanted = {_named(word, holder) for word in matches} or set(holder)
    taken = {receipt.name: (receipt, sorted(name for name in wanted if holder[name] is receipt))
             for receipt in receipts}
    return [(receipt, names) for receipt, names in taken.values() if names]


def _named(word: str, there: dict[str, Receipt]) -> str:
    """The one of these matches that has this id, or else whose id begins so."""
    found = [word] if word in there else sorted(name for name in there if word and name.startswith(word))
    if len(found) != 1:
        what = "several matches begin so" if found else "no match with decisions is called so"
        raise NotFound(f"{what} (there are: {', '.join((found or sorted(there))[:8])})", where=word,
                       next_step="Name one of them")
    return found[0]


def _labelled(store: Store, decisions: pl.DataFrame) -> pl.DataFrame:
    """Decisions with labels of their times: ``option`` and ``situation``, codes or 0, and ``v``, V or NaN."""
    count = len(decisions)
    codes = {name: np.zeros(count, dtype=np.int64) for name in ("option", "situation")}
    value = np.full(count, np.nan)
    of_match = decisions.with_row_index("row").group_by("match_id", maintain_order=True)
    for (name,), part in of_match:
        receipt = store.receipt("matches", str(name))
        if receipt is None:  # it was discarded
            continue
        labels = Labels(MatchTables(stored_match(store, receipt)))
        for (side, robot, episode), rows in part.group_by("team", "robot", "episode", maintain_order=True):
            row, t_ns = rows["row"].to_numpy(), rows["t_ns"].to_numpy()
            for label, found in codes.items():
                found[row] = labels.codes(label, str(side), int(str(robot)), t_ns)
            value[row] = labels.value(str(side), int(str(episode)), t_ns)
    return decisions.with_columns(*(pl.Series(*found) for found in codes.items()), pl.Series("v", value))


def _seed(store: Store, match: str) -> int | None:
    """The seed of a match that was played here; None of a recording, or where the match was discarded."""
    receipt = store.receipt("matches", match)
    seed = None if receipt is None else receipt.settings.get("seed")
    return seed if isinstance(seed, int) else None


def _version(store: Store, digests: dict[str, str]) -> int | None:
    """The newest version of the knowledge that learned from exactly these decisions of these matches."""
    for version in reversed(store.manifests("knowledge")):
        held = {name: each.sha256 for one in lineage(store, version)
                for name, each in learned_from(one).items()}
        if digests.items() <= held.items():
            return version.version
    return None
