"""Many matches from few: copies under ids of their own, in a league that takes no room for most of them.

``copies.py FROM TO MATCHES``: FROM is a data folder that is up to date, TO one that does not exist yet. The
tables that stages of all matches and the questions read are written anew for each copy, with its id; a third
of the elements of its states are others, so that states are about as often new as in played matches. All
other files are hard links: their rows name the match that was copied. Its situations are the same. So a run,
a look and a question cost what they do in a league of that size, but for its distinct grams.

Receipts have the keys that a run gives them: it takes copies for done, and makes what is of all matches.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import polars as pl

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.state.keys import columns, decode
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.sealed import sealed
from pitchlore.pipeline.store.tables import to_parquet
from pitchlore.pipeline.store.work import Work
from pitchlore.schemas import Goals, Matches, Sequences, Sides, Situations

#: Tables that are written anew, by their noun.
ANEW = {"matches": Matches, "sides": Sides, "sequences": Sequences, "situations": Situations, "goals": Goals}
_LEVELS = np.array([column.levels for column in columns("full36")], dtype=np.int64)
_WEIGHTS = np.append(np.cumprod(_LEVELS[::-1])[::-1][1:], 1)


def turned(states: pl.Series, copy: int) -> pl.Series:
    """The states of a copy: a third of the 36 elements have other levels, by a map of the copy's own."""
    draw = np.random.default_rng(copy)
    shift = draw.integers(0, _LEVELS) * draw.permutation(np.arange(len(_LEVELS)) % 3 == 0)
    digits = decode(states.fill_null(0).to_numpy(), "full36").astype(np.int64)
    found = pl.Series("state", ((digits + shift) % _LEVELS) @ _WEIGHTS)
    return pl.select(pl.when(states.is_not_null()).then(found).alias("state")).to_series()


def copied(store: Store, out: Path, match: str, copy: int) -> None:
    """Write a copy of a match: its receipts, some tables, and links to all other files."""
    name, shas = f"c{copy:02d}-{match}", dict[str, str]()
    for noun in STAGES.nouns(Per.MATCH):
        receipt = store.receipt(noun, match)
        assert receipt is not None
        files = {}
        for role, original in receipt.files.items():
            kind, data = original.path.rpartition(f"-{original.sha256[:12]}.")[2], None
            record = original
            if role == noun and noun in ANEW:
                table = store.read_table(receipt, role, ANEW[noun]).with_columns(match_id=pl.lit(name))
                if noun == "sequences":
                    table = table.with_columns(turned(table["state"], copy))
                data = to_parquet(table, ANEW[noun], where=name)
                record = original.model_copy(update={"sha256": digest(data), "size": len(data)})
            path = f"{noun}/{name}-{record.sha256[:12]}.{kind}"
            if data is not None:
                (out / path).write_bytes(data)
            else:
                os.link(store.root / original.path, out / path)
            files[role] = record.model_copy(update={"path": path})
            shas[f"{noun}/{match}/{role}"] = record.sha256
        inputs = {label.replace(f"/{match}/", f"/{name}/"): shas.get(label, sha)
                  for label, sha in receipt.inputs.items()}
        work = Work(
            noun, name, receipt.settings, receipt.versions[noun], inputs, schemas=STAGES[noun].schemas)
        made: Receipt = receipt.model_copy(
            update={"name": name, "key": work.key, "inputs": inputs, "files": files})
        (out / noun / f"{name}.receipt.json").write_bytes(sealed(made))


def main(data: Path, out: Path, matches: int) -> None:
    """Make a league of so many matches, the played ones among them."""
    left_out = shutil.ignore_patterns("catalog.duckdb", "closed", "runs", "playing", ".*")
    shutil.copytree(data, out, copy_function=os.link, ignore=left_out)
    store = Store(data)
    names = store.names("matches")
    for number in range(matches - len(names)):
        copied(store, out, names[number % len(names)], number // len(names) + 1)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
